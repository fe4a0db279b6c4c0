"""Levelling: a vehicle that was taken back in the air comes to its search height, wherever it was found.

A firmware's own return climbs, and brings vehicles together, so nothing is presumed: two may be at one height and
nearer than the separation, or one above the other.  TAKEN, a vehicle keeps its height and makes for the nearest place
where nobody is in the column between that and its search height.  There it claims the column (LEVEL), which the
guards of all others then keep clear of, and changes height in it, standing.  Then it holds (HOLD).

Whoever is taken back moves sideways only as the guard allows, which lets a pair that is too near do nothing but
part or stand.  It changes height only where nobody is, so it never comes down, or up, upon another.
"""

import math

from . import fence, guard, homing, stages
from .arrays import Floats, Records
from .jit import kernel

REACHED_M = 0.6  # so near to its search height a vehicle is there
DRIFT_M = 1.5  # so far from the height that it keeps, it keeps the one where it is: it was still climbing or sinking
AWAY_MPS = 3.0
PLACES_ROUND, MOST_CIRCLES = (
    16,
    16,
)  # places tried on each circle round where it is, and circles, half the room apart
MARGIN_M = 1.0  # a place must be so much clearer of others than it needs


@kernel
def kept_height(poses: Records, errands: Records, i: int) -> float:
    """The height that a vehicle TAKEN keeps: where it was when it was taken back, or has come to since."""
    up, kept = float(poses[i].up), float(errands[i].wait_up)
    return kept if abs(kept - up) <= DRIFT_M else up


@kernel
def _column_is_clear(paths: Records, i: int, row: int, low: float, high: float, room: float) -> bool:
    """Whether no vehicle's path but ``i``'s comes within ``room`` of path ``row``, at any height from low to high."""
    for j in range(paths.shape[0] - 1):
        gap = max(paths[j].low - high, low - paths[j].high)
        if j == i or paths[j].airborne == 0 or gap >= guard.HEIGHT_SEPARATION_M + guard.HEIGHT_MARGIN_M:
            continue
        if guard.path_distance(paths, row, j) < room * room:
            return False
    return True


@kernel
def _head_for_a_clear_one(
    poses: Records, i: int, low: float, high: float, room: float, edges: Floats, paths: Records, wants: Records
) -> None:  # fmt: skip
    """Want the velocity to the nearest place with a clear column; where there is none, stand."""
    row = paths.shape[0] - 1
    for circle in range(1, MOST_CIRCLES + 1):
        for k in range(PLACES_ROUND):
            east = math.cos(2.0 * math.pi * k / PLACES_ROUND)
            north = math.sin(2.0 * math.pi * k / PLACES_ROUND)
            x, y = poses[i].east + 0.5 * room * circle * east, poses[i].north + 0.5 * room * circle * north
            paths[row].east_0, paths[row].east_1, paths[row].east_2 = x, x, x
            paths[row].north_0, paths[row].north_1, paths[row].north_2 = y, y, y
            if fence.inside(edges, x, y) and _column_is_clear(paths, i, row, low, high, room + MARGIN_M):
                wants[i].v_east, wants[i].v_north = AWAY_MPS * east, AWAY_MPS * north
                return


@kernel
def level(
    fleet: Records, poses: Records, errands: Records, i: int, rules: Records, edges: Floats, paths: Records,
    wants: Records,
) -> None:  # fmt: skip
    """What a vehicle TAKEN or at LEVEL wants at this setpoint tick; moves it on to its next stage."""
    up = fleet[i].altitude
    wants[i].up = up
    if errands[i].stage == stages.LEVEL:
        if abs(poses[i].up - up) < REACHED_M:
            errands[i].stage = stages.HOLD
        return
    kept = kept_height(poses, errands, i)
    errands[i].wait_up = kept
    low, high = min(kept, up), max(kept, up)
    room = homing.room_of(rules)
    if not _column_is_clear(paths, i, i, low, high, room):
        wants[i].up = kept
        _head_for_a_clear_one(poses, i, low, high, room, edges, paths, wants)
        return
    errands[i].stage = stages.LEVEL
    paths[i].low, paths[i].high = min(low, poses[i].up), max(high, poses[i].up)
