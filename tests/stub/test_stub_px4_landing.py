"""PX4 on its way back to the ground: each test plays one row of the table of what real autopilots do."""

from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
OFFBOARD, LOITER, RTL, LAND = 0x60000, 0x3040000, 0x5040000, 0x6040000


@pytest.mark.row("px4-rtl")
def test_rtl_climbs_to_the_return_altitude_and_flies_straight_home(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.run_until(lambda: s.body["east"] > 60.0, 30.0, lambda: s.setpoint(0.0, 8.0, z=-10.0))
    assert s.set_mode(RTL) == [0, 0]
    highest, worst = 0.0, 0.0

    def watch() -> None:
        nonlocal highest, worst
        highest, worst = max(highest, s.body["up"]), max(worst, abs(s.body["north"]))

    s.run_until(lambda: not s.vehicle.armed, 150.0, watch)
    assert highest == pytest.approx(30.0, abs=0.8)
    assert worst < 0.1
    assert (s.body["east"], s.body["north"]) == pytest.approx((0.0, 0.0), abs=1.0)


@pytest.mark.row("px4-rtl")
def test_rtl_near_home_climbs_less(station: Make) -> None:
    s = station()
    s.fly_offboard(5.0)
    s.run_until(lambda: s.body["east"] > 12.0, 30.0, lambda: s.setpoint(0.0, 3.0, z=-5.0))
    s.set_mode(RTL)
    highest = 0.0
    for _ in range(500):
        s.tick()
        highest = max(highest, s.body["up"])
    assert 11.0 < highest < 17.0


@pytest.mark.row("px4-rtl")
def test_rtl_from_40_m_takes_about_a_minute(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.run_until(lambda: s.body["east"] > 40.0, 30.0, lambda: s.setpoint(0.0, 5.0, z=-10.0))
    s.set_mode(RTL)
    assert s.run_until(lambda: not s.vehicle.armed, 120.0) == pytest.approx(64.0, rel=0.1)


@pytest.mark.row("px4-after-landing")
def test_after_landing_the_mode_is_offboard_again_and_arming_flies(station: Make) -> None:
    s = station()
    s.fly_offboard(5.0)
    s.setpoint(z=-5.0)
    s.set_mode(RTL)
    s.run_until(lambda: not s.vehicle.armed, 60.0)
    assert s.mode == OFFBOARD
    s.run(0.5, lambda: s.setpoint(z=-5.0))
    assert s.arm() == [0]
    s.run(10.0, lambda: s.setpoint(z=-5.0))
    assert s.body["up"] > 4.0


@pytest.mark.row("px4-after-landing")
def test_after_landing_loiter_first_keeps_it_on_the_ground(station: Make) -> None:
    s = station()
    s.fly_offboard(5.0)
    s.setpoint(z=-5.0)
    s.set_mode(LAND)
    s.run_until(lambda: not s.vehicle.armed, 60.0)
    assert s.set_mode(LOITER) == [0, 0]
    s.run(0.5, lambda: s.setpoint(z=-5.0))
    assert s.arm() == [0]
    s.run(5.0, lambda: s.setpoint(z=-5.0))
    assert s.body["up"] == 0.0


def test_land_goes_straight_down_tells_so_and_disarms_two_seconds_later(station: Make) -> None:
    s = station()
    s.fly_up(8.0)
    assert s.command(mav.MAV_CMD_NAV_LAND) == [0]
    s.run(3.0)
    assert s.last(245).landed_state == mav.MAV_LANDED_STATE_LANDING
    s.run_until(lambda: s.vehicle.landed, 30.0)
    assert s.vehicle.armed
    assert 1.8 < s.run_until(lambda: not s.vehicle.armed, 5.0) < 2.3
    s.run(1.0)
    assert s.last(245).landed_state == mav.MAV_LANDED_STATE_ON_GROUND
    assert not s.last(0).base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert s.last(0).custom_mode == LOITER
