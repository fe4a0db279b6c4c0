"""MAVSDK steers the stub by setpoints, which it repeats by itself.

A test named for a row shows that row of "What a MAVSDK 4.1 client needs from a vehicle".
"""

import math
from collections.abc import Callable
from itertools import pairwise
from statistics import median

import pytest
from mavsdk.plugins.offboard import OffboardError, OffboardResult, PositionNedYaw, VelocityNedYaw

from swarmctl.mavlink.dialect import mav

from .meeting import MODES, Meeting

Meet = Callable[..., Meeting]
SETPOINT: int = mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
VELOCITY_MASK, POSITION_MASK = 2503, 2552
REPEATED_EVERY_S = 0.05
HEIGHT_M = 5.0


@pytest.fixture
def flight(meet: Meet) -> Meeting:
    """The vehicle hovers, and MAVSDK has sent no setpoint yet."""
    meeting: Meeting = meet(speed=10.0)
    meeting.bear_rare_setpoints()
    meeting.take_off(HEIGHT_M)
    return meeting


def reach(flight: Meeting, north: float, east: float) -> None:
    """Wait until the vehicle has what its firmware makes of this horizontal velocity (m/s)."""
    stub = flight.stub
    share = stub.vehicle.limits.velocity_share
    stub.until(lambda: math.dist(stub.velocity[:2], (share * east, share * north)) < 0.05)


def delay_of_anew(flight: Meeting, north_mps: float) -> float:
    """Wall seconds from setting a new velocity until the vehicle has it."""
    stub, client = flight
    began, count = stub.wall, len(stub.heard)
    client.offboard.set_velocity_ned(VelocityNedYaw(north_mps, 0.0, 0.0, 0.0))

    def arrived() -> list[float]:
        return [
            one.wall
            for one in stub.heard[count:]
            if one.frame.message_id == SETPOINT and one.frame.fields.vx == pytest.approx(north_mps)
        ]

    stub.until(lambda: bool(arrived()))
    return arrived()[0] - began


def test_a_velocity_is_flown_from_the_first_setpoint_on(flight: Meeting, autopilot: str) -> None:
    stub, client = flight
    client.offboard.set_velocity_ned(VelocityNedYaw(4.0, -3.0, 0.0, 0.0))
    client.offboard.start()
    assert stub.mode == MODES[autopilot].offboard
    reach(flight, 4.0, -3.0)
    stub.run(4.0)
    share = stub.vehicle.limits.velocity_share
    assert stub.velocity[:2] == pytest.approx((-3.0 * share, 4.0 * share), abs=0.05)
    assert client.offboard.is_active()
    client.offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, -1.0, 0.0))
    reach(flight, 0.0, 2.0)
    climbed_from = stub.place[2]
    stub.run(2.0)
    assert stub.place[2] > climbed_from + 1.5


def test_row_velocity_setpoints_are_repeated_at_20_hz(flight: Meeting) -> None:
    """It cannot be told another rate; but what is set anew goes out at once."""
    stub, client = flight
    client.offboard.set_velocity_ned(VelocityNedYaw(1.0, 2.0, -0.5, 90.0))
    stub.until(lambda: len(stub.received(SETPOINT)) > 20)
    heard = [one for one in stub.heard if one.frame.message_id == SETPOINT]
    assert {(one.frame.system, one.frame.component) for one in heard} == {(245, 190)}
    fields = heard[-1].frame.fields
    assert (fields.type_mask, fields.coordinate_frame) == (VELOCITY_MASK, mav.MAV_FRAME_LOCAL_NED)
    assert (fields.vx, fields.vy, fields.vz) == (1.0, 2.0, -0.5)
    assert fields.yaw == pytest.approx(math.pi / 2)
    intervals = [later.wall - earlier.wall for earlier, later in pairwise(heard)]
    assert median(intervals) == pytest.approx(REPEATED_EVERY_S, abs=0.005)
    assert median(delay_of_anew(flight, 0.1 * k) for k in range(9)) < 0.01


def test_a_position_is_reached_facing_where_told(flight: Meeting) -> None:
    stub, client = flight
    client.offboard.set_position_ned(PositionNedYaw(12.0, -9.0, -8.0, 90.0))
    client.offboard.start()
    stub.arrive(-9.0, 12.0, 8.0)
    assert stub.vehicle.yaw == pytest.approx(math.pi / 2)
    assert stub.received(SETPOINT)[-1].type_mask == POSITION_MASK


def test_stop_holds_and_ends_the_setpoints(flight: Meeting, autopilot: str) -> None:
    stub, client = flight
    client.offboard.set_velocity_ned(VelocityNedYaw(4.0, 0.0, 0.0, 0.0))
    client.offboard.start()
    reach(flight, 4.0, 0.0)
    client.offboard.stop()
    assert stub.mode == MODES[autopilot].hold
    assert not client.offboard.is_active()
    sent = len(stub.received(SETPOINT))
    stub.until(lambda: math.hypot(*stub.velocity) < 0.05)
    stub.run(2.0)
    assert len(stub.received(SETPOINT)) <= sent + 1
    assert stub.vehicle.armed
    assert stub.place[2] == pytest.approx(HEIGHT_M, abs=0.5)


def test_without_a_setpoint_nothing_is_started(meet: Meet) -> None:
    stub, client = meet()
    mode = stub.mode
    with pytest.raises(OffboardError) as caught:
        client.offboard.start()
    assert caught.value.result is OffboardResult.NO_SETPOINT_SET
    stub.run(1.0)
    assert not stub.received(SETPOINT)
    assert stub.mode == mode


def test_setpoints_that_no_longer_come_through_bring_px4_home_and_stop_ardupilot(
    meet: Meet, autopilot: str
) -> None:
    flight = meet()
    stub, client = flight
    flight.take_off(HEIGHT_M)
    client.offboard.set_velocity_ned(VelocityNedYaw(4.0, 0.0, 0.0, 0.0))
    client.offboard.start()
    reach(flight, 4.0, 0.0)
    stub.do(stub.vehicle.faults.begin, "link-loss")
    if autopilot == "px4":
        assert 0.5 < stub.until(lambda: stub.mode == MODES["px4"].return_home, 3.0) < 2.0
    else:
        assert stub.until(lambda: stub.velocity[1] < 3.9, 6.0) > 2.5
        stub.until(lambda: math.hypot(*stub.velocity) < 0.05)
        assert stub.mode == MODES["ardupilot"].offboard
