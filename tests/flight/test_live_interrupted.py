"""Ctrl-C at any moment of a live flight, in virtual time: nobody is left in the air."""

from pathlib import Path

import pytest

from swarmctl.flight.errors import StoppedError

from .virtual import Live, outcomes

MOMENTS = {"px4": range(0, 180, 20), "ardupilot": range(0, 220, 20)}


@pytest.mark.parametrize("again_s", [None, 0.0, 4.0])
@pytest.mark.parametrize(("autopilot", "at_s"), [(name, at) for name in MOMENTS for at in MOMENTS[name]])
def test_at_any_moment(autopilot: str, at_s: float, again_s: float | None, tmp_path: Path) -> None:
    live = Live(tmp_path, autopilots=[autopilot] * 3)
    live.at = [(at_s, lambda live: live.orders.interrupt())]
    if again_s is not None:
        live.at.append((at_s + again_s, lambda live: live.orders.interrupt()))
    try:
        outcome = live.fly()
    except StoppedError as error:
        assert str(error) == "stopped before anything was armed"
        assert not any(vehicle.armed for vehicle in live.fleet.vehicles)
        assert live.now < at_s + 1.0
        return
    assert all(live.down)
    assert outcomes(outcome) == ["landed"] * 3
    assert outcome.summary("")["geofence_violations"] == 0
    ended_first = outcome.swarm.part.value == "over" and live.now < at_s
    assert outcome.exit_code() == (0 if ended_first else 4)


def test_a_third_time_lands_real_vehicles_all_the_same(tmp_path: Path) -> None:
    live = Live(tmp_path)
    live.at = [(60.0 + k, lambda live: live.orders.interrupt()) for k in range(4)]
    outcome = live.fly()
    assert all(live.down)
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 4)


def test_a_third_time_stops_a_flight_of_our_own_stubs(tmp_path: Path) -> None:
    live = Live(tmp_path, options={"own_stubs": True})
    live.at = [(60.0 + k, lambda live: live.orders.interrupt()) for k in range(3)]
    with pytest.raises(StoppedError, match="stopped at once"):
        live.fly()
    assert live.now < 63.0
