"""A session that finds its vehicle in the air changes nothing, sends no setpoint, and takes it back by order only."""

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.ardupilot import MODES as ARDUPILOT
from swarmctl.vehicle.autopilots.px4 import MODES as PX4
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import OrderError, Session
from swarmctl.vehicle.settings import SessionSettings

from .stub_flight import BOTH, SETPOINT, StubFlight

FENCE = Fence([[(47.39, 8.53), (47.39, 8.56), (47.41, 8.56), (47.41, 8.53)]])
OTHER = Fence([[(47.39, 8.53), (47.39, 8.56), (47.42, 8.56), (47.42, 8.53)]])
POSCTL, ARDUPILOT_LOITER, SMART_RTL = 3 << 16, 5, 21


def orphaned(autopilot: str, after_s: float = 20.0, fence: Fence = FENCE) -> StubFlight:
    """A flight whose controller died ``after_s`` ago; another one has come, which knows of ``fence``."""
    flight = StubFlight(autopilot, preflight=Preflight(read_parameters=True, fence=FENCE))
    flight.engage()
    flight.command(5.0, 0.0)
    flight.run(5.0)
    flight.each_tick = lambda: None
    flight.drop = lambda frame: True
    flight.run(after_s)
    flight.drop = lambda frame: False
    looks = Preflight(read_parameters=True, fence=fence, upload=False)
    flight.session = Session(1, settings=SessionSettings(), now=flight.now, preflight=looks, adopts=True)
    return flight


@pytest.mark.parametrize("autopilot", BOTH)
@pytest.mark.parametrize("after_s", [0.5, 4.0, 20.0])
def test_found_and_taken_back_where_it_is(autopilot: str, after_s: float) -> None:
    flight = orphaned(autopilot, after_s)
    since = flight.now
    flight.until_phase(Phase.FOUND, 20.0)
    asked = {f.command for f in flight.sent(mav.MAVLINK_MSG_ID_COMMAND_LONG, since)}
    assert asked == {mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAV_CMD_REQUEST_MESSAGE}
    assert not flight.sent(mav.MAVLINK_MSG_ID_MISSION_COUNT, since)
    assert not flight.sent(SETPOINT, since)
    assert flight.session.fence_verified and flight.session.parameters["speed_mps"] > 0.0
    height_m = flight.session.telemetry.height_m
    flight.session.adopt()
    flight.until_phase(Phase.ENGAGED, 10.0)
    flight.command(0.0, 0.0, height_m)
    flight.run(5.0)
    assert flight.session.phase is Phase.ENGAGED
    assert flight.speed_mps < 0.3 and abs(flight.body["up"] - height_m) < 2.0
    flight.land()


@pytest.mark.parametrize(("autopilot", "mode"), [("px4", POSCTL), ("ardupilot", ARDUPILOT_LOITER)])
def test_a_pilots_vehicle_is_not_taken(autopilot: str, mode: int) -> None:
    flight = orphaned(autopilot)
    flight.until_phase(Phase.FOUND, 20.0)
    flight.session.telemetry.mode = mode
    with pytest.raises(OrderError, match="vehicle 1: a pilot flies it in "):
        flight.session.adopt()
    assert flight.session.phase is Phase.FOUND


def test_a_pilot_who_takes_over_while_it_is_being_taken_back_is_not_fought() -> None:
    flight = orphaned("ardupilot")
    flight.pilot_sets_mode(ARDUPILOT.hold)
    flight.until_phase(Phase.FOUND, 20.0)
    flight.session.adopt()
    flight.pilot_sets_mode(ARDUPILOT_LOITER)
    flight.drop = lambda frame: frame[7] == mav.MAVLINK_MSG_ID_COMMAND_LONG
    flight.until_phase(Phase.RELEASED, 5.0)
    assert flight.session.reason == "vehicle 1: its mode became LOITER while engaging"


@pytest.mark.parametrize("autopilot", BOTH)
def test_another_fence_on_board_is_left_there_and_the_vehicle_alone(autopilot: str) -> None:
    flight = orphaned(autopilot, 4.0, OTHER)
    since = flight.now
    flight.until_phase(Phase.RELEASED, 30.0)
    assert "fence read back: vertex 2 is" in flight.session.reason
    assert flight.texts(EventKind.RELEASED) == [flight.session.reason]
    flight.run(30.0)
    assert not flight.sent(mav.MAVLINK_MSG_ID_MISSION_COUNT, since) and not flight.sent(SETPOINT, since)
    assert not flight.commands(mav.MAV_CMD_DO_SET_MODE, since)


def test_declined_it_is_released_for_a_reason_and_can_be_retaken() -> None:
    flight = orphaned("px4")
    flight.until_phase(Phase.FOUND, 20.0)
    flight.session.decline("it is outside the fence")
    assert (flight.session.phase, flight.session.reason) == (
        Phase.RELEASED,
        "vehicle 1: it is outside the fence",
    )
    flight.session.retake()
    flight.until_phase(Phase.ENGAGED, 10.0)


@pytest.mark.parametrize("autopilot", BOTH)
def test_one_that_landed_meanwhile_has_landed(autopilot: str) -> None:
    flight = orphaned(autopilot, 1.0)
    flight.pilot_sets_mode((ARDUPILOT if autopilot == "ardupilot" else PX4).land)
    flight.drop = lambda frame: True
    flight.until(lambda: not flight.vehicle.armed)
    flight.drop = lambda frame: False
    flight.until_phase(Phase.LANDED, 20.0)


@pytest.mark.parametrize("autopilot", BOTH)
def test_one_on_the_last_metres_is_let_land(autopilot: str) -> None:
    flight = orphaned(autopilot, 1.0)
    flight.pilot_sets_mode((ARDUPILOT if autopilot == "ardupilot" else PX4).land)
    flight.drop = lambda frame: True
    flight.until(lambda: bool(flight.body["up"] < 4.0))
    flight.drop = lambda frame: False
    phases = set()
    while flight.session.phase is not Phase.LANDED:
        flight.tick()
        phases.add(flight.session.phase)
        assert flight.now < 300.0
    assert Phase.FOUND not in phases and not flight.vehicle.armed


def test_what_a_failsafe_may_choose() -> None:
    assert {PX4.comeback, PX4.land, PX4.hold, PX4.engaged, PX4.take_off} == PX4.unattended
    assert SMART_RTL in ARDUPILOT.unattended and ARDUPILOT_LOITER not in ARDUPILOT.unattended
