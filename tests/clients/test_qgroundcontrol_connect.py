"""What QGroundControl asks a vehicle when it connects, in virtual time: every question is answered, and quickly.

QGroundControl itself cannot run here, so its questions are asked one after the other, through pymavlink's own
parser.  It waits 1 to 3 s for each answer and asks again a few times, so that silence delays it by many
seconds; a refusal it takes as an answer and goes on.  Here nothing may take longer than half a second of the
vehicle's time.
"""

import struct
from collections.abc import Callable
from typing import Any

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as dialect

from sim_vehicle_stub.fleet import StubFleet

ORIGIN = (47.3977, 8.5456, 488.0)
TICK_S = 0.02
ANSWERED_WITHIN_S = 0.5
BOOTED_BEFORE_S = 45.0
PROTOCOL_VERSION, COMPONENT_INFORMATION, COMPONENT_METADATA, AVAILABLE_MODES = 300, 395, 397, 435
STREAM_GROUPS = {1: 2, 2: 2, 3: 2, 6: 3, 10: 10, 11: 10, 12: 3}
"""Hz for each MAV_DATA_STREAM that QGroundControl asks of ArduPilot."""
SHOWN = {
    "HEARTBEAT",
    "SYS_STATUS",
    "GPS_RAW_INT",
    "ATTITUDE",
    "GLOBAL_POSITION_INT",
    "VFR_HUD",
    "BATTERY_STATUS",
}
"""What its displays are made of."""


class Station:
    """A ground station connected to one vehicle, which was switched on a while before."""

    def __init__(self, autopilot: str) -> None:
        self.now = 0.0
        self.heard: list[Any] = []
        self.fleet = StubFleet(
            1, origin=ORIGIN, pads_m=[(0.0, 0.0)], autopilot=autopilot, now=-BOOTED_BEFORE_S
        )
        self.vehicle = self.fleet.vehicles[0]
        self._packer = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
        self._parser = dialect.MAVLink(None)
        self.tick()

    def tick(self) -> None:
        self.now += TICK_S
        self.fleet.advance(self.now)
        for datagram in self.vehicle.outgoing():
            self.heard += self._parser.parse_buffer(datagram) or []

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.tick()

    def send(self, message: Any) -> None:
        self.vehicle.receive(message.pack(self._packer), self.now)

    def ask(self, question: Any, answers: Callable[[Any], bool]) -> Any:
        """The first answer to a question; none in time is a failure."""
        begin, end = len(self.heard), self.now + ANSWERED_WITHIN_S
        self.send(question)
        while self.now < end:
            self.tick()
            for message in self.heard[begin:]:
                if answers(message):
                    return message
        raise AssertionError(f"no answer within {ANSWERED_WITHIN_S} s to {question}")

    def command(self, number: int, *parameters: float) -> int:
        """The result of a COMMAND_LONG to the autopilot."""
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        question = dialect.MAVLink_command_long_message(1, 1, number, 0, *filled)
        ack = self.ask(question, lambda m: m.get_type() == "COMMAND_ACK" and m.command == number)
        return int(ack.result)

    def last(self, name: str) -> Any:
        return next(m for m in reversed(self.heard) if m.get_type() == name)


@pytest.fixture(params=["px4", "ardupilot"])
def station(request: pytest.FixtureRequest) -> Station:
    return Station(request.param)


def is_px4(station: Station) -> bool:
    return bool(station.last("HEARTBEAT").autopilot == dialect.MAV_AUTOPILOT_PX4)


def test_heartbeat_tells_a_mode_that_has_a_name(station: Station) -> None:
    station.run(2.0)
    mode = mavutil.mode_string_v10(station.last("HEARTBEAT"))
    assert mode == ("LOITER" if is_px4(station) else "STABILIZE")


def test_its_version_is_told_and_what_it_lacks_is_refused(station: Station) -> None:
    station.run(2.0)
    assert station.command(512, dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == 0
    version = station.last("AUTOPILOT_VERSION")
    assert version.flight_sw_version >> 16 == (0x0111 if is_px4(station) else 0x0408)
    kinds = dialect.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE | dialect.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    assert version.capabilities & kinds == kinds
    refusal = dialect.MAV_RESULT_DENIED if is_px4(station) else dialect.MAV_RESULT_FAILED
    for message_id in (PROTOCOL_VERSION, AVAILABLE_MODES, COMPONENT_METADATA, COMPONENT_INFORMATION):
        assert station.command(512, message_id) == refusal


def test_the_parameters_come_as_a_list_after_a_file_was_refused(station: Station) -> None:
    station.run(2.0)
    name = b"@PARAM/param.pck"
    request = struct.pack("<HBBBBBxI", 1, 0, 4, len(name), 0, 0, 0) + name
    refused = station.ask(
        dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, request.ljust(251, b"\0")),
        lambda m: m.get_type() == "FILE_TRANSFER_PROTOCOL",
    )
    assert refused.payload[3] == dialect.MAV_FTP_OPCODE_NAK
    if is_px4(station):  # asks whether the list that it kept from last time still holds
        hash_question = dialect.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1)
        station.ask(hash_question, lambda m: m.get_type() in ("PARAM_VALUE", "PARAM_ERROR"))

    numbers: set[int] = set()

    def complete(message: Any) -> bool:
        if message.get_type() != "PARAM_VALUE":
            return False
        numbers.add(message.param_index)
        return len(numbers) == int(message.param_count)

    station.ask(dialect.MAVLink_param_request_list_message(1, 0), complete)
    assert numbers == set(range(len(station.vehicle.parameters)))


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_mission_fence_and_rally_points_are_counted(station: Station, kind: int) -> None:
    station.run(2.0)
    count = station.ask(
        dialect.MAVLink_mission_request_list_message(1, 1, kind),
        lambda m: m.get_type() == "MISSION_COUNT" and m.mission_type == kind,
    )
    assert (count.count, count.target_system, count.target_component) == (0, 255, 190)


def test_home_and_the_streams_that_it_shows(station: Station) -> None:
    station.run(2.0)
    assert station.command(512, dialect.MAVLINK_MSG_ID_HOME_POSITION) == 0
    assert station.command(dialect.MAV_CMD_GET_HOME_POSITION) == 0
    assert station.last("HOME_POSITION").altitude == 488000
    for message_id in (dialect.MAVLINK_MSG_ID_HOME_POSITION, dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE):
        assert station.command(511, message_id, 1_000_000) == 0
    if not is_px4(station):
        for group, rate_hz in STREAM_GROUPS.items():
            station.send(dialect.MAVLink_request_data_stream_message(1, 1, group, rate_hz, 1))
    station.heard.clear()
    station.run(3.0)
    names = [message.get_type() for message in station.heard]
    assert set(names) >= SHOWN
    assert (names.count("HOME_POSITION"), names.count("EXTENDED_SYS_STATE")) == (3, 3)


def test_an_unknown_command_is_refused_and_no_answer_would_be_noticed(station: Station) -> None:
    station.run(2.0)
    assert station.command(31999) == dialect.MAV_RESULT_UNSUPPORTED
    station.vehicle.network.impair(up_cut=True)
    with pytest.raises(AssertionError, match="no answer within"):
        station.command(31999)
