"""MAVProxy as an independent client of stub vehicles, for the tests beside this file.

The fleet lives in the test's process, served over UDP by a thread of its own, and is looked at there after
every tick, so that tests judge what the vehicle did.  MAVProxy is a process that is typed to as a user types
and whose words are read.  Limits for a vehicle are in its own time, which runs ``SPEED`` times as fast.
"""

import asyncio
import contextlib
import math
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.links import Clock, serve, udp
from sim_vehicle_stub.plans import Item
from swarmctl.core.geodesy import to_geodetic
from swarmctl.live_cli import free_ports

ORIGIN = (47.3977, 8.5456, 488.0)
SPEED = 10.0
NOBODY = 9
"""The port that the vehicle sends to until MAVProxy has spoken to it: "discard"."""
BOOTED_BEFORE_S = 45.0
"""The vehicle was switched on so long before the test: it has found its position and can be armed."""
SOON_S = 100.0
"""Fleet time in which an order that is typed takes effect, even on a machine that is busy with other tests."""
PATIENCE_S = 30.0
"""Wall time in which MAVProxy says, and the fleet's thread decides, whatever it does at all."""
MODULES = "link,log,signing,wp,rally,fence,ftp,param,arm,mode,misc,cmdlong"
"""MAVProxy's default modules that these tests use; the terrain module would ask the internet for heights."""
POSITION, INTERVAL_US = 33, 100_000
STREAMS = {
    "px4": [f"long SET_MESSAGE_INTERVAL {message} {INTERVAL_US}" for message in (30, 32, 74, POSITION)],
    "ardupilot": ["set streamrate 10"],
}
"""What is typed first: PX4 sends faster than MAVProxy reads at this speed, ArduPilot hardly anything unasked."""


@dataclass
class Watch:
    """What a test waits for: ``limit_s`` and ``ends_at`` are fleet time."""

    condition: Callable[[], bool]
    limit_s: float
    ends_at: float | None = None
    outcome: "Future[None]" = field(default_factory=Future)


class ServedFleet:
    """One vehicle that waits at UDP port ``port`` for its partner, moved by a thread until it is stopped."""

    def __init__(self, autopilot: str) -> None:
        self.fleet = StubFleet(
            1, origin=ORIGIN, pads_m=[(0.0, 0.0)], autopilot=autopilot, now=-BOOTED_BEFORE_S
        )
        self.vehicle = self.fleet.vehicles[0]
        self.body: Any = self.fleet.truth[0]
        self.highest_m = 0.0
        self.furthest_m = 0.0
        self.fastest_mps = 0.0
        self.port = 0
        self._clock: Any = None
        self._watches: list[Watch] = []
        self._task: Any = None
        self._loop: Any = None
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()))
        self._thread.start()
        self.until(lambda: True, 0.0)  # the port is open now

    async def _serve(self) -> None:
        self._loop, self._task = asyncio.get_running_loop(), asyncio.current_task()
        with contextlib.suppress(asyncio.CancelledError):
            await serve(self.fleet, self._open, SPEED)

    async def _open(self, fleet: StubFleet, clock: Clock) -> list[Any]:
        self._clock = clock
        while True:
            self.port = free_ports(1)
            with contextlib.suppress(OSError):  # taken by another test in the meantime
                return [*await udp(NOBODY, self.port, shared=False)(fleet, clock), self]

    def flush(self) -> None:
        """Look at the vehicle: the fleet's loop calls this after every tick, as it does for every link."""
        body = self.body
        self.highest_m = max(self.highest_m, body["up"])
        self.furthest_m = max(self.furthest_m, math.hypot(body["east"], body["north"]))
        self.fastest_mps = max(self.fastest_mps, math.hypot(body["v_east"], body["v_north"]))
        for watch in tuple(self._watches):
            if watch.ends_at is None:
                watch.ends_at = self._clock.now() + watch.limit_s
            if watch.condition():
                watch.outcome.set_result(None)
            elif self._clock.now() > watch.ends_at:
                watch.outcome.set_exception(AssertionError(f"not within {watch.limit_s} s: {self.seen}"))
            else:
                continue
            self._watches.remove(watch)

    def until(self, condition: Callable[[], bool], limit_s: float) -> None:
        """Wait for a moment at which ``condition`` holds, at most so many seconds of fleet time."""
        watch = Watch(condition, limit_s)
        self._watches.append(watch)
        watch.outcome.result(PATIENCE_S)

    def let_pass(self, seconds: float) -> None:
        """Wait for so much fleet time."""
        end = self._clock.now() + seconds
        self.until(lambda: self._clock.now() >= end, seconds + 1.0)

    def is_at(self, east: float, north: float, up: float) -> Callable[[], bool]:
        """Whether the vehicle hovers within half a metre of a place."""
        body = self.body

        def condition() -> bool:
            away = (body["east"] - east, body["north"] - north, body["up"] - up)
            moves = (body["v_east"], body["v_north"], body["v_up"])
            return bool(max(map(abs, away)) < 0.5 and max(map(abs, moves)) < 0.1)

        return condition

    @property
    def mode(self) -> int:
        """The custom mode that it is in."""
        return self.vehicle.personality.custom_mode

    @property
    def fence(self) -> list[Item]:
        """The fence that it holds."""
        return self.vehicle.plans.kept[1]

    @property
    def seen(self) -> str:
        """The vehicle in a line, for failures."""
        body = {name: round(float(self.body[name]), 2) for name in self.body.dtype.names}
        return f"mode {self.mode:#x}, armed {self.vehicle.armed}, {body}"

    def stop(self) -> None:
        """End the thread."""
        self._loop.call_soon_threadsafe(self._task.cancel)
        self._thread.join(PATIENCE_S)


class MavProxy:
    """MAVProxy in a process of its own, connected to ``master``; all that it writes lands in ``folder``."""

    def __init__(self, master: str, folder: Path) -> None:
        words = (f"--master={master}", f"--default-modules={MODULES}", f"--state-basedir={folder}")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "MAVProxy.mavproxy", *words, "--aircraft=stub"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            cwd=folder, env={**os.environ, "HOME": str(folder), "PYTHONUNBUFFERED": "1"},
            start_new_session=True,
        )  # fmt: skip
        self._said = ""
        self._begin = 0
        self._news = threading.Condition()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for piece in iter(lambda: os.read(self._process.stdout.fileno(), 65536), b""):  # type: ignore[union-attr]
            with self._news:
                self._said += piece.decode("utf-8", "replace")
                self._news.notify_all()

    def type(self, *lines: str) -> None:
        """Type commands; `hear` looks at what is said from here on."""
        assert self._process.stdin is not None
        with self._news:
            self._begin = len(self._said)
        self._process.stdin.write("".join(f"{line}\n" for line in lines).encode())
        self._process.stdin.flush()

    def hear(self, pattern: str) -> re.Match[str]:
        """Wait until something is said that matches, since the last command."""
        found: list[re.Match[str]] = []

        def said() -> bool:
            match = re.compile(pattern).search(self._said, self._begin)
            found.extend([match] if match else [])
            return bool(found)

        with self._news:
            assert self._news.wait_for(said, PATIENCE_S), f"no {pattern!r} in {self._said[self._begin :]!r}"
        return found[0]

    def said(self, pattern: str) -> list[Any]:
        """All that matches of what was said since the last command."""
        with self._news:
            return re.findall(pattern, self._said[self._begin :])

    def close(self) -> None:
        """End the process: at the end of its input, or else killed with all that it has started."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        try:
            self._process.wait(PATIENCE_S)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._reader.join(PATIENCE_S)
            self._process.stdout.close()


@contextlib.contextmanager
def flown(autopilot: str, folder: Path) -> Iterator[tuple[ServedFleet, MavProxy]]:
    """A vehicle that is ready to arm, and a MAVProxy that has found it and been told what it streams."""
    with contextlib.ExitStack() as ends:
        fleet = ServedFleet(autopilot)
        ends.callback(fleet.stop)
        mavproxy = MavProxy(f"udpout:127.0.0.1:{fleet.port}", folder)
        ends.callback(mavproxy.close)
        mavproxy.hear("online system 1")
        mavproxy.type(*STREAMS[autopilot])
        fleet.until(lambda: fleet.vehicle.interval_us(POSITION) == INTERVAL_US, SOON_S)
        yield fleet, mavproxy


def hear_where_it_hovers(fleet: ServedFleet, mavproxy: MavProxy) -> None:
    """MAVProxy tells, watched and as its status, just where the vehicle has come to rest."""
    fleet.let_pass(5.0)
    lat, lon, alt, relative_alt = fleet.vehicle.wire[:4]
    place = f"lat : {lat}, lon : {lon}, alt : {alt}, relative_alt : {relative_alt}"
    mavproxy.type("watch GLOBAL_POSITION_INT")
    mavproxy.hear(place)
    mavproxy.type("watch", "status GLOBAL_POSITION_INT")
    mavproxy.hear(rf"\d+: GLOBAL_POSITION_INT .*{place}")


def guided(east: float, north: float, altitude_m: float) -> str:
    """The command to fly to a place, metres from the origin."""
    lat, lon = to_geodetic(east, north, *ORIGIN)
    return f"guided {lat:.7f} {lon:.7f} {altitude_m}"
