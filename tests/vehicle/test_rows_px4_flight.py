"""What PX4 was seen to do in flight, played by the stub, and what the session makes of it."""

import math
from collections import Counter

import numpy as np
import pytest

from swarmctl.core.geodesy import to_local
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight

from .stub_flight import ARM_DISARM, ORIGIN, SCATTERED, SET_MODE, SETPOINT, StubFlight

OFFBOARD, TAKEOFF, LOITER, RTL, LAND = 0x60000, 0x2040000, 0x3040000, 0x5040000, 0x6040000
ACCEPTED, NOT_YET = mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_TEMPORARILY_REJECTED
Z_AND_VELOCITY = 1 | 2 | 32 | 64 | 128 | 256 | 2048
FORCE = 21196


def is_setpoint(frame: bytes) -> bool:
    return frame[7] == SETPOINT


@pytest.mark.row("px4-origin", "px4-takeoff")
def test_every_vehicle_flies_at_the_true_height_by_its_own_origin_and_sea_level() -> None:
    flight = StubFlight(*["px4"] * 4, seed=SCATTERED)
    flight.engage(10.0)
    assert flight.fleet.truth["up"] == pytest.approx([10.0] * 4, abs=0.5)
    flight.command(1.0, 0.0, 25.0)
    flight.run(20.0)
    assert flight.fleet.truth["up"] == pytest.approx([25.0] * 4, abs=0.1)
    told = [session.telemetry.altitude_amsl_m for session in flight.sessions]
    assert 1.0 < max(told) - min(told) <= 1.4


@pytest.mark.row("px4-projection")
def test_positions_a_kilometre_away_are_true_to_a_centimetre() -> None:
    """By latitude and longitude: in the vehicle's own local frame they would be 2 m off."""
    flight = StubFlight(seed=SCATTERED)
    flight.engage()
    flight.command(12.0, 12.0)
    flight.until(lambda: flight.body["east"] > 700.0, 200.0)
    telemetry = flight.session.telemetry
    east, north = to_local(telemetry.lat_e7 * 1e-7, telemetry.lon_e7 * 1e-7, *ORIGIN)
    assert (east, north) == pytest.approx((flight.body["east"], flight.body["north"]), abs=0.01)
    local_north, local_east, _ = flight.vehicle.personality.local_ned()
    assert math.hypot(local_east - east, local_north - north) > 1.5


@pytest.mark.row("px4-mode-numbers")
def test_the_modes_of_a_flight_have_their_numbers() -> None:
    flight = StubFlight()
    seen: dict[Phase, int] = {}
    flight.until_phase(Phase.READY)
    flight.session.take_off(10.0)
    flight.run(5.0)
    seen[flight.session.phase] = flight.session.telemetry.mode
    flight.until_phase(Phase.HOLDING)
    seen[flight.session.phase] = flight.session.telemetry.mode
    flight.session.engage()
    flight.until_phase(Phase.ENGAGED)
    seen[flight.session.phase] = flight.session.telemetry.mode
    flight.session.land()
    flight.run(3.0)
    seen[flight.session.phase] = flight.session.telemetry.mode
    assert seen == {
        Phase.TAKING_OFF: TAKEOFF,
        Phase.HOLDING: LOITER,
        Phase.ENGAGED: OFFBOARD,
        Phase.LANDING: LAND,
    }


@pytest.mark.row("px4-mode-numbers", "px4-rtl")
@pytest.mark.parametrize(("mode", "name"), [(RTL, "AUTO.RTL"), (LAND, "AUTO.LAND"), (LOITER, "AUTO.LOITER")])
def test_a_mode_that_a_pilot_chose_is_named_and_not_fought(mode: int, name: str) -> None:
    flight = StubFlight()
    flight.engage()
    flight.command(3.0, 0.0)
    flight.run(3.0)
    flight.pilot_sets_mode(mode)
    assert flight.until_phase(Phase.RELEASED, 3.0) <= 1.1
    assert flight.texts(EventKind.RELEASED) == [f"vehicle 1: its mode became {name} while engaged"]
    flight.check_not_fought(10.0)
    assert flight.mode == mode


@pytest.mark.row("px4-mode-change")
def test_the_first_ack_of_a_mode_change_is_not_believed() -> None:
    flight = StubFlight()
    flight.hold_at()
    flight.drop = is_setpoint
    flight.session.engage()
    flight.run(5.0)
    assert flight.acknowledged(SET_MODE)[-2:] == [ACCEPTED, NOT_YET]
    assert flight.session.phase is Phase.ENGAGING
    flight.drop = lambda frame: False
    flight.until_phase(Phase.ENGAGED, 5.0)
    assert flight.mode == OFFBOARD


@pytest.mark.row("px4-takeoff")
def test_take_off_is_to_an_altitude_above_sea_level_and_then_armed() -> None:
    flight = StubFlight()
    flight.until_phase(Phase.READY)
    flight.session.take_off(10.0)
    assert flight.until_phase(Phase.HOLDING) == pytest.approx(12.0, abs=1.5)
    (order,) = flight.commands(mav.MAV_CMD_NAV_TAKEOFF)
    assert order.param7 == pytest.approx(498.0, abs=0.01)
    numbers = [f.command for f in flight.sent(mav.MAVLINK_MSG_ID_COMMAND_LONG)]
    assert numbers.index(mav.MAV_CMD_NAV_TAKEOFF) < numbers.index(ARM_DISARM)
    assert flight.body["up"] == pytest.approx(10.0, abs=0.5)


@pytest.mark.row("px4-offboard")
def test_offboard_is_asked_for_when_there_is_a_stream() -> None:
    flight = StubFlight()
    flight.engage()
    assert NOT_YET not in flight.acknowledged(SET_MODE)
    assert len(flight.commands(SET_MODE)) == 1


def fly_through_a_gap(offset_s: float) -> Phase:
    """Setpoints stop for 1.2 s, at some moment between two heartbeats; the phase that the session then has."""
    flight = StubFlight()
    flight.engage()
    flight.command(3.0, 0.0)
    flight.run(3.0 + offset_s)
    flight.drop = is_setpoint
    flight.until(lambda: flight.mode == RTL, 2.0)
    flight.run(0.1)
    flight.drop = lambda frame: False
    flight.run(3.0)
    phase = flight.session.phase
    if phase is Phase.ENGAGED:
        assert flight.mode == OFFBOARD
        flight.land()
    else:
        assert flight.texts(EventKind.RELEASED) == ["vehicle 1: its mode became AUTO.RTL while engaged"]
        flight.check_not_fought(2.0)
        flight.until(lambda: not flight.vehicle.armed)
        assert math.hypot(flight.body["east"], flight.body["north"]) < 1.5
    return phase


@pytest.mark.row("px4-setpoints-stop")
def test_a_gap_in_the_stream_is_flown_through_or_told() -> None:
    """The firmware returns for a moment, then resumes silently; a heartbeat may tell of it, or none."""
    assert {fly_through_a_gap(0.1 * k) for k in range(10)} == {Phase.ENGAGED, Phase.RELEASED}


@pytest.mark.row("px4-setpoints-stop")
def test_a_setpoint_that_comes_late_resumes_for_a_second_and_the_return_goes_on() -> None:
    flight = StubFlight()
    flight.engage()
    flight.command(3.0, 0.0)
    flight.run(3.0)
    late = flight.crossed[-1][1]
    assert late.message_id == SETPOINT
    flight.drop = is_setpoint
    flight.until_phase(Phase.RELEASED, 5.0)
    flight.vehicle.receive(late.raw, flight.now)
    flight.tick()
    assert flight.mode == OFFBOARD
    flight.check_not_fought(2.0)
    assert flight.mode == RTL and flight.session.phase is Phase.RELEASED


@pytest.mark.row("px4-velocity")
def test_setpoints_hold_the_height_and_fall_short_of_the_speed() -> None:
    flight = StubFlight()
    flight.engage()
    flight.command(5.0, 0.0)
    heights, speeds = [], []
    for _ in range(101):
        flight.tick()
        heights.append(float(flight.body["up"]))
        speeds.append(flight.speed_mps)
    assert np.abs(np.array(heights[20:]) - 20.0).max() < 0.3
    assert (speeds[10], speeds[100]) == pytest.approx((3.0, 4.4), rel=0.06)
    assert {f.type_mask for f in flight.sent(SETPOINT)} == {Z_AND_VELOCITY}


@pytest.mark.row("px4-frames")
def test_no_setpoint_of_a_flight_is_complained_of() -> None:
    flight = StubFlight()
    flight.engage()
    flight.command(3.0, -2.0, 25.0)
    flight.run(10.0)
    flight.land()
    assert {f.coordinate_frame for f in flight.sent(SETPOINT)} == {mav.MAV_FRAME_LOCAL_NED}
    assert [text for text in flight.texts(EventKind.TEXT) if "frame" in text] == []


@pytest.mark.row("px4-gcs-loss")
def test_a_ground_station_that_is_not_heard_is_told_of_and_the_vehicle_retaken_by_order_alone() -> None:
    flight = StubFlight()
    flight.set_parameter("NAV_DLL_ACT", 2)
    flight.hold_at()
    flight.impair(up_cut=True)
    assert flight.until(lambda: flight.mode == RTL) == pytest.approx(11.8 + 5.0, abs=1.1)
    assert flight.texts(EventKind.LOST) == ["vehicle 1: no answer for 15 s while holding"]
    flight.impair(up_cut=False)
    flight.until_phase(Phase.RELEASED, 3.0)
    assert flight.session.reason == "vehicle 1: its mode became AUTO.RTL while holding"
    flight.check_not_fought(3.0)
    assert flight.mode == RTL
    flight.session.retake()
    flight.until_phase(Phase.ENGAGED, 5.0)
    flight.land()


@pytest.mark.row("px4-rtl")
def test_a_return_of_the_firmwares_own_is_watched_to_its_end() -> None:
    flight = StubFlight()
    flight.engage()
    flight.command(5.0, 0.0)
    flight.until(lambda: flight.body["east"] > 40.0, 30.0)
    flight.pilot_sets_mode(RTL)
    flight.until_phase(Phase.RELEASED, 3.0)
    highest = 0.0

    def watch() -> None:
        nonlocal highest
        highest = max(highest, float(flight.body["up"]))

    flight.each_tick = watch
    assert flight.until(lambda: not flight.session.telemetry.armed) == pytest.approx(64.0, rel=0.1)
    assert highest == pytest.approx(30.0, abs=0.8)
    assert flight.session.phase is Phase.RELEASED


@pytest.mark.row("px4-rtl")
def test_the_session_never_asks_for_the_firmwares_return() -> None:
    """All return at one height, and their paths may cross."""
    flight = StubFlight()
    flight.engage()
    flight.session.hold()
    flight.until_phase(Phase.HOLDING)
    flight.land()
    asked = Counter(int(f.param3) << 24 | int(f.param2) << 16 for f in flight.commands(SET_MODE))
    assert asked == Counter({OFFBOARD: 1, LOITER: 1, LAND: 1})
    assert flight.commands(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH) == []


KEEP_IN = [(47.3970, 8.5450), (47.3970, 8.5462), (47.3982, 8.5462), (47.3982, 8.5450)]


KEEP_OUT = [(47.39785, 8.5457), (47.39785, 8.5459), (47.39795, 8.5458)]


FENCE = Preflight(read_parameters=True, fence=Fence([KEEP_IN], [KEEP_OUT]))


def fly_out(action: int) -> StubFlight:
    """Fenced in, with a GF_ACTION, and flown out to the west."""
    flight = StubFlight(preflight=FENCE)
    flight.set_parameter("GF_ACTION", action)
    flight.engage()
    assert flight.session.fence_verified
    assert flight.session.parameters["fence_action"] == action
    flight.command(-3.0, 0.0)
    fence = flight.vehicle.fence
    flight.until(lambda: fence.broken_at(*flight.vehicle.pilot.place[:2]), 60.0)
    return flight


@pytest.mark.row("px4-fence")
def test_a_fence_that_only_warns_is_told_and_flown_through() -> None:
    flight = fly_out(1)
    flight.run(3.0)
    assert flight.session.phase is Phase.ENGAGED
    assert "Geofence: approaching or outside geofence" in flight.texts(EventKind.TEXT)


@pytest.mark.row("px4-fence")
def test_after_a_breach_it_is_left_in_its_failsafe_and_retaken_only_by_order() -> None:
    flight = fly_out(2)
    border = float(flight.body["east"])
    flight.until_phase(Phase.RELEASED, 3.0)
    assert flight.session.reason == "vehicle 1: its mode became AUTO.LOITER while engaged"
    flight.check_not_fought(20.0)
    assert border - flight.body["east"] == pytest.approx(2.0, abs=1.0)
    flight.session.retake()
    flight.until_phase(Phase.ENGAGED, 5.0)
    flight.command(3.0, 0.0)
    flight.run(10.0)
    assert flight.body["east"] > border + 5.0
    flight.land()


@pytest.mark.row("px4-fence")
def test_a_fence_that_sends_it_home_is_told_once() -> None:
    flight = fly_out(3)
    flight.until_phase(Phase.RELEASED, 3.0)
    flight.check_not_fought(10.0)
    assert flight.mode == RTL
    assert len(flight.texts(EventKind.RELEASED)) == 1


@pytest.mark.row("px4-in-the-air")
def test_only_a_forced_disarm_ends_a_flight_and_is_told() -> None:
    flight = StubFlight()
    flight.engage()
    flight.command(1.0, 0.0)
    flight.pilot_commands(ARM_DISARM, 0)
    flight.run(3.0)
    assert flight.session.phase is Phase.ENGAGED
    flight.pilot_commands(ARM_DISARM, 0, FORCE)
    flight.until_phase(Phase.FAILED, 3.0)
    assert flight.session.reason == "vehicle 1: it disarmed while engaged"
