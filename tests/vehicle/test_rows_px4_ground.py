"""What PX4 was seen to do before and after a flight, played by the stub, and what the session makes of it."""

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .stub_flight import ARM_DISARM, SCATTERED, StubFlight

OFFBOARD, LOITER = 0x60000, 0x3040000
ACCEPTED = mav.MAV_RESULT_ACCEPTED


@pytest.mark.row("px4-rates")
def test_404_messages_a_second_are_turned_down_to_what_is_read() -> None:
    flight = StubFlight(tick_s=0.01)
    flight.until_phase(Phase.CONFIGURING)
    since = flight.now
    flight.until_phase(Phase.POSITIONING)
    full = len([1 for t, f in flight.crossed if t < since and f.system == 1])
    assert full / since > 300.0
    flight.until_phase(Phase.READY)
    since = flight.now
    flight.run(10.0)
    assert len([1 for t, f in flight.crossed if t > since and f.system == 1]) / 10.0 <= 20.0


@pytest.mark.row("px4-rates")
def test_the_rates_are_turned_down_again_after_a_reboot() -> None:
    flight = StubFlight()
    flight.until_phase(Phase.READY)
    flight.run(10.0)
    flight.vehicle.reboot()
    flight.until(lambda: flight.session.phase is not Phase.READY, 10.0)
    flight.until_phase(Phase.READY)
    since = flight.now
    flight.run(10.0)
    assert len([1 for t, f in flight.crossed if t > since and f.system == 1]) / 10.0 <= 20.0


@pytest.mark.row("px4-statustext")
def test_a_text_in_chunks_is_put_together_and_quoted() -> None:
    flight = StubFlight()
    flight.until_phase(Phase.READY)
    flight.vehicle.faults.begin("arming-refused")
    flight.session.take_off(20.0)
    flight.until_phase(Phase.FAILED)
    text = "Arming denied: Resolve system health failures first"
    assert max(f.chunk_seq for f in flight.told(mav.MAVLINK_MSG_ID_STATUSTEXT)) == 1
    assert text in flight.texts(EventKind.TEXT)
    assert flight.session.reason == (
        "vehicle 1: arming: ARM had no effect in 20 s; last answer TEMPORARILY_REJECTED "
        f'(the vehicle says: "{text}")'
    )


@pytest.mark.row("px4-origin")
def test_an_origin_that_was_told_before_anybody_listened_is_asked_for() -> None:
    flight = StubFlight(seed=SCATTERED)
    flight.drop = lambda frame: frame[7] == mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN
    flight.until_phase(Phase.POSITIONING)
    flight.run(3.0)
    assert flight.session.telemetry.origin is None
    flight.drop = lambda frame: False
    flight.until_phase(Phase.READY)
    origin = flight.session.telemetry.origin
    assert origin is not None
    assert origin[:2] == pytest.approx(flight.vehicle.local_origin[:2], abs=1e-7)


@pytest.mark.row("px4-ready")
def test_a_vehicle_that_disarms_itself_before_it_flies_is_told() -> None:
    flight = StubFlight()
    flight.until_phase(Phase.READY)
    flight.vehicle.faults.begin("motor-failure")
    flight.session.take_off(20.0)
    took = flight.until_phase(Phase.FAILED)
    assert took == pytest.approx(11.0, abs=1.0)
    assert flight.session.reason == "vehicle 1: it disarmed while taking off"


@pytest.mark.row("px4-offboard", "px4-after-landing")
def test_a_vehicle_that_was_left_in_offboard_is_put_into_loiter_and_gets_ready() -> None:
    """It would never say that it is ready, or fly as soon as it is armed."""
    flight = StubFlight()
    flight.run(6.0)
    flight.session = Session(1, settings=SessionSettings(), now=flight.now)
    flight.pilot_sets_mode(OFFBOARD)
    flight.until_phase(Phase.READY)
    assert flight.mode == LOITER
    flight.engage()
    flight.land()


@pytest.mark.row("px4-after-landing")
def test_a_controller_that_starts_after_a_return_finds_it_harmless() -> None:
    flight = StubFlight()
    flight.engage()
    flight.run(0.5)
    flight.until_phase(Phase.RELEASED, 5.0)
    flight.until(lambda: not flight.vehicle.armed)
    assert flight.mode == OFFBOARD
    flight.session = Session(1, settings=SessionSettings(), now=flight.now)
    flight.until_phase(Phase.READY)
    assert flight.mode == LOITER


@pytest.mark.row("px4-after-landing")
def test_after_a_landing_arming_is_harmless_although_setpoints_flow() -> None:
    flight = StubFlight()
    flight.engage()
    flight.land()
    assert flight.mode == LOITER
    flight.pilot_commands(ARM_DISARM, 1)
    flight.run(5.0)
    assert flight.body["up"] == 0.0


@pytest.mark.row("px4-gcs-loss")
def test_the_sessions_heartbeats_are_what_arming_needs() -> None:
    flight = StubFlight()
    flight.set_parameter("NAV_DLL_ACT", 2)
    flight.engage()
    flight.command(1.0, 0.0)
    flight.run(20.0)
    assert flight.session.phase is Phase.ENGAGED
    flight.land()


@pytest.mark.row("px4-in-the-air")
def test_the_session_disarms_on_the_ground_alone_and_never_by_force() -> None:
    flight = StubFlight()
    flight.set_parameter("COM_DISARM_LAND", 60.0)
    flight.engage()
    flight.land()
    orders = [f for f in flight.commands(ARM_DISARM) if f.param1 == 0.0]
    assert orders and {f.param2 for f in orders} == {0.0}
    assert set(flight.acknowledged(ARM_DISARM)) == {ACCEPTED}
