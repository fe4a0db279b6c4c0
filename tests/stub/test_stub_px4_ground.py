"""PX4 on the ground: each test plays one row of the table of what real autopilots do."""

import math
import struct
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sim_vehicle_stub.pilot import Limits
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]


@pytest.mark.row("px4-rates")
def test_rates_404_messages_a_second_run_unasked(station: Make) -> None:
    s = station(tick_s=0.01, chatter=True)
    s.run(8.0)
    counts = Counter(frame.message_id for time, frame in s.heard if time > 4.0)
    assert (counts[30], counts[33], counts[1], counts[0]) == (400, 200, 20, 4)
    assert counts[32] == pytest.approx(120, abs=1)
    assert counts.total() / 4.0 == pytest.approx(404.0, rel=0.01)


@pytest.mark.row("px4-rates")
def test_rates_an_interval_is_kept_to_the_tick(station: Make) -> None:
    s = station()
    s.run(3.0)
    assert s.command(511, 33, 100_000) == [0]
    assert s.command(511, 30, -1) == [0]
    s.run(10.0)
    times = [time for time, _ in s.all(33) if time > 3.0]
    assert len(times) == 100
    assert np.allclose(np.diff(times), 0.1)
    assert not [time for time, _ in s.all(30) if time > 3.0]
    assert s.command(511, 30, 0) == [0]
    s.run(1.0)
    assert [time for time, _ in s.all(30) if time > 13.0]


@pytest.mark.row("px4-rates")
@pytest.mark.parametrize("message_id", [65000.0, math.nan, 33.5])
def test_rates_an_interval_for_what_does_not_exist_fails(station: Make, message_id: float) -> None:
    assert station().command(511, message_id, 100_000) == [mav.MAV_RESULT_FAILED]


@pytest.mark.row("px4-statustext")
def test_statustext_comes_only_after_a_ground_station_was_heard(station: Make) -> None:
    s = station(hello=False)
    s.arm()
    assert s.texts() == []
    s.send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4, 3))
    s.arm()
    assert s.texts() == []
    s.send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
    s.arm()
    assert s.texts()


@pytest.mark.row("px4-statustext")
def test_statustext_is_cut_into_chunks_that_end_in_a_tab(station: Make) -> None:
    s = station()
    s.vehicle.say(6, "x" * 70)
    s.vehicle.say(6, "short")
    s.listen()
    chunks = [(f.text, f.id, f.chunk_seq) for _, f in s.all(253)]
    assert chunks == [("x" * 50, 1, 0), ("x" * 20 + "\t", 1, 1), ("short\t", 0, 0)]


@pytest.mark.row("px4-origin")
def test_origin_is_told_once_and_on_request(station: Make) -> None:
    s = station(pads=[(300.0, 400.0)])
    assert s.command(512, 49) == [mav.MAV_RESULT_DENIED]
    s.run(20.0)
    assert len(s.all(49)) == 1
    assert s.command(512, 49) == [0]
    assert len(s.all(49)) == 2
    origin, position = s.last(49), s.last(33)
    assert (origin.latitude, origin.longitude) == (position.lat, position.lon)
    assert origin.altitude == 488000


@pytest.mark.row("px4-origin")
def test_origin_home_lies_on_the_grid_of_float32(station: Make) -> None:
    s = station(pads=[(300.0, 400.0)])
    s.run(4.0)
    home = s.last(242)
    assert home.latitude == round(float(np.float32(home.latitude / 1e7)) * 1e7)
    assert 0 < abs(home.latitude - s.last(33).lat) < 40
    assert home.altitude == 488000


def test_before_the_fix_no_position_is_told(station: Make) -> None:
    s = station()
    s.run(1.5)
    assert not s.all(33)
    assert not s.all(32)
    assert not s.last(1).onboard_control_sensors_health & mav.MAV_SYS_STATUS_SENSOR_GPS


@pytest.mark.row("px4-projection")
@pytest.mark.parametrize(("metres", "off"), [(100.0, 0.2), (1000.0, 2.1)])
def test_projection_is_spherical_and_2_m_off_at_1_km(station: Make, metres: float, off: float) -> None:
    s = station()
    s.run(3.0)
    s.fleet.truth["east"][0] = s.fleet.truth["north"][0] = metres / math.sqrt(2.0)
    s.tick()
    place = math.hypot(s.last(32).x - s.body["north"], s.last(32).y - s.body["east"])
    assert place == pytest.approx(off, abs=0.05)


@pytest.mark.row("px4-mode-numbers")
def test_mode_numbers(station: Make) -> None:
    s = station()
    s.fly_offboard(10.0)
    for mode in (0x60000, 0x3040000, 0x6040000, 0x5040000):
        s.setpoint(z=-10.0)
        assert s.set_mode(mode) == [0, 0]
        s.command(512, 0)
        assert s.last(0).custom_mode == mode
        assert s.last(0).base_mode & 1


@pytest.mark.row("px4-mode-change")
def test_mode_change_is_acknowledged_twice_and_the_second_tells_the_truth(station: Make) -> None:
    s = station()
    assert s.set_mode(0x5040000) == [0, mav.MAV_RESULT_TEMPORARILY_REJECTED]
    s.run(5.0)
    assert s.set_mode(0x3040000) == [0, 0]
    assert s.command(176, 1, 99, 0) == [0, mav.MAV_RESULT_DENIED]
    assert s.command(176, 1, math.nan, math.nan) == [0, mav.MAV_RESULT_DENIED]


@pytest.mark.row("px4-mode-change")
def test_mode_change_is_told_at_once_by_current_mode_and_within_a_second_by_heartbeat(station: Make) -> None:
    s = station()
    s.run(5.25)
    beats, told = len(s.all(0)), len(s.all(436))
    assert s.set_mode(0x60000) == [0, 0]
    assert [f.custom_mode for _, f in s.all(436)[told:]] == [0x60000]
    assert len(s.all(0)) == beats
    s.run(1.0)
    assert [f.custom_mode for _, f in s.all(0)[beats:]] == [0x60000]
    assert s.command(512, 436) == [0]
    assert s.last(436).intended_custom_mode == 0x60000


@pytest.mark.row("px4-ready")
def test_ready_to_arm_some_seconds_after_boot(station: Make) -> None:
    s = station()
    s.run(4.3)
    assert s.arm() == [mav.MAV_RESULT_TEMPORARILY_REJECTED]
    assert not s.last(1).onboard_control_sensors_health & 0x10000000
    s.run(0.4)
    status = s.last(1)
    assert status.onboard_control_sensors_health & 0x10000000
    assert not (status.onboard_control_sensors_present | status.onboard_control_sensors_enabled) & 0x10000000
    assert s.arm() == [0]
    s.run(1.0)
    assert s.last(0).base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
    assert s.last(0).system_status == mav.MAV_STATE_ACTIVE


@pytest.mark.row("px4-ready")
def test_ready_to_arm_disarms_itself_without_takeoff(station: Make) -> None:
    s = station()
    s.run(5.0)
    s.arm()
    s.run(9.8)
    assert s.vehicle.armed
    s.run(0.3)
    assert not s.vehicle.armed


@pytest.mark.row("px4-offboard")
def test_offboard_is_accepted_disarmed_without_a_stream_but_not_arming(station: Make) -> None:
    s = station()
    s.run(5.0)
    assert s.set_mode(0x60000) == [0, 0]
    assert s.mode == 0x60000
    assert s.arm() == [mav.MAV_RESULT_TEMPORARILY_REJECTED]
    s.run(0.4, s.setpoint)
    assert s.arm() == [0]


def test_no_answer_for_another_system_and_none_to_setpoints(station: Make) -> None:
    s = station()
    s.run(5.0)
    before = len(s.heard)
    assert s.command(400, 1, target=2) == []
    s.setpoint()
    s.send(mav.MAVLink_param_request_list_message(9, 1))
    assert len(s.heard) == before
    assert not s.vehicle.armed
    assert s.command(400, 1, target=0) == [0]


def test_an_unknown_command_is_unsupported(station: Make) -> None:
    assert station().command(31000, 1) == [mav.MAV_RESULT_UNSUPPORTED]


def test_version_and_battery_on_request(station: Make) -> None:
    s = station()
    assert s.command(512, 148) == [0]
    assert s.last(148).capabilities & mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    assert s.last(148).capabilities & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert s.last(148).flight_sw_version >> 16 == 0x0111
    assert s.command(512, 147) == [0]
    assert s.last(147).battery_remaining == 100
    assert s.command(512, 65000) == [mav.MAV_RESULT_DENIED]


def test_garbage_and_a_lone_zero_message_change_nothing(station: Make) -> None:
    s = station()
    s.send_raw(b"\xfd\xff\x00garbage")
    s.send_raw(bytes(300))
    assert s.arm() == [mav.MAV_RESULT_TEMPORARILY_REJECTED]


class TestParameters:
    """Integers cross bytewise; an unknown name is answered with PARAM_ERROR at once."""

    def ask(self, s: Any, name: bytes, index: int = -1) -> Any:
        before = len(s.heard)
        s.send(mav.MAVLink_param_request_read_message(1, 1, name, index))
        [(_, frame)] = s.heard[before:]
        return frame

    def test_read_by_name_and_by_index(self, station: Make) -> None:
        s = station(limits=Limits(speed_mps=25.0))
        value = self.ask(s, b"MPC_XY_VEL_MAX").fields
        assert (value.param_value, value.param_type) == (25.0, mav.MAV_PARAM_TYPE_REAL32)
        assert self.ask(s, b"", value.param_index).fields.param_id == "MPC_XY_VEL_MAX"

    def test_integers_cross_bytewise(self, station: Make) -> None:
        s = station()
        value = self.ask(s, b"GF_ACTION").fields
        assert value.param_type == mav.MAV_PARAM_TYPE_INT32
        assert struct.unpack("<i", struct.pack("<f", value.param_value)) == (2,)
        (wire,) = struct.unpack("<f", struct.pack("<i", 3))
        s.send(mav.MAVLink_param_set_message(1, 1, b"GF_ACTION", wire, mav.MAV_PARAM_TYPE_INT32))
        assert s.vehicle.parameters["GF_ACTION"] == 3

    def test_list_gives_every_parameter_once(self, station: Make) -> None:
        s = station()
        s.send(mav.MAVLink_param_request_list_message(1, 1))
        values = [fields for _, fields in s.all(22)]
        assert [v.param_index for v in values] == list(range(values[0].param_count))
        assert len({v.param_id for v in values}) == len(values) >= 8

    def test_an_unknown_one_is_answered_with_an_error(self, station: Make) -> None:
        s = station()
        assert self.ask(s, b"NO_SUCH").message_id == 345
        assert self.ask(s, b"", 999).fields.error == mav.MAV_PARAM_ERROR_DOES_NOT_EXIST
        s.send(mav.MAVLink_param_set_message(1, 1, b"NO_SUCH", 1.0, 9))
        assert s.last(345).param_id == "NO_SUCH"

    @pytest.mark.parametrize(("value", "kind"), [(math.nan, 9), (math.inf, 9), (3.0, 6)])
    def test_a_wrong_value_or_type_is_refused(self, station: Make, value: float, kind: int) -> None:
        s = station()
        s.send(mav.MAVLink_param_set_message(1, 1, b"MPC_XY_VEL_MAX", value, kind))
        assert s.last(345).error == mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
        assert s.vehicle.parameters["MPC_XY_VEL_MAX"] == 12.0


def test_two_vehicles_have_their_own_ids_and_sequences(station: Make) -> None:
    s = station(pads=[(0.0, 0.0), (20.0, 0.0)])
    first, second = s.fleet.vehicles
    s.run(3.0)
    frames = [s.decoder.feed(raw)[0] for raw in second.outgoing()]
    assert {frame.system for frame in frames} == {2}
    assert s.decoder.lost == 0
    assert first.wire[1] < second.wire[1]
    second.receive(Encoder(255, 190).encode(mav.MAVLink_param_request_list_message(1, 1)), s.now)
    assert second.outgoing() == []
