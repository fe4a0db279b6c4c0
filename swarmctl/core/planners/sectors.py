"""Sectors: equal shares of the area, by angle about the launch place, agreed before anybody flies.

Every vehicle works its own sector out from what all know at launch: the fence, the fleet, and the headings handed
out to it.  Shares are in proportion to how fast a vehicle's sensor sweeps the ground, and are dealt in the order of
the headings, so that the ways to them do not cross.

Vehicles that start far from one another have no sectors but homes: all ground about the own launch place, rather more
than their share of the area.  So those of a large swarm search where they are.

The area within an angle about the launch place is a sum over the fence's edges: of the triangles that they make with
the launch place, counted negative where the edge is seen from its other side.  So any polygon with any keep-outs will
do whose borders all have the legal area on the same hand, and any launch place, inside, on the border or without.
"""

import math

from ..arrays import Floats, Records
from ..jit import kernel
from . import common

TURN = 2.0 * math.pi
PROBES = 72  # wedges in which an empty one is looked for, to begin to count at
HALVINGS = 32  # of a full turn: to 1.5e-9 rad
APART = 0.2  # launch places are far apart at so much, root mean square from their middle, of the area's width
HOME = 1.5  # radius of a home, that of a circle as large as the vehicle's share of the area being 1
FIELDS = (
    "launch_east", "launch_north", "left_east", "left_north", "right_east", "right_north", "wide", "home",
)  # fmt: skip


@kernel
def _part(low: float, high: float, at_begin: float, at_end: float) -> tuple[float, float]:
    """That part of a segment's part ``low`` to ``high`` where what changes evenly along it is not negative."""
    if at_begin < 0.0 and at_end < 0.0:
        return 1.0, 0.0
    if at_begin < 0.0:
        low = max(low, at_begin / (at_begin - at_end))
    elif at_end < 0.0:
        high = min(high, at_begin / (at_begin - at_end))
    return low, high


@kernel
def _wedge(edges: Floats, east: float, north: float, first: float, last: float) -> float:
    """The legal area (m²) seen from a place between two angles less than half a turn apart, but for the sign."""
    first_x, first_y, last_x, last_y = math.cos(first), math.sin(first), math.cos(last), math.sin(last)
    area = 0.0
    for k in range(edges.shape[0]):
        ax, ay = edges[k, 0] - east, edges[k, 1] - north
        bx, by = edges[k, 2] - east, edges[k, 3] - north
        low, high = _part(0.0, 1.0, first_x * ay - first_y * ax, first_x * by - first_y * bx)
        low, high = _part(low, high, ax * last_y - ay * last_x, bx * last_y - by * last_x)
        if low < high:
            area += 0.5 * (high - low) * (ax * by - ay * bx)
    return area


@kernel
def _whole(edges: Floats) -> float:
    """The legal area (m²), but for the sign."""
    area = 0.0
    for k in range(edges.shape[0]):
        area += 0.5 * (edges[k, 0] * edges[k, 3] - edges[k, 1] * edges[k, 2])
    return area


@kernel
def _share(edges: Floats, east: float, north: float, first: float, angle: float, whole: float) -> float:
    """The share of the area from the first angle to ``angle`` further on."""
    if angle <= math.pi:
        return _wedge(edges, east, north, first, first + angle) / whole
    return 1.0 - _wedge(edges, east, north, first + angle, first + TURN) / whole


@kernel
def _angle_of(edges: Floats, east: float, north: float, first: float, share: float, whole: float) -> float:
    """How far from the first angle there is so much of the area."""
    low, high = 0.0, TURN
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _share(edges, east, north, first, middle, whole) < share:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel
def _empty_direction(edges: Floats, east: float, north: float, whole: float) -> float:
    """The middle of the widest gap without any area; 0 where there is none (shares may begin anywhere)."""
    best, best_end, run = 0, 0, 0
    for k in range(2 * PROBES):  # twice round, for a gap that lies across the first angle
        first, last = TURN * k / PROBES, TURN * (k + 1) / PROBES
        if run < PROBES and _wedge(edges, east, north, first, last) / whole < 1e-9:
            run += 1
        else:
            run = 0
        if run > best:
            best, best_end = run, k + 1
    return TURN * (best_end - 0.5 * best) / PROBES


@kernel
def _order(x: float, y: float, first_x: float, first_y: float) -> float:
    """A number in [0, 4) that grows with the angle from the first direction to (x, y); all of length 1."""
    along, across = first_x * x + first_y * y, first_x * y - first_y * x
    return 1.0 - along if across >= 0.0 else 3.0 + along


@kernel
def _shares(fleet: Records, i: int, first: float) -> tuple[float, float]:
    """Vehicle ``i``'s share of the area from which to which, in the order of the initial headings from ``first``."""
    first_x, first_y = math.cos(first), math.sin(first)
    mine = _order(fleet[i].heading_east, fleet[i].heading_north, first_x, first_y)
    before, own, whole = 0.0, common.sweep_rate(fleet, i), 0.0
    for j in range(fleet.shape[0]):
        weight = common.sweep_rate(fleet, j)
        other = _order(fleet[j].heading_east, fleet[j].heading_north, first_x, first_y)
        whole += weight
        if other < mine or (other == mine and j < i):
            before += weight
    return before / whole, (before + own) / whole


@kernel
def _far_apart(fleet: Records, east: float, north: float, whole: float) -> bool:
    """Whether the launch places, whose middle is given, are spread over the area."""
    squared = 0.0
    for j in range(fleet.shape[0]):
        dx, dy = fleet[j].pad_east - east, fleet[j].pad_north - north
        squared += (dx * dx + dy * dy) / fleet.shape[0]
    return bool(squared > APART * APART * abs(whole))


@kernel
def _settle(memory: Records, i: int, fleet: Records, whole: float) -> None:
    """Make a home about the launch place of vehicle ``i``."""
    begin, end = _shares(fleet, i, 0.0)
    memory[i].launch_east, memory[i].launch_north = fleet[i].pad_east, fleet[i].pad_north
    memory[i].home = HOME * math.sqrt((end - begin) * abs(whole) / math.pi)


@kernel
def agree(memory: Records, i: int, fleet: Records, edges: Floats) -> None:
    """Work out the sector of vehicle ``i``, and head along the line that halves it; or its home."""
    east, north = 0.0, 0.0
    for j in range(fleet.shape[0]):
        east += fleet[j].pad_east / fleet.shape[0]
        north += fleet[j].pad_north / fleet.shape[0]
    whole = _whole(edges)
    memory[i].home = 0.0
    if _far_apart(fleet, east, north, whole):
        _settle(memory, i, fleet, whole)
        return
    first = _empty_direction(edges, east, north, whole)
    begin, end = _shares(fleet, i, first)
    left = first + (_angle_of(edges, east, north, first, begin, whole) if begin > 0.0 else 0.0)
    right = first + (_angle_of(edges, east, north, first, end, whole) if end < 1.0 else TURN)
    middle = first + _angle_of(edges, east, north, first, 0.5 * (begin + end), whole)
    memory[i].launch_east, memory[i].launch_north = east, north
    memory[i].left_east, memory[i].left_north = math.cos(left), math.sin(left)
    memory[i].right_east, memory[i].right_north = math.cos(right), math.sin(right)
    memory[i].wide = 1 if right - left > math.pi else 0
    memory[i].heading_east, memory[i].heading_north = math.cos(middle), math.sin(middle)


@kernel
def own(memory: Records, i: int, east: float, north: float) -> bool:
    """Whether a place lies in vehicle ``i``'s sector, or home."""
    x, y = east - memory[i].launch_east, north - memory[i].launch_north
    if memory[i].home > 0.0:
        return bool(x * x + y * y <= memory[i].home * memory[i].home)
    after_left = memory[i].left_east * y - memory[i].left_north * x >= 0.0
    before_right = memory[i].right_east * y - memory[i].right_north * x < 0.0
    return bool((after_left or before_right) if memory[i].wide != 0 else (after_left and before_right))
