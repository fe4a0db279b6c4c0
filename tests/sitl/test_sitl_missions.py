"""Whole missions of six real autopilots, with every algorithm, over every kind of link: everybody lands."""

from typing import Any

import pytest

from swarmctl.core.planners import MODULES
from swarmctl.mission.load import load

from .conftest import MISSION, Fly
from .firmware import PX4_PORT, PX4_SHARED_PORT, Simulators

SPEEDS = {"px4": 2.0, "ardupilot": 5.0}
SEARCH_S = 60.0


def fleet_up(simulators: Simulators, setup: str, speed: float) -> list[str]:
    """Start the six of one setup; the words that name their links."""
    firmware, links = setup.split("-")
    urls = []
    for number in range(6):
        if firmware == "px4" or (firmware == "mixed" and number < 3):
            urls.append(simulators.start_px4(number, speed))
        else:
            port = {"tcp": None, "shared": PX4_SHARED_PORT, "own": PX4_PORT + number}[links]
            urls.append(simulators.start_arducopter(number, speed, port=port))
    if links == "shared":
        urls = [f"udpin://0.0.0.0:{PX4_SHARED_PORT}"]
    return [word for url in urls for word in ("--connect", url)]


def is_safe(summary: dict[str, Any]) -> None:
    """Six landed by themselves, inside the fence and apart from one another."""
    assert [vehicle["outcome"] for vehicle in summary["per_vehicle"]] == ["landed"] * 6
    assert summary["geofence_violations"] == 0
    assert summary["min_separation_m"] >= load(MISSION, {}).safety.separation_m


@pytest.mark.parametrize("algorithm", MODULES)
@pytest.mark.parametrize("links", ["own", "shared", "tcp"])
def test_six_of_one_firmware_search_and_land(
    simulators: Simulators, fly: Fly, firmware: str, links: str, algorithm: str
) -> None:
    if firmware == "px4" and links == "tcp":
        links = "own"  # it has no TCP: at real time instead
        speed = 1.0
    else:
        speed = SPEEDS[firmware]
    words = fleet_up(simulators, f"{firmware}-{links}", speed)
    code, summary = fly(*words, "--speed", speed, "--algo", algorithm, "--duration", SEARCH_S).ended()
    is_safe(summary)
    assert code == 0 and summary["detected"] > 0
    assert {vehicle["autopilot"] for vehicle in summary["per_vehicle"]} == {firmware}


@pytest.mark.needs("px4", "ardupilot")
@pytest.mark.parametrize("algorithm", MODULES)
@pytest.mark.parametrize("links", ["own", "shared"])
def test_three_of_each_search_together(simulators: Simulators, fly: Fly, links: str, algorithm: str) -> None:
    words = fleet_up(simulators, f"mixed-{links}", 1.0)
    code, summary = fly(*words, "--algo", algorithm, "--duration", SEARCH_S).ended()
    is_safe(summary)
    assert code == 0 and summary["detected"] > 0
    assert [vehicle["autopilot"] for vehicle in summary["per_vehicle"]] == ["px4"] * 3 + ["ardupilot"] * 3


def test_the_whole_mission_in_real_time(simulators: Simulators, fly: Fly, firmware: str) -> None:
    words = fleet_up(simulators, f"{firmware}-own", 1.0)
    code, summary = fly(*words).ended()
    is_safe(summary)
    assert code == 0 and summary["searched_s"] == 300.0 and summary["setpoint_interval_ms"]["p99"] < 150.0
