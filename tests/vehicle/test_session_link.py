"""Bad links: lost, repeated, overtaken and broken frames, silence, and somebody else at the controls."""

import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import OrderError, Session
from swarmctl.vehicle.settings import SessionSettings

POSCTL = 3 << 16


def fly_and_land(rig: Any, engaged_s: float = 2.0) -> None:
    """A whole flight, with a setpoint every tick while engaged."""
    rig.until_phase(Phase.READY, 300.0)
    rig.session.take_off(20.0)
    rig.until_phase(Phase.HOLDING, 300.0)
    rig.session.engage()
    rig.until_phase(Phase.ENGAGED, 300.0)
    rig.each_tick = lambda: rig.session.setpoint(3.0, 0.0, 20.0)
    rig.run(engaged_s)
    rig.session.land()
    rig.until_phase(Phase.LANDED, 300.0)
    assert not rig.vehicle.armed and rig.vehicle.height_m == 0.0


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("loss", [0.1, 0.4])
def test_a_flight_with_lost_frames(make_rig: Any, make_noise: Any, loss: float, seed: int) -> None:
    rig = make_rig(link_loss_s=15.0)
    rig.up, rig.down = make_noise(seed, loss), make_noise(seed + 1000, loss)
    fly_and_land(rig)
    statistics = rig.session.statistics()
    share = statistics.messages_lost / (statistics.messages_lost + statistics.messages_received)
    assert share == pytest.approx(loss, abs=0.1)


@pytest.mark.parametrize("seed", range(6))
def test_a_flight_with_repeated_and_overtaken_frames(make_rig: Any, make_noise: Any, seed: int) -> None:
    rig = make_rig(link_loss_s=10.0)
    rig.up = make_noise(seed, repeat=0.3, overtake=0.3)
    rig.down = make_noise(seed + 1000, repeat=0.3, overtake=0.3)
    fly_and_land(rig, 5.0)
    assert rig.session.statistics().messages_late > 50


def test_a_flight_byte_by_byte_with_garbage_between(rig: Any) -> None:
    noise = random.Random(1)

    def crumbs(frames: list[bytes]) -> list[bytes]:
        dirty = b"".join(noise.randbytes(noise.randrange(8)) + frame for frame in frames)
        return [bytes([byte]) for byte in dirty]

    rig.down = crumbs
    fly_and_land(rig)
    assert rig.session.statistics().messages_bad > 50


def test_a_flight_in_which_a_datagram_is_all_of_a_tick(rig: Any) -> None:
    rig.down = lambda frames: [b"".join(frames)]
    fly_and_land(rig)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.binary(max_size=60), max_size=30))
def test_garbage_alone_does_nothing(blobs: list[bytes]) -> None:
    session = Session(1, settings=SessionSettings(), now=0.0)
    for i, blob in enumerate(blobs):
        session.receive(blob, i * 0.1)
        session.poll(i * 0.1)
    assert session.phase is Phase.CONNECTING


def test_other_systems_components_and_ground_stations_are_not_the_vehicle(rig: Any) -> None:
    session = Session(1, settings=SessionSettings(), now=0.0)
    beat = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, 0, 0, 0, 3)
    session.receive(Encoder(2, 1).encode(beat), 0.1)
    session.receive(Encoder(1, 154).encode(beat), 0.2)
    assert session.phase is Phase.CONNECTING
    assert session.statistics().messages_received == 1
    session.receive(Encoder(1, 1).encode(beat), 0.3)
    assert session.phase is Phase.IDENTIFYING


def test_an_overtaken_heartbeat_does_not_take_the_vehicle_away(rig: Any) -> None:
    rig.reach(Phase.HOLDING)
    rig.vehicle.heartbeat()
    old = rig.vehicle.out.pop()
    rig.session.engage()
    rig.until_phase(Phase.ENGAGED)
    rig.session.receive(old, rig.now)
    assert rig.session.phase is Phase.ENGAGED
    assert rig.session.statistics().messages_late == 1


def test_a_repeated_ack_does_not_answer_the_next_command(rig: Any) -> None:
    rig.vehicle.healthy = False
    rig.reach(Phase.CONFIGURING)
    rig.vehicle.deaf.add(mav.MAV_CMD_SET_MESSAGE_INTERVAL)
    ack = mav.MAVLink_command_ack_message(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 0, 0, 0, 255, 190)
    rig.vehicle.send(ack)
    frame = rig.vehicle.out.pop()
    for _ in range(40):
        rig.session.receive(frame, rig.now)
    rig.run(3.0)
    assert rig.session.phase is Phase.CONFIGURING


def test_a_restarted_vehicle_is_heard_again_although_its_numbers_start_anew(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    sequence = rig.vehicle.encoder.sequence
    rig.vehicle.encoder.sequence = (sequence - 10) & 0xFF
    rig.vehicle.silent = False
    rig.until_phase(Phase.READY)
    assert rig.session.statistics().messages_late == 0


def test_lost_while_setting_up_begins_again_and_forgets_what_it_knew(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    assert rig.texts(EventKind.LOST) == ["vehicle 1: no heartbeat for 3 s while ready"]
    rig.vehicle.silent = False
    rig.until_phase(Phase.IDENTIFYING)
    assert rig.session.telemetry.home is None and rig.session.telemetry.version is None
    asked = len(rig.vehicle.asked)
    rig.until_phase(Phase.READY)
    assert len(rig.vehicle.asked) > asked + 10


def test_no_setpoint_is_sent_while_lost_and_engaged_goes_on_after(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    rig.each_tick = lambda: rig.session.setpoint(1.0, 0.0, 20.0)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    flown = len(rig.vehicle.setpoints)
    assert rig.session.setpoint(1.0, 0.0, 20.0) is False
    rig.run(5.0)
    assert len(rig.vehicle.setpoints) == flown
    rig.vehicle.silent = False
    rig.until_phase(Phase.ENGAGED)
    assert rig.texts(EventKind.REGAINED) == ["vehicle 1: heartbeat again"]
    rig.run(1.0)
    assert len(rig.vehicle.setpoints) > flown + 10


def test_back_in_the_failsafes_mode_is_released(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    rig.vehicle.mode = MODES.comeback
    rig.vehicle.silent = False
    rig.until_phase(Phase.RELEASED)
    assert rig.session.reason == "vehicle 1: its mode became AUTO.RTL while engaged"


def test_back_disarmed_failed(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    rig.vehicle.armed = False
    rig.vehicle.silent = False
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == "vehicle 1: it disarmed while engaged"


def test_a_step_begins_anew_after_a_loss(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(20.0)
    rig.until(lambda: rig.vehicle.height_m > 5.0)
    rig.vehicle.silent = True
    rig.vehicle.target_m = 7.0
    rig.run(90.0)
    assert rig.session.phase is Phase.LOST
    rig.vehicle.silent = False
    rig.vehicle.target_m = 20.0
    rig.until_phase(Phase.HOLDING, 15.0)


def test_the_hold_setpoints_flow_again_after_a_loss(rig: Any) -> None:
    rig.reach(Phase.HOLDING)
    rig.vehicle.deaf.add(mav.MAV_CMD_DO_SET_MODE)
    rig.session.engage()
    rig.run(0.5)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    flown = len(rig.vehicle.setpoints)
    rig.run(2.0)
    assert len(rig.vehicle.setpoints) == flown
    rig.vehicle.silent = False
    rig.vehicle.deaf.clear()
    rig.until_phase(Phase.ENGAGED)
    assert len(rig.vehicle.setpoints) > flown + 3


@pytest.mark.parametrize("phase", [Phase.HOLDING, Phase.ENGAGING, Phase.ENGAGED])
def test_a_stolen_mode_is_reported_and_never_fought(rig: Any, phase: Phase) -> None:
    rig.reach(phase)
    rig.vehicle.mode = POSCTL
    rig.vehicle.deaf.add(mav.MAV_CMD_DO_SET_MODE)
    rig.until_phase(Phase.RELEASED, 3.0)
    assert rig.texts(EventKind.RELEASED) == [f"vehicle 1: its mode became POSCTL while {phase.value}"]
    asked, flown = len(rig.vehicle.asked), len(rig.vehicle.setpoints)
    rig.each_tick = lambda: rig.session.setpoint(1.0, 0.0, 20.0)
    rig.run(20.0)
    assert (len(rig.vehicle.asked), len(rig.vehicle.setpoints)) == (asked, flown)
    assert rig.session.phase is Phase.RELEASED


def test_a_mode_change_during_the_climb_is_released(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.session.take_off(20.0)
    rig.until(lambda: rig.vehicle.height_m > 5.0)
    rig.vehicle.mode = POSCTL
    rig.until_phase(Phase.RELEASED, 3.0)
    assert rig.session.reason == "vehicle 1: its mode became POSCTL while taking off"


def test_an_autopilot_that_we_cannot_fly_is_named(rig: Any) -> None:
    rig.vehicle.autopilot = mav.MAV_AUTOPILOT_PPZ
    rig.run(1.0)
    assert rig.session.phase is Phase.FAILED
    assert rig.session.reason == "vehicle 1: its autopilot is PPZ; can fly: PX4, ARDUPILOTMEGA"
    with pytest.raises(OrderError, match="not possible while failed"):
        rig.session.land()
