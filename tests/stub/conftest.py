"""A ground station of a few lines: raw frames to and from a stub fleet, in virtual time."""

import math
import struct
from collections.abc import Callable
from typing import Any

import pytest

from sim_vehicle_stub.chatter import MESSAGES
from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.pilot import Limits
from swarmctl.core.geodesy import to_geodetic
from swarmctl.mavlink.codec import Decoder, Encoder, Frame
from swarmctl.mavlink.dialect import mav

ORIGIN = (47.3977, 8.5456, 488.0)
Z_AND_VELOCITY = 1 | 2 | 32 | 64 | 128 | 256 | 2048


class Station:
    """Drives a fleet tick by tick and remembers every frame of its first vehicle with the time it came."""

    def __init__(
        self,
        pads: list[tuple[float, float]],
        limits: Limits | None,
        tick_s: float,
        hello: bool,
        chatter: bool,
        **others: Any,
    ) -> None:
        self.fleet = StubFleet(len(pads), origin=ORIGIN, pads_m=pads, limits=limits, **others)
        for vehicle in () if chatter else self.fleet.vehicles:
            for message_id in MESSAGES:
                vehicle.set_interval(message_id, -1)
        self.vehicle = self.fleet.vehicles[0]
        self.encoder = Encoder(255, 190)
        self.decoder = Decoder()
        self.heard: list[tuple[float, Frame]] = []
        self.now = 0.0
        self.tick_s = tick_s
        self._ticks = 0
        self.fleet.advance(0.0)
        if hello:
            self.beat()
        self.listen()

    def send(self, message: Any) -> None:
        self.send_raw(self.encoder.encode(message))

    def send_raw(self, data: bytes) -> None:
        self.vehicle.receive(data, self.now)
        self.listen()

    def listen(self) -> None:
        for raw in self.vehicle.outgoing():
            frames = self.decoder.feed(raw)
            assert len(frames) == 1, "one frame is one datagram"
            self.heard += [(self.now, frame) for frame in frames]

    def tick(self) -> None:
        self._ticks += 1
        self.now = round(self._ticks * self.tick_s, 6)
        self.fleet.advance(self.now)
        self.listen()

    def run(self, seconds: float, each: Callable[[], None] | None = None, every: float = 0.1) -> None:
        """Let time pass; ``each`` is called ``every`` so many seconds."""
        end = self.now + seconds - 1e-9
        due = self.now
        while self.now < end:
            if each and self.now >= due - 1e-9:
                each()
                due += every
            self.tick()

    def run_until(
        self, condition: Callable[[], bool], limit: float, each: Callable[[], None] | None = None
    ) -> float:
        """Let time pass until ``condition``; the seconds it took."""
        start = self.now
        while not condition():
            assert self.now - start < limit, "it never happened"
            if each:
                each()
            self.tick()
        return self.now - start

    def command(self, number: int, *parameters: float, target: int = 1) -> list[int]:
        """Send a COMMAND_LONG; the results acknowledged at once."""
        filled = [*parameters, *[math.nan] * (7 - len(parameters))]
        before = len(self.heard)
        self.send(mav.MAVLink_command_long_message(target, 1, number, 0, *filled))
        return [
            f.fields.result
            for _, f in self.heard[before:]
            if f.message_id == 77 and f.fields.command == number
        ]

    def set_mode(self, mode: int) -> list[int]:
        return self.command(mav.MAV_CMD_DO_SET_MODE, 1, mode >> 16 & 0xFF, mode >> 24)

    def arm(self) -> list[int]:
        return self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def beat(self) -> None:
        """A ground station's heartbeat."""
        self.send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, 4, 3))

    def set_parameter(self, name: str, value: float) -> None:
        """As a client that knows the firmware's encoding would."""
        before = len(self.all(22))
        self.send(mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
        kind = self.all(22)[before][1].param_type
        if kind == mav.MAV_PARAM_TYPE_INT32 and self.vehicle.personality.tells_parameter_errors:
            (value,) = struct.unpack("<f", struct.pack("<i", value))
        self.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, kind))

    def setpoint(
        self,
        v_north: float = 0.0,
        v_east: float = 0.0,
        z: float = 0.0,
        *,
        mask: int = Z_AND_VELOCITY,
        frame: int = 1,
        xy: tuple[float, float] = (0.0, 0.0),
        vz: float = 0.0,
        yaw: float = 0.0,
    ) -> None:
        self.send_raw(
            self.encoder.set_position_target_local_ned(
                0, 1, 1, frame, mask, xy[0], xy[1], z, v_north, v_east, vz, 0.0, 0.0, 0.0, yaw, 0.0
            )
        )

    def put_fence(self, west: float, east: float) -> int:
        """A box on board, 100 m from north to south; the result that it is acknowledged with."""
        corners = [to_geodetic(e, n, *ORIGIN) for e, n in ((west, -50), (east, -50), (east, 50), (west, 50))]
        self.send(mav.MAVLink_mission_count_message(1, 1, 4, mav.MAV_MISSION_TYPE_FENCE))
        for number, (lat, lon) in enumerate(corners):
            self.send(
                mav.MAVLink_mission_item_int_message(
                    1, 1, number, 0, mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, 0, 0, 4, 0, 0, 0,
                    round(lat * 1e7), round(lon * 1e7), 0, mav.MAV_MISSION_TYPE_FENCE,
                )
            )  # fmt: skip
        return int(self.last(47).type)

    def all(self, message_id: int) -> list[tuple[float, Any]]:
        return [(time, frame.fields) for time, frame in self.heard if frame.message_id == message_id]

    def last(self, message_id: int) -> Any:
        return self.all(message_id)[-1][1]

    def texts(self) -> list[str]:
        return [fields.text for _, fields in self.all(253)]

    @property
    def mode(self) -> int:
        return self.vehicle.personality.custom_mode

    @property
    def body(self) -> Any:
        return self.fleet.truth[0]

    def fly_up(self, height: float) -> None:
        """Boot, take off, loiter."""
        self.run(5.0)
        assert self.command(mav.MAV_CMD_NAV_TAKEOFF, *[math.nan] * 6, ORIGIN[2] + height) == [0]
        assert self.arm() == [0]
        self.run_until(lambda: self.mode == 0x3040000, 60.0)
        self.run(5.0)

    def fly_guided(self, height: float) -> None:
        """ArduPilot: wait for the position, arm in GUIDED, take off."""
        self.run(42.0)
        assert self.command(mav.MAV_CMD_DO_SET_MODE, 1, 4) == [0]
        assert self.arm() == [0]
        assert self.command(mav.MAV_CMD_NAV_TAKEOFF, *[math.nan] * 6, height) == [0]
        self.run_until(lambda: self.body["up"] > height - 0.2, 60.0)
        self.run(2.0)

    def fly_offboard(self, height: float) -> None:
        """Take off and switch to OFFBOARD, standing still."""
        self.fly_up(height)
        self.run(0.5, lambda: self.setpoint(z=-height))
        assert self.set_mode(0x60000) == [0, 0]


@pytest.fixture
def station() -> Callable[..., Station]:
    """Make a station; one vehicle at the origin unless told otherwise, its chatter turned off."""

    def make(
        pads: list[tuple[float, float]] | None = None,
        limits: Limits | None = None,
        tick_s: float = 0.1,
        hello: bool = True,
        chatter: bool = False,
        **others: Any,
    ) -> Station:
        return Station(pads or [(0.0, 0.0)], limits, tick_s, hello, chatter, **others)

    return make
