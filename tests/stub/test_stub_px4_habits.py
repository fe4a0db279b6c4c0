"""What PX4 was seen to do beside what it is asked for: see docs/autopilots.md."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
OFFBOARD, LOITER, RTL, LAND = 0x60000, 0x3040000, 0x5040000, 0x6040000
BREACHED = "Geofence: approaching or outside geofence\t"
INVALID = "Geofence invalid, doesn't contain Home position\t"


@pytest.mark.parametrize("holds_home", [True, False])
def test_a_fence_without_home_is_accepted_and_not_heeded(station: Make, holds_home: bool) -> None:
    s = station()
    s.fly_offboard(10.0)
    assert s.put_fence(-20.0 if holds_home else 5.0, 20.0) == mav.MAV_MISSION_ACCEPTED
    assert (INVALID in s.texts()) != holds_home
    s.run(12.0, lambda: s.setpoint(v_east=5.0, z=-10.0))
    assert s.body["east"] > 20.0
    assert (s.mode == LOITER) == holds_home
    assert (BREACHED in s.texts()) == holds_home


@pytest.mark.parametrize("mode", [RTL, LAND])
def test_it_sends_itself_commands_for_a_gimbal(station: Make, mode: int) -> None:
    """COMMAND_LONGs that nobody else is meant by, with the vehicle's own system id as target."""
    s = station()
    s.fly_up(10.0)
    assert not s.all(76)
    s.set_mode(mode)
    sent = [fields for _, fields in s.all(76)]
    assert [(f.command, f.target_system, f.target_component) for f in sent] == [(1001, 1, 0), (1000, 1, 0)]
    assert math.isnan(sent[1].param1)


def test_on_the_ground_one_that_misses_setpoints_says_that_it_is_not_set_up(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.set_mode(LAND)
    s.run_until(lambda: not s.vehicle.armed, 60.0)
    s.run(2.0)
    beat = s.last(0)
    assert (beat.custom_mode, beat.system_status) == (OFFBOARD, mav.MAV_STATE_UNINIT)
    s.set_mode(LOITER)
    s.run(2.0)
    assert s.last(0).system_status == mav.MAV_STATE_STANDBY


@pytest.mark.parametrize(("speed", "then"), [(3.0, LOITER), (8.0, RTL)])
def test_who_breaks_its_fence_fast_holds_and_then_returns(station: Make, speed: float, then: int) -> None:
    """With GF_ACTION 2; slowly, it holds for good."""
    s = station()
    s.fly_offboard(10.0)
    s.put_fence(-20.0, 60.0)
    s.set_parameter("GF_ACTION", 2)
    s.run_until(lambda: s.mode == LOITER, 60.0, lambda: s.setpoint(v_east=speed, z=-10.0))
    s.run(5.0)
    assert s.mode == then
