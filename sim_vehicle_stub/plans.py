"""The mission protocol: fence, rally points and missions are put in, read back and cleared.

Each kind of plan (its MAV_MISSION_TYPE is echoed in every answer) is a list of items that a client offers
with a count and the vehicle asks for one by one; it takes the whole list or none of it.  Firmwares differ in
the request that they send, and take an item in either form.
"""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

from .fences import CIRCLES, POLYGONS

if TYPE_CHECKING:
    from .vehicle import StubVehicle

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
MOST_ITEMS = 200
ASK_AGAIN_S, ATTEMPTS = 1.0, 8
FRAMES = frozenset({0, 3, 5, 6})
FENCE_COMMANDS = {mav.MAV_CMD_NAV_FENCE_RETURN_POINT, *POLYGONS, *CIRCLES}
ACCEPTED: int = mav.MAV_MISSION_ACCEPTED


class Item(NamedTuple):
    """One item; ``x``, ``y``: latitude and longitude in 1e-7 degrees."""

    frame: int
    command: int
    p1: float
    p2: float
    p3: float
    p4: float
    x: int
    y: int
    z: float


class Upload:
    """Items that a client has promised, and those that have come."""

    def __init__(self, frame: Frame, now: float) -> None:
        self.client = (frame.system, frame.component)
        self.kind: int = frame.fields.mission_type
        self.count: int = frame.fields.count
        self.items: list[Item] = []
        self.asked_at = now
        self.attempts = 1


class Plans:
    """The plans of one vehicle. ``kept`` has the items of each MAV_MISSION_TYPE, ``upload`` those to come."""

    def __init__(self, vehicle: "StubVehicle") -> None:
        self.kept: dict[int, list[Item]] = {MISSION: [], FENCE: [], RALLY: []}
        self.upload: Upload | None = None
        self._vehicle = vehicle

    def advance(self) -> None:
        """Ask again for an item that does not come, and give up in the end."""
        upload = self.upload
        if upload is None or self._vehicle.now - upload.asked_at < ASK_AGAIN_S:
            return
        upload.attempts += 1
        if upload.attempts > ATTEMPTS:
            self.upload = None
            self._acknowledge(upload.client, upload.kind, mav.MAV_MISSION_OPERATION_CANCELLED)
        else:
            self._ask(upload)

    # From the client

    def count(self, frame: Frame) -> None:
        """MISSION_COUNT: a client offers so many items."""
        fields = frame.fields
        client = (frame.system, frame.component)
        if fields.mission_type not in self.kept:
            self._acknowledge(client, fields.mission_type, mav.MAV_MISSION_UNSUPPORTED)
        elif fields.count > MOST_ITEMS:
            self._acknowledge(client, fields.mission_type, mav.MAV_MISSION_NO_SPACE)
        elif fields.count == 0:
            self._keep(fields.mission_type, [])
            self._acknowledge(client, fields.mission_type, ACCEPTED)
        else:
            self.upload = Upload(frame, self._vehicle.now)
            self._ask(self.upload)

    def item_int(self, frame: Frame) -> None:
        """MISSION_ITEM_INT."""
        f = frame.fields
        self._take(frame, Item(f.frame, f.command, f.param1, f.param2, f.param3, f.param4, f.x, f.y, f.z))

    def item(self, frame: Frame) -> None:
        """MISSION_ITEM: degrees as floats, which are about half a metre coarse."""
        f = frame.fields
        if not (abs(f.x) <= 90.0 and abs(f.y) <= 180.0):
            self._acknowledge((frame.system, frame.component), f.mission_type, mav.MAV_MISSION_INVALID)
            return
        x, y = round(f.x * 1e7), round(f.y * 1e7)
        self._take(frame, Item(f.frame, f.command, f.param1, f.param2, f.param3, f.param4, x, y, f.z))

    def request_list(self, frame: Frame) -> None:
        """MISSION_REQUEST_LIST: how many there are."""
        kind = frame.fields.mission_type
        client = (frame.system, frame.component)
        if kind not in self.kept:
            self._acknowledge(client, kind, mav.MAV_MISSION_UNSUPPORTED)
        else:
            self._send(mav.MAVLink_mission_count_message(*client, len(self.kept[kind]), kind))

    def request_int(self, frame: Frame) -> None:
        """MISSION_REQUEST_INT: one item, in integers."""
        self._tell(frame, mav.MAVLink_mission_item_int_message, 1, 1)

    def request(self, frame: Frame) -> None:
        """MISSION_REQUEST: one item, in floats."""
        self._tell(frame, mav.MAVLink_mission_item_message, 1e-7, 1e-7)

    def clear(self, frame: Frame) -> None:
        """MISSION_CLEAR_ALL, of one kind or of all."""
        kind = frame.fields.mission_type
        known = kind in self.kept or kind == ALL
        for each in list(self.kept) if kind == ALL else [kind] if known else []:
            self._keep(each, [])
        result = ACCEPTED if known else mav.MAV_MISSION_UNSUPPORTED
        self._acknowledge((frame.system, frame.component), kind, result)

    # Inside

    def _take(self, frame: Frame, item: Item) -> None:
        """An item has come: ask for the next, or check and keep them all."""
        upload, fields = self.upload, frame.fields
        client = (frame.system, frame.component)
        if upload is None or upload.client != client or upload.kind != fields.mission_type:
            if self.kept.get(fields.mission_type, [])[fields.seq :] == [item]:
                self._acknowledge(client, fields.mission_type, ACCEPTED)  # the first ACK was lost
            return
        if fields.seq == len(upload.items):
            upload.items.append(item)
            upload.attempts = 0
        if len(upload.items) < upload.count:
            self._ask(upload)
            return
        self.upload = None
        fault = first_fault(upload.kind, upload.items)
        if fault == ACCEPTED:
            self._keep(upload.kind, upload.items)
        self._acknowledge(client, upload.kind, fault)

    def _keep(self, kind: int, items: list[Item]) -> None:
        self.kept[kind] = items
        if kind == FENCE:
            self._vehicle.build_fence(items)

    def _ask(self, upload: Upload) -> None:
        """Request the first item that is missing."""
        upload.asked_at = self._vehicle.now
        message = (
            mav.MAVLink_mission_request_int_message
            if self._vehicle.personality.requests_integers
            else mav.MAVLink_mission_request_message
        )
        self._send(message(*upload.client, len(upload.items), upload.kind))

    def _tell(self, frame: Frame, message: Any, x_unit: float, y_unit: float) -> None:
        """Answer a request for an item."""
        kind, number = frame.fields.mission_type, frame.fields.seq
        client = (frame.system, frame.component)
        items = self.kept.get(kind, [])
        if number >= len(items):
            self._acknowledge(client, kind, mav.MAV_MISSION_INVALID_SEQUENCE)
            return
        i = items[number]
        self._send(
            message(
                *client, number, i.frame, i.command, 0, 1, i.p1, i.p2, i.p3, i.p4,
                i.x * x_unit, i.y * y_unit, i.z, kind,
            )
        )  # fmt: skip

    def _acknowledge(self, client: tuple[int, int], kind: int, result: int) -> None:
        self._send(mav.MAVLink_mission_ack_message(*client, result, kind))

    def _send(self, message: Any) -> None:
        self._vehicle.send_message(message)


def first_fault(kind: int, items: list[Item]) -> int:
    """MAV_MISSION_RESULT of a list of items: accepted, or what is wrong with the first bad one."""
    if kind == MISSION:
        return ACCEPTED
    allowed = FENCE_COMMANDS if kind == FENCE else {mav.MAV_CMD_NAV_RALLY_POINT}
    for item in items:
        if item.frame not in FRAMES:
            return int(mav.MAV_MISSION_UNSUPPORTED_FRAME)
        if item.command not in allowed:
            return int(mav.MAV_MISSION_UNSUPPORTED)
        if abs(item.x) > 90e7 or abs(item.y) > 180e7:
            return int(mav.MAV_MISSION_INVALID_PARAM5_X)
    return ACCEPTED if kind == RALLY or _shapes_are_whole(items) else int(mav.MAV_MISSION_INVALID_PARAM1)


def _shapes_are_whole(items: list[Item]) -> bool:
    """Whether circles have a radius, and every vertex stands among as many of its kind as it says."""
    at = 0
    while at < len(items):
        first = items[at]
        if first.command not in POLYGONS:
            if first.command in CIRCLES and not 0.0 < first.p1 < math.inf:
                return False
            at += 1
            continue
        vertices = items[at : at + int(first.p1)] if 3 <= first.p1 <= MOST_ITEMS else []
        if not vertices or len(vertices) != first.p1 or {(v.command, v.p1) for v in vertices} != {first[1:3]}:
            return False
        at += len(vertices)
    return True
