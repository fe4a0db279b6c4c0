"""ArduPilot's ways: when it is ready, how it takes off, what it flies, how it is held."""

import itertools
from typing import Any

import pytest

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.ardupilot import GUIDED, MODES, ArduPilot, climb_rate
from swarmctl.vehicle.autopilots.registry import adapter_for
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.telemetry import Telemetry

from .fake_ardupilot import BRAKE, EKF, LAND, LOCAL, POSITION, STABILIZE, STATE, STATUS

ARM = mav.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = mav.MAV_CMD_NAV_TAKEOFF
SET_MODE = mav.MAV_CMD_DO_SET_MODE
LONGEST_GAP_S = 3.0


def test_ready_needs_guided_the_estimate_and_the_local_position(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.until_phase(Phase.READY)
    assert 41.0 <= rig.now < 45.0
    assert rig.vehicle.mode == GUIDED
    assert rig.vehicle.asked_for(ARM) == []


@pytest.mark.parametrize("missing", [EKF, LOCAL, STATUS])
def test_ready_without_one_of_its_gates_is_not_ready(ardupilot_rig: Any, missing: int) -> None:
    rig = ardupilot_rig
    stream = rig.vehicle.stream
    rig.vehicle.stream = lambda message_id: None if message_id == missing else stream(message_id)
    rig.until_phase(Phase.FAILED, 300.0)
    assert "vehicle 1: " in rig.session.reason


def test_what_the_checks_said_in_another_mode_does_not_count() -> None:
    adapter, telemetry = ArduPilot(), Telemetry()
    decoder, encoder = Decoder(), Encoder(1, 1)

    def observe(message: Any) -> bool:
        (frame,) = decoder.feed(encoder.encode(message))
        adapter.observe(frame.message_id, frame.fields, telemetry)
        return telemetry.healthy

    beat = [mav.MAVLink_heartbeat_message(2, 3, 1, mode, 4, 3) for mode in (STABILIZE, GUIDED)]
    prearm = mav.MAV_SYS_STATUS_PREARM_CHECK
    ready = mav.MAVLink_sys_status_message(0, 0, prearm, 0, 0, -1, 80, 0, 0, 0, 0, 0, 0)
    observe(mav.MAVLink_ekf_status_report_message(0x10, 0, 0, 0, 0, 0))
    observe(mav.MAVLink_local_position_ned_message(1, 0, 0, 0, 0, 0, 0))
    assert not observe(beat[0]) and not observe(ready)
    assert not observe(beat[1])
    assert observe(ready)


def test_every_stream_is_asked_for(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.READY)
    expected = {POSITION: 0.1, STATE: 0.5, STATUS: 0.5, EKF: 1.0, LOCAL: 1.0}
    assert rig.vehicle.intervals == pytest.approx(expected)


def test_after_a_reboot_on_the_ground_the_streams_are_asked_for_again(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.until_phase(Phase.READY)
    rig.vehicle.reboot()
    rig.until_phase(Phase.IDENTIFYING, 10.0)
    assert rig.texts(EventKind.POSITION_LOST) == ["vehicle 1: no valid position while ready"]
    rig.until_phase(Phase.READY)
    assert len(rig.vehicle.intervals) == 5
    assert rig.vehicle.mode == GUIDED and rig.vehicle.uptime >= 41.0


def test_a_vehicle_that_somebody_has_armed_is_not_put_into_guided(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.vehicle.armed, rig.vehicle.auto_disarm = True, False
    rig.run(60.0)
    assert rig.session.phase is Phase.POSITIONING
    assert rig.vehicle.asked_for(SET_MODE) == []


def test_take_off_is_guided_arm_and_an_altitude_above_home(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.READY)
    rig.vehicle.mode = STABILIZE
    rig.run(1.2)
    asked = len(rig.vehicle.asked)
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    orders = rig.vehicle.asked[asked:]
    assert [order.command for order in orders] == [SET_MODE, ARM, TAKEOFF]
    assert orders[-1].param7 == 20.0
    assert rig.vehicle.setpoints == []
    assert rig.vehicle.height_m == pytest.approx(20.0, abs=0.5)


def test_no_setpoint_is_sent_before_the_climb_has_ended(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.READY)
    rig.session.take_off(20.0)
    rig.each_tick = lambda: rig.session.setpoint(1.0, 0.0, 20.0)
    rig.until_phase(Phase.HOLDING)
    assert rig.vehicle.setpoints == []
    assert rig.vehicle.height_m == pytest.approx(20.0, abs=0.5)


def test_arming_is_asked_again_after_failed_which_is_its_not_yet(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[mav.MAV_RESULT_FAILED]] * 3
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING)
    assert len(rig.vehicle.asked_for(ARM)) == 4


def test_arming_refused_for_good_names_the_reason(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.READY)
    rig.vehicle.results[ARM] = [[mav.MAV_RESULT_FAILED]] * 500
    rig.session.take_off(20.0)
    rig.run(2.0)
    rig.vehicle.say("Arm: Need Position Estimate")
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == (
        "vehicle 1: arming: ARM had no effect in 20 s; last answer FAILED"
        ' (the vehicle says: "Arm: Need Position Estimate")'
    )


def test_setpoints_give_all_three_axes_and_close_the_altitude_loop(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.ENGAGED)
    rig.each_tick = lambda: rig.session.setpoint(3.0, -4.0, 30.0)
    rig.run(20.0)
    setpoint = rig.vehicle.setpoints[-1]
    assert (setpoint.vx, setpoint.vy) == (-4.0, 3.0)
    assert setpoint.coordinate_frame == 1 and setpoint.type_mask == 2503
    assert rig.vehicle.height_m == pytest.approx(30.0, abs=0.2)
    assert rig.vehicle.position_en[0] == pytest.approx(60.0, abs=1.0)


@pytest.mark.parametrize(("error_m", "rate"), [(0.0, 0.0), (0.5, 0.5), (-0.5, -0.5), (50, 2.5), (-50, -1.5)])
def test_the_altitude_loop_is_bounded(error_m: float, rate: float) -> None:
    assert climb_rate(error_m) == pytest.approx(rate)


def test_the_altitude_loop_can_stop_in_time() -> None:
    """At no distance is it faster than 1 m/s² can brake, and nowhere does it jump."""
    rates = [climb_rate(0.01 * k) for k in range(1000)]
    assert all(rate * rate <= 2.0 * 0.01 * k + 1e-9 for k, rate in enumerate(rates))
    assert max(b - a for a, b in itertools.pairwise(rates)) < 0.011


def test_hold_is_brake_and_resume_is_guided(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.ENGAGED)
    rig.each_tick = lambda: rig.session.setpoint(5.0, 0.0, 20.0)
    rig.run(3.0)
    rig.session.hold()
    rig.until_phase(Phase.HOLDING)
    assert rig.vehicle.mode == BRAKE
    rig.run(10.0)
    assert rig.session.phase is Phase.HOLDING
    east = rig.vehicle.position_en[0]
    rig.session.resume()
    rig.until_phase(Phase.ENGAGED)
    rig.run(3.0)
    assert rig.vehicle.mode == GUIDED and rig.vehicle.position_en[0] > east + 10.0


def test_setpoints_never_pause_longer_than_the_firmware_waits(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.HOLDING)
    times: list[float] = []
    fly = rig.vehicle.fly
    rig.vehicle.fly = lambda fields: (times.append(rig.now), fly(fields))
    rig.session.engage()
    rig.each_tick = lambda: rig.session.setpoint(5.0, 0.0, 20.0)
    rig.run(10.0)
    rig.vehicle.deaf.add(SET_MODE)
    rig.session.hold()
    rig.run(5.0)
    assert rig.session.phase is Phase.STOPPING
    assert max(b - a for a, b in itertools.pairwise(times)) < LONGEST_GAP_S / 10
    assert rig.now - times[-1] < LONGEST_GAP_S / 10


def test_a_flight_ends_disarmed_in_a_mode_that_cannot_be_armed(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.LANDING)
    rig.until_phase(Phase.LANDED, 200.0)
    assert not rig.vehicle.armed and rig.vehicle.height_m == 0.0 and rig.vehicle.mode == LAND
    assert [text for kind in (EventKind.FAILED, EventKind.WARNING) for text in rig.texts(kind)] == []


def test_a_pilots_mode_is_released_by_name(ardupilot_rig: Any) -> None:
    rig = ardupilot_rig
    rig.reach(Phase.ENGAGED)
    rig.vehicle.mode = 5
    rig.until_phase(Phase.RELEASED)
    assert rig.session.reason == "vehicle 1: its mode became LOITER while engaged"


def test_its_modes_and_braking() -> None:
    adapter = adapter_for(mav.MAV_AUTOPILOT_ARDUPILOTMEGA)
    assert isinstance(adapter, ArduPilot)
    assert adapter.set_mode(MODES.land).parameters[:3] == (1.0, 9.0, 0.0)
    assert adapter.set_mode(MODES.hold).name == "DO_SET_MODE BRAKE"
    limits = adapter.limits  # a real one came 16.2 m further from 8 m/s, and 24.2 m from 10 m/s
    for speed, came in ((8.0, 16.2), (10.0, 24.2)):
        assert came < speed * limits.latency_s + speed**2 / (2.0 * limits.braking_mps2) < came + 4.0
