"""Frames to messages and back, without I/O: bytes in, frames out; messages in, bytes out.

The frequent messages are packed and unpacked here with pymavlink's own structs and checksum seeds; every
other message, MAVLink 1 and signed frames go through pymavlink.  Unlike pymavlink's parser, the decoder
never loses a good frame that follows garbage or a truncated frame: what fails its checksum is given up one
byte at a time, and a datagram that is one whole frame ends any partial frame left by an earlier one.
"""

import struct
from typing import Any, NamedTuple

from fastcrc import crc16

from . import messages
from .dialect import mav
from .messages import BY_FIELDS, HOT_MESSAGES, HotMessage

_mcrf4xx = crc16.mcrf4xx
_HEADER = struct.Struct("<4xBBBHB")  # sequence, ids, message id; before them magic, length and two flags
_BODY = struct.Struct("<BHBBBHB")  # the header without its magic byte, the two flags as one zero
_CHECKSUM = struct.Struct("<H")
_V1, _V2 = 0xFE, 0xFD
_V1_OVERHEAD, _V2_OVERHEAD = 8, 12
_SIGNED, _SIGNATURE_BYTES = 0x01, 13
_RUN_BELIEVED = 4
_tuple = tuple.__new__  # makes a named tuple of its values, in a third of the time that its own class takes


class Frame(NamedTuple):
    """One received frame. ``fields`` has the message's fields as attributes, named as MAVLink names them."""

    message_id: int
    system: int
    component: int
    sequence: int
    fields: Any
    raw: bytes


class Decoder:
    """Turns the bytes of one link into frames.

    ``frames`` counts those decoded, ``bad`` the stretches of bytes that were none, ``lost`` the frames that
    are missing by their senders' sequence numbers (a late or repeated frame counts nothing).
    """

    def __init__(self) -> None:
        self.frames = 0
        self.bad = 0
        self.lost = 0
        self._pending = b""
        self._discarding = False
        self._expected: dict[int, int] = {}  # by sender: system and component as one number
        self._parser = mav.MAVLink(None)

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that ``data`` completes, in order; what is left is kept for the next call.

        A message that the dialect does not know carries no checksum that can be checked: it is given out
        when its sender is known and the frame behind it has come and is good.
        """
        frame = self._whole(data)
        if frame is None:
            return self._scan(self._pending + data, ended=False)
        if self._pending:
            return [*self._scan(self._pending, ended=True), self._accept(frame)]
        return [self._accept(frame)]

    def _whole(self, data: bytes) -> Frame | None:
        """The frame, if ``data`` is exactly one: a datagram, the common case."""
        if len(data) < _V2_OVERHEAD or data[0] != _V2 or len(data) != data[1] + _V2_OVERHEAD or data[2]:
            return None
        sequence, system, component, low, high = _HEADER.unpack_from(data)
        message_id = low | high << 16
        hot = HOT_MESSAGES.get(message_id)
        if hot is None:
            return self._decode_any(data) if message_id in mav.mavlink_map else None
        _, kind, payload, crc_extra, lengths = hot
        if _mcrf4xx(data[1:-2] + crc_extra) != data[-2] | data[-1] << 8:
            return None
        values = (
            payload.unpack_from(data, 10)
            if data[1] >= payload.size
            else payload.unpack(data[10:-2].ljust(payload.size, b"\0"))
        )
        fields = _tuple(kind, hot.grouped(values) if lengths else values)
        return _tuple(Frame, (message_id, system, component, sequence, fields, data))

    def _scan(self, buffer: bytes, ended: bool) -> list[Frame]:
        """All frames in ``buffer``, however it was cut; an unfinished one at its end is kept for later.

        ``ended``: a good frame is known to begin right behind the buffer, so nothing in it is unfinished.
        """
        frames = []
        start = 0
        while start < len(buffer):
            frame = self._at(buffer, start)
            good = self._vouched(buffer, start, frame, ended)
            if good is None:
                break
            if good and frame is not None:
                frames.append(self._accept(frame))
                start += len(frame.raw)
            else:
                self._discard()
                start += 1
        self._pending = buffer[start:]
        return frames

    def _at(self, buffer: bytes, start: int) -> Frame | None:
        """The whole frame that begins at ``start``, if there is one."""
        size = _frame_size(buffer, start)
        if size == 0 or size > len(buffer) - start:
            return None
        raw = buffer[start : start + size]
        return self._whole(raw) or self._decode_any(raw)

    def _vouched(self, buffer: bytes, start: int, frame: Frame | None, ended: bool) -> bool | None:
        """Whether ``frame``, found at ``start``, is really one; None while that cannot be said yet.

        A known message has its checksum.  An unknown one is believed when its sender has been heard before
        and what follows it is a frame whose checksum is good, or a few more like it.
        """
        for _ in range(_RUN_BELIEVED):
            if frame is None:
                unfinished = _frame_size(buffer, start) > len(buffer) - start
                return None if unfinished and not ended else False
            if frame.message_id in mav.mavlink_map:
                return True
            if frame.system << 8 | frame.component not in self._expected:
                return False
            start += len(frame.raw)
            if start == len(buffer):
                return True if ended else None
            frame = self._at(buffer, start)
        return True

    def _decode_any(self, raw: bytes) -> Frame | None:
        """Decode one whole frame by pymavlink: any message, MAVLink 1 or 2, signed or not."""
        try:
            message = self._parser.decode(bytearray(raw))
        except mav.MAVError:
            return None
        if raw[0] == _V1:
            return Frame(raw[5], raw[3], raw[4], raw[2], message, raw)
        return Frame(int.from_bytes(raw[7:10], "little"), raw[5], raw[6], raw[4], message, raw)

    def _accept(self, frame: Frame) -> Frame:
        """Count the frame, and those that are missing before it."""
        self.frames += 1
        self._discarding = False
        _, system, component, sequence, _, _ = frame
        sender = system << 8 | component
        gap = (sequence - self._expected.get(sender, sequence)) & 0xFF
        if gap < 128:
            self.lost += gap
            self._expected[sender] = sequence + 1
        return frame

    def _discard(self) -> None:
        """Note bytes that are no frame, once for each stretch of them."""
        if not self._discarding:
            self.bad += 1
            self._discarding = True


def _frame_size(buffer: bytes, start: int) -> int:
    """Bytes of the frame that begins at ``start``; 0 if none can; past the end while it is not known yet."""
    if buffer[start] == _V1:
        return buffer[start + 1] + _V1_OVERHEAD if len(buffer) > start + 1 else _V1_OVERHEAD
    if buffer[start] != _V2:
        return 0
    if len(buffer) <= start + 2:
        return _V2_OVERHEAD
    incompatible = buffer[start + 2]
    if incompatible & ~_SIGNED:
        return 0
    return buffer[start + 1] + _V2_OVERHEAD + (_SIGNATURE_BYTES if incompatible else 0)


class Encoder:
    """Packs the messages that one component sends over one link, as MAVLink 2, numbering them.

    The builders take the arguments of pymavlink's message of that name, in its order and units.  A value
    that its field cannot hold raises ``struct.error``, as pymavlink does.
    """

    def __init__(self, system: int, component: int) -> None:
        self.system = system
        self.component = component
        self.sequence = 0
        self._packer = mav.MAVLink(None, system, component)

    def encode(self, message: Any) -> bytes:
        """The frame of any pymavlink message object, or of a frequent message's tuple."""
        hot = BY_FIELDS.get(type(message))
        if hot is not None:
            return self._frame(hot, hot.payload.pack(*(hot.flat(message) if hot.lengths else message)))
        self._packer.seq = self.sequence
        frame: bytes = message.pack(self._packer)
        self.sequence = (self.sequence + 1) & 0xFF
        return frame

    def _frame(self, hot: HotMessage, payload: bytes) -> bytes:
        """Wrap a packed payload, without its trailing zeros (but one byte at least), as pymavlink does."""
        payload = payload.rstrip(b"\0") or b"\0"
        sequence = self.sequence
        body = _BODY.pack(len(payload), 0, sequence, self.system, self.component, hot.message_id, 0) + payload
        self.sequence = (sequence + 1) & 0xFF
        return b"\xfd" + body + _CHECKSUM.pack(_mcrf4xx(body + hot.crc_extra))

    def heartbeat(
        self,
        type: int,
        autopilot: int,
        base_mode: int,
        custom_mode: int,
        system_status: int,
        mavlink_version: int = 3,
    ) -> bytes:
        """HEARTBEAT."""
        return self._frame(
            messages.HEARTBEAT,
            messages.HEARTBEAT.payload.pack(
                custom_mode, type, autopilot, base_mode, system_status, mavlink_version
            ),
        )

    def sys_status(
        self,
        sensors_present: int,
        sensors_enabled: int,
        sensors_health: int,
        load: int,
        voltage_battery: int,
        current_battery: int,
        battery_remaining: int,
        drop_rate_comm: int,
        *rest: int,
    ) -> bytes:
        """SYS_STATUS; ``rest``: errors_comm, four error counts and, if given, three extended sensor fields."""
        extended = (*rest[5:], 0, 0, 0)[:3]
        payload = messages.SYS_STATUS.payload.pack(
            sensors_present, sensors_enabled, sensors_health, load, voltage_battery, current_battery,
            drop_rate_comm, *rest[:5], battery_remaining, *extended,
        )  # fmt: skip
        return self._frame(messages.SYS_STATUS, payload)

    def extended_sys_state(self, vtol_state: int, landed_state: int) -> bytes:
        """EXTENDED_SYS_STATE."""
        payload = messages.EXTENDED_SYS_STATE.payload.pack(vtol_state, landed_state)
        return self._frame(messages.EXTENDED_SYS_STATE, payload)

    def global_position_int(
        self,
        time_boot_ms: int,
        lat: int,
        lon: int,
        alt: int,
        relative_alt: int,
        vx: int,
        vy: int,
        vz: int,
        hdg: int,
    ) -> bytes:
        """GLOBAL_POSITION_INT: degrees × 1e7, mm, cm/s north east down, heading in 0.01° (65535: unknown)."""
        return self._frame(
            messages.GLOBAL_POSITION_INT,
            messages.GLOBAL_POSITION_INT.payload.pack(
                time_boot_ms, lat, lon, alt, relative_alt, vx, vy, vz, hdg
            ),
        )

    def local_position_ned(
        self, time_boot_ms: int, x: float, y: float, z: float, vx: float, vy: float, vz: float
    ) -> bytes:
        """LOCAL_POSITION_NED: metres and m/s from the vehicle's own origin."""
        return self._frame(
            messages.LOCAL_POSITION_NED,
            messages.LOCAL_POSITION_NED.payload.pack(time_boot_ms, x, y, z, vx, vy, vz),
        )

    def attitude(
        self,
        time_boot_ms: int,
        roll: float,
        pitch: float,
        yaw: float,
        rollspeed: float,
        pitchspeed: float,
        yawspeed: float,
    ) -> bytes:
        """ATTITUDE: radians and rad/s."""
        return self._frame(
            messages.ATTITUDE,
            messages.ATTITUDE.payload.pack(time_boot_ms, roll, pitch, yaw, rollspeed, pitchspeed, yawspeed),
        )

    def set_position_target_local_ned(
        self,
        time_boot_ms: int,
        target_system: int,
        target_component: int,
        coordinate_frame: int,
        type_mask: int,
        x: float,
        y: float,
        z: float,
        vx: float,
        vy: float,
        vz: float,
        afx: float,
        afy: float,
        afz: float,
        yaw: float,
        yaw_rate: float,
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED: metres, m/s, m/s², rad, rad/s; a set bit of the mask ignores."""
        return self._frame(
            messages.SET_POSITION_TARGET_LOCAL_NED,
            messages.SET_POSITION_TARGET_LOCAL_NED.payload.pack(
                time_boot_ms, x, y, z, vx, vy, vz, afx, afy, afz, yaw, yaw_rate,
                type_mask, target_system, target_component, coordinate_frame,
            ),
        )  # fmt: skip
