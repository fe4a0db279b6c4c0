"""What a session reports to whoever runs it, and the assembling of the vehicle's own texts."""

from enum import Enum
from typing import NamedTuple

CHUNK_CHARACTERS = 50


class EventKind(Enum):
    """What happened."""

    PHASE = "phase"  #: the session entered a phase
    FAILED = "failed"  #: it gave up; the text is the reason
    RELEASED = "released"  #: somebody else flies the vehicle now
    LOST = "lost"  #: no heartbeat
    REGAINED = "regained"  #: heartbeats again
    POSITION_LOST = "position lost"  #: heartbeats, but no valid position
    BATTERY_LOW = "battery low"  #: once a set-up
    ASTRAY = "astray"  #: it does not fly its setpoints; once, until it does
    RESTARTED = "restarted"  #: the autopilot has booted again
    WARNING = "warning"  #: something optional did not work
    TEXT = "text"  #: STATUSTEXT of the vehicle


class Event(NamedTuple):
    """One report: the caller's time in seconds, the vehicle's system id, and a sentence."""

    time: float
    system: int
    kind: EventKind
    text: str


class TextAssembler:
    """Joins the 50-character chunks in which MAVLink carries long status texts."""

    def __init__(self) -> None:
        self._id = 0
        self._parts: dict[int, str] = {}

    def add(self, text: str, message_id: int, chunk: int) -> str | None:
        """The whole text once its last chunk is here; None while more is to come.

        A text of which a chunk was lost comes out without it.
        """
        if message_id == 0:
            return text.rstrip()
        if message_id != self._id:
            self._id, self._parts = message_id, {}
        self._parts[chunk] = text
        if len(text) >= CHUNK_CHARACTERS:
            return None
        whole = "".join(self._parts[number] for number in sorted(self._parts))
        self._id, self._parts = 0, {}
        return whole.rstrip()
