"""What a link did: counts, and the spread of setpoint intervals and command round trips."""

from array import array
from dataclasses import dataclass


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
