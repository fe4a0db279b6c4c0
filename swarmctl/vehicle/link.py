"""One vehicle's end of the wire: frames in, frames out, and the record of both.

Only the vehicle's own frames pass.  A frame that comes twice is recorded but not passed on, or an old
COMMAND_ACK would answer a new command.  Nor is one that tells the vehicle's state if a newer one of its kind
overtook it on the way: an old HEARTBEAT would show a mode that is no more.

With a key every frame is signed as it is queued, under the vehicle's system id as its link id: each vehicle has
a stream of its own, on which times rise, even where many share one radio.
"""

from typing import Any

from swarmctl.mavlink.codec import Decoder, Encoder, Frame
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import SignedDecoder, Signing, Verdict, Verifier

from .commands import AUTOPILOT_COMPONENT

GROUND_SYSTEM = 255  #: the only system id that ArduPilot takes for its ground station
GROUND_COMPONENT: int = mav.MAV_COMP_ID_MISSIONPLANNER

# A frame less than this many numbers behind the newest is late; more means that the sender restarted.
LATE_FRAMES = 48
_WINDOW = (1 << LATE_FRAMES) - 1

# Messages of which only the newest is true.
STATE_MESSAGES: frozenset[int] = frozenset(
    (
        mav.MAVLINK_MSG_ID_HEARTBEAT,
        mav.MAVLINK_MSG_ID_SYS_STATUS,
        mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mav.MAVLINK_MSG_ID_HOME_POSITION,
        mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    )
)


class Link:
    """The link to the vehicle ``system``, signed if there is a key. ``encoder`` numbers what we send on it."""

    def __init__(self, system: int, signing: Signing | None = None) -> None:
        self.system = system
        self.encoder = Encoder(GROUND_SYSTEM, GROUND_COMPONENT)
        self.received = 0
        self.late = 0
        self._signing = signing
        self._verifier = Verifier(signing) if signing else None
        self._decoder = SignedDecoder(self._verifier) if self._verifier else Decoder()
        self._newest: int | None = None
        self._count = 0  # the newest frame's number, counted on beyond the wire's 255
        self._told: dict[int, int] = {}  # message id → the number of the newest frame of its kind
        self._seen = 0  # bit k: the frame k numbers behind the newest has come
        self._outgoing: list[bytes] = []
        self._traffic: list[bytes] = []

    @property
    def lost(self) -> int:
        """Frames missing by sequence number."""
        return self._decoder.lost

    @property
    def bad(self) -> int:
        """Stretches of bytes that were no frame."""
        return self._decoder.bad

    def refused(self, verdict: Verdict) -> int:
        """How many frames were dropped on this verdict; without a key none is."""
        return self._verifier.counts[verdict] if self._verifier else 0

    def take(self, data: bytes) -> list[Frame]:
        """The autopilot's frames that ``data`` completes, without repeated and outdated ones."""
        passed = []
        for frame in self._decoder.feed(data):
            if frame.system != self.system:
                continue
            self.received += 1
            self._traffic.append(frame.raw)
            if frame.component == AUTOPILOT_COMPONENT and self._is_news(frame):
                passed.append(frame)
        return passed

    def _is_news(self, frame: Frame) -> bool:
        """Whether a frame has not come before, nor tells of a state that a newer one has told."""
        newest = self._newest
        behind = LATE_FRAMES if newest is None else (newest - frame.sequence) & 0xFF
        if behind >= LATE_FRAMES:
            ahead = -behind & 0xFF
            self._seen = (self._seen << ahead | 1) & _WINDOW
            self._newest = frame.sequence
            self._count += ahead
            self._told[frame.message_id] = self._count
            return True
        return self._is_late_news(frame.message_id, behind)

    def _is_late_news(self, message_id: int, behind: int) -> bool:
        """The same for a frame that comes after one of a higher number."""
        self.late += 1
        repeated = self._seen >> behind & 1
        self._seen |= 1 << behind
        number = self._count - behind
        if repeated or (message_id in STATE_MESSAGES and number < self._told.get(message_id, number)):
            return False
        self._told[message_id] = max(number, self._told.get(message_id, number))
        return True

    def expect_any(self) -> None:
        """Take the next frame whatever its number: after a silence the sender may have restarted."""
        self._newest = None

    def send(self, frame: bytes) -> None:
        """Queue a frame."""
        if self._signing is not None:
            frame = self._signing.sign(frame, self.system)
        self._outgoing.append(frame)
        self._traffic.append(frame)

    def send_message(self, message: Any) -> None:
        """Queue a message, as the encoder takes it."""
        self.send(self.encoder.encode(message))

    def send_heartbeat(self) -> None:
        """Queue a ground station's HEARTBEAT."""
        beat = (mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE)
        self.send(self.encoder.heartbeat(*beat))

    def outgoing(self) -> list[bytes]:
        """The queued frames, which are then forgotten."""
        frames, self._outgoing = self._outgoing, []
        return frames

    def traffic(self) -> list[bytes]:
        """All frames of both directions since the last call, in order."""
        frames, self._traffic = self._traffic, []
        return frames
