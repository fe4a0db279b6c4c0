"""A controller that stands still for a while, as a stopped process or a laptop that sleeps, in virtual time."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.core import stages
from swarmctl.flight.parts import Part
from swarmctl.flight.roster import AIRBORNE, Roster
from swarmctl.flight.swarm import Swarm

from .virtual import Live, events, outcomes

SLOW: dict[str, object] = {"vehicles.speed_mps": 8.0}
FEW = 20
"""Frames: what is left of a small receive buffer, long before the end of the standstill."""


def stops(seconds: float, kept: int = 10_000) -> Callable[[Live], None]:
    """SIGSTOP, and SIGCONT after so long."""
    return lambda live: live.wires.stop_controller(seconds, kept)


def modes(live: Live) -> set[int]:
    """The modes that the vehicles are in."""
    return {vehicle.personality.custom_mode for vehicle in live.fleet.vehicles}


@pytest.mark.parametrize("kept", [10_000, FEW])
@pytest.mark.parametrize(("autopilot", "seconds"), [("px4", 2.0), ("ardupilot", 2.0), ("ardupilot", 10.0)])
def test_who_waited_for_its_controller_flies_on(
    autopilot: str, seconds: float, kept: int, tmp_path: Path
) -> None:
    live = Live(tmp_path, SLOW, [autopilot] * 3)
    if autopilot == "px4":
        for vehicle in live.fleet.vehicles:
            vehicle.parameters.set("COM_OF_LOSS_T", 5.0)
    live.at = [(70.0, stops(seconds, kept))]
    outcome = live.fly()
    assert (outcomes(outcome), outcome.summary("")["geofence_violations"]) == (["landed"] * 3, 0)
    assert outcome.summary("")["searched_s"] == 70.0
    for system in (1, 2, 3):
        told = events(outcome, system)
        stood = re.search(r"the controller stood still for ([\d.]+) s", told)
        assert stood is not None and seconds <= float(stood[1]) <= seconds + 0.2
        assert "no heartbeat" not in told and "no answer" not in told


@pytest.mark.parametrize("kept", [10_000, FEW])
@pytest.mark.parametrize("seconds", [1.5, 2.0, 10.0])
def test_who_has_begun_its_failsafe_is_not_taken_back(seconds: float, kept: int, tmp_path: Path) -> None:
    """PX4 would turn round at the first setpoint."""
    live = Live(tmp_path, SLOW)
    seen: list[set[int]] = []
    after = [72.0 + seconds + k for k in range(5)]
    live.at = [(70.0, stops(seconds, kept))] + [(t, lambda live: seen.append(modes(live))) for t in after]
    outcome = live.fly()
    assert seen == [{0x5040000}] * 5  # RTL
    assert outcomes(outcome) == ["released"] * 3
    assert all(live.down)
    assert outcome.exit_code() == 1
    assert "its mode became AUTO.RTL while engaged" in events(outcome, 2)


def test_nothing_is_compiled_when_a_vehicle_drops_out() -> None:
    """It would be a standstill of its own: a second on a busy machine."""
    in_the_air = {stage for stage in range(len(stages.NAMES)) if stages.airborne(stage)}
    assert in_the_air == AIRBORNE
    assert "airborne" not in Roster.flies.__code__.co_names


def test_setpoints_of_before_the_standstill_are_not_sent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process may be stopped between a tick and its sending."""
    live = Live(tmp_path, SLOW)
    tick = Swarm.tick
    stopped: list[float] = []

    def stopped_after(swarm: Swarm, k: int, now: float) -> None:
        tick(swarm, k, now)
        if now > 70.0 and not stopped:
            stopped.append(now)
            live.wires.stop_controller(10.0, kept=0)

    seen: list[set[int]] = []
    monkeypatch.setattr(Swarm, "tick", stopped_after)
    live.at = [(82.0, lambda live: seen.append(modes(live)))]
    outcome = live.fly()
    assert stopped and seen == [{0x5040000}]
    assert outcomes(outcome) == ["released"] * 3


def test_all_that_were_silent_at_once_come_home(tmp_path: Path) -> None:
    """For a moment nobody was the swarm's, and there was nobody to wait for."""
    faults = [f"{system}:link-loss@70+5" for system in (1, 2, 3)]
    live = Live(tmp_path, SLOW, ["ardupilot"] * 3, faults=faults)
    parts: list[Part] = []
    live.at = [(82.0, lambda live: parts.append(live.swarm.part if live.swarm else Part.OVER))]
    outcome = live.fly()
    assert parts == [Part.RETURNING]  # and looked after as such
    assert (outcomes(outcome), all(live.down)) == (["landed"] * 3, True)
    assert live.now < 300.0
    fleet = outcome.world.fleet
    for row, body in enumerate(live.fleet.truth):
        assert abs(body["east"] - fleet["pad_east"][row]) < 1.5
        assert abs(body["north"] - fleet["pad_north"][row]) < 1.5
