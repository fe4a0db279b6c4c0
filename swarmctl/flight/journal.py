"""The flight's recorder: what the loop tells it goes to flight.mcap and flight.tlog, the oldest first."""

import contextlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from swarmctl.core.world import World
from swarmctl.record import rows
from swarmctl.record.errors import RecordError
from swarmctl.record.folder import RunFolder
from swarmctl.record.mcap_log import Channel, McapLog
from swarmctl.record.searched import CONTINUES
from swarmctl.record.tlog import TlogWriter

FLUSH_S = 30.0
"""Flight time between two flushes, a fraction of a second of the wall's in lockstep: all that a crash can take.

By flight time, so that the same flight writes the same bytes.
"""


class _Nowhere:
    """Takes every record and keeps none."""

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_, **__: None


class Journal:
    """Writes one flight.  Raises RunFolderError where the disk refuses; ``close`` in any case."""

    def __init__(
        self,
        folder: RunFolder,
        world: World,
        mission_text: str,
        about: Mapping[str, str],
        flush_s: float = FLUSH_S,
    ) -> None:
        self._flush_s = flush_s
        self._world = world
        self._log: Any = McapLog(folder.mcap)
        self._tlog: Any = TlogWriter(folder.tlog)
        self._tick_rows = np.zeros(len(world.fleet), rows.TICK)
        self._flushed = 0.0
        self._log.attach("mission.yaml", mission_text)
        self._log.metadata("flight", about)
        once = (
            ("/rules", world.rules), ("/fleet", world.fleet), ("/settings", world.settings),
            ("/targets", world.scene.targets), ("/fence", rows.fence(world)),
        )  # fmt: skip
        for topic, array in once:
            self._log.write_rows(self._log.channel(topic, array.dtype), 0, 0.0, array)
        self._observations = self._log.channel("/observations", rows.OBSERVATION)
        self._beacons = self._log.channel("/beacons", world.beacons.dtype)
        self._heard = self._log.channel("/heard", rows.HEARD)
        self._decisions = self._log.channel("/decisions", rows.DECISION)
        self._ticks = self._log.channel("/ticks", rows.TICK)

    def continues(self, about: Mapping[str, str], seen: rows.Records) -> None:
        """At the start of a flight that goes on where another ended: which one, and what had been seen by then."""
        self._log.metadata(CONTINUES, about)
        self._log.write_rows(self._log.channel("/seen", rows.SEEN), 0, 0.0, seen)

    def state(self, tick: int, now: float) -> None:
        """Before a planner tick, or at the start of a flight that goes on: all memory."""
        self._log.write_bytes("/state", tick, now, rows.dump_state(self._world))

    def planner_tick(self, tick: int, now: float) -> None:
        """After a planner tick: what passed between its stages."""
        world, slot = self._world, tick % self._world.depth
        write: tuple[tuple[Channel, rows.Records], ...] = (
            (self._observations, rows.observations(world)),
            (self._beacons, world.beacons[slot]),
            (self._heard, rows.heard(world, slot)),
            (self._decisions, rows.decisions(world)),
        )
        for channel, array in write:
            self._log.write_rows(channel, tick, now, array)

    def before_steering(self) -> None:
        """The guard's inputs at this setpoint tick."""
        rows.tick_inputs(self._world, self._tick_rows)

    def after_steering(self, tick: int, now: float) -> None:
        """The guard's outputs; the tick is written."""
        rows.tick_outputs(self._world, self._tick_rows)
        self._log.write_rows(self._ticks, tick, now, self._tick_rows)

    def frames(self, now: float, frames: list[bytes]) -> None:
        """MAVLink frames of either direction."""
        self._tlog.write(now, frames)

    def event(self, now: float, vehicle: int, kind: str, text: str) -> None:
        """Something happened to a vehicle (its system id; 0: to the flight)."""
        self._log.write_json(
            "/events", now, {"time_s": round(now, 3), "vehicle": vehicle, "kind": kind, "text": text}
        )

    def stop(self) -> None:
        """Record nothing more, and never raise again: the disk refuses, or the flight is being broken off."""
        for file in (self._log, self._tlog):
            with contextlib.suppress(RecordError, OSError):
                file.close()
        self._log = self._tlog = _Nowhere()

    def breathe(self, now: float) -> None:
        """Now and then give what was written to the operating system."""
        if now - self._flushed >= self._flush_s:
            self._flushed = now
            self._log.flush()
            self._tlog.flush()

    def close(self) -> None:
        """Finish both files."""
        try:
            self._log.close()
        finally:
            self._tlog.close()
