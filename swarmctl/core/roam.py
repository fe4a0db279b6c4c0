"""How targets move: people, animals, things adrift.  Where a target is, is a pure function of seed, target and time.

A wandering target swings about its own point, east and north on two incommensurate periods.  The targets of a
drifting cluster go to and fro together, at one speed on a straight way, and begin where they were laid out, so that a
drifting search starts from the same layout as one that stands still.  The way is drawn when the targets are laid
out: the roomiest of a few directions, and as far as none of the cluster's targets meets the area's border or a
keep-out.  Only wandering can lead a target across one, by its swing.
"""

import math

from .arrays import Floats, Integers, Records
from .jit import kernel
from .randoms import LAYOUT, uniform
from .scene import TURN

WAYS = 4  # directions drawn for a cluster, of which the roomiest is taken
CLEAR_M = 1.0  # a target turns back so far from a border: nothing that rounding could carry across
SECOND = 0.618  # a wandering target's northern rate as a share of its eastern one
FASTEST = math.hypot(1.0, SECOND)  # its greatest speed, as a share of its greatest speed east


@kernel
def _direction(seed: int, cluster: int, way: int) -> tuple[float, float]:
    angle = TURN * uniform(seed, cluster, way, LAYOUT + 32)
    return math.cos(angle), math.sin(angle)


@kernel
def _free(raw: Floats, x: float, y: float, east: float, north: float, most: float) -> float:
    """How far (m), up to ``most``, one may go from (x, y) along the unit vector (east, north) and meet no border."""
    free = most + CLEAR_M
    for k in range(raw.shape[0]):
        dx, dy = raw[k, 2] - raw[k, 0], raw[k, 3] - raw[k, 1]
        across = east * dy - north * dx
        if across == 0.0:
            continue  # along the border: its neighbours are met
        to_x, to_y = raw[k, 0] - x, raw[k, 1] - y
        along = (to_x * dy - to_y * dx) / across
        share = (to_x * north - to_y * east) / across
        if 0.0 <= share <= 1.0 and along >= 0.0:
            free = min(free, along)
    return max(free - CLEAR_M, 0.0)


@kernel
def lay_ways(
    seed: int, raw: Floats, most: float, places: Floats, clusters: Integers, room: Floats, grid: Records
) -> None:
    """Give each cluster, a row of ``grid``, its way: a direction, and how far ahead and behind it may go.

    ``places`` (T, 2) and ``clusters`` (T,) are the targets, ``room`` (clusters, WAYS, 2) is scratch.
    """
    room[:] = most
    for t in range(places.shape[0]):
        x, y, k = places[t, 0], places[t, 1], clusters[t]
        for way in range(WAYS):
            east, north = _direction(seed, k, way)
            room[k, way, 0] = min(room[k, way, 0], _free(raw, x, y, east, north, room[k, way, 0]))
            room[k, way, 1] = min(room[k, way, 1], _free(raw, x, y, -east, -north, room[k, way, 1]))
    for k in range(grid.shape[0]):
        best = 0
        for way in range(1, WAYS):
            if room[k, way, 0] + room[k, way, 1] > room[k, best, 0] + room[k, best, 1]:
                best = way
        grid[k].way_east, grid[k].way_north = _direction(seed, k, best)
        grid[k].ahead, grid[k].behind = room[k, best, 0], room[k, best, 1]


@kernel
def _drift(grid: Records, cluster: int, now: float) -> float:
    """How far (m) along its way a cluster is from where it was laid out, negative behind."""
    length = grid[cluster].ahead + grid[cluster].behind
    if length <= 0.0:
        return 0.0
    gone = (grid[cluster].behind + grid[0].drift_speed * now) % (2.0 * length)
    return float(min(gone, 2.0 * length - gone) - grid[cluster].behind)


@kernel
def place_at(grid: Records, targets: Records, t: int, now: float) -> tuple[float, float]:
    """Where target ``t`` is at time ``now`` (s)."""
    east, north = targets[t].east, targets[t].north
    if grid[0].wander > 0.0:
        rate = grid[0].wander_speed / (FASTEST * grid[0].wander)
        a = TURN * uniform(grid[0].seed, t, 0, LAYOUT + 30)
        b = TURN * uniform(grid[0].seed, t, 0, LAYOUT + 31)
        east += grid[0].wander * math.sin(rate * now + a)
        north += grid[0].wander * math.sin(SECOND * rate * now + b)
    if grid[0].drift_speed > 0.0:
        k = targets[t].cluster
        gone = _drift(grid, k, now)
        east += gone * grid[k].way_east
        north += gone * grid[k].way_north
    return east, north


@kernel
def stray(grid: Records) -> float:
    """How far (m) from its place in TARGET a target can be at most."""
    furthest = 0.0
    if grid[0].drift_speed > 0.0:
        for k in range(grid.shape[0]):
            furthest = max(furthest, max(grid[k].ahead, grid[k].behind))
    return float(furthest + math.sqrt(2.0) * grid[0].wander)
