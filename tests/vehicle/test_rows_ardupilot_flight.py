"""What ArduCopter was seen to do in flight, played by the stub, and what the session makes of it."""

import math

import pytest

from swarmctl.core.geodesy import to_local
from swarmctl.core.guard import BRAKING_SHARE
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight

from .stub_flight import ORIGIN, SCATTERED, SET_MODE, SETPOINT, StubFlight

STABILIZE, GUIDED, LOITER, RTL, LAND, BRAKE, SMART_RTL = 0, 4, 5, 6, 9, 17, 21
FAILED = mav.MAV_RESULT_FAILED
POSITION = 33
PLACE = 1 | 2 | 4
VELOCITY = 1 | 2 | 4 | 64 | 128 | 256 | 2048


def engaged(**others: float) -> StubFlight:
    """One vehicle that flies the session's setpoints at 20 m."""
    flight = StubFlight("ardupilot", **others)
    flight.engage()
    return flight


@pytest.mark.row("ardupilot-modes")
def test_the_modes_of_a_flight_have_their_numbers() -> None:
    flight = engaged()
    assert flight.session.telemetry.mode == GUIDED
    flight.session.hold()
    flight.until_phase(Phase.HOLDING)
    assert flight.session.telemetry.mode == BRAKE
    flight.land()
    assert flight.session.telemetry.mode == LAND
    assert {f.param2 for f in flight.commands(SET_MODE)} == {GUIDED, BRAKE, LAND}
    assert FAILED not in flight.acknowledged(SET_MODE)


@pytest.mark.row("ardupilot-modes", "ardupilot-rtl", "ardupilot-stopping")
@pytest.mark.parametrize(
    ("mode", "name"),
    [(STABILIZE, "STABILIZE"), (LOITER, "LOITER"), (RTL, "RTL"), (SMART_RTL, "SMART_RTL"), (BRAKE, "BRAKE")],
)
def test_a_mode_that_a_pilot_chose_is_named_and_not_fought(mode: int, name: str) -> None:
    """LOITER sinks without a pilot: that is his affair, and told."""
    flight = engaged()
    flight.command(3.0, 0.0)
    flight.run(3.0)
    flight.pilot_sets_mode(mode)
    assert flight.until_phase(Phase.RELEASED, 3.0) <= 1.1
    assert flight.texts(EventKind.RELEASED) == [f"vehicle 1: its mode became {name} while engaged"]
    flight.check_not_fought(3.0)
    assert flight.mode == mode


@pytest.mark.row("ardupilot-takeoff", "ardupilot-local-frame")
def test_every_vehicle_takes_off_to_a_height_above_its_own_home() -> None:
    flight = StubFlight(*["ardupilot"] * 4, seed=SCATTERED)
    flight.until_phase(Phase.READY)
    for session in flight.sessions:
        session.take_off(20.0)
    flight.until(lambda: bool((flight.fleet.truth["up"] > 19.5).all()), 15.0)
    flight.until_phase(Phase.HOLDING)
    assert flight.fleet.truth["up"] == pytest.approx([20.0] * 4, abs=0.5)
    assert {f.param7 for f in flight.commands(mav.MAV_CMD_NAV_TAKEOFF)} == {20.0}
    told = [session.telemetry.altitude_amsl_m for session in flight.sessions]
    assert max(told) - min(told) > 1.0


@pytest.mark.row("ardupilot-setpoints-during-takeoff")
def test_no_setpoint_reaches_it_before_the_altitude_is_reached() -> None:
    flight = StubFlight("ardupilot")
    flight.until_phase(Phase.READY)
    flight.session.take_off(10.0)
    flight.command(3.0, 0.0, 10.0)
    flight.until_phase(Phase.HOLDING)
    assert flight.body["up"] == pytest.approx(10.0, abs=0.5)
    assert flight.sent(SETPOINT) == []


@pytest.mark.row("ardupilot-setpoints-during-takeoff")
def test_a_take_off_that_somebody_else_cancels_is_given_up_and_told() -> None:
    flight = StubFlight("ardupilot")
    flight.until_phase(Phase.READY)
    flight.session.take_off(10.0)
    flight.until(lambda: flight.body["up"] > 6.0, 15.0)
    still = [0.0] * 3
    flight.pilot_sends(
        mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, VELOCITY, *still, *still, *still, 0, 0)
    )
    flight.run(5.0)
    assert flight.body["up"] == pytest.approx(7.1, abs=1.0)
    flight.until_phase(Phase.FAILED)
    assert flight.session.reason == "vehicle 1: take-off altitude: not reached in 50 s"
    flight.land()


@pytest.mark.row("ardupilot-setpoints-stop")
def test_a_link_that_is_silent_for_seconds_is_flown_through() -> None:
    """It goes on for 3.1 s and brakes; when the setpoints are back it flies on."""
    flight = engaged()
    flight.command(5.0, 0.0)
    flight.run(10.0)
    east = float(flight.body["east"])
    flight.impair(up_cut=True)
    flight.run(2.9)
    assert flight.speed_mps == pytest.approx(5.0, abs=0.05)
    flight.run(7.0)
    assert flight.speed_mps < 0.05
    assert flight.body["east"] - east == pytest.approx(21.6, rel=0.05)
    assert flight.session.phase is Phase.ENGAGED
    flight.impair(up_cut=False)
    flight.run(5.0)
    assert flight.speed_mps == pytest.approx(5.0, abs=0.05)
    flight.land()


@pytest.mark.row("ardupilot-stopping")
def test_hold_brakes_as_its_adapter_says_and_keeps_the_height() -> None:
    flight = engaged()
    flight.command(8.0, 0.0)
    flight.run(10.0)
    east = float(flight.body["east"])
    flight.session.hold()
    flight.until_phase(Phase.HOLDING)
    flight.run(10.0)
    adapter = flight.session.adapter
    assert adapter is not None
    assert flight.mode == BRAKE and flight.speed_mps < 0.05
    limits = adapter.limits
    latest_m = 8.0 * (limits.latency_s + 0.2) + 8.0**2 / (2.0 * BRAKING_SHARE * limits.braking_mps2)
    assert 15.0 < flight.body["east"] - east < latest_m
    assert flight.body["up"] == pytest.approx(20.0, abs=0.2)


@pytest.mark.row("ardupilot-velocity-limits")
def test_setpoints_leave_no_axis_out_and_turn_the_nose_north() -> None:
    flight = engaged()
    flight.command(15.0, 0.0)
    flight.run(10.0)
    assert flight.speed_mps == pytest.approx(10.3, rel=0.05)
    assert flight.vehicle.yaw == 0.0
    assert {f.type_mask for f in flight.sent(SETPOINT)} == {VELOCITY}


@pytest.mark.row("ardupilot-frames")
def test_the_height_is_held_by_climb_rates_in_the_local_frame() -> None:
    flight = engaged()
    flight.command(3.0, -2.0, 30.0)
    flight.run(15.0)
    assert flight.body["up"] == pytest.approx(30.0, abs=0.2)
    flight.command(3.0, -2.0, 22.0)
    flight.run(15.0)
    assert flight.body["up"] == pytest.approx(22.0, abs=0.2)
    assert {f.coordinate_frame for f in flight.sent(SETPOINT)} == {mav.MAV_FRAME_LOCAL_NED}


@pytest.mark.row("ardupilot-position-setpoints")
def test_a_flight_goes_to_its_place_by_velocities_alone() -> None:
    """A place in the vehicle's own frame is never asked for; 30 m are gone as fast as the firmware does it."""
    flight = engaged()
    goal = float(flight.body["east"]) + 30.0

    def steer() -> None:
        gap = goal - float(flight.body["east"])
        flight.session.setpoint(math.copysign(min(8.0, math.sqrt(3.0 * abs(gap)), abs(gap)), gap), 0.0, 20.0)

    flight.each_tick = steer
    assert flight.until(lambda: abs(goal - flight.body["east"]) < 1.0, 15.0) < 1.5 * 6.3
    flight.run(10.0)
    assert flight.body["east"] == pytest.approx(goal, abs=0.08)
    assert all(f.type_mask & PLACE == PLACE for f in flight.sent(SETPOINT))


@pytest.mark.row("ardupilot-local-frame")
def test_positions_are_true_although_every_local_frame_is_another() -> None:
    flight = StubFlight(*["ardupilot"] * 3, seed=SCATTERED)
    flight.engage()
    flight.command(5.0, 8.0)
    flight.run(30.0)
    for session, body in zip(flight.sessions, flight.fleet.truth, strict=True):
        telemetry = session.telemetry
        east, north = to_local(telemetry.lat_e7 * 1e-7, telemetry.lon_e7 * 1e-7, *ORIGIN)
        assert (east, north) == pytest.approx((body["east"], body["north"]), abs=0.01)
        assert telemetry.height_m == pytest.approx(body["up"], abs=0.01)


@pytest.mark.row("ardupilot-rtl")
def test_a_return_of_the_firmwares_own_is_watched_to_its_end() -> None:
    flight = StubFlight("ardupilot")
    flight.engage(10.0)
    flight.command(5.0, 0.0, 10.0)
    flight.until(lambda: flight.body["east"] > 50.0, 30.0)
    flight.pilot_sets_mode(RTL)
    flight.until_phase(Phase.RELEASED, 3.0)
    assert 44.0 <= flight.until(lambda: not flight.session.telemetry.armed) <= 50.0
    assert flight.session.phase is Phase.RELEASED
    assert math.hypot(flight.body["east"], flight.body["north"]) < 1.0


@pytest.mark.row("ardupilot-gcs-loss")
def test_by_default_nothing_happens_and_the_flight_goes_on_when_it_is_heard_again() -> None:
    flight = StubFlight("ardupilot")
    flight.hold_at()
    flight.impair(up_cut=True)
    flight.until_phase(Phase.LOST, 20.0)
    flight.run(60.0)
    assert flight.mode == GUIDED and flight.body["up"] == pytest.approx(20.0, abs=0.5)
    flight.impair(up_cut=False)
    flight.until_phase(Phase.HOLDING, 3.0)
    flight.session.engage()
    flight.until_phase(Phase.ENGAGED, 5.0)
    flight.land()


@pytest.mark.row("ardupilot-gcs-loss")
def test_with_the_failsafe_on_the_sessions_heartbeats_count_and_their_loss_is_told() -> None:
    flight = StubFlight("ardupilot")
    flight.set_parameter("FS_GCS_ENABLE", 1)
    flight.engage()
    flight.command(2.0, 0.0)
    flight.run(20.0)
    assert flight.session.phase is Phase.ENGAGED
    flight.impair(up_cut=True)
    assert flight.until_phase(Phase.RELEASED) == pytest.approx(5.0, abs=1.1)
    assert flight.session.reason == "vehicle 1: its mode became RTL while engaged"
    flight.impair(up_cut=False)
    flight.check_not_fought(5.0)
    assert flight.mode == RTL


NORTH = 47.39820


KEEP_IN = [(47.3970, 8.5450), (47.3970, 8.5462), (NORTH, 8.5462), (NORTH, 8.5450)]


KEEP_OUT = [(47.3972, 8.5460), (47.3972, 8.5461), (47.3973, 8.5461)]


FENCE = Preflight(read_parameters=True, fence=Fence([KEEP_IN], [KEEP_OUT]))


@pytest.mark.row("ardupilot-fence")
def test_the_fence_is_verified_and_a_silent_throttle_short_of_it_is_no_failure() -> None:
    flight = StubFlight("ardupilot", preflight=FENCE)
    flight.set_parameter("FENCE_ENABLE", 1)
    flight.engage()
    assert flight.session.fence_verified
    assert flight.told(mav.MAVLINK_MSG_ID_MISSION_REQUEST)
    assert not flight.told(mav.MAVLINK_MSG_ID_MISSION_REQUEST_INT)
    parameters = flight.session.parameters
    assert (parameters["avoidance"], parameters["fence_enabled"]) == (3.0, 1.0)
    flight.command(0.0, 8.0)
    flight.run(40.0)
    assert flight.speed_mps < 0.1
    assert flight.session.telemetry.lat_e7 < NORTH * 1e7
    assert flight.session.phase is Phase.ENGAGED
    flight.command(0.0, -5.0)
    flight.run(3.0)
    assert flight.body["v_north"] == pytest.approx(-5.0, abs=0.1)
    flight.land()


@pytest.mark.row("ardupilot-fence")
def test_a_breach_without_avoidance_is_told_and_not_fought() -> None:
    flight = StubFlight("ardupilot", preflight=FENCE)
    flight.set_parameter("FENCE_ENABLE", 1)
    flight.set_parameter("AVOID_ENABLE", 0)
    flight.engage()
    flight.command(0.0, 8.0)
    flight.until_phase(Phase.RELEASED, 60.0)
    assert flight.session.reason == "vehicle 1: its mode became RTL while engaged"
    assert "Polygon fence breached" in flight.texts(EventKind.TEXT)
    flight.check_not_fought(5.0)


@pytest.mark.row("ardupilot-no-answer")
def test_setpoints_are_never_acknowledged_and_nobody_waits_for_that() -> None:
    flight = engaged()
    since = flight.now + 0.05
    flight.command(3.0, 0.0)
    flight.run(10.0)
    assert flight.told(mav.MAVLINK_MSG_ID_COMMAND_ACK, since) == []
    assert flight.session.statistics().setpoints_sent == 100


@pytest.mark.row("ardupilot-speedup")
@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_a_vehicle_whose_time_runs_faster_is_flown_in_its_own_time(speed: float) -> None:
    flight = StubFlight("ardupilot", speed=speed, tick_s=0.1 / speed)
    assert flight.until_phase(Phase.READY) * speed == pytest.approx(42.0, abs=2.0)
    flight.engage()
    flight.command(5.0, 0.0)
    flight.run(10.0 / speed)
    since = flight.now + 0.05 / speed
    flight.run(2.0 / speed)
    assert len(flight.told(POSITION, since)) == 20
    flight.impair(up_cut=True)
    assert flight.until(lambda: flight.speed_mps < 4.9, 5.0) * speed == pytest.approx(3.1, abs=0.2)
    flight.impair(up_cut=False, down_cut=True)
    assert flight.until_phase(Phase.LOST, 5.0) * speed == pytest.approx(3.0, abs=1.0)
    flight.impair(down_cut=False)
    flight.until_phase(Phase.ENGAGED, 2.0)
    flight.land()
