"""Setpoints, telemetry, deadlines, texts and the record of what crossed the link."""

import itertools
import math
from typing import Any

import pytest

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES, Px4
from swarmctl.vehicle.autopilots.registry import adapter_for, autopilot_name
from swarmctl.vehicle.events import EventKind, TextAssembler
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.reading import read_position
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.telemetry import GeoPoint, Telemetry


def test_the_setpoint_is_north_east_at_a_depth_below_the_vehicles_own_origin(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    rig.vehicle.setpoints.clear()
    assert rig.session.setpoint(3.0, -4.0, 25.0) is True
    rig.tick()
    (setpoint,) = rig.vehicle.setpoints
    assert (setpoint.vx, setpoint.vy) == (-4.0, 3.0)
    assert setpoint.z == pytest.approx(-(25.0 + 488.0 - 487.4), abs=1e-4)
    assert setpoint.type_mask == 1 | 2 | 32 | 64 | 128 | 256 | 2048
    assert setpoint.coordinate_frame == mav.MAV_FRAME_LOCAL_NED
    assert (setpoint.target_system, setpoint.target_component) == (1, 1)


def test_engaged_never_invents_a_setpoint(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    flown = len(rig.vehicle.setpoints)
    rig.run(5.0)
    assert len(rig.vehicle.setpoints) == flown


def test_hold_setpoints_flow_before_offboard_mode_is_asked_for(rig: Any) -> None:
    rig.reach(Phase.HOLDING)
    arrived: list[tuple[float, int]] = []

    def note(frames: list[bytes]) -> list[bytes]:
        arrived.extend((rig.now, frame[7]) for frame in frames)
        return frames

    rig.up = note
    rig.session.engage()
    rig.until_phase(Phase.ENGAGED)
    kinds = [kind for _, kind in arrived]
    asked = kinds.index(mav.MAVLINK_MSG_ID_COMMAND_LONG)
    stream = [t for t, kind in arrived if kind == mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED]
    before = [t for t, kind in arrived[:asked] if kind == mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED]
    assert before[-1] - before[0] >= 0.3
    assert max(b - a for a, b in itertools.pairwise(stream)) < 0.11
    assert {(s.vx, s.vy) for s in rig.vehicle.setpoints} == {(0.0, 0.0)}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("place", range(3))
def test_a_setpoint_that_is_no_number_is_never_sent(rig: Any, place: int, bad: float) -> None:
    rig.reach(Phase.ENGAGED)
    rig.session.outgoing()
    values = [1.0, 1.0, 20.0]
    values[place] = bad
    assert rig.session.setpoint(*values) is False
    assert rig.session.outgoing() == []
    assert rig.session.statistics().setpoints_refused == 1


def test_setpoint_intervals_are_counted(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    assert rig.session.statistics().setpoint_interval is None
    for gap in (1, 2, 2, 2, 6):
        rig.session.setpoint(0.0, 0.0, 20.0)
        rig.run(gap * 0.05)
    statistics = rig.session.statistics()
    assert statistics.setpoints_sent == 5
    spread = statistics.setpoint_interval
    assert (spread.minimum_s, spread.median_s, spread.maximum_s) == pytest.approx((0.05, 0.1, 0.1))


def test_position_units_and_axes() -> None:
    telemetry = Telemetry()
    message = mav.MAVLink_global_position_int_message(
        1234, -334567890, 1512345678, 12345, -6789, 100, -200, 300, 0
    )
    (frame,) = Decoder().feed(Encoder(1, 1).encode(message))
    read_position(telemetry, frame.fields, 7.5)
    assert (telemetry.lat_e7, telemetry.lon_e7) == (-334567890, 1512345678)
    assert (telemetry.altitude_amsl_m, telemetry.height_m) == (12.345, -6.789)
    assert (telemetry.v_north, telemetry.v_east, telemetry.v_up) == (1.0, -2.0, -3.0)
    assert (telemetry.boot_ms, telemetry.received_at) == (1234, 7.5)


def test_telemetry_of_a_flight(rig: Any) -> None:
    rig.reach(Phase.ENGAGED)
    telemetry = rig.session.telemetry
    assert telemetry.armed and telemetry.mode == MODES.engaged
    assert telemetry.landed_state == mav.MAV_LANDED_STATE_IN_AIR
    assert telemetry.battery_percent == 87 and telemetry.healthy
    assert telemetry.home == GeoPoint(47.397742, 8.545594, 488.0)
    assert telemetry.origin == GeoPoint(47.397742, 8.545594, 487.4)
    assert telemetry.height_m == pytest.approx(20.0, abs=0.5)


def test_an_unknown_battery_is_none(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.send(mav.MAVLink_sys_status_message(0, 0, 0, 0, 0, -1, -1, 0, 0, 0, 0, 0, 0))
    rig.session.receive(rig.vehicle.out.pop(), rig.now)
    assert rig.session.telemetry.battery_percent is None
    assert not rig.session.telemetry.healthy


def test_our_heartbeat_is_a_ground_stations_at_1_hz_from_the_start() -> None:
    session = Session(1, settings=SessionSettings(), now=0.0)
    decoder = Decoder()
    beats = []
    for tick in range(100):
        session.poll(tick * 0.1)
        beats += [(tick, frame) for data in session.outgoing() for frame in decoder.feed(data)]
    assert [tick for tick, _ in beats] == list(range(0, 100, 10))
    assert {(f.system, f.component, f.fields.type) for _, f in beats} == {(255, 190, mav.MAV_TYPE_GCS)}
    assert [f.sequence for _, f in beats] == list(range(10))


def test_polling_only_at_the_deadlines_flies_as_well(make_rig: Any) -> None:
    """Each poll at ``next_deadline`` gets somewhere: the deadline moves on, and time-outs are met exactly."""
    session = Session(1, settings=SessionSettings(), now=0.0)
    beat = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, 0, 0, 0, 3)
    session.receive(Encoder(1, 1).encode(beat), 0.0)
    asked, now = [], 0.0
    while session.phase is Phase.IDENTIFYING:
        assert session.next_deadline > now or now == 0.0
        now = session.next_deadline
        session.poll(now)
        frames = [frame for data in session.outgoing() for frame in Decoder().feed(data)]
        asked += [now for frame in frames if frame.message_id == mav.MAVLINK_MSG_ID_COMMAND_LONG]
    assert session.phase is Phase.LOST and now == 3.0
    assert asked[1:] == [0.5, 1.0, 1.5, 2.0, 2.5]


@pytest.mark.parametrize("end", [Phase.FAILED, Phase.LANDED, Phase.RELEASED, Phase.LOST])
def test_a_silent_end_leaves_only_heartbeats_due(rig: Any, end: Phase) -> None:
    if end is Phase.FAILED:
        rig.vehicle.autopilot = mav.MAV_AUTOPILOT_PPZ
    elif end is Phase.LANDED:
        rig.reach(Phase.LANDING)
    elif end is Phase.RELEASED:
        rig.reach(Phase.HOLDING)
        rig.vehicle.mode = 3 << 16
    else:
        rig.reach(Phase.TAKING_OFF)
        rig.vehicle.silent = True
    rig.until_phase(end)
    rig.vehicle.silent = True
    rig.run(10.0)
    start = rig.session.next_deadline
    for _ in range(5):
        rig.session.poll(rig.session.next_deadline)
    assert rig.session.next_deadline == pytest.approx(start + 5.0)


def test_traffic_is_every_frame_of_both_directions_in_order(rig: Any) -> None:
    crossed: list[bytes] = []

    def note(frames: list[bytes]) -> list[bytes]:
        crossed.extend(frames)
        return frames

    rig.down, rig.up = note, note
    rig.reach(Phase.ENGAGED)
    recorded = rig.session.traffic()
    assert sorted(recorded) == sorted(crossed)
    per_sender = [[f for f in recorded if f[5] == system] for system in (1, 255)]
    assert per_sender == [[f for f in crossed if f[5] == system] for system in (1, 255)]
    assert rig.session.traffic() == []


def test_status_texts_are_events(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.vehicle.say("Ready for takeoff!\t")
    rig.run(0.1)
    assert rig.texts(EventKind.TEXT) == ["Ready for takeoff!"]


def test_long_texts_are_joined() -> None:
    texts = TextAssembler()
    assert texts.add("short\t", 0, 0) == "short"
    assert texts.add("a" * 50, 7, 0) is None
    assert texts.add("b" * 50, 7, 1) is None
    assert texts.add("c\t", 7, 2) == "a" * 50 + "b" * 50 + "c"
    assert texts.add("x" * 50, 8, 1) is None
    assert texts.add("whole", 9, 0) == "whole"


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_senseless_settings_are_refused_by_name(value: float) -> None:
    with pytest.raises(ValueError, match="ack_timeout_s must be positive"):
        SessionSettings(ack_timeout_s=value)


def test_px4_modes_and_commands() -> None:
    adapter = Px4()
    modes = adapter.modes
    assert (modes.engaged, modes.take_off, modes.hold) == (0x60000, 0x2040000, 0x3040000)
    assert (modes.comeback, modes.land) == (0x5040000, 0x6040000)
    command = adapter.set_mode(modes.land)
    assert command.parameters[:3] == (1.0, 4.0, 6.0)
    assert command.name == "DO_SET_MODE AUTO.LAND"
    assert modes.name(0x7F0000) == "mode 0x7f0000"


def test_px4_is_known() -> None:
    adapter = adapter_for(mav.MAV_AUTOPILOT_PX4)
    assert adapter is not None and adapter.name == "px4"
    assert adapter is not adapter_for(mav.MAV_AUTOPILOT_PX4)
    assert adapter_for(mav.MAV_AUTOPILOT_PPZ) is None
    assert autopilot_name(250) == "autopilot 250"


def test_px4_cannot_take_off_or_steer_without_home() -> None:
    with pytest.raises(ValueError, match="home"):
        Px4().take_off(Telemetry(), 20.0, SessionSettings())
    with pytest.raises(ValueError, match="home"):
        Px4().setpoint(Encoder(255, 190), 1, Telemetry(), (0.0, 0.0), 20.0)
