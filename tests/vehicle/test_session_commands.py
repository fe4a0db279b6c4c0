"""Commands: acknowledged, retried, confirmed by telemetry, given up with a reason."""

import math
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES, UNWANTED_MESSAGES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase

ARM = mav.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = mav.MAV_CMD_NAV_TAKEOFF
SET_MODE = mav.MAV_CMD_DO_SET_MODE
INTERVAL = mav.MAV_CMD_SET_MESSAGE_INTERVAL
REQUEST = mav.MAV_CMD_REQUEST_MESSAGE
ACCEPTED = mav.MAV_RESULT_ACCEPTED
NOT_YET = mav.MAV_RESULT_TEMPORARILY_REJECTED
DENIED = mav.MAV_RESULT_DENIED
FAILED = mav.MAV_RESULT_FAILED
UNSUPPORTED = mav.MAV_RESULT_UNSUPPORTED


def test_set_up_asks_for_what_is_read_and_turns_off_the_rest(rig: Any) -> None:
    rig.reach(Phase.READY)
    intervals = {int(m.param1): m.param2 for m in rig.vehicle.asked_for(INTERVAL)}
    assert intervals[mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT] == 100_000
    assert intervals[mav.MAVLINK_MSG_ID_SYS_STATUS] == 500_000
    assert intervals[mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE] == 500_000
    assert intervals[mav.MAVLINK_MSG_ID_ATTITUDE] == -1
    assert intervals[mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED] == -1
    assert rig.session.telemetry.version == "1.17.0"


def test_an_unanswered_command_is_sent_again_with_the_confirmation_counted(make_rig: Any) -> None:
    rig = make_rig(ack_timeout_s=0.5, attempts=4)
    rig.reach(Phase.READY)
    rig.vehicle.deaf.add(TAKEOFF)
    sent_at = []
    rig.each_tick = lambda: sent_at.append(rig.now) if rig.session.phase is Phase.TAKING_OFF else None
    rig.session.take_off(20.0)
    rig.until_phase(Phase.FAILED)
    assert [m.confirmation for m in rig.vehicle.asked_for(TAKEOFF)] == [0, 1, 2, 3]
    assert rig.session.reason == "vehicle 1: NAV_TAKEOFF was not answered in 4 tries"
    assert rig.texts(EventKind.FAILED) == [rig.session.reason]
    assert sent_at[-1] - sent_at[0] == pytest.approx(4 * 0.5, abs=0.11)


def test_a_refused_arming_fails_and_names_vehicle_command_and_result(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[DENIED]]
    rig.session.take_off(20.0)
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == "vehicle 1: ARM was refused: DENIED"
    assert rig.texts(EventKind.FAILED) == [rig.session.reason]


def test_the_vehicles_own_words_are_in_the_reason(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[NOT_YET], [DENIED]]
    rig.session.take_off(20.0)
    rig.until(lambda: len(rig.vehicle.asked_for(ARM)) == 1)
    rig.vehicle.say("Preflight Fail: compass\t")
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == (
        'vehicle 1: ARM was refused: DENIED (the vehicle says: "Preflight Fail: compass")'
    )


def test_a_temporary_rejection_is_asked_again_until_it_is_accepted(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[NOT_YET]] * 5
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    assert len(rig.vehicle.asked_for(ARM)) == 6


def test_a_temporary_rejection_that_never_ends_fails_in_the_end(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[NOT_YET]] * 500
    rig.session.take_off(20.0)
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == (
        "vehicle 1: arming: ARM had no effect in 20 s; last answer TEMPORARILY_REJECTED"
    )


def test_px4s_second_ack_is_believed_not_its_first(rig: Any) -> None:
    rig.reach(Phase.HOLDING)
    rig.vehicle.results[SET_MODE] = [[ACCEPTED, NOT_YET], [ACCEPTED, NOT_YET]]
    rig.session.engage()
    rig.run(0.6)
    assert rig.session.phase is Phase.ENGAGING
    rig.until_phase(Phase.ENGAGED)
    assert len(rig.vehicle.asked_for(SET_MODE)) == 3


def test_an_accepted_command_without_effect_is_sent_again_then_fails(rig: Any) -> None:
    rig.reach(Phase.HOLDING)
    rig.vehicle.idle.add(SET_MODE)
    rig.session.engage()
    rig.until_phase(Phase.FAILED)
    assert len(rig.vehicle.asked_for(SET_MODE)) == 8
    assert rig.session.reason == (
        "vehicle 1: offboard control: DO_SET_MODE OFFBOARD had no effect in 20 s; last answer ACCEPTED"
    )


def test_telemetry_confirms_when_every_ack_is_lost(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.mute |= {ARM, SET_MODE}
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    rig.session.engage()
    rig.until_phase(Phase.ENGAGED)


def test_take_off_mode_left_from_before_does_not_pass_for_this_take_off(rig: Any) -> None:
    rig.vehicle.mode = MODES.take_off
    rig.reach(Phase.READY)
    rig.vehicle.deaf.add(TAKEOFF)
    rig.session.take_off(20.0)
    rig.run(3.0)
    assert rig.vehicle.asked_for(ARM) == []


def test_take_off_is_above_sea_level_and_comes_before_arming(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    take_off = rig.vehicle.asked_for(TAKEOFF)[0]
    assert take_off.param7 == pytest.approx(508.0)
    assert math.isnan(take_off.param5) and math.isnan(take_off.param6)
    order = [m.command for m in rig.vehicle.asked]
    assert order.index(TAKEOFF) < order.index(ARM)
    assert rig.vehicle.height_m == pytest.approx(20.0, abs=0.5)
    assert abs(rig.vehicle.v_up) <= 0.31


def test_holding_waits_for_the_altitude(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(50.0)
    rig.run(10.0)
    assert rig.session.phase is Phase.TAKING_OFF
    rig.until_phase(Phase.HOLDING)
    assert rig.now > 20.0


def test_a_climb_that_stops_short_fails(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(20.0)
    rig.until(lambda: rig.vehicle.height_m > 7.0)
    rig.vehicle.target_m = 7.1
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == "vehicle 1: take-off altitude: not reached in 70 s"


def test_only_refusals_that_matter_are_warnings(rig: Any) -> None:
    rig.vehicle.results[INTERVAL] = [[ACCEPTED]] * 3 + [[UNSUPPORTED]] * 50
    rig.vehicle.results[REQUEST] = [[UNSUPPORTED]]
    rig.reach(Phase.READY)
    assert rig.texts(EventKind.WARNING) == ["REQUEST_MESSAGE AUTOPILOT_VERSION was refused: UNSUPPORTED"]
    assert len(rig.vehicle.asked_for(INTERVAL)) == 3 + len(UNWANTED_MESSAGES)


def test_positioning_insists_until_the_vehicle_knows_its_home(rig: Any) -> None:
    rig.vehicle.home_known = False
    rig.reach(Phase.POSITIONING)
    rig.vehicle.results[REQUEST] = [[FAILED]] * 4
    rig.run(6.0)
    assert rig.session.phase is Phase.POSITIONING
    rig.vehicle.home_known = True
    rig.until_phase(Phase.READY)
    assert rig.session.telemetry.home.alt_amsl_m == 488.0


def test_a_position_at_zero_zero_is_none(rig: Any) -> None:
    rig.vehicle.fixed = False
    rig.reach(Phase.POSITIONING)
    rig.run(10.0)
    assert rig.session.phase is Phase.POSITIONING
    assert not rig.session.telemetry.positioned
    rig.vehicle.fixed = True
    rig.until_phase(Phase.READY)


def test_a_vehicle_that_is_never_ready_fails(rig: Any) -> None:
    rig.vehicle.healthy = False
    rig.reach(Phase.POSITIONING)
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == "vehicle 1: ready to arm: not reached in 90 s"


def test_an_armed_vehicle_is_not_ready(rig: Any) -> None:
    rig.vehicle.armed = True
    rig.reach(Phase.POSITIONING)
    rig.run(10.0)
    assert rig.session.phase is Phase.POSITIONING


def test_the_time_scale_shortens_every_time_out(make_rig: Any) -> None:
    rig = make_rig(time_scale=5.0, link_loss_s=30.0)
    rig.vehicle.healthy = False
    rig.reach(Phase.POSITIONING)
    start = rig.now
    rig.until_phase(Phase.FAILED)
    assert rig.now - start == pytest.approx(18.0, abs=0.5)
    assert rig.session.reason == "vehicle 1: ready to arm: not reached in 90 s"


def test_an_ack_for_another_ground_station_is_not_ours(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.deaf.add(TAKEOFF)
    rig.session.take_off(20.0)
    rig.tick()
    rig.vehicle.send(mav.MAVLink_command_ack_message(TAKEOFF, DENIED, 0, 0, 245, 190))
    rig.run(1.0)
    assert rig.session.phase is Phase.TAKING_OFF


def test_in_progress_is_waited_for(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[mav.MAV_RESULT_IN_PROGRESS]]
    rig.session.take_off(20.0)
    rig.until(lambda: len(rig.vehicle.asked_for(ARM)) == 1)
    rig.run(2.0)
    assert len(rig.vehicle.asked_for(ARM)) == 1
    rig.until_phase(Phase.HOLDING)


def test_a_vehicle_that_does_not_disarm_itself_is_told_to(rig: Any) -> None:
    rig.vehicle.auto_disarm = False
    rig.reach(Phase.LANDING)
    rig.until_phase(Phase.LANDED)
    disarms = [m for m in rig.vehicle.asked_for(ARM) if m.param1 == 0.0]
    assert len(disarms) == 1 and disarms[0].param2 == 0.0
    assert not rig.vehicle.armed


def test_a_vehicle_that_disarms_itself_is_left_alone_and_put_in_hold(rig: Any) -> None:
    rig.reach(Phase.LANDING)
    rig.until_phase(Phase.LANDED)
    assert [m for m in rig.vehicle.asked_for(ARM) if m.param1 == 0.0] == []
    assert rig.vehicle.mode == MODES.hold


def test_landing_ordered_before_arming_is_known_still_commands_land(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(20.0)
    rig.until(lambda: rig.vehicle.armed)
    assert not rig.session.telemetry.armed
    rig.session.land()
    rig.until_phase(Phase.LANDED)
    assert not rig.vehicle.armed and rig.vehicle.height_m == 0.0


def test_round_trips_are_measured_in_the_callers_time(rig: Any) -> None:
    rig.reach(Phase.READY)
    spread = rig.session.statistics().command_round_trip
    assert spread.minimum_s == pytest.approx(0.05) and spread.maximum_s <= 0.11


def test_a_round_trip_is_not_measured_when_the_command_was_sent_twice(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.deaf.add(ARM)
    rig.session.take_off(20.0)
    rig.until(lambda: len(rig.vehicle.asked_for(ARM)) == 2)
    rig.run(0.3)
    rig.vehicle.send(mav.MAVLink_command_ack_message(ARM, ACCEPTED, 0, 0, 255, 190))
    rig.vehicle.armed = True
    rig.until_phase(Phase.HOLDING)
    assert rig.session.statistics().command_round_trip.maximum_s <= 0.11


def test_a_command_that_is_asked_anew_counts_its_tries_anew(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[NOT_YET]] * 3
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    assert [m.confirmation for m in rig.vehicle.asked_for(ARM)] == [0, 0, 0, 0]


def test_the_ack_of_another_command_is_not_this_ones(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.mute.add(ARM)
    rig.vehicle.idle.add(ARM)
    rig.session.take_off(20.0)
    rig.until(lambda: len(rig.vehicle.asked_for(ARM)) == 1)
    rig.vehicle.send(mav.MAVLink_command_ack_message(SET_MODE, DENIED, 0, 0, 255, 190))
    rig.run(1.0)
    assert rig.session.phase is Phase.TAKING_OFF


def test_an_ack_before_the_command_is_sent_answers_nothing(rig: Any) -> None:
    rig.vehicle.auto_disarm = False
    rig.reach(Phase.LANDING)
    rig.until(lambda: rig.session.telemetry.landed_state == mav.MAV_LANDED_STATE_ON_GROUND)
    landed_at = rig.now
    rig.run(0.5)
    rig.vehicle.send(mav.MAVLink_command_ack_message(ARM, ACCEPTED, 0, 0, 255, 190))
    asked = len(rig.vehicle.asked_for(ARM))
    rig.until(lambda: len(rig.vehicle.asked_for(ARM)) > asked)
    assert rig.now - landed_at == pytest.approx(5.0, abs=0.11)


def test_take_off_needs_the_truth_of_the_second_ack_too(rig: Any) -> None:
    rig.vehicle.mode = MODES.take_off
    rig.reach(Phase.READY)
    rig.vehicle.results[TAKEOFF] = [[ACCEPTED, NOT_YET]] * 3
    armed_after = []
    rig.each_tick = lambda: (
        armed_after.append(len(rig.vehicle.asked_for(TAKEOFF))) if (rig.vehicle.asked_for(ARM)) else None
    )
    rig.down = lambda frames: [b"".join(frames)]
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    assert armed_after[0] == 4


def test_holding_waits_until_the_vehicle_says_that_it_flies(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.landed_state = mav.MAV_LANDED_STATE_TAKEOFF
    rig.session.take_off(20.0)
    rig.run(30.0)
    assert rig.session.phase is Phase.TAKING_OFF
    rig.vehicle.landed_state = None
    rig.until_phase(Phase.HOLDING, 2.0)


def test_a_vehicle_in_the_air_is_not_ready(rig: Any) -> None:
    rig.vehicle.landed_state = mav.MAV_LANDED_STATE_IN_AIR
    rig.reach(Phase.POSITIONING)
    rig.run(10.0)
    assert rig.session.phase is Phase.POSITIONING


def test_a_landing_from_high_up_has_the_time_it_takes(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(100.0)
    rig.until_phase(Phase.HOLDING)
    rig.session.land()
    rig.until_phase(Phase.LANDED, 130.0)


def test_the_mode_that_comes_with_disarming_is_nobodys_doing(rig: Any) -> None:
    rig.vehicle.mode_after_disarm = MODES.engaged
    rig.reach(Phase.LANDING)
    rig.vehicle.landed_state = mav.MAV_LANDED_STATE_IN_AIR
    rig.until(lambda: not rig.session.telemetry.armed)
    assert rig.session.phase is Phase.LANDING
    rig.vehicle.landed_state = None
    rig.until_phase(Phase.LANDED)
    assert rig.vehicle.mode == MODES.hold
