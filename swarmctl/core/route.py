"""The shortest way between two points of a region: along the corners that see one another (Lozano-Pérez 1979).

Corners are those of the planners' region (keep-outs grown by the fence margin); legs are tested against the
guard's, which is wider, so that a route keeps off the fence the guard holds.
"""

import math

import numpy as np

from . import fence
from .arrays import Floats, Records
from .jit import allocating_kernel, kernel
from .state import ROUTE_POINTS


@kernel
def _sees(guard_edges: Floats, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether one may fly straight from a to b, both inside or on the border."""
    if fence.crosses(guard_edges, ax, ay, bx, by):
        return False
    return fence.inside(guard_edges, 0.5 * (ax + bx), 0.5 * (ay + by))


@allocating_kernel
def _shortest_tree(nodes: Floats, guard_edges: Floats, goal: int, parents: Floats) -> None:
    """Dijkstra from node ``goal``; column 0 of ``parents`` (N, 2) is the next node towards it, 1 the distance."""
    count = nodes.shape[0]
    done = np.zeros(count, np.uint8)
    for n in range(count):
        parents[n, 0] = -1.0
        parents[n, 1] = math.inf
    parents[goal, 1] = 0.0
    for _ in range(count):
        here = -1
        for n in range(count):
            if done[n] == 0 and parents[n, 1] < math.inf and (here < 0 or parents[n, 1] < parents[here, 1]):
                here = n
        if here < 0:
            return
        done[here] = 1
        for n in range(count):
            if done[n] != 0:
                continue
            dx, dy = nodes[n, 0] - nodes[here, 0], nodes[n, 1] - nodes[here, 1]
            distance = parents[here, 1] + math.sqrt(dx * dx + dy * dy)
            if distance < parents[n, 1] and _sees(
                guard_edges, nodes[here, 0], nodes[here, 1], nodes[n, 0], nodes[n, 1]
            ):
                parents[n, 0] = here
                parents[n, 1] = distance


@allocating_kernel
def find(
    plan_edges: Floats, guard_edges: Floats, ax: float, ay: float, bx: float, by: float, errands: Records,
    i: int,
) -> None:  # fmt: skip
    """Write the way from a to b into vehicle ``i``'s errand: the corners to turn at, then b.

    Where no way exists (a lies in a pocket the fence cuts off) the route is the straight line, which the guard
    will not let the vehicle fly to its end.
    """
    count = plan_edges.shape[0] + 2
    nodes = np.empty((count, 2))
    for k in range(count - 2):
        nodes[k, 0], nodes[k, 1] = plan_edges[k, 0], plan_edges[k, 1]
    nodes[count - 2, 0], nodes[count - 2, 1] = ax, ay
    nodes[count - 1, 0], nodes[count - 1, 1] = bx, by
    parents = np.empty((count, 2))
    _shortest_tree(nodes, guard_edges, count - 1, parents)
    points = 0
    node = int(parents[count - 2, 0])
    while 0 <= node < count - 1 and points < ROUTE_POINTS - 1:
        errands[i].route_east[points] = nodes[node, 0]
        errands[i].route_north[points] = nodes[node, 1]
        points += 1
        node = int(parents[node, 0])
    errands[i].route_east[points] = bx
    errands[i].route_north[points] = by
    errands[i].points = points + 1
    errands[i].next = 0
