"""PX4 in the air: each test plays one row of the table of what real autopilots do."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from sim_vehicle_stub.pilot import Limits
from swarmctl.core.geodesy import to_geodetic
from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
ORIGIN = (47.3977, 8.5456, 488.0)
OFFBOARD, TAKEOFF, LOITER, RTL = 0x60000, 0x2040000, 0x3040000, 0x5040000
NAN = math.nan
PURE_VELOCITY = 1 | 2 | 4 | 64 | 128 | 256 | 1024 | 2048
PLACE = 8 | 16 | 32 | 64 | 128 | 256 | 1024 | 2048
REJECTED: int = mav.MAV_RESULT_TEMPORARILY_REJECTED


def take_off(s: Any, altitude: float) -> list[int]:
    results: list[int] = s.command(mav.MAV_CMD_NAV_TAKEOFF, NAN, NAN, NAN, NAN, NAN, NAN, altitude)
    return results


def speed_of(s: Any) -> float:
    return math.hypot(s.body["v_east"], s.body["v_north"])


@pytest.mark.row("px4-takeoff")
def test_takeoff_is_above_sea_level_and_takes_about_twelve_seconds_to_10_m(station: Make) -> None:
    s = station()
    s.run(5.0)
    assert take_off(s, 498.0) == [0]
    assert (s.mode, s.body["up"]) == (TAKEOFF, 0.0)
    assert s.arm() == [0]
    assert s.run_until(lambda: s.body["up"] > 9.9, 20.0) == pytest.approx(12.0, rel=0.1)
    s.run(5.0)
    assert s.mode == LOITER
    assert s.body["up"] == pytest.approx(10.0, abs=0.1)
    s.command(512, 245)
    assert s.last(245).landed_state == mav.MAV_LANDED_STATE_IN_AIR
    assert s.last(33).alt == pytest.approx(498000, abs=100)
    assert s.last(33).relative_alt == pytest.approx(10000, abs=100)


@pytest.mark.row("px4-takeoff")
def test_takeoff_a_relative_altitude_means_below_the_ground(station: Make) -> None:
    s = station()
    s.run(5.0)
    frame = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
    none = 0x7FFFFFFF
    s.send(mav.MAVLink_command_int_message(1, 1, frame, 22, 0, 0, NAN, NAN, NAN, NAN, none, none, 6.0))
    assert s.arm() == [0]
    s.run(15.0)
    assert s.body["up"] == 0.0
    assert not s.vehicle.armed


@pytest.mark.row("px4-takeoff")
def test_takeoff_a_relative_altitude_of_a_reposition_in_the_air_lands_it(station: Make) -> None:
    s = station()
    s.fly_up(10.0)
    frame, none = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, 0x7FFFFFFF
    s.send(mav.MAVLink_command_int_message(1, 1, frame, 192, 0, 0, -1, 1, NAN, NAN, none, none, 6.0))
    s.run_until(lambda: not s.vehicle.armed, 30.0)
    assert s.body["up"] == 0.0


@pytest.mark.row("px4-takeoff")
def test_takeoff_without_an_altitude_uses_the_parameter(station: Make) -> None:
    s = station()
    s.run(5.0)
    s.send(mav.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 5.0, 9))
    assert take_off(s, NAN) == [0]
    s.arm()
    s.run(15.0)
    assert s.body["up"] == pytest.approx(5.0, abs=0.1)


def test_takeoff_tells_its_landed_state_on_the_way(station: Make) -> None:
    s = station()
    s.run(5.0)
    take_off(s, 498.0)
    s.arm()
    s.run(5.0)
    assert s.last(245).landed_state == mav.MAV_LANDED_STATE_TAKEOFF


@pytest.mark.row("px4-offboard")
def test_offboard_needs_a_stream_in_the_air(station: Make) -> None:
    s = station()
    s.fly_up(10.0)
    assert s.set_mode(OFFBOARD) == [0, REJECTED]
    assert s.mode == LOITER


@pytest.mark.row("px4-offboard")
@pytest.mark.parametrize(
    ("old_s", "results", "mode"), [(0.0, [0, 0], OFFBOARD), (1.5, [0, REJECTED], LOITER)]
)
def test_offboard_one_setpoint_is_enough_while_it_is_fresh(
    station: Make, old_s: float, results: list[int], mode: int
) -> None:
    s = station()
    s.fly_up(10.0)
    s.setpoint(z=-10.0)
    s.run(old_s)
    assert s.set_mode(OFFBOARD) == results
    assert s.mode == mode


@pytest.mark.row("px4-setpoints-stop")
def test_setpoints_stop_brings_it_home_after_a_second(station: Make) -> None:
    s = station(tick_s=0.01)
    s.fly_offboard(10.0)
    s.run(1.0, lambda: s.setpoint(3.0, z=-10.0))
    s.setpoint(3.0, z=-10.0)
    assert s.run_until(lambda: s.mode == RTL, 3.0) == pytest.approx(1.15, abs=0.06)
    s.run(1.0)
    assert s.last(0).system_status == mav.MAV_STATE_CRITICAL


@pytest.mark.row("px4-setpoints-stop")
@pytest.mark.parametrize(("rate", "modes"), [(1.1, {OFFBOARD}), (0.9, {OFFBOARD, RTL})])
def test_setpoints_stop_a_slow_stream_holds_or_flaps(station: Make, rate: float, modes: set[int]) -> None:
    s = station(tick_s=0.01)
    s.fly_offboard(10.0)
    seen = set()

    def send() -> None:
        s.setpoint(z=-10.0)
        seen.add(s.mode)

    for _ in range(6):
        send()
        s.run_until(lambda until=s.now + 1.0 / rate: seen.add(s.mode) or s.now >= until, 2.0)
    assert seen == modes


@pytest.mark.row("px4-setpoints-stop")
def test_setpoints_stop_and_resume_silently(station: Make) -> None:
    s = station(tick_s=0.045)
    s.fly_offboard(10.0)
    s.run(1.5)
    assert s.mode == RTL
    texts = len(s.texts())
    s.setpoint(z=-10.0)
    s.tick()
    assert s.mode == OFFBOARD
    assert len(s.texts()) == texts


def test_a_mode_chosen_by_the_pilot_is_not_taken_back_by_the_stream(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.setpoint(z=-10.0)
    assert s.set_mode(RTL) == [0, 0]
    s.run(1.0, lambda: s.setpoint(z=-10.0))
    assert s.mode == RTL


@pytest.mark.row("px4-velocity")
def test_velocity_pure_velocity_drifts_in_height_and_z_holds_it(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.run(10.0, lambda: s.setpoint(2.0, mask=PURE_VELOCITY))
    assert s.body["up"] - 10.0 == pytest.approx(1.3, abs=0.1)
    s.run(10.0, lambda: s.setpoint(2.0, z=-10.0))
    assert s.body["up"] == pytest.approx(10.0, abs=0.3)
    s.run(3.0, lambda: s.setpoint(mask=PURE_VELOCITY, vz=-1.0))
    assert s.body["v_up"] == pytest.approx(1.13, abs=0.01)


@pytest.mark.row("px4-velocity")
@pytest.mark.parametrize(
    ("commanded", "after", "reached"), [(5.0, 1.0, 3.0), (5.0, 10.0, 4.4), (30.0, 6.0, 9.7)]
)
def test_velocity_takes_time_and_is_never_quite_reached(
    station: Make, commanded: float, after: float, reached: float
) -> None:
    """Within 6 %: the real one falls short by a growing part, the stub by the same part at any speed."""
    s = station()
    s.fly_offboard(10.0)
    s.run(after, lambda: s.setpoint(commanded, z=-10.0))
    assert speed_of(s) == pytest.approx(reached, rel=0.06)


@pytest.mark.row("px4-velocity")
def test_velocity_is_limited_by_the_parameter(station: Make) -> None:
    s = station(limits=Limits())
    s.fly_offboard(10.0)
    s.run(10.0, lambda: s.setpoint(30.0, z=-10.0))
    assert speed_of(s) == pytest.approx(12.0, abs=0.1)
    s.send(mav.MAVLink_param_set_message(1, 1, b"MPC_XY_VEL_MAX", 8.0, 9))
    s.run(10.0, lambda: s.setpoint(30.0, z=-10.0))
    assert speed_of(s) == pytest.approx(8.0, abs=0.1)


def test_acceleration_and_climb_stay_within_the_vehicles_limits(station: Make) -> None:
    s = station(limits=Limits(25.0, 4.0, 6.0, 4.0, lag_s=0.0))
    s.fly_offboard(20.0)
    before = dict(zip(s.body.dtype.names, s.body, strict=True))
    fastest_up = 0.0
    for _ in range(100):
        s.setpoint(-18.0, 18.0, z=-60.0)
        s.tick()
        change = math.hypot(s.body["v_east"] - before["v_east"], s.body["v_north"] - before["v_north"])
        assert change <= 4.0 * 0.1 + 1e-9
        fastest_up = max(fastest_up, s.body["v_up"])
        before = dict(zip(s.body.dtype.names, s.body, strict=True))
    assert speed_of(s) == pytest.approx(25.0, abs=0.1)
    assert fastest_up == pytest.approx(6.0)


@pytest.mark.row("px4-frames")
def test_frames_body_turns_with_the_nose(station: Make) -> None:
    s = station(limits=Limits())
    s.fly_offboard(10.0)
    mask = PURE_VELOCITY & ~1024
    s.run(3.0, lambda: s.setpoint(4.0, mask=mask, frame=8, yaw=math.pi / 2))
    assert s.body["v_east"] == pytest.approx(4.0, abs=0.1)
    assert s.body["v_north"] == pytest.approx(0.0, abs=0.1)
    s.tick()
    assert s.last(33).hdg == 9000
    assert s.last(30).yaw == pytest.approx(math.pi / 2)


@pytest.mark.row("px4-frames")
@pytest.mark.parametrize("frame", [9, 12])
def test_frames_others_are_complained_of_and_are_no_stream(station: Make, frame: int) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.setpoint(z=-10.0)
    texts = len(s.all(253))
    s.run(0.5, lambda: s.setpoint(5.0, z=-10.0, frame=frame))
    assert len([1 for _, f in s.all(253)[texts:] if f.chunk_seq == 0]) == 5
    assert speed_of(s) == 0.0
    s.run(1.0, lambda: s.setpoint(5.0, z=-10.0, frame=frame))
    assert s.mode == RTL


def send_global(
    s: Any, east: float, north: float, altitude: float, frame: int = 6, mask: int = PLACE
) -> None:
    lat, lon = to_geodetic(east, north, *ORIGIN)
    s.send(
        mav.MAVLink_set_position_target_global_int_message(
            0, 1, 1, frame, mask, round(lat * 1e7), round(lon * 1e7), altitude, 0, 0, 0, 0, 0, 0, 0, 0
        )
    )


@pytest.mark.row("px4-frames")
def test_frames_global_place_with_relative_altitude(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.run(30.0, lambda: send_global(s, 40.0, -30.0, 15.0))
    assert (s.body["east"], s.body["north"]) == pytest.approx((40.0, -30.0), abs=0.1)
    assert s.body["up"] == pytest.approx(15.0, abs=0.1)
    s.run(15.0, lambda: send_global(s, 40.0, -30.0, 508.0, frame=5))
    assert s.body["up"] == pytest.approx(20.0, abs=0.1)
    s.run(0.1, lambda: send_global(s, 0.0, 0.0, 10.0, frame=1))
    assert s.body["up"] == pytest.approx(20.0, abs=0.1)


def test_local_place_is_met_in_the_vehicles_own_frame(station: Make) -> None:
    s = station(pads=[(100.0, 200.0)])
    s.fly_offboard(10.0)
    s.run(30.0, lambda: s.setpoint(z=-12.0, mask=PLACE, xy=(30.0, 40.0)))
    assert (s.last(32).x, s.last(32).y, s.last(32).z) == pytest.approx((30.0, 40.0, -12.0), abs=0.1)
    assert (s.body["east"], s.body["north"]) == pytest.approx((140.0, 230.0), abs=0.3)


def test_numbers_that_are_none_leave_the_vehicle_where_it_is(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.run(3.0, lambda: s.setpoint(NAN, math.inf, z=NAN, mask=0, xy=(NAN, 1.0), vz=NAN, yaw=NAN))
    assert speed_of(s) == 0.0
    assert s.body["up"] == pytest.approx(10.0, abs=0.1)
    assert s.mode == OFFBOARD


def test_loiter_brakes_and_stays(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    s.run(10.0, lambda: s.setpoint(8.0, z=-10.0))
    north = s.body["north"]
    assert s.command(mav.MAV_CMD_NAV_LOITER_UNLIM) == [0]
    s.run(10.0)
    assert speed_of(s) < 0.05
    assert 8.0 < s.body["north"] - north < 20.0
    held = s.body["north"]
    s.run(5.0)
    assert s.body["north"] == pytest.approx(held, abs=0.05)


@pytest.mark.row("px4-takeoff")
def test_takeoff_reposition_is_above_sea_level_too(station: Make) -> None:
    s = station()
    s.fly_up(10.0)
    lat, lon = to_geodetic(30.0, 20.0, *ORIGIN)
    frame = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
    flags = mav.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
    s.send(
        mav.MAVLink_command_int_message(
            1, 1, frame, 192, 0, 0, -1, flags, NAN, NAN, round(lat * 1e7), round(lon * 1e7), 508.0
        )
    )
    s.run(30.0)
    assert (s.body["east"], s.body["north"], s.body["up"]) == pytest.approx((30.0, 20.0, 20.0), abs=0.2)
    assert s.command(192, -1, 1, NAN, NAN, NAN, NAN, NAN) == [0]
    s.run(3.0)
    assert s.body["up"] == pytest.approx(20.0, abs=0.3)


@pytest.mark.row("px4-in-the-air")
def test_in_the_air_disarm_needs_force(station: Make) -> None:
    s = station()
    s.fly_up(10.0)
    assert s.command(400, 0) == [REJECTED]
    assert s.vehicle.armed
    assert s.command(400, 0, 21196) == [0]
    assert not s.vehicle.armed
    s.run(3.0)
    assert s.body["up"] == 0.0


def test_telemetry_is_the_truth_of_its_tick_and_a_setpoint_acts_from_its_tick_on(station: Make) -> None:
    s = station(limits=Limits(25.0, 4.0, lag_s=0.0))
    s.fly_offboard(10.0)
    s.command(511, 33, 100_000)
    s.setpoint(10.0, z=-10.0)
    assert speed_of(s) == 0.0
    s.tick()
    assert s.body["v_north"] == pytest.approx(0.4)
    for _ in range(30):
        s.setpoint(10.0, -5.0, z=-10.0)
        s.tick()
        told = s.last(33)
        lat, lon = to_geodetic(s.body["east"], s.body["north"], *ORIGIN)
        assert (told.lat, told.lon) == (round(lat * 1e7), round(lon * 1e7))
        assert told.relative_alt == round(s.body["up"] * 1000)
        assert (told.vx, told.vy) == (round(s.body["v_north"] * 100), round(s.body["v_east"] * 100))
        assert told.time_boot_ms == round(s.now * 1000)


def test_the_battery_drains_in_the_air_alone(station: Make) -> None:
    s = station(limits=Limits(endurance_s=100.0))
    s.fly_up(10.0)
    s.run(0.3)
    before = s.last(1).battery_remaining
    s.run(20.0)
    assert before - s.last(1).battery_remaining == pytest.approx(20, abs=1)
    assert station(limits=Limits(endurance_s=100.0)).vehicle.battery.percent == 100.0


def test_the_same_flight_twice_gives_the_same_bytes(station: Make) -> None:
    def fly() -> list[bytes]:
        s = station()
        s.fly_offboard(10.0)
        s.run(5.0, lambda: s.setpoint(3.0, -1.0, z=-12.0))
        return [frame.raw for _, frame in s.heard]

    assert fly() == fly()
