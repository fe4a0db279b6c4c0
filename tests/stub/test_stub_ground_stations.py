"""What ground stations do beside flying, as MAVProxy and QGroundControl do it: files, home, fence, forced arming."""

import struct
from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
AUTOPILOTS = pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
HEADER = struct.Struct("<HBBBBBxI")
OPEN, TERMINATE, RESET, ACK, NAK, NO_SUCH_FILE = 4, 1, 2, 128, 129, 10
GEOFENCE: int = mav.MAV_SYS_STATUS_GEOFENCE


def transfer(s: Any, sequence: int, opcode: int, data: bytes, target: int = 1) -> list[tuple[Any, ...]]:
    """Send one request of session 7 for offset 3; the answers, header and first byte of data."""
    before = len(s.all(110))
    request = HEADER.pack(sequence, 7, opcode, len(data), 0, 0, 3) + data
    s.send(mav.MAVLink_file_transfer_protocol_message(0, target, 1, request.ljust(251, b"\0")))
    answers = s.all(110)[before:]
    assert all((f.target_system, f.target_component) == (255, 190) for _, f in answers)
    return [(*HEADER.unpack_from(bytes(f.payload)), f.payload[12]) for _, f in answers]


@AUTOPILOTS
def test_a_file_is_refused_at_once_and_a_session_ended(station: Make, autopilot: str) -> None:
    s = station(autopilot=autopilot)
    s.run(2.0)
    refused = (6, 7, NAK, 1, OPEN, 0, 3, NO_SUCH_FILE)
    assert transfer(s, 5, OPEN, b"@PARAM/param.pck") == [refused]
    assert transfer(s, 65535, TERMINATE, b"") == [(0, 7, ACK, 0, TERMINATE, 0, 3, 0)]
    assert transfer(s, 8, RESET, b"") == [(9, 7, ACK, 0, RESET, 0, 3, 0)]
    assert transfer(s, 9, OPEN, b"@PARAM/param.pck", target=2) == []


@pytest.mark.parametrize(
    ("autopilot", "result"), [("px4", mav.MAV_RESULT_DENIED), ("ardupilot", mav.MAV_RESULT_FAILED)]
)
def test_home_is_told_when_asked_for_in_the_older_way(station: Make, autopilot: str, result: int) -> None:
    s = station(autopilot=autopilot)
    assert s.command(mav.MAV_CMD_GET_HOME_POSITION) == [result]
    s.run(25.0)
    before = len(s.all(242))
    assert s.command(mav.MAV_CMD_GET_HOME_POSITION) == [0]
    assert len(s.all(242)) == before + 1
    assert s.last(242).altitude == 488000


@pytest.mark.parametrize(
    ("autopilot", "result"), [("px4", mav.MAV_RESULT_DENIED), ("ardupilot", mav.MAV_RESULT_FAILED)]
)
@pytest.mark.parametrize("message_id", [300, 395, 397, 435])
def test_a_message_that_it_lacks_is_refused_in_the_firmwares_way(
    station: Make, autopilot: str, result: int, message_id: int
) -> None:
    """PROTOCOL_VERSION, COMPONENT_INFORMATION, COMPONENT_METADATA, AVAILABLE_MODES."""
    assert station(autopilot=autopilot).command(512, message_id) == [result]


def test_ardupilots_status_tells_the_fence_present_enabled_and_healthy(station: Make) -> None:
    s = station(autopilot="ardupilot")
    s.run(45.0)

    def fence() -> tuple[bool, bool, bool]:
        s.command(512, 1)
        f = s.last(1)
        names = ("present", "enabled", "health")
        present, enabled, healthy = (
            bool(getattr(f, f"onboard_control_sensors_{n}") & GEOFENCE) for n in names
        )
        return present, enabled, healthy

    assert fence() == (True, False, True)
    s.command(mav.MAV_CMD_DO_FENCE_ENABLE, 1)
    assert fence() == (True, True, True)
    s.send(mav.MAVLink_mission_count_message(1, 1, 1, 1))
    s.send(
        mav.MAVLink_mission_item_int_message(1, 1, 0, 0, 5004, 0, 1, 30, 0, 0, 0, 473977000, 85456000, 0, 1)
    )
    assert fence() == (True, True, False)
    s.command(mav.MAV_CMD_DO_FENCE_ENABLE, 0)
    assert fence() == (True, False, True)
    s.set_parameter("FENCE_TYPE", 0)
    assert fence() == (False, False, True)


def test_ardupilot_arms_without_checks_by_its_own_magic_number(station: Make) -> None:
    s = station(autopilot="ardupilot")
    s.run(5.0)
    assert s.command(400, 1, 21196) == [mav.MAV_RESULT_FAILED]
    assert s.command(400, 1, 2989) == [0]
    assert s.vehicle.armed


def test_px4_streams_what_a_ground_station_shows(station: Make) -> None:
    """The receiver's fix, and speed, heading and climb rate."""
    s = station(tick_s=0.01)
    s.run(5.0)
    last_second = [fields.message_id for time, fields in s.heard if time > 4.0]
    assert (last_second.count(24), last_second.count(74)) == (8, 10)
    assert s.last(24).fix_type == mav.GPS_FIX_TYPE_3D_FIX
