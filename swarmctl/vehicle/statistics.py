"""What a link did: counts, and the spread of setpoint intervals and command round trips."""

import math
from array import array
from dataclasses import dataclass

from .link import Link


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
    setpoints_sent: int
    setpoints_refused: int  #: not finite, and so never sent
    setpoint_interval: Spread | None
    command_round_trip: Spread | None


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
        self._setpoint_at = math.nan

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
            setpoints_sent=self.setpoints_sent,
            setpoints_refused=self.setpoints_refused,
            setpoint_interval=spread(self.setpoint_intervals_s),
            command_round_trip=spread(self.round_trips_s),
        )
