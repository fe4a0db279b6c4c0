"""Live flights over bad links, in virtual time: always landed or reported, in bounded time."""

from pathlib import Path
from typing import Any

import pytest

from swarmctl.flight.errors import RefusedError

from .virtual import Live, events, outcomes

AUTOPILOTS = ["px4", "ardupilot"]
WEATHER: dict[str, dict[str, Any]] = {
    "loss": {"loss": 0.25},
    "duplication": {"duplication": 0.4},
    "reordering": {"reordering": 0.5},
    "garbage": {"garbage": 0.3},
    "single bytes": {"single_bytes": True},
    "all at once": {"loss": 0.3, "duplication": 0.3, "reordering": 0.3, "garbage": 0.3, "delay_s": 0.3},
}
PATIENT: dict[str, object] = {"safety.link_loss_s": 10}
TAKES_OFF_S = {"px4": 20.0, "ardupilot": 55.0}
"""About when the vehicles leave the ground: their firmware boots first."""


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("weather", list(WEATHER))
def test_bad_weather_is_flown_through(autopilot: str, weather: str, tmp_path: Path) -> None:
    live = Live(tmp_path, PATIENT, [autopilot] * 3)
    live.impair(**WEATHER[weather])
    outcome = live.fly()
    summary = outcome.summary("")
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)
    assert all(live.down)
    assert summary["searched_s"] == 70.0
    assert min(summary["min_separation_m"], live.nearest_m) >= 15.0
    assert summary["geofence_violations"] == 0
    assert live.now < 450.0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("seed", range(4))
def test_a_link_that_loses_two_fifths_ends_landed_or_reported(
    autopilot: str, seed: int, tmp_path: Path
) -> None:
    """PX4's own failsafe may step in when ten setpoints in a row are lost: then it is let go, and lands."""
    live = Live(tmp_path, PATIENT, [autopilot] * 3, seed=seed)
    live.impair(loss=0.4)
    try:
        outcome = live.fly()
    except RefusedError as error:
        assert "gave up: " in str(error) and not any(vehicle.armed for vehicle in live.fleet.vehicles)
        return
    for system, how in enumerate(outcomes(outcome), start=1):
        assert how == "landed" or (how in ("released", "lost") and events(outcome, system))
    assert all(live.down)
    assert live.now < 900.0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("delay_s", [0.3, 0.6])
def test_a_steady_delay_keeps_them_apart(autopilot: str, delay_s: float, tmp_path: Path) -> None:
    live = Live(tmp_path, PATIENT, [autopilot] * 3)
    live.impair(delay_s=delay_s)
    outcome = live.fly()
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)
    assert live.nearest_m >= 15.0
    assert outcome.summary("")["geofence_violations"] == 0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_link_with_a_second_of_delay_each_way_ends_on_the_ground(autopilot: str, tmp_path: Path) -> None:
    live = Live(tmp_path, PATIENT, [autopilot] * 3)
    live.impair(delay_s=1.0)
    outcome = live.fly()
    assert outcomes(outcome) == ["landed"] * 3
    assert all(live.down)
    assert outcome.summary("")["geofence_violations"] == 0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("way", ["up_cut", "down_cut"])
@pytest.mark.parametrize("after_s", [5.0, 30.0, 60.0])
def test_a_link_that_carries_one_way_only(autopilot: str, way: str, after_s: float, tmp_path: Path) -> None:
    """Nobody is waited for for ever, the others come home, and what may still be in the air is told."""
    live = Live(tmp_path, autopilots=[autopilot] * 3)
    live.at = [
        (
            TAKES_OFF_S[autopilot] + after_s,
            lambda live: live.fleet.vehicles[1].network.impair(**{way: True}),
        )
    ]
    outcome = live.fly()
    assert [outcomes(outcome)[i] for i in (0, 2)] == ["landed"] * 2
    assert live.down[0] and live.down[2]
    assert outcomes(outcome)[1] in ("lost", "released")
    assert outcome.exit_code() == 1
    told = events(outcome, 2)
    assert any(words in told for words in ("no heartbeat", "no answer", "its mode became"))
    assert live.down[1] or "left in the air, as far as is known" in told


@pytest.mark.parametrize(("autopilot", "at_s"), [("px4", 5.0), ("ardupilot", 30.0)])
@pytest.mark.parametrize("way", ["up_cut", "down_cut"])
def test_a_link_that_fails_on_the_ground(autopilot: str, at_s: float, way: str, tmp_path: Path) -> None:
    live = Live(tmp_path, autopilots=[autopilot] * 3)
    live.at = [(at_s, lambda live: live.fleet.vehicles[1].network.impair(**{way: True}))]
    with pytest.raises(RefusedError, match=r"^vehicle 2 (is still lost|gave up)"):
        live.fly()
    assert not any(vehicle.armed for vehicle in live.fleet.vehicles)
    assert live.now < 150.0


def test_a_vehicle_that_hears_nothing_is_lost_though_it_speaks(tmp_path: Path) -> None:
    live = Live(tmp_path, autopilots=["ardupilot"] * 3)
    live.at = [(95.0, lambda live: live.fleet.vehicles[1].network.impair(up_cut=True))]
    outcome = live.fly()
    told = events(outcome, 2)
    assert "vehicle 2: no answer for 15 s while engaged" in told


@pytest.mark.parametrize(("autopilot", "ends"), [("px4", "released"), ("ardupilot", "landed")])
def test_a_gap_in_the_link(autopilot: str, ends: str, tmp_path: Path) -> None:
    """PX4 has begun its own return by then and is let go; ArduPilot hovers in our mode, and is taken back."""
    at_s = TAKES_OFF_S[autopilot] + 40.0
    live = Live(
        tmp_path,
        {"safety.if_one_fails": "continue"},
        [autopilot] * 3,
        faults=[f"2:link-loss@{at_s:g}+8"],
    )
    outcome = live.fly()
    assert outcomes(outcome) == ["landed", ends, "landed"]
    assert "vehicle 2: heartbeat again" in events(outcome, 2)
    assert all(live.down)
    assert outcome.exit_code() == (0 if ends == "landed" else 1)


def test_a_link_too_slow_for_setpoints_is_refused_on_the_ground(tmp_path: Path) -> None:
    live = Live(tmp_path, PATIENT)
    live.impair(delay_s=2.0)
    with pytest.raises(RefusedError, match=r"vehicle 1: its link's round trip takes 4\.\d s"):
        live.fly()
    assert all(live.down)
