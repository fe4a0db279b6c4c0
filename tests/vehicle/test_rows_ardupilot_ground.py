"""What ArduCopter was seen to do before a flight, played by the stub, and what the session makes of it."""

from collections import Counter

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight

from .stub_flight import ARM_DISARM, SET_MODE, StubFlight

STABILIZE, GUIDED = 0, 4
POSITION, STATE, STATUS, LOCAL, EKF = 33, 245, 1, 32, 193


@pytest.mark.row("ardupilot-ready")
def test_ready_is_guided_with_a_position_and_no_sooner() -> None:
    flight = StubFlight("ardupilot")
    flight.run(19.0)
    assert flight.session.phase is Phase.POSITIONING
    assert flight.told(POSITION) and not flight.session.telemetry.positioned, "0, 0 is no position"
    assert 41.0 <= 19.0 + flight.until_phase(Phase.READY) < 45.0
    assert flight.mode == GUIDED
    assert not flight.commands(ARM_DISARM)


@pytest.mark.row("ardupilot-ready")
def test_a_vehicle_armed_in_stabilize_is_left_alone_until_it_has_disarmed_itself() -> None:
    flight = StubFlight("ardupilot")
    flight.impair(down_cut=True)
    flight.run(25.0)
    flight.pilot_commands(ARM_DISARM, 1)
    flight.impair(down_cut=False)
    flight.run(9.0)
    assert flight.vehicle.armed and flight.mode == STABILIZE
    assert flight.session.phase is Phase.POSITIONING and not flight.commands(SET_MODE)
    flight.until_phase(Phase.READY)
    assert not flight.vehicle.armed and flight.mode == GUIDED


@pytest.mark.row("ardupilot-ready")
def test_checks_that_pass_in_stabilize_are_not_enough_for_a_controller_that_comes_late() -> None:
    """Not even if the heartbeat that tells of GUIDED comes before that mode's own checks."""
    flight = StubFlight("ardupilot")
    flight.impair(up_cut=True, down_cut=True)
    flight.run(28.0)
    assert flight.vehicle.personality.ready and flight.mode == STABILIZE
    flight.impair(up_cut=False, down_cut=False)
    flight.drop = lambda frame: (
        frame[7] == STATUS and flight.mode == GUIDED and flight.session.telemetry.mode != GUIDED
    )
    flight.until_phase(Phase.READY)
    assert flight.now >= 41.0


@pytest.mark.row("ardupilot-ready")
def test_a_refusal_to_arm_is_quoted() -> None:
    flight = StubFlight("ardupilot")
    flight.until_phase(Phase.READY)
    flight.vehicle.lose_fix()
    flight.session.take_off(20.0)
    flight.until_phase(Phase.FAILED)
    assert 'ARM had no effect in 20 s; last answer FAILED (the vehicle says: "Arm: Need Position' in (
        flight.session.reason
    )


@pytest.mark.row("ardupilot-streams")
def test_what_is_read_is_asked_for_and_comes_at_its_rate() -> None:
    flight = StubFlight("ardupilot")
    flight.until_phase(Phase.READY)
    flight.run(1.0)
    since = flight.now
    flight.run(20.0)
    counts = Counter(f.message_id for t, f in flight.crossed if t > since and f.system == 1)
    wanted = {POSITION: 200, STATE: 40, STATUS: 40, EKF: 20, LOCAL: 20, 0: 20}
    assert counts.pop(111) == 2 + 20, "its own, and the answers to ours"
    assert counts == pytest.approx(wanted, abs=1)


@pytest.mark.row("ardupilot-streams")
def test_after_a_reboot_it_is_all_asked_for_again() -> None:
    flight = StubFlight("ardupilot")
    flight.until_phase(Phase.READY)
    asked = Counter(int(f.param1) for f in flight.commands(mav.MAV_CMD_SET_MESSAGE_INTERVAL))
    flight.vehicle.reboot()
    flight.until(lambda: flight.session.phase is not Phase.READY, 10.0)
    since = flight.now
    flight.until_phase(Phase.READY)
    again = Counter(int(f.param1) for f in flight.commands(mav.MAV_CMD_SET_MESSAGE_INTERVAL, since))
    assert again.keys() == asked.keys() == {POSITION, STATE, STATUS, EKF, LOCAL}
    since = flight.now
    flight.run(5.0)
    assert len(flight.told(POSITION, since + 0.05)) == 50


@pytest.mark.row("ardupilot-takeoff")
def test_a_vehicle_that_does_not_lift_off_is_told_and_disarms_itself() -> None:
    flight = StubFlight("ardupilot")
    flight.until_phase(Phase.READY)
    flight.vehicle.faults.begin("motor-failure")
    flight.session.take_off(20.0)
    flight.until_phase(Phase.FAILED)
    assert flight.session.reason == (
        "vehicle 1: take-off: NAV_TAKEOFF had no effect in 20 s; last answer ACCEPTED"
    )
    assert flight.until(lambda: not flight.vehicle.armed) <= 10.1


@pytest.mark.row("ardupilot-parameters")
@pytest.mark.parametrize("autopilot", ["ardupilot", "ardupilot-4.6"])
def test_parameters_are_read_by_new_and_old_names_in_the_same_units(autopilot: str) -> None:
    flight = StubFlight(autopilot, preflight=Preflight(read_parameters=True))
    flight.until_phase(Phase.READY)
    assert flight.session.parameters == pytest.approx(
        {
            "speed_mps": 10.0,
            "acceleration_mps2": 2.5,
            "climb_mps": 2.5,
            "descent_mps": 1.5,
            "fence_enabled": 0.0,
            "fence_action": 1.0,
            "fence_types": 7.0,
            "fence_ceiling_m": 100.0,
            "fence_radius_m": 300.0,
            "avoidance": 3.0,
            "setpoint_loss_s": 3.0,
            "ground_station_loss_action": 0.0,
            "return_height_m": 15.0,
        }
    )
    assert flight.texts(EventKind.WARNING) == []


@pytest.mark.row("ardupilot-no-answer")
def test_a_session_for_another_system_hears_nothing_and_does_no_harm() -> None:
    flight = StubFlight("ardupilot", "ardupilot")
    flight.sessions.reverse()
    flight.run(60.0)
    assert {session.phase for session in flight.sessions} == {Phase.CONNECTING}
    assert {(f.message_id, f.system) for _, f in flight.crossed} == {(0, 255)}
    assert not any(vehicle.armed for vehicle in flight.fleet.vehicles)
