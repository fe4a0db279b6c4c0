"""Stub vehicles that are what a mission says they are: speed, acceleration, climb, pads, endurance."""

from collections.abc import Sequence

import numpy as np

from swarmctl.core.arrays import Records

from .fleet import StubFleet
from .pilot import Limits


def configured_fleet(
    vehicles: Records,
    origin: tuple[float, float, float],
    endurance_s: Sequence[float | None],
    interval_s: float,
    *,
    autopilots: Sequence[str] = ("px4",),
    wind_mps: tuple[float, float] = (0.0, 0.0),
) -> StubFleet:
    """A fleet that flies as ``vehicles`` (V,) VEHICLE, standing on their pads about ``origin``.

    ``interval_s`` is the time between two setpoints; bodies move in steps of just that.  ``autopilots``: one
    for all, or one each.  ``wind_mps``: east and north.
    """
    limits = [
        Limits(
            speed_mps=float(row["speed"]),
            acceleration_mps2=float(row["acceleration"]),
            braking_mps2=float(row["braking"]),
            climb_mps=float(row["climb"]),
            descent_mps=float(row["descent"]),
            lag_s=float(row["lag"]),
            climb_acceleration_mps2=float(row["climb_acceleration"]),
            endurance_s=endurance,
        )
        for row, endurance in zip(vehicles, endurance_s, strict=True)
    ]
    pads = np.column_stack((vehicles["pad_east"], vehicles["pad_north"]))
    return StubFleet(
        len(limits),
        origin=origin,
        pads_m=pads,
        limits=limits,
        autopilot=autopilots[0] if len(autopilots) == 1 else autopilots,
        wind_mps=wind_mps,
        step_s=interval_s,
    )
