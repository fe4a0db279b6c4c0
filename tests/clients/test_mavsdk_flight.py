"""MAVSDK flies the stub by its actions: arm, take off, go somewhere, return, land.

A test named for a row shows that row of "What a MAVSDK 4.1 client needs from a vehicle".
"""

import math
from collections.abc import Callable
from typing import Any

import pytest
from mavsdk.plugins.action import ActionError, ActionResult
from mavsdk.plugins.telemetry import LandedState

from swarmctl.core.calls import to_geodetic
from swarmctl.mavlink.dialect import mav

from .meeting import MODES, ORIGIN, Meeting

Meet = Callable[..., Meeting]
ARM, TAKEOFF, SET_MODE = 400, 22, 176
FAST = 20.0
"""Times the wall's, where MAVSDK sends no setpoints."""


def refusal(action: Callable[[], Any]) -> ActionResult:
    """What MAVSDK raises for an action."""
    with pytest.raises(ActionError) as caught:
        action()
    result: ActionResult = caught.value.result
    return result


def test_row_takeoff_altitude_is_a_parameter_of_px4_and_part_of_ardupilots_command(
    meet: Meet, autopilot: str
) -> None:
    flight = meet(speed=FAST)
    stub, client = flight
    flight.take_off(7.0)
    assert stub.place == pytest.approx((0.0, 0.0, 7.0), abs=0.2)
    assert client.action.get_takeoff_altitude() == 7.0
    (command,) = stub.commands(TAKEOFF)
    written = [fields.param_id for fields in stub.received(mav.MAVLINK_MSG_ID_PARAM_SET)]
    read = [fields.param_id for fields in stub.received(mav.MAVLINK_MSG_ID_PARAM_REQUEST_READ)]
    if autopilot == "px4":
        assert written == read == ["MIS_TAKEOFF_ALT"]
        assert stub.vehicle.parameters["MIS_TAKEOFF_ALT"] == 7.0
        assert math.isnan(command.param7)
    else:
        assert written == read == []
        assert command.param7 == 7.0


def test_row_commands_arm_take_off_land_and_disarm(meet: Meet) -> None:
    flight = meet(speed=FAST)
    stub, client = flight
    armed: list[bool] = []
    client.telemetry.set_rate_in_air(5.0)
    client.telemetry.subscribe_armed(lambda is_armed, _: armed.append(is_armed))
    client.action.arm()
    assert stub.vehicle.armed
    stub.until(lambda: armed[-1:] == [True])
    flight.take_off(5.0)
    stub.until(client.telemetry.in_air)
    client.action.land()
    stub.until(lambda: armed[-1:] == [False], 60.0)
    assert not stub.vehicle.armed
    assert stub.vehicle.landed
    assert stub.place[2] == 0.0
    stub.until(lambda: client.telemetry.landed_state() == LandedState.ON_GROUND)


def test_row_commands_return_to_launch_lands_at_home(meet: Meet, autopilot: str) -> None:
    flight = meet(speed=FAST)
    stub, client = flight
    flight.take_off(5.0)
    lat, lon = to_geodetic(20.0, 15.0, *ORIGIN)
    client.action.goto_location(lat, lon, ORIGIN[2] + 5.0, 0.0)
    stub.arrive(20.0, 15.0, 5.0)
    client.action.set_return_to_launch_altitude(12.0)
    client.action.return_to_launch()
    assert stub.mode == MODES[autopilot].return_home
    stub.until(lambda: stub.place[2] > 11.0)
    assert math.dist(stub.place[:2], (20.0, 15.0)) < 2.0
    stub.until(lambda: not stub.vehicle.armed, 90.0)
    assert stub.place == pytest.approx((0.0, 0.0, 0.0), abs=1.0)
    stub.until(lambda: not client.telemetry.armed())


def test_row_commands_mavsdk_believes_the_ack(meet: Meet) -> None:
    """The vehicle acknowledges the mode and stays in the one that it is in."""
    flight = meet(speed=FAST)
    stub, client = flight
    flight.take_off(5.0)
    before = stub.mode
    stub.do(stub.vehicle.faults.begin, "stuck-mode")
    client.action.land()
    stub.run(5.0)
    assert stub.mode == before
    assert stub.place[2] > 4.5


def test_row_commands_the_ack_must_come_within_2_s(meet: Meet) -> None:
    """MAVSDK gives up, after asking every half second; the vehicle has obeyed."""
    stub, client = meet(speed=1.0)
    stub.do(lambda: stub.vehicle.network.impair(down_cut=True))
    began = stub.wall
    assert refusal(client.action.arm) is ActionResult.TIMEOUT
    assert 1.9 < stub.wall - began < 2.5
    assert len(stub.commands(ARM)) == 4
    assert stub.vehicle.armed


def test_row_unused_parameters_are_nan_for_px4_and_zero_for_ardupilot(meet: Meet, autopilot: str) -> None:
    stub, client = meet()
    client.action.arm()
    client.action.return_to_launch()
    assert stub.vehicle.armed
    assert stub.mode == MODES[autopilot].return_home
    (arm,), (mode,) = stub.commands(ARM), stub.commands(SET_MODE)
    unused = [
        arm.param2,
        arm.param3,
        arm.param4,
        arm.param5,
        arm.param6,
        arm.param7,
        mode.param4,
        mode.param7,
    ]
    if autopilot == "px4":
        assert all(math.isnan(value) for value in unused)
    else:
        assert unused == [0.0] * len(unused)


@pytest.mark.parametrize("autopilot", ["px4"])
@pytest.mark.parametrize("name", ["arm", "takeoff", "land"])
def test_px4_refuses_before_it_is_ready(meet: Meet, name: str) -> None:
    stub, client = meet(booted_s=0.0, speed=1.0)
    mode = stub.mode
    assert refusal(getattr(client.action, name)) is ActionResult.COMMAND_DENIED
    assert stub.now < 2.0
    assert (stub.mode, stub.vehicle.armed) == (mode, False)


@pytest.mark.parametrize("autopilot", ["ardupilot"])
def test_ardupilot_refuses_to_arm_before_its_checks_and_to_take_off_before_it_has_a_position(
    meet: Meet,
) -> None:
    stub, client = meet(booted_s=0.0, speed=10.0)
    assert refusal(client.action.arm) is ActionResult.FAILED
    assert not stub.vehicle.armed
    stub.until(lambda: stub.now > 25.0, 40.0)
    client.action.arm()
    assert stub.vehicle.armed
    assert refusal(client.action.takeoff) is ActionResult.FAILED
    stub.run(5.0)
    assert stub.place[2] == 0.0


@pytest.mark.parametrize("autopilot", ["ardupilot"])
def test_mavsdk_cannot_arm_ardupilot_again_after_a_return(meet: Meet) -> None:
    """It asks for BRAKE before arming where it finds RTL, and ArduCopter does not arm in BRAKE."""
    stub, client = meet()
    client.action.return_to_launch()
    stub.until(lambda: client.telemetry.flight_mode().name == "RETURN_TO_LAUNCH")
    assert refusal(client.action.arm) is ActionResult.FAILED
    assert (stub.mode, stub.vehicle.armed) == (MODES["ardupilot"].hold, False)
