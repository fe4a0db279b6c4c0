"""What real firmware and the controller make of it when something goes wrong in the air, two vehicles at a time.

Times are of flight, which simulators run at several times the wall's.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from swarmctl.mission.load import load

from .conftest import MISSION, Flight, Fly
from .firmware import EAST_DEG_PER_M, PX4_PORT, Simulators, place
from .pilot import Pilot

SPEEDS = {"px4": 2.0, "ardupilot": 5.0}
UP_S, DOWN_S = 180.0, 300.0
"""Wall time for two vehicles to search, and to come down."""
SEARCHED_FIRST_S = 15.0
"""Before anything goes wrong: they are well on their way."""


@dataclass
class Scene:
    """Two vehicles of one firmware that search, and a second ground station on each."""

    firmware: str
    speed: float
    simulators: Simulators
    pilots: list[Pilot]
    flight: Flight

    def pass_by(self, flight_s: float) -> None:
        """Look on for a while."""
        self.pilots[0].pass_by(flight_s / self.speed)
        for pilot in self.pilots:
            pilot.refreshed()

    def told(self, text: str, flight_s: float = UP_S) -> None:
        """Wait until the controller has told something."""
        self.pilots[0].until(lambda: text in self.flight.said, flight_s / self.speed + UP_S)

    def control(self, *words: str) -> str:
        """`swarmctl control RUN words`: what it answers, or why it refuses."""
        command = [sys.executable, "-m", "swarmctl", "control", str(self.flight.run), *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60.0)
        return done.stdout + done.stderr

    def until_in(self, pilot: Pilot, mode: str) -> float:
        """Wait until a vehicle is in a mode; how long (s of flight) that took."""
        return pilot.until(lambda: pilot.is_in(mode), UP_S) * self.speed

    def until_down(self, pilot: Pilot) -> float:
        """The same for being disarmed."""
        return pilot.until(lambda: not pilot.armed, DOWN_S) * self.speed


Stage = Callable[..., Scene]


@pytest.fixture
def stage(simulators: Simulators, fly: Fly, firmware: str, small: Path) -> Iterator[Stage]:
    """Starts two vehicles and flies them until they have searched for a while.

    ``settings`` replaces words of the mission's file, ``parameters`` are the vehicles' own at boot.
    """
    pilots: list[Pilot] = []

    def begin(
        *words: Any, parameters: Mapping[str, float] | None = None, settings: Mapping[str, str] | None = None
    ) -> Scene:
        speed = SPEEDS[firmware]
        text = small.read_text() + "".join(f"\n{key}: {value}" for key, value in (settings or {}).items())
        small.write_text(text)
        connect: list[str] = []
        for number in (0, 1):
            if firmware == "px4":
                url = simulators.start_px4(number, speed, parameters)
            else:
                port = PX4_PORT + simulators.first + number
                url = simulators.start_arducopter(number, speed, parameters, port=port)
            connect += ["--connect", url]
            pilots.append(simulators.pilot(firmware, number))
        flight = fly(*connect, "--speed", speed, "--algo", "bounce", *words, mission=small)
        scene = Scene(firmware, speed, simulators, pilots, flight)
        scene.told("searching")
        scene.pass_by(SEARCHED_FIRST_S)
        return scene

    yield begin
    for pilot in pilots:
        pilot.close()


def outcomes(summary: Mapping[str, Any]) -> list[str]:
    """How each vehicle ended."""
    return [vehicle["outcome"] for vehicle in summary["per_vehicle"]]


def events(summary: Mapping[str, Any], row: int) -> str:
    """What is told of one vehicle."""
    return "\n".join(summary["per_vehicle"][row]["events"])


@pytest.mark.parametrize("silent_s", [1.0, 10.0])
def test_a_controller_that_stands_still(stage: Stage, firmware: str, silent_s: float) -> None:
    """Who waited flies on; who was brought home by its failsafe for long is not taken back."""
    scene = stage("--duration", 60)
    os.kill(scene.flight.process.pid, signal.SIGSTOP)
    scene.pilots[0].pass_by(silent_s / scene.speed)
    os.kill(scene.flight.process.pid, signal.SIGCONT)
    code, summary = scene.flight.ended()
    returned = firmware == "px4" and silent_s > 3.0
    assert (code, outcomes(summary)) == ((1, ["released"] * 2) if returned else (0, ["landed"] * 2))
    for row in (0, 1):
        told = events(summary, row)
        assert "the controller stood still" in told and "no heartbeat" not in told
        assert ("its mode became AUTO.RTL while engaged" in told) == returned
    assert summary["geofence_violations"] == 0 and summary["min_separation_m"] > 5.0
    assert not any(pilot.refreshed().armed for pilot in scene.pilots)


@pytest.mark.parametrize("if_one_fails", ["abort", "continue"])
def test_a_vehicle_that_dies_in_the_air(stage: Stage, if_one_fails: str) -> None:
    scene = stage("--duration", 60, settings={"safety": f"{{if_one_fails: {if_one_fails}}}"})
    scene.simulators.kill(scene.pilots[1].system)
    code, summary = scene.flight.ended()
    assert (code, outcomes(summary)) == (1, ["landed", "lost"])
    assert "no heartbeat for 3 s while engaged" in events(summary, 1)
    assert "left in the air, as far as is known" in events(summary, 1)
    assert (summary["searched_s"] == 60.0) == (if_one_fails == "continue")
    assert summary["geofence_violations"] == 0


def test_a_pilot_takes_a_vehicle_and_gives_it_back(stage: Stage, firmware: str) -> None:
    scene = stage("--duration", 90, settings={"safety": "{if_one_fails: continue}"})
    pilot = scene.pilots[1]
    pilot.change_mode("hold")
    scene.told(f"vehicle {pilot.system}: its mode became")
    scene.pass_by(10.0)
    assert pilot.is_in("hold")  # nobody fights for it
    assert f"retake vehicle {pilot.system} at" in scene.control("retake", str(pilot.system))
    pilot.until(lambda: pilot.is_in("setpoints"), 20.0)
    code, summary = scene.flight.ended()
    assert (code, outcomes(summary)) == (0, ["landed"] * 2)
    assert "retaken by the operator" in events(summary, 1)
    assert summary["min_separation_m"] >= load(MISSION, {}).safety.separation_m


PX4_BREACH = {"hold": {"GF_ACTION": 2}, "return": {"GF_ACTION": 3}}
ARDUPILOT_BREACH = {"hold": {"FENCE_ACTION": 4}, "return": {"FENCE_ACTION": 1}}
ARDUPILOT_FENCED = {"AVOID_ENABLE": 0, "FENCE_TYPE": 4, "FENCE_ENABLE": 1}


@pytest.mark.parametrize("action", ["hold", "return"])
def test_a_fence_on_board_that_is_broken(stage: Stage, firmware: str, action: str) -> None:
    """A box smaller than the mission's area, about home, is put on board by somebody else.

    ArduCopter's is switched on there and then: with a fence switched on and none on board it is never ready to arm.
    """
    parameters = PX4_BREACH[action] if firmware == "px4" else {}
    scene = stage("--duration", 60, parameters=parameters, settings={"safety": "{if_one_fails: continue}"})
    pilot = scene.pilots[1]
    pilot.fence_in(place(1), 20.0)
    if firmware == "ardupilot":
        pilot.set_parameters({**ARDUPILOT_BREACH[action], **ARDUPILOT_FENCED})
    scene.told(f"vehicle {pilot.system}: its mode became")
    scene.pass_by(10.0)
    assert pilot.is_in("hold") or pilot.is_in("return")  # and not silently taken back
    if pilot.is_in("hold"):
        pilot.change_mode("land")
    code, summary = scene.flight.ended()
    assert (code, outcomes(summary)) == (1, ["landed", "released"])
    assert not pilot.refreshed().armed


def test_a_vehicle_outside_the_missions_fence_is_not_retaken(stage: Stage, firmware: str) -> None:
    scene = stage("--duration", 60, settings={"safety": "{if_one_fails: continue}"})
    pilot, origin = scene.pilots[1], load(MISSION, {}).origin
    pilot.change_mode("hold")
    scene.told(f"vehicle {pilot.system}: its mode became")
    lat, _ = pilot.place
    pilot.fly_to(lat, origin.lon - 30.0 * EAST_DEG_PER_M, 120.0)
    answer = scene.control("retake", str(pilot.system))
    assert "m outside the mission's fence; bring it inside first, or have it land" in answer
    assert (
        not pilot.refreshed().is_in("setpoints") or firmware == "ardupilot"
    )  # whose pilot flies it in GUIDED too
    pilot.change_mode("return")
    code, summary = scene.flight.ended()
    assert (code, outcomes(summary)) == (1, ["landed", "released"])
    assert not pilot.refreshed().armed


def test_vehicles_come_home_from_a_controller_that_died(stage: Stage, firmware: str) -> None:
    """With the ground station's loss heeded, as the docs advise."""
    heeds = {"px4": {"NAV_DLL_ACT": 2}, "ardupilot": {"FS_GCS_ENABLE": 1}}[firmware]
    scene = stage("--duration", 300, parameters=heeds)
    scene.flight.kill()
    noticed = [scene.until_in(pilot, "return") for pilot in scene.pilots]
    down = [scene.until_down(pilot) for pilot in scene.pilots]
    print(
        f"{firmware}: return {noticed[0]:.1f} s after the controller's end, on the ground {down[0]:.1f} s later"
    )
    assert all(abs(pilot.height_m) < 2.0 for pilot in scene.pilots)


def test_a_controller_that_died_is_resumed(stage: Stage, fly: Fly, firmware: str) -> None:
    """PX4 is on its way home by then, ArduCopter hovers; both are taken back and search on."""
    scene = stage("--duration", 60)
    scene.flight.kill()
    scene.pass_by(6.0)
    assert all(pilot.is_in("return" if firmware == "px4" else "setpoints") for pilot in scene.pilots)
    code, summary = fly("--resume", scene.flight.run, mission=None).ended()
    assert (code, outcomes(summary)) == (0, ["landed"] * 2)
    assert summary["searched_s"] == 60.0 and summary["geofence_violations"] == 0
