"""MAVLink 2 signing, without I/O: what leaves is signed with a key that both ends hold, what arrives is judged by it.

Behind its checksum a signed frame carries a link id, the time in units of 10 µs since 2015 and the first six
bytes of the SHA-256 of key, frame, link id and time.  Times never repeat on a stream (system, component and
link id), so a frame that was recorded and is sent again is known by its time; a stream that is heard for the
first time may be a minute behind the newest time known, and no more.

Signing has no part in the frequent path: a frame is signed when it is whole, and judged when it is decoded.
What is sent on one link must leave in the order in which it was signed.
"""

import base64
import binascii
from collections.abc import Callable
from enum import Enum
from hashlib import sha256
from hmac import compare_digest

from fastcrc import crc16

from .codec import Decoder, Frame
from .dialect import mav

KEY_BYTES = 32
SIGNED = 0x01  #: the incompatibility flag
SIGNATURE_BYTES = 13
UNITS_PER_S = 100_000
EPOCH_S = 1_420_070_400  #: 2015-01-01 UTC in seconds since 1970
STALE = 60 * UNITS_PER_S
KEEP_EVERY = 5 * UNITS_PER_S
_V2 = 0xFD

# A SiK radio tells of itself unsigned, as nobody gave it a key.  It is no vehicle.
RADIO_STATUS = (mav.MAVLINK_MSG_ID_RADIO_STATUS, mav.MAVLINK_MSG_ID_RADIO)
RADIO = (51, 68)  #: its system and component


class Verdict(Enum):
    """What a frame's signature says of it."""

    GOOD = "good"
    UNSIGNED = "unsigned"
    WRONG = "wrongly signed"
    REPLAYED = "replayed"  #: not newer than what its stream has sent, or long past


REFUSED = (Verdict.UNSIGNED, Verdict.WRONG, Verdict.REPLAYED)


def parse_key(content: bytes) -> bytes:
    """The key that a file holds: 64 hex digits, base64 of 32 bytes, or 32 raw bytes.  Raises ValueError."""
    text = content.strip()
    if len(text) == 2 * KEY_BYTES:
        try:
            return bytes.fromhex(text.decode("ascii"))
        except ValueError:
            pass  # neither is it base64, whose length differs
    if len(content) == KEY_BYTES:
        return content
    try:
        key = base64.b64decode(text, validate=True)
    except binascii.Error:
        key = b""
    if len(key) != KEY_BYTES:
        raise ValueError("it must hold 64 hex digits, base64 of 32 bytes, or 32 raw bytes")
    return key


def units(utc_s: float) -> int:
    """The time in signatures at ``utc_s`` seconds since 1970; 0 before 2015."""
    return max(0, round((utc_s - EPOCH_S) * UNITS_PER_S))


class Signing:
    """One holder of a key, for all of its links.

    ``clock`` gives the time in `units`; ``newest`` is the newest time that was used or heard before.  ``keep`` is
    told the time with the first frame and then every `KEEP_EVERY`, so that times can go on in another program.
    """

    def __init__(
        self,
        key: bytes,
        clock: Callable[[], int],
        newest: int = 0,
        keep: Callable[[int], None] = lambda time: None,
    ) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self._key = key
        self._clock = clock
        self._newest = newest
        self._keep = keep
        self._keep_at = 0

    @property
    def now(self) -> int:
        """The newest time known, by the clock or by what was heard."""
        return max(self._newest, self._clock())

    def sign(self, frame: bytes, link: int) -> bytes:
        """``frame``, a whole unsigned MAVLink 2 frame of a known message, signed for the link id ``link``."""
        self._newest = time = max(self._newest + 1, self._clock())
        if time >= self._keep_at:
            self._keep_at = time + KEEP_EVERY
            self._keep(time)
        head = frame[:2] + bytes([frame[2] | SIGNED]) + frame[3:-2]
        extra: int = mav.mavlink_map[int.from_bytes(frame[7:10], "little")].crc_extra
        checksum = crc16.mcrf4xx(head[1:] + bytes([extra]))
        signed = head + checksum.to_bytes(2, "little") + bytes([link]) + time.to_bytes(6, "little")
        return signed + self.signature(signed)

    def signature(self, signed: bytes) -> bytes:
        """The last six bytes of a signed frame, from all that comes before."""
        return sha256(self._key + signed).digest()[:6]

    def heard(self, time: int) -> None:
        """A frame of this time was believed: ours will be newer."""
        self._newest = max(self._newest, time)


class Verifier:
    """Judges frames, remembering the newest time of each stream.  ``counts``: how many got which verdict."""

    def __init__(self, signing: Signing) -> None:
        self.counts = dict.fromkeys(Verdict, 0)
        self._signing = signing
        self._streams: dict[tuple[int, int, int], int] = {}

    def judge(self, raw: bytes) -> Verdict:
        """What to think of one whole frame whose checksum is good."""
        verdict = self._judge(raw)
        self.counts[verdict] += 1
        return verdict

    def _judge(self, raw: bytes) -> Verdict:
        if raw[0] != _V2 or not raw[2] & SIGNED:
            return Verdict.GOOD if _is_radio_status(raw) else Verdict.UNSIGNED
        if not compare_digest(self._signing.signature(raw[:-6]), raw[-6:]):
            return Verdict.WRONG
        stream = (raw[5], raw[6], raw[-SIGNATURE_BYTES])
        time = int.from_bytes(raw[-12:-6], "little")
        if time <= self._streams.get(stream, self._signing.now - STALE - 1):
            return Verdict.REPLAYED
        self._streams[stream] = time
        self._signing.heard(time)
        return Verdict.GOOD


class SignedDecoder(Decoder):
    """A decoder that gives out, and counts, only what ``verifier`` believes."""

    def __init__(self, verifier: Verifier) -> None:
        super().__init__()
        self._verifier = verifier
        self._believed: list[Frame] = []

    def feed(self, data: bytes) -> list[Frame]:
        """The believed ones of the frames that ``data`` completes."""
        self._believed = []
        super().feed(data)
        return self._believed

    def _accept(self, frame: Frame) -> Frame:
        if self._verifier.judge(frame.raw) is not Verdict.GOOD:
            return frame
        self._believed.append(frame)
        return super()._accept(frame)


def _is_radio_status(raw: bytes) -> bool:
    """Whether a radio tells of itself, in MAVLink 2 or 1."""
    if raw[0] == _V2:
        return (raw[5], raw[6]) == RADIO and int.from_bytes(raw[7:10], "little") in RADIO_STATUS
    return (raw[3], raw[4]) == RADIO and raw[5] in RADIO_STATUS
