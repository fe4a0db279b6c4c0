"""Where a vehicle may be: a region of the plane given by nothing but its edges.

The region is keep-in minus every keep-out, its borders flattened into one array of edges, shape (E, 4):
x0, y0, x1, y1 in local metres.  A point is inside when a ray from it crosses an odd number of edges, which
needs neither the order of the edges nor to know which ring they belong to.  All tests are plain loops.
"""

import math

from .arrays import Floats
from .jit import kernel


@kernel
def inside(edges: Floats, x: float, y: float) -> bool:
    """Whether the point lies in the region; points exactly on a border may count as either."""
    odd = False
    for k in range(edges.shape[0]):
        y0 = edges[k, 1]
        y1 = edges[k, 3]
        if (y0 > y) != (y1 > y):
            x0 = edges[k, 0]
            if x < x0 + (y - y0) * (edges[k, 2] - x0) / (y1 - y0):
                odd = not odd
    return odd


@kernel
def crosses(edges: Floats, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether the segment a-b properly crosses an edge; touching one, or starting on one, does not count."""
    low_x, high_x = min(ax, bx), max(ax, bx)
    low_y, high_y = min(ay, by), max(ay, by)
    for k in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        if max(x0, x1) < low_x or min(x0, x1) > high_x or max(y0, y1) < low_y or min(y0, y1) > high_y:
            continue
        side_0 = (bx - ax) * (y0 - ay) - (by - ay) * (x0 - ax)
        side_1 = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
        if (side_0 > 0.0) == (
            side_1 > 0.0
        ):  # a corner on the line belongs to one side, so none slips through
            continue
        side_a = (x1 - x0) * (ay - y0) - (y1 - y0) * (ax - x0)
        side_b = (x1 - x0) * (by - y0) - (y1 - y0) * (bx - x0)
        if side_a * side_b < 0.0:
            return True
    return False


@kernel
def legal(edges: Floats, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether one may fly straight from a, inside or on the border, to b."""
    return not crosses(edges, ax, ay, bx, by) and inside(edges, bx, by)


@kernel
def nearest(edges: Floats, x: float, y: float) -> tuple[float, float]:
    """The point of the border nearest to (x, y)."""
    best = math.inf
    best_x = x
    best_y = y
    for k in range(edges.shape[0]):
        x0, y0 = edges[k, 0], edges[k, 1]
        dx, dy = edges[k, 2] - x0, edges[k, 3] - y0
        size = dx * dx + dy * dy
        t = ((x - x0) * dx + (y - y0) * dy) / size if size > 0.0 else 0.0
        t = min(max(t, 0.0), 1.0)
        px, py = x0 + t * dx, y0 + t * dy
        distance = (px - x) * (px - x) + (py - y) * (py - y)
        if distance < best:
            best, best_x, best_y = distance, px, py
    return best_x, best_y


@kernel
def point_to_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance (m²) of a point from the segment a-b."""
    dx, dy = bx - ax, by - ay
    size = dx * dx + dy * dy
    t = ((x - ax) * dx + (y - ay) * dy) / size if size > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    ex, ey = ax + t * dx - x, ay + t * dy - y
    return ex * ex + ey * ey


@kernel
def segment_to_segment(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Squared distance (m²) between the segments a-b and c-d; 0 when they cross."""
    side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    side_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    side_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    if side_c * side_d < 0.0 and side_a * side_b < 0.0:
        return 0.0
    return min(
        min(point_to_segment(ax, ay, cx, cy, dx, dy), point_to_segment(bx, by, cx, cy, dx, dy)),
        min(point_to_segment(cx, cy, ax, ay, bx, by), point_to_segment(dx, dy, ax, ay, bx, by)),
    )
