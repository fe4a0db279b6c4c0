"""Sectors: equal shares of the area, by angle about the launch place, agreed before anybody flies.

Every vehicle works its own sector out from what all know at launch: the fence, the fleet, and the headings handed
out to it.  Shares are in proportion to how fast a vehicle's sensor sweeps the ground, and are dealt in the order of
the headings, so that the ways to them do not cross.

The area within an angle about the launch place is a sum over the fence's edges: the triangle that an edge makes with
the launch place counts in full where the near side of the edge is legal, and is taken away where the far side is.  So
any polygon with any keep-outs will do, and any launch place, inside, on the border or without.
"""

import math

import numpy as np

from .. import fence
from ..arrays import Floats, Records
from ..jit import kernel

TURN = 2.0 * math.pi
PROBES = 72  # wedges in which an empty one is looked for, to begin to count at
HALVINGS = 32  # of a full turn: to 1.5e-9 rad
BESIDE = 1e-6  # share of its distance by which a point lies before or behind an edge
FIELDS = (
    "launch_east", "launch_north", "left_east", "left_north", "right_east", "right_north", "wide",
)  # fmt: skip


@kernel
def _turned(angle: float) -> float:
    """The same angle in [0, 2π)."""
    turned = angle % TURN
    return turned if turned < TURN else 0.0


@kernel
def _legal_side(edges: Floats, k: int, east: float, north: float) -> float:
    """1 if edge ``k``, looked at from a place, ends the legal area; -1 if the area begins there; 0 for neither."""
    dx = 0.5 * (edges[k, 0] + edges[k, 2]) - east
    dy = 0.5 * (edges[k, 1] + edges[k, 3]) - north
    near, far = 1.0 - BESIDE, 1.0 + BESIDE
    before = fence.inside(edges, east + near * dx, north + near * dy)
    behind = fence.inside(edges, east + far * dx, north + far * dy)
    return (1.0 if before else 0.0) - (1.0 if behind else 0.0)


@kernel
def _triangles(edges: Floats, east: float, north: float, first: float, triangles: Floats) -> None:
    """Each edge as seen from a place: angle from ``first`` and width, foot of the perpendicular, ± half its square."""
    for k in range(edges.shape[0]):
        ax, ay = edges[k, 0] - east, edges[k, 1] - north
        bx, by = edges[k, 2] - east, edges[k, 3] - north
        cross, dot = ax * by - ay * bx, ax * bx + ay * by
        if cross < 0.0:
            ax, ay, bx, by, cross = bx, by, ax, ay, -cross
        dx, dy = bx - ax, by - ay
        size = dx * dx + dy * dy
        triangles[k, 0] = _turned(math.atan2(ay, ax) - first)
        triangles[k, 1] = math.atan2(cross, dot)
        triangles[k, 2] = math.atan2(-ax * dx - ay * dy, cross)  # from the edge's beginning to the foot
        triangles[k, 3] = 0.0
        if cross > 1e-9 * size:
            triangles[k, 3] = 0.5 * cross * cross / size * _legal_side(edges, k, east, north)


@kernel
def _area(triangles: Floats, angle: float) -> float:
    """The legal area (m²) from the first angle to ``angle``, at most a full turn on."""
    area = 0.0
    for k in range(triangles.shape[0]):
        begin, width, foot, half = triangles[k, 0], triangles[k, 1], triangles[k, 2], triangles[k, 3]
        if half == 0.0:
            continue
        upto = min(angle - begin, width)
        if upto > 0.0:
            area += half * (math.tan(upto - foot) + math.tan(foot))
        over = min(angle, begin + width - TURN)  # what of it lies beyond the full turn comes first
        if over > 0.0:
            turned = TURN - begin - foot
            area += half * (math.tan(turned + over) - math.tan(turned))
    return area


@kernel
def _angle_of(triangles: Floats, area: float) -> float:
    """The angle up to which there is so much legal area."""
    low, high = 0.0, TURN
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _area(triangles, middle) < area:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel
def _empty_direction(triangles: Floats, whole: float) -> float:
    """The middle of the widest gap without any area; 0 where there is none (shares may begin anywhere)."""
    best, best_end = 0, 0
    run = 0
    for k in range(2 * PROBES):  # twice round, for a gap that lies across the first angle
        low, high = TURN * (k % PROBES) / PROBES, TURN * (k % PROBES + 1) / PROBES
        empty = _area(triangles, high) - _area(triangles, low) < 1e-9 * whole
        run = min(run + 1, PROBES) if empty else 0
        if run > best:
            best, best_end = run, k + 1
    return _turned(TURN * (best_end - 0.5 * best) / PROBES)


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
    before, own, whole = 0.0, fleet[i].speed * fleet[i].sensor_range, 0.0
    for j in range(fleet.shape[0]):
        weight = fleet[j].speed * fleet[j].sensor_range
        other = _order(fleet[j].heading_east, fleet[j].heading_north, first_x, first_y)
        whole += weight
        if other < mine or (other == mine and j < i):
            before += weight
    return before / whole, (before + own) / whole


@kernel
def agree(memory: Records, i: int, fleet: Records, edges: Floats) -> None:
    """Work out the sector of vehicle ``i``, and head along the line that halves it."""
    east, north = 0.0, 0.0
    for j in range(fleet.shape[0]):
        east += fleet[j].pad_east / fleet.shape[0]
        north += fleet[j].pad_north / fleet.shape[0]
    triangles = np.zeros((edges.shape[0], 4))
    _triangles(edges, east, north, 0.0, triangles)
    whole = _area(triangles, TURN)
    first = _empty_direction(triangles, whole)
    for k in range(edges.shape[0]):
        triangles[k, 0] = _turned(triangles[k, 0] - first)
    begin, end = _shares(fleet, i, first)
    left = first + (_angle_of(triangles, begin * whole) if begin > 0.0 else 0.0)
    right = first + (_angle_of(triangles, end * whole) if end < 1.0 else TURN)
    middle = first + _angle_of(triangles, 0.5 * (begin + end) * whole)
    memory[i].launch_east, memory[i].launch_north = east, north
    memory[i].left_east, memory[i].left_north = math.cos(left), math.sin(left)
    memory[i].right_east, memory[i].right_north = math.cos(right), math.sin(right)
    memory[i].wide = 1 if right - left > math.pi else 0
    memory[i].heading_east, memory[i].heading_north = math.cos(middle), math.sin(middle)


@kernel
def own(memory: Records, i: int, east: float, north: float) -> bool:
    """Whether a place lies in vehicle ``i``'s sector."""
    x, y = east - memory[i].launch_east, north - memory[i].launch_north
    after_left = memory[i].left_east * y - memory[i].left_north * x >= 0.0
    before_right = memory[i].right_east * y - memory[i].right_north * x < 0.0
    return (after_left or before_right) if memory[i].wide != 0 else (after_left and before_right)
