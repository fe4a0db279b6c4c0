"""The figures of summary.json, computed from arrays of what truly happened.

Pure functions.  K ticks, V vehicles, T targets; metres east, north and up in the mission's frame; positions
need to be finite only where a vehicle is airborne.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEVELS_PERCENT = (25, 50, 75, 85)
SAME_HEIGHT_M = 5.0


def time_to(found_times_s: Floats, levels_percent: Sequence[int] = LEVELS_PERCENT) -> dict[str, float | None]:
    """When each share of all targets had been found, in seconds; None where it never was.

    ``found_times_s`` (T,): when each target was first found, infinity for never.
    """
    ordered = np.sort(found_times_s)
    times: dict[str, float | None] = {}
    for level in levels_percent:
        needed = -(-level * len(ordered) // 100)  # rounded up: 25 % of 10 targets are 3
        time_s = float(ordered[needed - 1]) if needed > 0 else float("inf")
        times[str(level)] = time_s if np.isfinite(time_s) else None
    return times


def min_separation(east: Floats, north: Floats, up: Floats, airborne: Flags) -> float | None:
    """The least horizontal distance (m) of two airborne vehicles less than 5 m apart in height.

    All arrays are (K, V).  None if no two were ever airborne at about one height.
    """
    least = np.inf
    for vehicle in range(east.shape[1] - 1):
        others = slice(vehicle + 1, None)
        one = slice(vehicle, vehicle + 1)
        level = np.abs(up[:, others] - up[:, one]) < SAME_HEIGHT_M
        met = level & airborne[:, others] & airborne[:, one]
        squared = (east[:, others] - east[:, one]) ** 2 + (north[:, others] - north[:, one]) ** 2
        least = min(least, float(np.min(squared, where=met, initial=np.inf)))
    return float(np.sqrt(least)) if np.isfinite(least) else None


def geofence_violations(
    east: Floats, north: Floats, airborne: Flags, inside: Callable[[Floats, Floats], Flags]
) -> int:
    """How many airborne positions (vehicles × ticks) are not ``inside``, which is asked for 1-D arrays."""
    return int(np.count_nonzero(~inside(east[airborne], north[airborne])))


def distance_flown(east: Floats, north: Floats, airborne: Flags) -> Floats:
    """The length (m) of each vehicle's track over ground while airborne, shape (V,)."""
    steps = np.hypot(np.diff(east, axis=0), np.diff(north, axis=0))
    flown: Floats = np.sum(steps, axis=0, where=airborne[1:] & airborne[:-1])
    return flown
