"""What a link did: counts, and the spread of setpoint intervals and of round trips.

A round trip is measured once a heartbeat by a TIMESYNC, which firmware answers at once; that of a command
has the firmware's own time in it.
"""

import math
from array import array
from collections import deque
from dataclasses import dataclass
from typing import Any

from swarmctl.mavlink.messages import Timesync
from swarmctl.mavlink.signing import Verdict

from .link import Link

NANOSECONDS = 1e9
PINGS_KEPT = 16  #: an answer later than so many further pings counts for nothing


@dataclass(frozen=True, slots=True)
class Spread:
    """The spread of some durations, in seconds; percentiles are the nearest rank, never interpolated."""

    minimum_s: float
    median_s: float
    p99_s: float
    maximum_s: float


@dataclass(frozen=True, slots=True)
class Statistics:
    """One session's figures so far; a spread is None until there is something to spread."""

    messages_received: int  #: whole frames of this vehicle
    messages_lost: int  #: missing by sequence number
    messages_bad: int  #: garbage or failed checksums
    messages_late: int  #: repeated or overtaken on the way
    messages_unsigned: int  #: dropped for want of a signature, as are the next two; 0 without a key
    messages_wrongly_signed: int
    messages_replayed: int
    setpoints_sent: int
    setpoints_refused: int  #: not finite, and so never sent
    setpoint_interval: Spread | None
    command_round_trip: Spread | None
    round_trip: Spread | None  #: of the link


def spread(durations_s: "array[float]") -> Spread | None:
    """The spread of ``durations_s``; None for none."""
    if not durations_s:
        return None
    ordered = sorted(durations_s)
    last = len(ordered) - 1
    return Spread(ordered[0], ordered[round(0.5 * last)], ordered[round(0.99 * last)], ordered[last])


class Tally:
    """Counts what one session sends and how long its answers take."""

    def __init__(self) -> None:
        self.setpoint_intervals_s: array[float] = array("d")
        self.round_trips_s: array[float] = array("d")
        self.setpoints_sent = 0
        self.setpoints_refused = 0
        self.pings_s: array[float] = array("d")
        self._setpoint_at = math.nan
        self._unanswered: deque[int] = deque(maxlen=PINGS_KEPT)

    def ping(self, now: float) -> Timesync:
        """The TIMESYNC whose answer measures a round trip."""
        stamp = round(now * NANOSECONDS)
        self._unanswered.append(stamp)
        return Timesync(0, stamp)

    def pong(self, fields: Any, now: float) -> bool:
        """A TIMESYNC came: the answer to one of the last pings, or something else, which is ignored."""
        if fields.tc1 == 0 or fields.ts1 not in self._unanswered:
            return False
        self._unanswered.remove(fields.ts1)
        self.pings_s.append(now - fields.ts1 / NANOSECONDS)
        return True

    def setpoint(self, now: float) -> None:
        """A setpoint is sent."""
        if self.setpoints_sent:
            self.setpoint_intervals_s.append(now - self._setpoint_at)
        self._setpoint_at = now
        self.setpoints_sent += 1

    def figures(self, link: Link) -> Statistics:
        """The figures so far, with those of the link."""
        return Statistics(
            messages_received=link.received,
            messages_lost=link.lost,
            messages_bad=link.bad,
            messages_late=link.late,
            messages_unsigned=link.refused(Verdict.UNSIGNED),
            messages_wrongly_signed=link.refused(Verdict.WRONG),
            messages_replayed=link.refused(Verdict.REPLAYED),
            setpoints_sent=self.setpoints_sent,
            setpoints_refused=self.setpoints_refused,
            setpoint_interval=spread(self.setpoint_intervals_s),
            command_round_trip=spread(self.round_trips_s),
            round_trip=spread(self.pings_s),
        )
