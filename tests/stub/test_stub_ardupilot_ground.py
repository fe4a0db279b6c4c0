"""ArduPilot on the ground: each test plays one row of the table of what real autopilots do."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
FAILED: int = mav.MAV_RESULT_FAILED
STABILIZE, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE, SMART_RTL = 0, 3, 4, 5, 6, 9, 17, 21
NAN = math.nan


@pytest.fixture
def pilot(station: Make) -> Make:
    return lambda **others: station(autopilot="ardupilot", **others)


def mode(s: Any, number: int) -> list[int]:
    results: list[int] = s.command(mav.MAV_CMD_DO_SET_MODE, 1, number)
    return results


@pytest.mark.row("ardupilot-streams")
def test_streams_only_heartbeat_text_timesync_and_a_few_parameters_come_unasked(pilot: Make) -> None:
    s = pilot()
    s.run(60.0)
    assert {frame.message_id for _, frame in s.heard} == {0, 22, 111, 253}
    assert len(s.all(0)) == 60
    assert 0 < len(s.all(22)) < 10


@pytest.mark.row("ardupilot-streams")
def test_streams_are_exact_and_lost_at_reboot(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    assert s.command(511, 33, 200_000) == [0]
    before = len(s.all(33))
    s.run(10.0)
    assert len(s.all(33)) - before == 50
    assert s.command(510, 33) == [0]
    assert s.last(244).interval_us == 200_000
    assert s.command(246, 1) == [0]
    s.tick()
    before, heartbeats = len(s.all(33)), len(s.all(0))
    s.run(10.0)
    assert len(s.all(33)) == before
    assert len(s.all(0)) > heartbeats
    assert s.vehicle.boot_ms < 10_000


@pytest.mark.row("ardupilot-streams")
def test_streams_the_older_request_sets_groups(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    s.send(mav.MAVLink_request_data_stream_message(1, 1, mav.MAV_DATA_STREAM_POSITION, 4, 1))
    s.run(2.0)
    assert (len(s.all(33)), len(s.all(32)), len(s.all(30))) == (8, 8, 0)
    s.send(mav.MAVLink_request_data_stream_message(1, 1, mav.MAV_DATA_STREAM_ALL, 4, 0))
    s.run(2.0)
    assert len(s.all(33)) == 8


@pytest.mark.row("ardupilot-ready")
def test_ready_heartbeat_home_checks_and_position_come_one_after_the_other(pilot: Make) -> None:
    s = pilot()
    for message in (1, 32, 33, 193, 242):
        s.command(511, message, 200_000)

    def first(message_id: int, condition: Callable[[Any], bool] = lambda fields: True) -> float:
        return next(time for time, fields in s.all(message_id) if condition(fields))

    s.run(50.0)
    assert first(0) == pytest.approx(1.0, abs=0.11)
    assert first(242) == pytest.approx(20.0, abs=0.3)
    assert first(1, lambda f: f.onboard_control_sensors_health & 0x10000000) == pytest.approx(23.0, abs=0.3)
    assert first(32) == pytest.approx(41.0, abs=0.3)
    assert first(193, lambda f: f.flags & 0x10) == pytest.approx(41.0, abs=0.3)
    assert s.last(193).flags == 0x33F
    assert (s.all(33)[0][1].lat, s.all(33)[0][1].lon) == (0, 0)
    assert s.last(33).lat == pytest.approx(473977000, abs=2)


@pytest.mark.row("ardupilot-ready")
def test_ready_guided_needs_the_position(pilot: Make) -> None:
    s = pilot()
    s.run(30.0)
    assert mode(s, GUIDED) == [0]
    assert s.arm() == [FAILED]
    assert s.texts()[-1] == "Arm: Need Position Estimate"
    s.command(512, 1)
    assert not s.last(1).onboard_control_sensors_health & 0x10000000
    s.run(12.0)
    s.command(512, 1)
    assert s.last(1).onboard_control_sensors_health & 0x10000000
    assert s.arm() == [0]


@pytest.mark.row("ardupilot-ready")
def test_ready_stabilize_arms_early_and_then_refuses_guided(pilot: Make) -> None:
    s = pilot()
    s.run(15.0)
    assert s.arm() == [FAILED]
    s.run(10.0)
    assert s.arm() == [0]
    assert mode(s, GUIDED) == [FAILED]
    assert s.texts()[-1] == "Mode change to GUIDED failed: requires position"
    assert s.mode == STABILIZE


@pytest.mark.row("ardupilot-modes")
def test_modes_have_their_numbers_and_a_wrong_one_fails(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    for number in (GUIDED, LOITER, RTL, LAND, BRAKE, SMART_RTL, STABILIZE):
        assert mode(s, number) == [0]
        s.command(512, 0)
        assert s.last(0).custom_mode == number
    assert mode(s, 99) == [FAILED]
    assert mode(s, AUTO) == [FAILED]
    s.send(mav.MAVLink_set_mode_message(1, 1, GUIDED))
    assert s.mode == GUIDED
    assert s.last(77).result == 0


@pytest.mark.parametrize("number", [RTL, LAND, BRAKE])
def test_a_mode_that_flies_by_itself_cannot_be_armed_in(pilot: Make, number: int) -> None:
    s = pilot()
    s.run(45.0)
    mode(s, number)
    assert s.arm() == [FAILED]
    assert s.texts()[-1].endswith("mode not armable")


@pytest.mark.row("ardupilot-takeoff")
def test_takeoff_disarms_itself_after_ten_seconds_without_one(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    mode(s, GUIDED)
    s.arm()
    s.run(9.8)
    assert s.vehicle.armed
    s.run(0.3)
    assert not s.vehicle.armed


@pytest.mark.row("ardupilot-takeoff")
@pytest.mark.parametrize(("armed", "number"), [(False, GUIDED), (True, STABILIZE)])
def test_takeoff_needs_guided_and_arming(pilot: Make, armed: bool, number: int) -> None:
    s = pilot()
    s.run(45.0)
    mode(s, number)
    if armed:
        s.arm()
    assert s.command(22, NAN, NAN, NAN, NAN, NAN, NAN, 10.0) == [FAILED]


@pytest.mark.row("ardupilot-no-answer")
def test_no_answer_silence_for_another_system_answers_for_any_component(pilot: Make) -> None:
    s = pilot()
    s.run(45.0)
    before = len(s.heard)
    assert s.command(400, 1, target=2) == []
    s.send(mav.MAVLink_set_mode_message(2, 1, GUIDED))
    s.setpoint(1.0)
    assert len(s.heard) == before
    assert s.command(176, 1, GUIDED, target=0) == [0]
    s.send(mav.MAVLink_command_long_message(1, 77, 176, 0, 1, BRAKE, 0, 0, 0, 0, 0))
    assert s.mode == BRAKE
    assert s.command(31000) == [mav.MAV_RESULT_UNSUPPORTED]


@pytest.mark.row("ardupilot-parameters")
class TestParameters:
    """New and old names, silence for others, integers as C casts them."""

    def read(self, s: Any, name: str) -> Any:
        before = len(s.heard)
        s.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
        return s.heard[-1][1].fields if len(s.heard) > before else None

    NEW = ("MAV_SYSID", "WP_SPD", "RTL_ALT_M", "LAND_SPD_MS", "ARMING_SKIPCHK")
    OLD = ("SYSID_THISMAV", "WPNAV_SPEED", "RTL_ALT", "LAND_SPEED", "ARMING_CHECK")

    def test_present_firmware_knows_the_new_names_alone(self, pilot: Make) -> None:
        s = pilot()
        assert [self.read(s, name).param_value for name in self.NEW] == [1.0, 10.0, 15.0, 0.5, 0.0]
        assert [self.read(s, name) for name in self.OLD] == [None] * 5

    def test_older_firmware_knows_the_old_names_in_centimetres(self, station: Make) -> None:
        s = station(autopilot="ardupilot-4.6")
        assert [self.read(s, name).param_value for name in self.OLD[:4]] == [1.0, 1000.0, 1500.0, 50.0]
        assert [self.read(s, name) for name in self.NEW] == [None] * 5
        s.command(512, 148)
        assert s.last(148).flight_sw_version >> 16 == 0x0406

    def test_integers_are_cast_and_their_type_does_not_matter(self, pilot: Make) -> None:
        s = pilot()
        assert self.read(s, "DISARM_DELAY").param_value == 10.0
        s.send(mav.MAVLink_param_set_message(1, 1, b"DISARM_DELAY", 7.0, mav.MAV_PARAM_TYPE_REAL32))
        assert s.last(22).param_value == 7.0
        assert s.last(22).param_type == mav.MAV_PARAM_TYPE_INT32

    @pytest.mark.parametrize("value", [math.nan, math.inf, 1e20])
    def test_no_number_is_ignored_silently(self, pilot: Make, value: float) -> None:
        s = pilot()
        before = len(s.heard)
        s.send(mav.MAVLink_param_set_message(1, 1, b"DISARM_DELAY", value, 6))
        assert len(s.heard) == before
        assert s.vehicle.parameters["DISARM_DELAY"] == 10


def test_a_client_that_asks_for_the_capabilities_and_the_time_is_answered(pilot: Make) -> None:
    s = pilot()
    s.run(2.0)
    assert s.command(520, 1) == [0]
    assert s.last(148).capabilities & mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    assert s.last(148).capabilities & mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    s.send(mav.MAVLink_timesync_message(0, 77))
    assert (s.last(111).ts1, s.last(111).tc1) == (77, 2_000_000_000)


@pytest.mark.row("ardupilot-local-frame")
def test_local_frame_is_the_vehicles_own(pilot: Make) -> None:
    s = pilot(pads=[(300.0, 400.0)])
    s.command(511, 32, 100_000)
    s.run(45.0)
    assert (s.last(32).x, s.last(32).y, s.last(32).z) == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    s.fleet.truth["east"][0] += 100.0
    s.run(0.2)
    assert (s.last(32).x, s.last(32).y) == pytest.approx((0.0, 100.0), abs=0.4)
