"""Whole flights through links that lose, repeat, delay, reorder, garble and fall silent one way.

However bad it is, a flight ends landed or reported, within a bounded time; and what is called landed is.
"""

from typing import Any

import pytest

from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .fake_ardupilot import FakeArduPilot
from .fake_px4 import FakePx4
from .storm import Weather, fly

LIMIT_S = 900.0
PATIENT = {"command_patience_s": 60.0, "attempts": 60, "parameter_patience_s": 30.0}
REPORTS = {EventKind.FAILED, EventKind.RELEASED, EventKind.LOST}
PREFLIGHT = Preflight(True, Fence([[(47.39, 8.54), (47.39, 8.56), (47.41, 8.55)]]))

ROUGH = {
    "loss": Weather(loss=0.4),
    "late and out of order": Weather(delay_s=2.0),
    "repeated": Weather(repeat=0.5, delay_s=0.5),
    "garbage": Weather(garbage=0.5),
    "byte by byte": Weather(garbage=0.3, crumbs=True),
    "everything": Weather(loss=0.4, repeat=0.2, delay_s=2.0, garbage=0.2, crumbs=True),
}


def flown(kind: type[FakePx4], weather: Weather, seed: int, **settings: Any) -> tuple[Session, FakePx4, Any]:
    """A flight of the scripted vehicle ``kind``: its session, itself, and the events."""
    session = Session(1, settings=SessionSettings(**settings), now=0.0, preflight=PREFLIGHT)
    vehicle = kind(1)
    vehicle.memory.parameters = {"MPC_XY_VEL_MAX": 12.0, "WP_SPD": 10.0}
    vehicle.memory.unknown_answered = True

    def advance(now: float) -> list[bytes]:
        vehicle.advance(now, 0.1)
        frames, vehicle.out = vehicle.out, []
        return frames

    fly(session, advance, lambda data, now: vehicle.receive(data), weather, seed=seed, limit_s=LIMIT_S)
    return session, vehicle, session.events()


def check_end(session: Session, vehicle: Any, events: list[Any]) -> None:
    """Landed and truly so, or reported."""
    if session.phase is Phase.LANDED:
        assert not vehicle.armed and vehicle.height_m == 0.0
    else:
        assert {event.kind for event in events} & REPORTS, session.phase
        assert session.phase in (Phase.FAILED, Phase.RELEASED, Phase.LOST)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("weather", ROUGH.values(), ids=ROUGH.keys())
@pytest.mark.parametrize("kind", [FakePx4, FakeArduPilot])
def test_rough(kind: type[FakePx4], weather: Weather, seed: int) -> None:
    check_end(*flown(kind, weather, seed))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("weather", ROUGH.values(), ids=ROUGH.keys())
@pytest.mark.parametrize("kind", [FakePx4, FakeArduPilot])
def test_rough_with_patience_lands(kind: type[FakePx4], weather: Weather, seed: int) -> None:
    session, vehicle, events = flown(kind, weather, seed, link_loss_s=20.0, **PATIENT)
    check_end(session, vehicle, events)
    told = [event.text for event in events if event.kind is EventKind.FAILED]
    assert session.phase is Phase.LANDED and not told, told
    assert session.fence_verified and session.parameters["speed_mps"] in (10.0, 12.0)


@pytest.mark.parametrize("dead_from", [0.0, 1.5, 3.0, 8.0, 14.0, 25.0, 35.0, 47.0, 55.0, 62.0, 70.0])
@pytest.mark.parametrize("way", ["dead_up_from", "dead_down_from"])
@pytest.mark.parametrize("kind", [FakePx4, FakeArduPilot])
def test_one_way_only(kind: type[FakePx4], way: str, dead_from: float) -> None:
    """A vehicle that does not hear us is reported; one that we do not hear is landed if it was ours."""
    session, vehicle, events = flown(kind, Weather(**{way: dead_from}), 1)
    if way == "dead_down_from" and dead_from == 0.0:
        assert session.phase is Phase.CONNECTING and not vehicle.armed
        return
    check_end(session, vehicle, events)
    if way == "dead_down_from":
        assert not vehicle.armed and vehicle.height_m == 0.0
