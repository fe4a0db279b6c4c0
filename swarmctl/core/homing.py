"""Homing: every vehicle's way back to its own pad, under the guard.

Ordered home, a vehicle waits until the column to its height layer is clear, changes height, flies the shortest
way round the keep-outs, waits over its pad until nobody below still has to pass, and descends.  Layers lie at
least 6 m apart for vehicles whose ways meet; the lowest layer is the vehicle's own search height, unless others
still search there.  Nobody waits for a vehicle above, so the lowest can always go on.
"""

import math

from . import fence, guard, route, stages
from .arrays import Floats, Records
from .jit import kernel

LAYER_M = 6.0
LAYER_REACHED_M = 0.6
MEETING_MARGIN_M = 5.0  # ways nearer than the separation and this meet
RELEASE_S = 2.0  # between two departures
CORNER_MPS = 4.0  # speed at a turn of the route
CORNER_M = 4.0  # a turn counts as reached within this
ARRIVED_M = 0.7
ARRIVED_MPS = 0.4
LANDING_HEIGHT_M = 10.0
STUCK_S = 6.0  # without coming nearer for so long: look for the way anew
SIDESTEP_MPS = 3.0


@kernel
def _leg(errands: Records, poses: Records, i: int, k: int) -> tuple[float, float]:
    """Point ``k`` of the remaining way of vehicle ``i``; its own position before the next point."""
    if k < errands[i].next:
        return float(poses[i].east), float(poses[i].north)
    return float(errands[i].route_east[k]), float(errands[i].route_north[k])


@kernel
def way_distance(errands: Records, poses: Records, i: int, x: float, y: float) -> float:
    """Squared distance (m²) of a point from the remaining way of vehicle ``i``."""
    closest = math.inf
    for k in range(errands[i].next, errands[i].points):
        ax, ay = _leg(errands, poses, i, k - 1)
        bx, by = _leg(errands, poses, i, k)
        closest = min(closest, fence.point_to_segment(x, y, ax, ay, bx, by))
    return closest


@kernel
def _ways_meet(errands: Records, poses: Records, i: int, j: int, room: float) -> bool:
    for a in range(errands[i].next, errands[i].points):
        ax, ay = _leg(errands, poses, i, a - 1)
        bx, by = _leg(errands, poses, i, a)
        for b in range(errands[j].next, errands[j].points):
            cx, cy = _leg(errands, poses, j, b - 1)
            dx, dy = _leg(errands, poses, j, b)
            if fence.segment_to_segment(ax, ay, bx, by, cx, cy, dx, dy) < room * room:
                return True
    return False


@kernel
def _layer_taken(
    fleet: Records, poses: Records, errands: Records, i: int, height: float, room: float
) -> bool:
    """Whether somebody whose way meets vehicle ``i``'s already flies, or searches, near ``height``."""
    for j in range(errands.shape[0]):
        stage = errands[j].stage
        if j == i or stage == stages.GROUND or stage >= stages.DESCEND:
            continue
        theirs = errands[j].layer if stage >= stages.WAIT else fleet[j].altitude
        if abs(theirs - height) >= LAYER_M - 1e-6:
            continue
        if stage < stages.WAIT or _ways_meet(errands, poses, i, j, room):
            return True
    return False


@kernel
def choose_layer(fleet: Records, poses: Records, errands: Records, i: int, separation: float) -> float:
    """The lowest free layer: the own search height, then 6 m steps above the highest search height."""
    room = separation + MEETING_MARGIN_M
    height = float(fleet[i].altitude)
    top = height
    for j in range(fleet.shape[0]):
        top = max(top, float(fleet[j].altitude))
    for k in range(fleet.shape[0] + 1):
        if not _layer_taken(fleet, poses, errands, i, height, room):
            return height
        height = top + LAYER_M * (k + 1)
    return height


@kernel
def _find_route(
    fleet: Records, poses: Records, errands: Records, i: int, plan_edges: Floats, guard_edges: Floats
) -> None:
    x, y = poses[i].east, poses[i].north
    if not fence.inside(guard_edges, x, y):  # start from just inside, where recovery will bring it
        nx, ny = fence.nearest(guard_edges, x, y)
        size = max(math.sqrt((nx - x) * (nx - x) + (ny - y) * (ny - y)), 1e-9)
        x, y = nx + (nx - x) / size, ny + (ny - y) / size
    route.find(plan_edges, guard_edges, x, y, fleet[i].pad_east, fleet[i].pad_north, errands, i)
    errands[i].closest = math.inf


@kernel
def order_home(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, plan_edges: Floats,
    guard_edges: Floats,
) -> None:  # fmt: skip
    """Send vehicle ``i`` home: find its way and its place in the queue.  Its layer is chosen afterwards.

    Until then it is in nobody's layer, so that of several ordered at once the first may take the search height.
    """
    _find_route(fleet, poses, errands, i, plan_edges, guard_edges)
    ahead = 0
    for j in range(errands.shape[0]):
        if stages.WAIT <= errands[j].stage <= stages.CLIMB:
            ahead += 1
    errands[i].release_at = now + RELEASE_S * ahead
    errands[i].wait_up = poses[i].up
    errands[i].layer = math.inf
    errands[i].stage = stages.WAIT


@kernel
def _in_column(paths: Records, i: int, x: float, y: float, low: float, high: float, separation: float) -> int:
    """The first other vehicle whose stop path touches the column over (x, y) between two heights; -1: none."""
    room = separation + guard.SEPARATION_MARGIN_M
    for j in range(paths.shape[0] - 1):
        if j == i or paths[j].airborne == 0:
            continue
        gap = max(paths[j].low - high, low - paths[j].high)
        if gap >= guard.HEIGHT_SEPARATION_M + guard.HEIGHT_MARGIN_M:
            continue
        near = min(
            fence.point_to_segment(
                x, y, paths[j].east_0, paths[j].north_0, paths[j].east_1, paths[j].north_1
            ),
            fence.point_to_segment(
                x, y, paths[j].east_1, paths[j].north_1, paths[j].east_2, paths[j].north_2
            ),
        )
        if near < room * room:
            return j
    return -1


@kernel
def _still_to_pass(fleet: Records, poses: Records, errands: Records, i: int, separation: float) -> bool:
    """Whether somebody in a layer below, or in this one, still has to pass vehicle ``i``'s pad."""
    room = separation + MEETING_MARGIN_M
    x, y = fleet[i].pad_east, fleet[i].pad_north
    for j in range(errands.shape[0]):
        if j == i or errands[j].stage < stages.WAIT or errands[j].stage > stages.TRANSIT:
            continue
        below = errands[j].layer < errands[i].layer + LAYER_M - 1e-6
        if below and way_distance(errands, poses, j, x, y) < room * room:
            return True
    return False


@kernel
def _head_for(
    fleet: Records, poses: Records, i: int, x: float, y: float, final: bool, wants: Records
) -> float:
    """Want the velocity that brings vehicle ``i`` to (x, y), stopping there if ``final``; returns the distance."""
    dx, dy = x - poses[i].east, y - poses[i].north
    distance = math.sqrt(dx * dx + dy * dy)
    at_end = 0.0 if final else CORNER_MPS
    speed = math.sqrt(at_end * at_end + fleet[i].braking * distance)
    if final:
        speed = min(speed, 0.8 * distance)
    speed = min(speed, fleet[i].speed)
    wants[i].v_east = speed * dx / max(distance, 1e-9)
    wants[i].v_north = speed * dy / max(distance, 1e-9)
    return distance


@kernel
def _wait(
    fleet: Records, poses: Records, errands: Records, i: int, paths: Records, rules: Records, wants: Records
) -> None:
    """Hover until the column to the layer is clear; whoever stands in it, step aside of."""
    wants[i].up = errands[i].wait_up
    low, high = min(poses[i].up, errands[i].layer), max(poses[i].up, errands[i].layer)
    x, y = poses[i].east, poses[i].north
    speed = math.sqrt(poses[i].v_east * poses[i].v_east + poses[i].v_north * poses[i].v_north)
    other = _in_column(paths, i, x, y, low, high, rules[0].separation)
    if other < 0:
        if speed < ARRIVED_MPS:
            errands[i].stage = stages.CLIMB
            wants[i].up = errands[i].layer
            paths[i].low, paths[i].high = low, high
        return
    dx, dy = x - poses[other].east, y - poses[other].north
    size = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    wants[i].v_east = SIDESTEP_MPS * dx / size
    wants[i].v_north = SIDESTEP_MPS * dy / size


@kernel
def _transit(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, plan_edges: Floats,
    guard_edges: Floats, wants: Records,
) -> None:  # fmt: skip
    """Follow the route; when nothing brings the vehicle nearer for a while, look for the way anew."""
    k = errands[i].next
    final = k == errands[i].points - 1
    distance = _head_for(fleet, poses, i, errands[i].route_east[k], errands[i].route_north[k], final, wants)
    if distance < errands[i].closest - 0.5:
        errands[i].closest = distance
        errands[i].progress_at = now
    elif now - errands[i].progress_at > STUCK_S:
        errands[i].progress_at = now
        _find_route(fleet, poses, errands, i, plan_edges, guard_edges)
        return
    if not final and distance < CORNER_M:
        errands[i].next = k + 1
        errands[i].closest = math.inf
    speed = math.sqrt(poses[i].v_east * poses[i].v_east + poses[i].v_north * poses[i].v_north)
    if final and distance < ARRIVED_M and speed < ARRIVED_MPS:
        errands[i].stage = stages.OVER_PAD


@kernel
def home(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, rules: Records, plan_edges: Floats,
    guard_edges: Floats, paths: Records, wants: Records,
) -> None:  # fmt: skip
    """What a vehicle on its way home wants at this setpoint tick; moves it on to its next stage."""
    wants[i].v_east, wants[i].v_north, wants[i].up = 0.0, 0.0, errands[i].layer
    stage = errands[i].stage
    if stage == stages.WAIT:
        _wait(fleet, poses, errands, i, paths, rules, wants)
    elif stage == stages.CLIMB:
        if abs(poses[i].up - errands[i].layer) < LAYER_REACHED_M and now >= errands[i].release_at:
            errands[i].stage = stages.TRANSIT
            errands[i].closest = math.inf
            errands[i].progress_at = now
    elif stage == stages.TRANSIT:
        _transit(fleet, poses, errands, i, now, plan_edges, guard_edges, wants)
    elif stage >= stages.OVER_PAD:
        x, y = fleet[i].pad_east, fleet[i].pad_north
        distance = _head_for(fleet, poses, i, x, y, True, wants)
        if stage == stages.OVER_PAD and distance < ARRIVED_M:
            blocked = _still_to_pass(fleet, poses, errands, i, rules[0].separation)
            if not blocked and _in_column(paths, i, x, y, 0.0, poses[i].up, rules[0].separation) < 0:
                errands[i].stage = stages.DESCEND
                paths[i].low = 0.0
        elif stage != stages.OVER_PAD:
            wants[i].up = LANDING_HEIGHT_M if stage == stages.DESCEND else 0.0
            if (
                stage == stages.DESCEND
                and distance < 2.0 * ARRIVED_M
                and poses[i].up < LANDING_HEIGHT_M + 1.0
            ):
                errands[i].stage = stages.LAND
