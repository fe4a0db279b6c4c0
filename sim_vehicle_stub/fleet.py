"""A fleet of stub vehicles: all bodies moved by one compiled call, then each vehicle's own protocol.

A tick is: `advance` to it, read every vehicle's `outgoing`, give it what comes back with `receive`.  What
arrives at a tick acts from there to the next one.  Bodies move in fixed steps, so that a flight does not
depend on how often `advance` is called.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmctl.core.bind import compiled
from swarmctl.core.calls import to_geodetic

from . import bodies
from .pilot import Limits, Pilot
from .vehicle import StubVehicle

move = compiled(bodies.move)
read_sensors = compiled(bodies.read_sensors)

STEP_S = 0.02
STEP_TOLERANCE = 1e-6
"""Part of a step by which a time may fall short of it: what rounding does to seconds."""


class StubFleet:
    """``count`` vehicles with system ids from 1.

    ``origin``: latitude, longitude (degrees) and altitude (m above sea level) of the common frame and of the
    ground.  ``pads_m``: (V, 2) metres east and north of it, where the vehicles stand.  ``limits``: one for
    all, or one each.  ``now``: the time of boot in seconds.  Raises ValueError for an autopilot that cannot
    be played, or pads or limits that are not one a vehicle.
    """

    def __init__(
        self,
        count: int,
        *,
        origin: tuple[float, float, float],
        pads_m: Sequence[Sequence[float]] | NDArray[np.float64],
        limits: Limits | Sequence[Limits] = Limits(),  # noqa: B008 - frozen
        autopilot: str = "px4",
        now: float = 0.0,
        step_s: float = STEP_S,
    ) -> None:
        each = [limits] * count if isinstance(limits, Limits) else list(limits)
        if len(pads_m) != count or len(each) != count:
            raise ValueError(
                f"{count} vehicles need as many pads and limits, not {len(pads_m)} and {len(each)}"
            )
        self.truth = np.zeros(count, bodies.BODY)
        self._commands = np.zeros(count, bodies.COMMAND)
        self._limits = np.zeros(count, bodies.LIMITS)
        self._wire = np.zeros((count, len(bodies.WIRE_COLUMNS)), np.int64)
        self._rows = self.truth.view(np.float64).reshape(count, -1)
        self._rows[:, :2] = pads_m
        self._origin = origin
        self._boot = now
        self._step_s = step_s
        self._steps = 0
        self.vehicles = [self._vehicle(index, autopilot, each[index]) for index in range(count)]
        move(self.truth, self._commands, self._limits, 0, step_s)  # compiled here, not in the first tick
        self._tell_bodies()

    def _vehicle(self, index: int, autopilot: str, limits: Limits) -> StubVehicle:
        """The vehicle of one row."""
        lat, lon = to_geodetic(self._rows[index, 0], self._rows[index, 1], *self._origin)
        place = (lat, lon, self._origin[2])
        pilot = Pilot(self._commands, self._limits, index)
        return StubVehicle(index + 1, autopilot, pilot, limits, place, self._origin, self._boot)

    def advance(self, now: float) -> None:
        """Move every body on to ``now`` (seconds, never backwards), then let every vehicle act and send."""
        steps = max(0, int((now - self._boot) / self._step_s + STEP_TOLERANCE) - self._steps)
        move(self.truth, self._commands, self._limits, steps, self._step_s)
        self._steps += steps
        self._tell_bodies()
        for vehicle in self.vehicles:
            vehicle.advance(now)

    def _tell_bodies(self) -> None:
        """Give every vehicle its place and motion, true and as its sensors read them."""
        read_sensors(self.truth, self._wire, *self._origin)
        boot_ms = round(self._steps * self._step_s * 1000.0)
        rows: Any = self._rows.tolist()
        wires: Any = self._wire.tolist()
        for vehicle, row, wire in zip(self.vehicles, rows, wires, strict=True):
            vehicle.pilot.place = tuple(row)
            vehicle.wire = tuple(wire)
            vehicle.boot_ms = boot_ms
