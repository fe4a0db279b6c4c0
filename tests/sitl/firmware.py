"""Real autopilots as processes: PX4 with its built-in simulator (SIH), ArduCopter with its own.

Every instance has a working folder, a system id and ports of its own, by its number; all stand 20 m apart
eastwards.  Nothing here knows swarmctl: that is what is tested with them.
"""

import contextlib
import math
import os
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from .pilot import Pilot

LAT, LON, ALT_M = 47.397742, 8.545594, 488.0
SPACING_M = 20.0
EAST_DEG_PER_M = 1.0 / (111_194.9 * math.cos(math.radians(LAT)))
PX4_PORT, PX4_SHARED_PORT, ARDUPILOT_TCP_PORT = 14540, 14550, 5760
PX4_GROUND_PORT, ARDUPILOT_PILOT_PORT = 18570, 14640
STOP_S = 10.0

# Without these ArduCopter's simulator has no frame and no calibration, and never arms.
ARDUCOPTER_NEEDS = {
    "FRAME_CLASS": 1,
    "FRAME_TYPE": 0,
    **{f"INS_ACC{n}OFFS_{axis}": 0.001 for n in ("", "2") for axis in "XYZ"},
    **{f"INS_ACC{n}SCAL_{axis}": 1.001 for n in ("", "2") for axis in "XYZ"},
    "LOG_BACKEND_TYPE": 0,
    "TERRAIN_ENABLE": 0,
    "MOT_THST_EXPO": 0.65,
    "MOT_THST_HOVER": 0.39,
    "BATT_MONITOR": 4,
    "BATT_CAPACITY": 100_000,  # mAh: enough for all flights of a test
}


@dataclass
class Simulators:
    """Starts instances below ``folder``, and stops them all.

    ``first`` is added to every instance's number, and so to its ids and ports, where others fly on this machine too.
    """

    folder: Path
    px4: Path | None
    arducopter: Path | None
    first: int = 0
    running: dict[int, "subprocess.Popen[bytes]"] = field(default_factory=dict)  #: by system id

    def start_px4(
        self, number: int, speed: float = 1.0, parameters: Mapping[str, float] | None = None
    ) -> str:
        """Instance ``number``, system id one more; the URL of its own port.  It also sends to 14550."""
        assert self.px4 is not None
        lat, lon = place(number)
        number += self.first
        given = {f"PX4_PARAM_{name}": f"{value:g}" for name, value in (parameters or {}).items()}
        environment = {
            **os.environ,
            "PX4_SIM_MODEL": "sihsim_quadx",
            "PX4_SYS_AUTOSTART": "10040",
            "PX4_HOME_LAT": f"{lat:.7f}",
            "PX4_HOME_LON": f"{lon:.7f}",
            "PX4_HOME_ALT": f"{ALT_M:g}",
            "PX4_PARAM_SDLOG_BACKEND": "0",
            **({"PX4_SIM_SPEED_FACTOR": f"{speed:g}"} if speed != 1.0 else {}),
            **given,
        }
        command = [self.px4 / "bin" / "px4", "-i", str(number), "-d", self.px4 / "etc"]
        self._start(number + 1, f"px4_{number}", command, environment)
        return f"udpin://0.0.0.0:{PX4_PORT + number}"

    def start_arducopter(
        self, number: int, speed: float = 1.0, parameters: Mapping[str, float] | None = None,
        port: int | None = None,
    ) -> str:  # fmt: skip
        """Instance ``number``, system id one more, sending to UDP ``port``, or waiting on TCP; its URL."""
        assert self.arducopter is not None
        lat, lon = place(number)
        number += self.first
        folder = self._folder(f"arducopter_{number}")
        lines = {**ARDUCOPTER_NEEDS, **(parameters or {})}
        (folder / "swarm.parm").write_text("".join(f"{k} {v:g}\n" for k, v in lines.items()))
        serial = "tcp:0" if port is None else f"udpclient:127.0.0.1:{port}"
        command = [
            self.arducopter, "-w", "--model", "+", "--speedup", f"{speed:g}", "--defaults", "swarm.parm",
            "--home", f"{lat:.7f},{lon:.7f},{ALT_M:g},0", f"-I{number}", "--sysid", str(number + 1),
            "--serial0", serial, "--serial1", f"udpclient:127.0.0.1:{ARDUPILOT_PILOT_PORT + number}",
            "--serial2", "none",
        ]  # fmt: skip
        self._start(number + 1, folder.name, command, dict(os.environ))
        if port is None:
            return f"tcp://127.0.0.1:{ARDUPILOT_TCP_PORT + 10 * number}"
        return f"udpin://0.0.0.0:{port}"

    def pilot(self, firmware: str, number: int) -> Pilot:
        """A second ground station on instance ``number``: PX4's own port for one, ArduCopter's second serial port."""
        number += self.first
        if firmware == "px4":
            return Pilot(firmware, number + 1, peer=PX4_GROUND_PORT + number)
        return Pilot(firmware, number + 1, port=ARDUPILOT_PILOT_PORT + number)

    def kill(self, system: int) -> None:
        """As a crash does."""
        process = self.running.pop(system)
        process.kill()
        process.wait(STOP_S)

    def stop(self) -> None:
        """End them all."""
        for process in self.running.values():
            process.terminate()
        for process in self.running.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(STOP_S)
            process.kill()
            process.wait()
        self.running.clear()

    def _start(self, system: int, name: str, command: list[str | Path], environment: dict[str, str]) -> None:
        folder = self._folder(name)
        with (folder / "out.log").open("wb") as log:
            self.running[system] = subprocess.Popen(
                command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )

    def _folder(self, name: str) -> Path:
        """A working folder that remembers nothing."""
        folder = self.folder / name
        if folder.exists() and not (folder / "swarm.parm").exists():
            shutil.rmtree(folder)
        folder.mkdir(parents=True, exist_ok=True)
        return folder


def place(number: int) -> tuple[float, float]:
    """Latitude and longitude of an instance."""
    return LAT, LON + number * SPACING_M * EAST_DEG_PER_M
