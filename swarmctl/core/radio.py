"""Radio: who hears whose beacon.  It emulates range, loss and delay; a real network takes its place.

Two hear each other up to the shorter of their ranges; range 0 is a radio that is off, even on the very same spot.

A beacon is sent once a period and heard, after the delay, by every vehicle that was in range when it was
sent and did not lose it.  Beacons on their way lie in a ring of slots, one a period.

A small swarm is gone through pair by pair.  In a large one vehicles are sorted into cells as wide as the furthest
radio reaches, and only those of neighbouring cells are looked at.  Senders are gone through by number, so every
list of whom a vehicle hears is in order of number, however it was found.
"""

import math

import numpy as np

from .arrays import Integers, Records
from .jit import allocating_kernel, kernel
from .randoms import LOSS, uniform

MOST_HEARD = 255  # beacons that a radio takes in a period: the lowest numbers
_PAIRWISE = 48  # vehicles up to which all pairs are gone through
_LEAST_CELL_M = 100.0


@kernel
def _hear(
    fleet: Records,
    i: int,
    j: int,
    rules: Records,
    tick: int,
    slot: int,
    heard: Integers,
    heard_count: Integers,
) -> None:
    """Vehicle ``i`` hears ``j``, which is in range, unless the beacon is lost."""
    count = heard_count[slot, i]
    if count == heard.shape[2]:
        return
    loss = fleet[i].radio_loss
    if loss > 0.0 and uniform(rules[0].seed, i, tick, LOSS + j) < loss:
        return
    heard[slot, i, count] = j
    heard_count[slot, i] = count + 1


@kernel
def _all_pairs(
    fleet: Records,
    poses: Records,
    rules: Records,
    tick: int,
    slot: int,
    heard: Integers,
    heard_count: Integers,
) -> float:
    nearest = math.inf
    for i in range(poses.shape[0]):
        x, y, reach_i = poses[i].east, poses[i].north, fleet[i].radio_range
        for j in range(i + 1, poses.shape[0]):
            dx = poses[j].east - x
            dy = poses[j].north - y
            squared = dx * dx + dy * dy
            nearest = min(nearest, squared)
            reach = min(reach_i, fleet[j].radio_range)
            if reach > 0.0 and squared <= reach * reach:
                _hear(fleet, i, j, rules, tick, slot, heard, heard_count)
                _hear(fleet, j, i, rules, tick, slot, heard, heard_count)
    return nearest


@kernel
def _cells(fleet: Records, poses: Records) -> tuple[float, float, float, int, int]:
    """A grid over all vehicles, cells as wide as the furthest radio reaches: west, south, size, columns, rows."""
    west, south, east, north, size = math.inf, math.inf, -math.inf, -math.inf, _LEAST_CELL_M
    for i in range(poses.shape[0]):
        west, east = min(west, poses[i].east), max(east, poses[i].east)
        south, north = min(south, poses[i].north), max(north, poses[i].north)
        size = max(size, fleet[i].radio_range)
    while ((east - west) / size + 1.0) * ((north - south) / size + 1.0) > 4.0 * poses.shape[0]:
        size *= 2.0
    return west, south, size, int((east - west) / size) + 1, int((north - south) / size) + 1


@kernel
def _sort_by_cell(cell_of: Integers, starts: Integers, order: Integers) -> None:
    """``order`` (V,): vehicles by cell, by number within; cell c holds places ``starts[c]`` to ``starts[c + 1]``."""
    for i in range(cell_of.shape[0]):
        starts[cell_of[i] + 2] += 1
    for c in range(2, starts.shape[0]):
        starts[c] += starts[c - 1]
    for i in range(cell_of.shape[0]):
        order[starts[cell_of[i] + 1]] = i
        starts[cell_of[i] + 1] += 1


@allocating_kernel
def _by_cells(
    fleet: Records,
    poses: Records,
    rules: Records,
    tick: int,
    slot: int,
    heard: Integers,
    heard_count: Integers,
) -> float:
    """As all pairs; the nearest distance is exact up to the size of a cell."""
    west, south, size, columns, rows = _cells(fleet, poses)
    count = poses.shape[0]
    cell_of, order = np.empty(count, np.int64), np.empty(count, np.int64)
    for i in range(count):
        cell_of[i] = int((poses[i].north - south) / size) * columns + int((poses[i].east - west) / size)
    starts = np.zeros(columns * rows + 2, np.int64)
    _sort_by_cell(cell_of, starts, order)
    nearest = math.inf
    for i in range(count):
        x, y, reach_i = poses[i].east, poses[i].north, fleet[i].radio_range
        row, column = cell_of[i] // columns, cell_of[i] % columns
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            first = r * columns + max(column - 1, 0)
            last = r * columns + min(column + 1, columns - 1)
            for place in range(starts[first], starts[last + 1]):
                j = order[place]
                if j == i:
                    continue
                dx = poses[j].east - x
                dy = poses[j].north - y
                squared = dx * dx + dy * dy
                nearest = min(nearest, squared)
                reach = min(reach_i, fleet[j].radio_range)
                if reach > 0.0 and squared <= reach * reach:
                    _hear(fleet, j, i, rules, tick, slot, heard, heard_count)
    return nearest


@kernel
def deliver(
    fleet: Records,
    poses: Records,
    rules: Records,
    tick: int,
    slot: int,
    heard: Integers,
    heard_count: Integers,
) -> float:
    """List in ``heard[slot, i]`` the senders that each vehicle i will hear of this tick's beacons, by number.

    Returns the squared distance (m²) of the two vehicles nearest to one another; infinity for a single one.
    """
    for i in range(poses.shape[0]):
        heard_count[slot, i] = 0
    if poses.shape[0] <= _PAIRWISE:
        return _all_pairs(fleet, poses, rules, tick, slot, heard, heard_count)
    return _by_cells(fleet, poses, rules, tick, slot, heard, heard_count)
