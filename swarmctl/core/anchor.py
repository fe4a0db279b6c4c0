"""Anchors: circles in which vehicles are for a while, so that most setpoint ticks test neither fence nor others.

Around its anchor a vehicle moves freely for some metres (``freedom``).  From there no stop path, whatever it is told,
leads farther than it can fly in its latency and then brake: the path stays in the circle of radius ``hold``.  While
that holds no edge of the fence (``clear`` is how far the nearest is), the path needs no test against the fence; and
while two vehicles' circles are the separation apart, none against each other: ``near`` counts whose circles are not.
Where a vehicle is free of both, the guard lets it do what it wishes without looking any further.

Nothing here depends on how a vehicle came to where it is: anchors save time and change no decision.
"""

import math

from . import fence, guard
from .arrays import Floats, Records
from .jit import kernel

LEAST_FREEDOM_M, MOST_FREEDOM_M = 10.0, 400.0
FASTER_MPS = 0.1  # telemetry's rounding may show a vehicle faster than it can fly
ROUNDING_M = 1e-6


@kernel
def _reach(fleet: Records, i: int, fastest: float, interval: float) -> float:
    """How far (m) a stop path of vehicle ``i`` can lead that flies no faster than ``fastest``."""
    braking = guard.BRAKING_SHARE * fleet[i].braking
    lag = fleet[i].lag
    flown = (guard.under_way(fleet, i, interval) + 1) * interval * fastest
    braked = fastest * fastest / (2.0 * braking) + min(fastest, braking * lag) * lag
    return float(flown + braked + ROUNDING_M)


@kernel
def _near(paths: Records, i: int, j: int, wanted: float) -> bool:
    """Whether two vehicles' circles are not ``wanted`` apart; one without an anchor is nobody's neighbour."""
    if paths[i].hold == 0.0 or paths[j].hold == 0.0:
        return False
    dx = paths[i].anchor_east - paths[j].anchor_east
    dy = paths[i].anchor_north - paths[j].anchor_north
    room = wanted + paths[i].hold + paths[j].hold
    return not dx * dx + dy * dy > room * room


@kernel
def _count_neighbours(paths: Records, i: int, wanted: float, by: int) -> None:
    """Add ``by`` to the counts of vehicle ``i`` and of all that are near it."""
    for j in range(paths.shape[0] - 1):
        if j != i and _near(paths, i, j, wanted):
            paths[i].near += by
            paths[j].near += by


@kernel
def _freedom(paths: Records, i: int, x: float, y: float, reach: float, wanted: float) -> float:
    """Metres that vehicle ``i`` at (x, y) may move: half of what lies between it and the others, some in any case."""
    freedom = MOST_FREEDOM_M
    for j in range(paths.shape[0] - 1):
        if j != i and paths[j].hold != 0.0:
            dx, dy = x - paths[j].anchor_east, y - paths[j].anchor_north
            gap = math.sqrt(dx * dx + dy * dy) - paths[j].hold - reach - wanted
            freedom = min(freedom, 0.5 * gap)
    return max(freedom, LEAST_FREEDOM_M)


@kernel
def _clearance(edges: Floats, x: float, y: float) -> float:
    """Metres from (x, y) to the fence, on the safe side; negative outside."""
    if not fence.inside(edges, x, y):
        return -1.0
    border_x, border_y = fence.nearest(edges, x, y)
    return math.sqrt((border_x - x) * (border_x - x) + (border_y - y) * (border_y - y)) - ROUNDING_M


@kernel
def _drop(
    fleet: Records, i: int, poses: Records, speed: float, rules: Records, edges: Floats, paths: Records
) -> None:
    """Anchor vehicle ``i`` where it is."""
    wanted = rules[0].separation + guard.SEPARATION_MARGIN_M + ROUNDING_M
    _count_neighbours(paths, i, wanted, -1)
    x, y = poses[i].east, poses[i].north
    fastest = max(speed, fleet[i].speed) + FASTER_MPS
    reach = _reach(fleet, i, fastest, rules[0].interval)
    freedom = _freedom(paths, i, x, y, reach, wanted)
    clear = _clearance(edges, x, y)
    if clear - reach - ROUNDING_M > LEAST_FREEDOM_M:
        freedom = min(freedom, clear - reach - ROUNDING_M)
    paths[i].anchor_east, paths[i].anchor_north = x, y
    paths[i].freedom, paths[i].fastest = freedom, fastest
    paths[i].hold, paths[i].clear = freedom + reach, clear
    _count_neighbours(paths, i, wanted, 1)


@kernel
def settle(fleet: Records, i: int, poses: Records, rules: Records, edges: Floats, paths: Records) -> None:
    """See to it that vehicle ``i`` has an anchor that holds."""
    dx, dy = poses[i].east - paths[i].anchor_east, poses[i].north - paths[i].anchor_north
    vx, vy = poses[i].v_east, poses[i].v_north
    freedom, fastest = paths[i].freedom, paths[i].fastest
    if not (dx * dx + dy * dy < freedom * freedom and vx * vx + vy * vy <= fastest * fastest):
        _drop(fleet, i, poses, math.sqrt(vx * vx + vy * vy), rules, edges, paths)


@kernel
def surely_inside(paths: Records, i: int, x: float, y: float) -> bool:
    """Whether no edge of the fence lies between vehicle ``i``'s anchor, inside it, and (x, y)."""
    dx, dy = x - paths[i].anchor_east, y - paths[i].anchor_north
    clear = paths[i].clear
    return bool(clear > 0.0 and dx * dx + dy * dy < clear * clear)
