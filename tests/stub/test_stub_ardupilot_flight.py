"""ArduPilot in the air: each test plays one row of the table of what real autopilots do."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.core.geodesy import to_geodetic
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
ORIGIN = (47.3977, 8.5456, 488.0)
STABILIZE, GUIDED, LOITER, RTL, LAND, BRAKE = 0, 4, 5, 6, 9, 17
FAILED: int = mav.MAV_RESULT_FAILED
NAN = math.nan
VELOCITY = 1 | 2 | 4 | 64 | 128 | 256 | 1024 | 2048
PLACE = 8 | 16 | 32 | 64 | 128 | 256 | 1024 | 2048
PX4S_MASK = 1 | 2 | 32 | 64 | 128 | 256 | 2048


@pytest.fixture
def pilot(station: Make) -> Make:
    return lambda **others: station(autopilot="ardupilot", **others)


@pytest.fixture
def flying(pilot: Make) -> Any:
    """In GUIDED, 20 m above its pad."""
    s = pilot()
    s.fly_guided(20.0)
    return s


def order(s: Any, number: int) -> list[int]:
    results: list[int] = s.command(mav.MAV_CMD_DO_SET_MODE, 1, number)
    return results


def speed_of(s: Any) -> float:
    return math.hypot(s.body["v_east"], s.body["v_north"])


def fly(s: Any, seconds: float, v_north: float, **others: Any) -> None:
    s.run(seconds, lambda: s.setpoint(v_north, mask=VELOCITY, **others))


@pytest.mark.row("ardupilot-takeoff")
def test_takeoff_20_m_takes_about_ten_seconds(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    order(s, GUIDED)
    s.arm()
    s.command(22, NAN, NAN, NAN, NAN, NAN, NAN, 20.0)
    assert s.run_until(lambda: s.body["up"] > 19.5, 20.0) == pytest.approx(10.5, rel=0.1)
    s.run(5.0)
    assert s.body["up"] == pytest.approx(20.0, abs=0.2)
    assert s.mode == GUIDED


@pytest.mark.row("ardupilot-setpoints-during-takeoff")
def test_setpoints_during_takeoff_a_velocity_does_not_lift_off(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    order(s, GUIDED)
    s.arm()
    fly(s, 9.0, 2.0, vz=-2.0)
    assert (s.body["up"], s.body["north"]) == (0.0, 0.0)


@pytest.mark.row("ardupilot-setpoints-during-takeoff")
@pytest.mark.parametrize(("after", "lowest", "highest"), [(0.5, 0.0, 0.0), (5.0, 3.0, 9.0)])
def test_setpoints_during_takeoff_one_cancels_it_silently(
    pilot: Make, after: float, lowest: float, highest: float
) -> None:
    s = pilot()
    s.run(45.0)
    order(s, GUIDED)
    s.arm()
    s.command(22, NAN, NAN, NAN, NAN, NAN, NAN, 10.0)
    s.run(after)
    texts = len(s.texts())
    s.setpoint(mask=VELOCITY)
    s.run(9.0)
    assert lowest <= s.body["up"] <= highest
    assert abs(s.body["v_up"]) < 0.01
    assert len(s.texts()) == texts
    assert s.mode == GUIDED


@pytest.mark.row("ardupilot-setpoints-stop")
def test_setpoints_stop_velocity_goes_on_for_three_seconds_then_brakes(flying: Any) -> None:
    s = flying
    fly(s, 10.0, 5.0)
    s.setpoint(5.0, mask=VELOCITY)
    north = s.body["north"]
    assert s.run_until(lambda: speed_of(s) < 4.9, 5.0) == pytest.approx(3.1, abs=0.15)
    s.run(10.0)
    assert speed_of(s) < 0.01
    assert s.body["north"] - north == pytest.approx(21.6, rel=0.05)
    assert s.mode == GUIDED


@pytest.mark.row("ardupilot-stopping")
def test_stopping_from_8_takes_16_m(flying: Any) -> None:
    s = flying
    fly(s, 15.0, 8.0)
    north = s.body["north"]
    fly(s, 10.0, 0.0)
    assert s.body["north"] - north == pytest.approx(16.0, abs=1.0)


@pytest.mark.row("ardupilot-stopping")
def test_stopping_brake_does_the_same(flying: Any) -> None:
    s = flying
    fly(s, 15.0, 8.0)
    north = s.body["north"]
    assert order(s, BRAKE) == [0]
    s.run(10.0)
    assert s.body["north"] - north == pytest.approx(16.0, abs=1.0)
    assert s.body["up"] == pytest.approx(20.0, abs=0.2)
    fly(s, 2.0, 5.0)
    assert speed_of(s) < 0.01


@pytest.mark.row("ardupilot-stopping")
@pytest.mark.parametrize("number", [LOITER, STABILIZE])
def test_stopping_loiter_sinks_without_a_pilot(flying: Any, number: int) -> None:
    s = flying
    assert order(s, number) == [0]
    s.run(4.0)
    assert s.body["v_up"] == pytest.approx(-2.5, abs=0.01)
    s.run_until(lambda: not s.vehicle.armed, 30.0)
    assert s.body["up"] == 0.0


@pytest.mark.row("ardupilot-velocity-limits")
def test_velocity_is_limited_by_the_parameter_and_the_nose_turns_into_it(flying: Any) -> None:
    s = flying
    fly(s, 10.0, 0.0, v_east=15.0)
    assert speed_of(s) == pytest.approx(10.3, rel=0.05)
    assert s.vehicle.yaw == pytest.approx(math.pi / 2)
    s.send(mav.MAVLink_param_set_message(1, 1, b"WP_SPD", 6.0, 9))
    fly(s, 10.0, 15.0)
    assert speed_of(s) == pytest.approx(6.0, abs=0.1)
    s.setpoint(5.0, mask=VELOCITY & ~1024, yaw=-1.0)
    assert s.vehicle.yaw == -1.0


@pytest.mark.row("ardupilot-velocity-limits")
@pytest.mark.parametrize("bit", [8, 16, 32])
def test_velocity_one_ignored_axis_ignores_them_all(flying: Any, bit: int) -> None:
    s = flying
    s.run(3.0, lambda: s.setpoint(5.0, 5.0, mask=VELOCITY | bit))
    assert speed_of(s) == 0.0


@pytest.mark.row("ardupilot-velocity-limits")
@pytest.mark.parametrize("bit", [1, 2, 4])
def test_velocity_one_ignored_axis_of_a_place_ignores_the_place(flying: Any, bit: int) -> None:
    s = flying
    s.run(3.0, lambda: s.setpoint(z=-30.0, mask=PLACE | bit, xy=(30.0, 30.0)))
    assert (speed_of(s), s.body["v_up"]) == (0.0, 0.0)


@pytest.mark.row("ardupilot-frames")
def test_frames_the_mask_that_px4_likes_holds(flying: Any) -> None:
    s = flying
    fly(s, 5.0, 5.0)
    s.run(10.0, lambda: s.setpoint(5.0, z=-30.0, mask=PX4S_MASK))
    assert speed_of(s) < 0.01
    assert s.body["up"] == pytest.approx(20.0, abs=0.2)


@pytest.mark.row("ardupilot-frames")
def test_frames_vertical_velocity_is_flown(flying: Any) -> None:
    s = flying
    fly(s, 4.0, 3.0, vz=-1.0)
    assert s.body["v_up"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.row("ardupilot-frames")
@pytest.mark.parametrize("frame", [8, 9])
def test_frames_body_turns_with_the_nose(flying: Any, frame: int) -> None:
    s = flying
    fly(s, 5.0, 0.0, v_east=3.0)
    s.run(5.0, lambda: s.setpoint(4.0, mask=VELOCITY, frame=frame))
    assert (s.body["v_east"], s.body["v_north"]) == pytest.approx((4.0, 0.0), abs=0.05)


@pytest.mark.row("ardupilot-frames")
@pytest.mark.parametrize("frame", [2, 6, 12])
def test_frames_anything_else_holds(flying: Any, frame: int) -> None:
    s = flying
    fly(s, 5.0, 5.0)
    s.run(10.0, lambda: s.setpoint(5.0, mask=VELOCITY, frame=frame))
    assert speed_of(s) < 0.01


@pytest.mark.row("ardupilot-position-setpoints")
def test_position_30_m_in_about_six_seconds(flying: Any) -> None:
    s = flying
    s.setpoint(z=-20.0, mask=PLACE, xy=(30.0, 0.0))
    assert s.run_until(lambda: abs(s.body["north"] - 30.0) < 1.0, 10.0) == pytest.approx(6.3, rel=0.1)
    s.run(10.0)
    assert s.body["north"] == pytest.approx(30.0, abs=0.08)


@pytest.mark.row("ardupilot-frames")
@pytest.mark.parametrize(("frame", "north"), [(1, 30.0), (7, 40.0)])
def test_frames_a_place_from_the_origin_or_from_here(flying: Any, frame: int, north: float) -> None:
    s = flying
    s.setpoint(z=-20.0, mask=PLACE, xy=(10.0, 0.0))
    s.run(10.0)
    s.setpoint(z=-20.0 if frame == 1 else 0.0, mask=PLACE, xy=(30.0, 0.0), frame=frame)
    s.run(15.0)
    assert (s.body["north"], s.body["up"]) == pytest.approx((north, 20.0), abs=0.2)


@pytest.mark.parametrize(("frame", "altitude"), [(6, 25.0), (5, 513.0)])
def test_a_global_place_above_home_or_the_sea(flying: Any, frame: int, altitude: float) -> None:
    s = flying
    lat, lon = to_geodetic(40.0, -30.0, *ORIGIN)
    message = mav.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, PLACE, round(lat * 1e7), round(lon * 1e7), altitude, 0, 0, 0, 0, 0, 0, 0, 0
    )
    s.send(message)
    s.run(25.0)
    assert (s.body["east"], s.body["north"], s.body["up"]) == pytest.approx((40.0, -30.0, 25.0), abs=0.2)
    message.coordinate_frame = 1
    s.send(message)
    fly(s, 3.0, 3.0)
    s.send(message)
    s.run(8.0)
    assert speed_of(s) < 0.01


@pytest.mark.parametrize(("frame", "altitude"), [(6, 25.0), (5, 513.0)])
def test_reposition_heeds_its_frame(flying: Any, frame: int, altitude: float) -> None:
    s = flying
    lat, lon = to_geodetic(20.0, 10.0, *ORIGIN)
    s.send(
        mav.MAVLink_command_int_message(
            1, 1, frame, 192, 0, 0, -1, 1, NAN, NAN, round(lat * 1e7), round(lon * 1e7), altitude
        )
    )
    s.run(15.0)
    assert (s.body["east"], s.body["north"], s.body["up"]) == pytest.approx((20.0, 10.0, 25.0), abs=0.3)


def test_numbers_that_are_none_stop_it(flying: Any) -> None:
    s = flying
    fly(s, 5.0, 5.0)
    s.run(8.0, lambda: s.setpoint(NAN, math.inf, z=NAN, mask=0, xy=(NAN, 1.0), vz=NAN, yaw=NAN))
    assert speed_of(s) < 0.01
    assert s.mode == GUIDED


@pytest.mark.row("ardupilot-rtl")
def test_rtl_climbs_to_15_m_and_takes_its_time(pilot: Make) -> None:
    s = pilot()
    s.fly_guided(10.0)
    fly(s, 15.0, 5.0)
    assert order(s, RTL) == [0]
    highest = 0.0

    def watch() -> None:
        nonlocal highest
        highest = max(highest, s.body["up"])

    assert 45.0 <= s.run_until(lambda: not s.vehicle.armed, 90.0, watch) <= 50.0
    assert highest == pytest.approx(15.0, abs=1.0)
    assert (s.body["east"], s.body["north"]) == pytest.approx((0.0, 0.0), abs=1.0)
    assert s.mode == RTL


@pytest.mark.row("ardupilot-rtl")
def test_rtl_land_is_slow_below_10_m(flying: Any) -> None:
    s = flying
    assert s.command(mav.MAV_CMD_NAV_LAND) == [0]
    s.run_until(lambda: s.body["up"] < 12.0, 20.0)
    assert s.body["v_up"] == pytest.approx(-1.5, abs=0.01)
    s.run_until(lambda: s.body["up"] < 8.0, 20.0)
    assert s.body["v_up"] == pytest.approx(-0.5, abs=0.01)
    s.run_until(lambda: not s.vehicle.armed, 30.0)
    assert s.mode == LAND


def test_disarm_in_the_air_needs_force(flying: Any) -> None:
    s = flying
    assert s.command(400, 0) == [FAILED]
    assert s.vehicle.armed
    assert s.command(400, 0, 21196) == [0]
    assert not s.vehicle.armed


def keep_beating(s: Any, seconds: float) -> None:
    s.run(seconds, s.beat, every=1.0)


@pytest.mark.row("ardupilot-gcs-loss")
def test_gcs_loss_nothing_happens_by_default(flying: Any) -> None:
    s = flying
    keep_beating(s, 3.0)
    s.run(30.0)
    assert s.mode == GUIDED


@pytest.mark.row("ardupilot-gcs-loss")
def test_gcs_loss_with_the_parameter_it_returns_and_stays_there(flying: Any) -> None:
    s = flying
    s.set_parameter("FS_GCS_ENABLE", 1)
    keep_beating(s, 5.0)
    assert s.run_until(lambda: s.mode == RTL, 10.0) == pytest.approx(4.2, abs=0.3)
    s.run(1.0)
    assert s.last(0).system_status == mav.MAV_STATE_CRITICAL
    keep_beating(s, 5.0)
    assert s.mode == RTL


@pytest.mark.row("ardupilot-gcs-loss")
def test_gcs_loss_only_system_255_counts(flying: Any) -> None:
    s = flying
    s.set_parameter("FS_GCS_ENABLE", 1)
    keep_beating(s, 2.0)
    s.encoder = Encoder(254, 190)
    keep_beating(s, 7.0)
    assert s.mode == RTL


@pytest.mark.row("ardupilot-speedup")
def test_two_speeds_of_the_same_flight_are_the_same(pilot: Make) -> None:
    """Time-outs run in the vehicle's time, however coarsely it is given."""
    ends = []
    for tick in (0.1, 0.02):
        s = pilot(tick_s=tick)
        s.fly_guided(20.0)
        s.run(5.0, lambda s=s: s.setpoint(5.0, mask=VELOCITY))
        s.run(15.0)
        ends.append(s.body["north"])
    assert ends[0] == pytest.approx(ends[1], abs=0.6)
