"""A fleet of stub vehicles: all bodies moved by one compiled call, then each vehicle's own protocol.

A tick is: `advance` to it, read every vehicle's `outgoing`, give it what comes back with `receive`.  What
arrives at a tick acts from there to the next one.  Bodies move in fixed steps, so that a flight does not
depend on how often `advance` is called.
"""

import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmctl.core.bind import compiled

from . import bodies
from .faults import FaultOrder
from .pilot import Limits, Pilot
from .vehicle import StubVehicle, Surroundings

move = compiled(bodies.move)
read_sensors = compiled(bodies.read_sensors)

STEP_S = 0.02
ALTITUDE_ERROR_M, START_ERROR_M = 0.7, 0.3
"""At most so much do a vehicle's altitude above sea level and the origin of its local frame deviate."""
STEP_TOLERANCE = 1e-6
"""Part of a step by which a time may fall short of it: what rounding does to seconds."""


class StubFleet:
    """``count`` vehicles with system ids from 1.

    ``origin``: latitude, longitude (degrees) and altitude (m above sea level) of the common frame and of the
    ground.  ``pads_m``: (V, 2) metres east and north of it, where the vehicles stand.  ``limits``: one for
    all, or one each; None: the firmware's own.  ``autopilot``: one for all, or one each.  ``wind_mps``: east
    and north.  ``seed``: altitudes and local origins scatter by it as they do between real vehicles, and the
    network's dice are thrown by it; None: nothing scatters.  ``now``: the time of boot in seconds.  ``key``: what
    all sign with and demand of others, ``date_s`` (seconds since 1970) being their date at time zero; None: nobody
    does.  Raises ValueError for an autopilot that cannot be played, or pads, limits or autopilots that are not one
    a vehicle.
    """

    def __init__(
        self,
        count: int,
        *,
        origin: tuple[float, float, float],
        pads_m: Sequence[Sequence[float]] | NDArray[np.float64],
        limits: Limits | Sequence[Limits] | None = None,
        autopilot: str | Sequence[str] = "px4",
        wind_mps: tuple[float, float] = (0.0, 0.0),
        seed: int | None = None,
        now: float = 0.0,
        step_s: float = STEP_S,
        key: bytes | None = None,
        date_s: float = 0.0,
    ) -> None:
        each_limits = [limits] * count if limits is None or isinstance(limits, Limits) else list(limits)
        autopilots = [autopilot] * count if isinstance(autopilot, str) else list(autopilot)
        if not len(pads_m) == len(each_limits) == len(autopilots) == count:
            raise ValueError(
                f"{count} vehicles need as many pads, limits and autopilots, "
                f"not {len(pads_m)}, {len(each_limits)} and {len(autopilots)}"
            )
        self.truth = np.zeros(count, bodies.BODY)
        self.wind_mps = wind_mps
        self._commands = np.zeros(count, bodies.COMMAND)
        self._limits = np.zeros(count, bodies.LIMITS)
        self._wire = np.zeros((count, len(bodies.WIRE_COLUMNS)), np.int64)
        self._altitude_errors = np.zeros(count)
        self._rows = self.truth.view(np.float64).reshape(count, -1)
        self._rows[:, :2] = pads_m
        self._origin = origin
        self._boot = now
        self._key, self._date_s = key, date_s
        self._step_s = step_s
        self._steps = 0
        self._to_come: list[tuple[float, int, Callable[[], None]]] = []
        self._ordered = 0
        self.vehicles = [self._vehicle(k, autopilots[k], each_limits[k], seed) for k in range(count)]
        self._move(0)  # compiled here, not in the first tick
        self._tell_bodies()

    def _vehicle(self, index: int, autopilot: str, limits: Limits | None, seed: int | None) -> StubVehicle:
        """The vehicle of one row."""
        surroundings = Surroundings(self._origin, key=self._key, date_s=self._date_s)
        if seed is not None:
            dice = Random(f"{seed} {index}")
            start = (dice.uniform(-START_ERROR_M, START_ERROR_M), dice.uniform(-START_ERROR_M, START_ERROR_M))
            altitude = dice.uniform(-ALTITUDE_ERROR_M, ALTITUDE_ERROR_M)
            height = dice.uniform(-START_ERROR_M, START_ERROR_M)
            surroundings = replace(
                surroundings, altitude_error_m=altitude, start_error_m=(*start, height), seed=seed
            )
        self._altitude_errors[index] = surroundings.altitude_error_m
        pilot = Pilot(self._commands, self._limits, index)
        pilot.place = tuple(self._rows[index].tolist())
        return StubVehicle(index + 1, autopilot, pilot, limits, surroundings, self._boot)

    def order(self, fault: FaultOrder) -> None:
        """Let a fault happen at its time.  Raises ValueError for a vehicle that there is not."""
        if fault.system is not None and not 1 <= fault.system <= len(self.vehicles):
            raise ValueError(f"fault {fault.name}: there is no vehicle {fault.system}")
        begin = self._boot + fault.at_s
        for vehicle in self.vehicles if fault.system is None else [self.vehicles[fault.system - 1]]:
            self._at(begin, partial(vehicle.faults.begin, fault.name, fault.value))
            if fault.for_s < math.inf:
                self._at(begin + fault.for_s, partial(vehicle.faults.end, fault.name))

    def _at(self, time: float, action: Callable[[], None]) -> None:
        """Have something done at the first tick not before ``time``."""
        self._ordered += 1
        heapq.heappush(self._to_come, (time, self._ordered, action))

    def advance(self, now: float) -> None:
        """Move every body on to ``now`` (seconds, never backwards), then let every vehicle act and send."""
        steps = max(0, int((now - self._boot) / self._step_s + STEP_TOLERANCE) - self._steps)
        self._move(steps)
        self._steps += steps
        self._tell_bodies()
        while self._to_come and self._to_come[0][0] <= now + STEP_TOLERANCE:
            heapq.heappop(self._to_come)[2]()
        for vehicle in self.vehicles:
            vehicle.advance(now)

    def _move(self, steps: int) -> None:
        wind_east, wind_north = self.wind_mps
        move(
            self.truth, self._commands, self._limits, float(wind_east), float(wind_north), steps, self._step_s
        )

    def _tell_bodies(self) -> None:
        """Give every vehicle its place and motion, true and as its sensors read them."""
        read_sensors(self.truth, self._wire, self._altitude_errors, *self._origin)
        boot_ms = round(self._steps * self._step_s * 1000.0)
        places: Any = map(tuple, self._rows.tolist())
        wires: Any = map(tuple, self._wire.tolist())
        for vehicle, place, wire in zip(self.vehicles, places, wires, strict=True):
            vehicle.pilot.place = place
            vehicle.wire = wire
            vehicle.boot_ms = max(0, boot_ms - vehicle.boot_offset_ms)
