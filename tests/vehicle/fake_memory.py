"""A scripted vehicle's parameters and fence: MAVLink's parameter and mission protocols, the vehicle's side."""

import struct
from collections.abc import Callable
from typing import Any

from swarmctl.mavlink.dialect import mav

FENCE = mav.MAV_MISSION_TYPE_FENCE
REAL32, INT32 = mav.MAV_PARAM_TYPE_REAL32, mav.MAV_PARAM_TYPE_INT32
ASK_AGAIN_S = 1.0


class FakeMemory:
    """``send`` transmits a message.  The attributes below are what a test may set."""

    def __init__(self, send: Callable[[Any], None], bytewise: bool) -> None:
        self.parameters: dict[str, float] = {}
        self.unknown_answered = True  # with PARAM_ERROR; else silence
        self.old_request = False  # MISSION_REQUEST instead of MISSION_REQUEST_INT
        self.result = mav.MAV_MISSION_ACCEPTED
        self.keep: Callable[[list[Any]], list[Any]] = lambda items: items  # what it really stores
        self.fence: list[Any] = []
        self.uploads = 0
        self._send, self._bytewise = send, bytewise
        self._coming: list[Any] = []
        self._count = 0
        self._now = self._asked_at = 0.0

    def receive(self, message_id: int, fields: Any) -> None:
        if message_id == mav.MAVLINK_MSG_ID_PARAM_REQUEST_READ:
            self.tell(fields.param_id.rstrip("\0"))
        elif getattr(fields, "mission_type", None) != FENCE:
            return
        elif message_id == mav.MAVLINK_MSG_ID_MISSION_COUNT:
            self.uploads += 1
            self._coming, self._count = [], fields.count
            self._request()
        elif message_id == mav.MAVLINK_MSG_ID_MISSION_ITEM_INT:
            self._store(fields)
        elif message_id == mav.MAVLINK_MSG_ID_MISSION_REQUEST_LIST:
            self._send(mav.MAVLink_mission_count_message(255, 190, len(self.fence), FENCE))
        elif message_id == mav.MAVLINK_MSG_ID_MISSION_REQUEST_INT and fields.seq < len(self.fence):
            f = self.fence[fields.seq]
            self._send(
                mav.MAVLink_mission_item_int_message(
                    255, 190, f.seq, f.frame, f.command, 0, 1, f.param1, 0, 0, 0, f.x, f.y, f.z, FENCE
                )
            )

    def tell(self, name: str) -> None:
        """PARAM_VALUE, PARAM_ERROR or nothing."""
        value = self.parameters.get(name)
        if value is not None:
            kind = INT32 if isinstance(value, int) else REAL32
            if isinstance(value, int) and self._bytewise:
                (value,) = struct.unpack("<f", struct.pack("<i", value))
            self._send(mav.MAVLink_param_value_message(name.encode(), value, kind, 9, 0))
        elif self.unknown_answered:
            self._send(mav.MAVLink_param_error_message(255, 190, name.encode(), -1, 1))

    def advance(self, now: float) -> None:
        self._now = now
        if self._count and now - self._asked_at >= ASK_AGAIN_S:
            self._request()

    def _request(self) -> None:
        """Ask for the next vertex, or be done."""
        self._asked_at = self._now
        if len(self._coming) < self._count and self.result == mav.MAV_MISSION_ACCEPTED:
            kind = "mission_request" if self.old_request else "mission_request_int"
            make = getattr(mav, f"MAVLink_{kind}_message")
            self._send(make(255, 190, len(self._coming), FENCE))
            return
        if self.result == mav.MAV_MISSION_ACCEPTED:
            self.fence = self.keep(self._coming)
        self._count = 0
        self._send(mav.MAVLink_mission_ack_message(255, 190, self.result, FENCE))

    def _store(self, fields: Any) -> None:
        """A vertex; one out of turn is refused, as ArduPilot does, and the transfer goes on."""
        if not self._count:
            return
        if fields.seq != len(self._coming):
            result = mav.MAV_MISSION_INVALID_SEQUENCE
            self._send(mav.MAVLink_mission_ack_message(255, 190, result, FENCE))
            return
        self._coming.append(fields)
        self._request()
