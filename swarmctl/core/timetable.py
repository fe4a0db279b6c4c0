"""Timetable: who sets out for home when, and in which height layer.

A few layers, 6 m apart, the lowest at the vehicle's own search height, are shared by all who return.  Each is
given the layer and the departure with which it is down soonest, so that at its planned pace it comes near nobody
of its layer who was given a place before: ways that cross at one height are flown at different times.  Those with
the shortest way come first, since they are the first to get out of the others' way.

This is a plan, drawn once, and nothing rests on it but speed.  Vehicles that are late are kept apart by the guard,
and core/homing.py sees to it that nobody waits for ever.
"""

import math

import numpy as np

from . import motion, stages
from .arrays import Floats, Integers, Records
from .jit import allocating_kernel, kernel

LAYER_M = 6.0
LAYERS = 5  # shared by all; only who is stuck climbs beyond
LATER_S = 1.0  # departures are tried in steps of this
ARRIVAL_S = (
    7.0  # from a way's end at full speed: braking, coming to rest over the pad, sinking out of the layer
)


@kernel
def leg_start(errands: Records, poses: Records, i: int, k: int) -> tuple[float, float]:
    """Where the leg to point ``k`` of vehicle ``i``'s remaining way begins: the point before, or where it is."""
    if k <= errands[i].next:
        return float(poses[i].east), float(poses[i].north)
    return float(errands[i].route_east[k - 1]), float(errands[i].route_north[k - 1])


@kernel
def _length(errands: Records, poses: Records, i: int) -> float:
    """Metres that vehicle ``i`` still has to fly."""
    length = 0.0
    for k in range(errands[i].next, errands[i].points):
        x, y = leg_start(errands, poses, i, k)
        dx, dy = errands[i].route_east[k] - x, errands[i].route_north[k] - y
        length += math.sqrt(dx * dx + dy * dy)
    return length


@kernel
def _place_after(errands: Records, poses: Records, i: int, metres: float) -> tuple[float, float]:
    """Where vehicle ``i`` is after so many metres of its remaining way; at its end after more."""
    last = errands[i].points - 1
    for k in range(errands[i].next, errands[i].points):
        x, y = leg_start(errands, poses, i, k)
        dx, dy = errands[i].route_east[k] - x, errands[i].route_north[k] - y
        size = math.sqrt(dx * dx + dy * dy)
        if metres <= size:
            share = metres / max(size, 1e-9)
            return x + share * dx, y + share * dy
        metres -= size
    return float(errands[i].route_east[last]), float(errands[i].route_north[last])


@kernel
def _reach(fleet: Records, i: int) -> float:
    """Metres ahead of vehicle ``i`` at full speed that the guard keeps clear."""
    return motion.stopping_distance(fleet[i].speed, fleet[i].braking, fleet[i].latency + fleet[i].lag)


@kernel
def _meet(
    fleet: Records, poses: Records, errands: Records, i: int, j: int, starts: Floats, lengths: Floats,
    separation: float,
) -> bool:  # fmt: skip
    """Whether vehicles ``i`` and ``j``, each setting out at its ``starts`` (s), come near each other on the way."""
    arrival_i = starts[i] + lengths[i] / fleet[i].speed
    arrival_j = starts[j] + lengths[j] / fleet[j].speed
    t = max(starts[i], starts[j])
    while t < min(arrival_i, arrival_j) + ARRIVAL_S:
        ax, ay = _place_after(errands, poses, i, fleet[i].speed * (t - starts[i]))
        bx, by = _place_after(errands, poses, j, fleet[j].speed * (t - starts[j]))
        room = separation
        if t < arrival_i or t < arrival_j:
            room += max(_reach(fleet, i), _reach(fleet, j))
        gap = math.sqrt((ax - bx) * (ax - bx) + (ay - by) * (ay - by)) - room
        if gap < 0.0:
            return True
        t += max(gap / (fleet[i].speed + fleet[j].speed), 0.5)
    return False


@kernel
def _departure(
    fleet: Records, poses: Records, errands: Records, i: int, layer: float, starts: Floats, lengths: Floats,
    separation: float,
) -> float:  # fmt: skip
    """The first time (s), from ``starts[i]`` on, at which vehicle ``i`` meets nobody in ``layer``; leaves it there."""
    j = 0
    while j < errands.shape[0]:
        shares = (
            stages.WAIT <= errands[j].stage <= stages.DESCEND
            and abs(errands[j].layer - layer) < LAYER_M - 1e-6
        )
        if j != i and shares and _meet(fleet, poses, errands, i, j, starts, lengths, separation):
            starts[i] += LATER_S
            j = 0
        else:
            j += 1
    return float(starts[i])


@kernel
def _searched(fleet: Records, errands: Records, height: float) -> bool:
    """Whether somebody still searches near ``height``."""
    for j in range(errands.shape[0]):
        searching = stages.TAKE_OFF <= errands[j].stage <= stages.SEARCH
        if searching and abs(fleet[j].altitude - height) < LAYER_M - 1e-6:
            return True
    return False


@kernel
def _give_place(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, starts: Floats, lengths: Floats,
    separation: float,
) -> None:  # fmt: skip
    """Vehicle ``i``'s layer and departure: those with which it is down soonest."""
    best, best_start = math.inf, now
    for k in range(LAYERS):
        layer = fleet[i].altitude + LAYER_M * k
        starts[i] = now + abs(layer - poses[i].up) / fleet[i].climb
        start = _departure(fleet, poses, errands, i, layer, starts, lengths, separation)
        down = start + layer / fleet[i].descent
        if _searched(fleet, errands, layer):
            down += 1e6  # only if all are
        if down < best:
            best, best_start = down, start
            errands[i].layer = layer
    starts[i] = best_start
    errands[i].release_at = best_start


@allocating_kernel
def draw_up(
    fleet: Records, poses: Records, errands: Records, orders: Integers, now: float, separation: float
) -> None:  # fmt: skip
    """Give a layer and a departure to everyone with a one in ``orders`` (V,), the shortest way first."""
    starts, lengths = np.empty(orders.shape[0]), np.empty(orders.shape[0])
    for i in range(orders.shape[0]):
        lengths[i] = _length(errands, poses, i)
        starts[i] = max(now, errands[i].release_at)
        if orders[i] != 0:
            errands[i].layer = math.inf  # in nobody's way until it has its place
    for _ in range(orders.shape[0]):
        first = -1
        for i in range(orders.shape[0]):
            placed = orders[i] == 0 or errands[i].layer < math.inf
            if not placed and (first < 0 or lengths[i] < lengths[first]):
                first = i
        if first >= 0:
            _give_place(fleet, poses, errands, first, now, starts, lengths, separation)
