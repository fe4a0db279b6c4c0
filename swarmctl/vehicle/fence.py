"""The vehicle's own geofence: uploaded, read back and compared, vertex by vertex.

A transfer follows MAVLink's mission protocol.  Going up, the vehicle asks for one vertex after the other,
by MISSION_REQUEST_INT or, as ArduPilot does, MISSION_REQUEST; it is answered whatever it asks, as often as
it asks.  Coming down, we ask.  Nothing is sent here: ``take`` returns the replies to each message.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from swarmctl.mavlink.dialect import mav

from .commands import AUTOPILOT_COMPONENT

FENCE: int = mav.MAV_MISSION_TYPE_FENCE
GLOBAL: int = mav.MAV_FRAME_GLOBAL
INCLUSION: int = mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
EXCLUSION: int = mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
CIRCLE_EXCLUSION: int = mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
ACCEPTED: int = mav.MAV_MISSION_ACCEPTED

REQUESTS = (mav.MAVLINK_MSG_ID_MISSION_REQUEST, mav.MAVLINK_MSG_ID_MISSION_REQUEST_INT)
ACK: int = mav.MAVLINK_MSG_ID_MISSION_ACK
COUNT: int = mav.MAVLINK_MSG_ID_MISSION_COUNT
ITEM_INT: int = mav.MAVLINK_MSG_ID_MISSION_ITEM_INT
FENCE_MESSAGES = frozenset((*REQUESTS, ACK, COUNT, ITEM_INT))

# Answers to a message out of turn, or that another try may better; any other refusal is final.
_PASSING = (mav.MAV_MISSION_ERROR, mav.MAV_MISSION_INVALID_SEQUENCE, mav.MAV_MISSION_OPERATION_CANCELLED)
# Some firmwares keep degrees as floating-point numbers: a hundredth of a metre.
_TOLERANCE_E7 = 1
_TOLERANCE_M = 0.01

Polygon = Sequence[tuple[float, float]]


class Circle(NamedTuple):
    """A circle to stay out of: its centre in degrees, its radius in metres."""

    lat: float
    lon: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class Fence:
    """Where the vehicle may be: polygons of (latitude, longitude) in degrees, not closed; and circles, where not.

    Raises ``ValueError`` for a polygon of fewer than three vertices, or for no polygon at all.
    """

    inclusions: Sequence[Polygon]
    exclusions: Sequence[Polygon] = ()
    circles: Sequence[Circle] = ()

    def __post_init__(self) -> None:
        polygons = (*self.inclusions, *self.exclusions)
        if not polygons or any(len(polygon) < 3 for polygon in polygons):
            raise ValueError("a fence needs polygons of three vertices or more")

    def vertices(self) -> "list[Vertex]":
        """All vertices, in the order of transfer."""
        kinds = ((INCLUSION, self.inclusions), (EXCLUSION, self.exclusions))
        polygons = [
            Vertex(kind, len(polygon), round(lat * 1e7), round(lon * 1e7))
            for kind, polygons in kinds
            for polygon in polygons
            for lat, lon in polygon
        ]
        circles = [
            Vertex(CIRCLE_EXCLUSION, radius, round(lat * 1e7), round(lon * 1e7))
            for lat, lon, radius in self.circles
        ]
        return polygons + circles


_KINDS = {INCLUSION: "inclusion", EXCLUSION: "exclusion", CIRCLE_EXCLUSION: "exclusion circle"}


class Vertex(NamedTuple):
    """One vertex, or circle, as it crosses the link: MAV_CMD, its polygon's vertices or radius (m), degrees × 1e7."""

    command: int
    of: float
    lat_e7: int
    lon_e7: int

    def __str__(self) -> str:
        kind = _KINDS.get(self.command, f"command {self.command}")
        return f"{kind} of {self.of:g}, {self.lat_e7 / 1e7:.7f}, {self.lon_e7 / 1e7:.7f}"

    def equals(self, other: "Vertex") -> bool:
        """Whether the other is this one, but for rounding."""
        off_e7 = max(abs(self.lat_e7 - other.lat_e7), abs(self.lon_e7 - other.lon_e7))
        alike = self.command == other.command and abs(self.of - other.of) <= _TOLERANCE_M
        return off_e7 <= _TOLERANCE_E7 and alike


class FenceTransfer:
    """One fence on its way to the vehicle ``system``, and back."""

    def __init__(self, fence: Fence, system: int) -> None:
        self.vertices = fence.vertices()
        self.stored = False  #: the vehicle says that it has the whole fence
        self.refusal = ""  #: why it will not
        self._system = system
        self._count: int | None = None
        self._read: dict[int, Vertex] = {}

    def take(self, message_id: int, fields: Any) -> tuple[Any, ...]:
        """The replies to one of ``FENCE_MESSAGES``."""
        if fields.mission_type != FENCE:
            return ()
        if message_id in REQUESTS:
            return (self._item(fields.seq),) if fields.seq < len(self.vertices) else ()
        if message_id == ACK:
            return self._acknowledged(fields.type)
        if message_id == COUNT:
            return self._counted(fields.count)
        return self._received(fields)

    def _acknowledged(self, result: int) -> tuple[Any, ...]:
        """MISSION_ACK: stored, or not."""
        if result == ACCEPTED:
            self.stored = True
        elif result not in _PASSING:
            entry = mav.enums["MAV_MISSION_RESULT"].get(result)
            self.refusal = f"refused: {entry.name if entry else result}".replace("MAV_MISSION_", "")
        return ()

    def _counted(self, count: int) -> tuple[Any, ...]:
        """MISSION_COUNT: the vehicle says how much there is to read."""
        if self._count is not None:
            return ()
        self._count = count
        return self.next_read(0)

    def _received(self, f: Any) -> tuple[Any, ...]:
        """MISSION_ITEM_INT: one vertex; the next is asked for, once."""
        if self._count is None or f.seq >= self._count or f.seq in self._read:
            return ()
        of = f.param1 if math.isfinite(f.param1) else 0.0
        self._read[f.seq] = Vertex(f.command, of, f.x, f.y)
        return self.next_read(0)

    def next_read(self, confirmation: int) -> tuple[Any, ...]:
        """What to send next to read the fence back."""
        to = (self._system, AUTOPILOT_COMPONENT)
        if self._count is None:
            return (mav.MAVLink_mission_request_list_message(*to, FENCE),)
        for number in range(self._count):
            if number not in self._read:
                return (mav.MAVLink_mission_request_int_message(*to, number, FENCE),)
        return (mav.MAVLink_mission_ack_message(*to, ACCEPTED, FENCE),)

    @property
    def verified(self) -> bool:
        """Whether what was read back is what was sent."""
        return self._count == len(self.vertices) == len(self._read) and not self.difference()

    def difference(self) -> str:
        """How what was read back differs, if it does."""
        if self._count is not None and self._count != len(self.vertices):
            return f"the vehicle holds {self._count} vertices, not {len(self.vertices)}"
        for number, vertex in self._read.items():
            if not self.vertices[number].equals(vertex):
                return f"vertex {number} is {vertex}, not {self.vertices[number]}"
        return ""

    def count_message(self) -> Any:
        """MISSION_COUNT, which begins the upload."""
        return mav.MAVLink_mission_count_message(self._system, AUTOPILOT_COMPONENT, len(self.vertices), FENCE)

    def items(self) -> list[Any]:
        """MISSION_ITEM_INT of every vertex."""
        return [self._item(number) for number in range(len(self.vertices))]

    def _item(self, number: int) -> Any:
        """MISSION_ITEM_INT."""
        vertex = self.vertices[number]
        return mav.MAVLink_mission_item_int_message(
            self._system, AUTOPILOT_COMPONENT, number, GLOBAL, vertex.command, 0, 1,
            vertex.of, 0.0, 0.0, 0.0, vertex.lat_e7, vertex.lon_e7, 0.0, FENCE,
        )  # fmt: skip


class FenceUpload(NamedTuple):
    """Asks the vehicle to take the fence."""

    transfer: FenceTransfer
    name: str = "MISSION_COUNT"

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """MISSION_COUNT; a transfer under way begins again."""
        return (self.transfer.count_message(),)


class FenceReading(NamedTuple):
    """Asks the vehicle for its fence."""

    transfer: FenceTransfer
    name: str = "MISSION_REQUEST_LIST"

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """Whatever is missing next."""
        return self.transfer.next_read(confirmation)
