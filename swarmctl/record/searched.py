"""What a search has come to, from its recording: who saw which target when, and what the summary counts.

A flight that continues another says at its beginning how far that had come; so a recording always tells of the
whole search.
"""

from dataclasses import dataclass

import numpy as np

from swarmctl.core.arrays import Integers, Records

from . import rows
from .errors import LogError
from .mcap_read import Log
from .replay import as_now, require_below

CONTINUES = "continues"
"""The name of the metadata that a flight which continues another has."""


@dataclass
class Searched:
    """``first_seen`` (V, T): the planner tick at which each vehicle first saw each target, -1: never; ``in_range``:
    reports of targets in all; ``alarms`` (V,): of what was not there."""

    first_seen: Integers
    in_range: int
    alarms: Integers

    @property
    def found(self) -> Integers:
        """The tick at which each target was first seen by anybody, (T,); -1: never."""
        never = np.iinfo(np.int64).max
        first = np.where(self.first_seen < 0, never, self.first_seen).min(axis=0, initial=never)
        return np.where(first == never, -1, first)

    def seen_rows(self) -> Records:
        """The same as /seen holds it."""
        vehicle, target = np.nonzero(self.first_seen >= 0)
        table = np.zeros(len(vehicle), rows.SEEN)
        table["vehicle"], table["target"] = vehicle, target
        table["tick"] = self.first_seen[vehicle, target]
        return table

    def metadata(self) -> dict[str, str]:
        """The counts, as a recording keeps them."""
        return {"in_range": str(self.in_range), "alarms": " ".join(map(str, self.alarms.tolist()))}


def searched(log: Log, vehicles: int, targets: int, ticks: int | None = None) -> Searched:
    """What the search on record came to, and all that it continued.

    ``ticks``: only so many planner ticks are counted, though whatever was seen later was seen.  Raises LogError.
    """
    so_far = _begun(log, vehicles, targets)
    first_seen = so_far.first_seen
    for message in log.rows("/seen", "/observations"):
        if message.topic == "/seen":
            table = as_now(message.rows, rows.SEEN, "/seen")
            require_below(vehicles, table["vehicle"], "/seen")
            require_below(targets, table["target"], "/seen")
            first_seen[table["vehicle"], table["target"]] = table["tick"]
            continue
        reports = as_now(message.rows, rows.OBSERVATION, "/observations")
        require_below(vehicles, reports["vehicle"], "/observations")
        true = reports[reports["id"] < targets]
        unseen = true[first_seen[true["vehicle"], true["id"]] < 0]
        first_seen[unseen["vehicle"], unseen["id"]] = message.tick
        if ticks is None or message.tick < ticks:
            so_far.in_range += len(true)
            np.add.at(so_far.alarms, reports["vehicle"][reports["id"] >= targets], 1)
    return so_far


def _begun(log: Log, vehicles: int, targets: int) -> Searched:
    """What the recording says of the flight that it continues; nothing, if it continues none."""
    counts = log.metadata.get(CONTINUES, {})
    try:
        alarms = np.array(counts.get("alarms", "0 " * vehicles).split(), np.int64)
        in_range = int(counts.get("in_range", "0"))
    except ValueError:
        raise LogError(f"{log.path}: {CONTINUES}: not a number; the recording was tampered with") from None
    if len(alarms) != vehicles:
        raise LogError(f"{log.path}: {CONTINUES}: of another number of vehicles")
    return Searched(np.full((vehicles, targets), -1, np.int64), in_range, alarms)
