"""Homing: every vehicle's way back to its own pad, under the guard.

Ordered home, a vehicle waits for its departure and until the column to its height layer is clear
(core/timetable.py draws both up), changes height, flies the shortest way round the keep-outs and sinks over its
pad, layer by layer, wherever the one below is clear.

Vehicles in one layer are kept apart by the guard, and may stand in one another's way.  So whoever gets no nearer
for a while climbs to the next layer up, where there are fewer; who waits to come down through its column steps
aside; and a climb that stays blocked is given up.  A vehicle whose pad somebody adrift stands over lands at the
nearest free place.  Hence nobody waits for ever.
"""

import math

from . import fence, guard, route, stages, timetable
from .arrays import Floats, Integers, Records
from .jit import kernel

CORNER_MPS = 4.0  # speed at a turn of the route
CORNER_M = 4.0  # a turn counts as reached within this
LAYER_REACHED_M = 0.6
ARRIVED_M = 1.4
LANDING_HEIGHT_M = 10.0
SINKING_ON_M = 2.5  # so far above a layer on the way down the next is tried, before slowing down
STUCK_S = 6.0  # without coming nearer for so long: climb
PATIENCE_S = 20.0  # then a climb is given up, or a pad that somebody adrift stands over
SIDESTEP_MPS = 3.0
PLACES_ROUND = 16  # landing places tried on each circle round the pad
MOST_CIRCLES = 40


@kernel
def room_of(rules: Records) -> float:
    return float(rules[0].separation + guard.SEPARATION_MARGIN_M)


@kernel
def _find_route(
    fleet: Records, poses: Records, errands: Records, i: int, goal_x: float, goal_y: float,
    plan_edges: Floats, guard_edges: Floats,
) -> None:  # fmt: skip
    x, y = poses[i].east, poses[i].north
    if not fence.inside(guard_edges, x, y):  # start from just inside, where recovery will bring it
        nx, ny = fence.nearest(guard_edges, x, y)
        size = max(math.sqrt((nx - x) * (nx - x) + (ny - y) * (ny - y)), 1e-9)
        x, y = nx + (nx - x) / size, ny + (ny - y) / size
    route.find(plan_edges, guard_edges, x, y, goal_x, goal_y, errands, i)
    errands[i].closest = math.inf


@kernel
def order_home(
    fleet: Records, poses: Records, errands: Records, orders: Integers, now: float, rules: Records,
    plan_edges: Floats, guard_edges: Floats,
) -> None:  # fmt: skip
    """Send home every vehicle with a one in ``orders`` (V,): find its way and its place in the timetable."""
    for i in range(orders.shape[0]):
        if orders[i] != 0:
            x, y = fleet[i].pad_east, fleet[i].pad_north
            _find_route(fleet, poses, errands, i, x, y, plan_edges, guard_edges)
            errands[i].wait_up = poses[i].up
            errands[i].stage = stages.WAIT
    timetable.draw_up(fleet, poses, errands, orders, now, rules[0].separation)
    for i in range(orders.shape[0]):
        if orders[i] != 0:
            errands[i].progress_at = errands[i].release_at


@kernel
def _in_the_way(paths: Records, i: int, low: float, high: float, room: float) -> int:
    """The first other vehicle that bars vehicle ``i``'s change of height; -1: none.

    One bars it whose stop path comes near vehicle ``i``'s between the two heights.  Not one at its height already:
    the guard keeps these two apart, wherever they climb.
    """
    for j in range(paths.shape[0] - 1):
        if j == i or paths[j].airborne == 0 or guard.same_height(paths, i, j):
            continue
        gap = max(paths[j].low - high, low - paths[j].high)
        if gap >= guard.HEIGHT_SEPARATION_M + guard.HEIGHT_MARGIN_M:
            continue
        if guard.path_distance(paths, i, j) < room * room:
            return j
    return -1


@kernel
def _square(dx: float, dy: float) -> float:
    return dx * dx + dy * dy


@kernel
def _near(poses: Records, i: int, j: int, room: float) -> bool:
    return bool(_square(poses[i].east - poses[j].east, poses[i].north - poses[j].north) < room * room)


@kernel
def _climber_below(poses: Records, errands: Records, i: int, now: float, room: float) -> int:
    """Somebody not far below vehicle ``i`` who waits to climb through where it is; -1: nobody."""
    for j in range(errands.shape[0]):
        if j == i or errands[j].stage != stages.WAIT or now < errands[j].release_at:
            continue
        below = poses[j].up <= poses[i].up <= errands[j].layer + timetable.LAYER_M
        if below and _near(poses, i, j, room):
            return j
    return -1


@kernel
def _step_aside(poses: Records, i: int, other: int, wants: Records) -> None:
    dx, dy = poses[i].east - poses[other].east, poses[i].north - poses[other].north
    size = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    wants[i].v_east = SIDESTEP_MPS * dx / size
    wants[i].v_north = SIDESTEP_MPS * dy / size


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
    fleet: Records, poses: Records, errands: Records, i: int, now: float, paths: Records, rules: Records,
    wants: Records,
) -> None:  # fmt: skip
    """Hover until it is time and the column to the layer is clear; whoever stands in it, step aside of."""
    wants[i].up = errands[i].wait_up
    low, high = min(poses[i].up, errands[i].layer), max(poses[i].up, errands[i].layer)
    if now < errands[i].release_at - (high - low) / fleet[i].climb:
        return
    other = _in_the_way(paths, i, low, high, room_of(rules))
    if other >= 0:
        _step_aside(poses, i, other, wants)
        return
    errands[i].stage = stages.CLIMB
    wants[i].up = errands[i].layer
    paths[i].low, paths[i].high = low, high


@kernel
def _climb_out(poses: Records, errands: Records, i: int, now: float, rules: Records) -> None:
    """Vehicle ``i`` is stuck: let it climb a layer, and those about it wait and see whether that frees them."""
    for j in range(errands.shape[0]):
        level = abs(poses[i].up - poses[j].up) < timetable.LAYER_M
        if level and _near(poses, i, j, 3.0 * rules[0].separation):
            errands[j].progress_at = now
    errands[i].stage = stages.WAIT
    errands[i].wait_up = errands[i].layer
    errands[i].layer += timetable.LAYER_M


@kernel
def _transit(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, plan_edges: Floats,
    guard_edges: Floats, rules: Records, wants: Records,
) -> None:  # fmt: skip
    """Follow the route; when nothing brings the vehicle nearer for a while, look for the way anew, a layer up."""
    k = errands[i].next
    last = errands[i].points - 1
    distance = _head_for(
        fleet, poses, i, errands[i].route_east[k], errands[i].route_north[k], k == last, wants
    )
    if distance < errands[i].closest - 0.5:
        errands[i].closest = distance
        errands[i].progress_at = now
    elif now - errands[i].progress_at > STUCK_S:
        _find_route(
            fleet, poses, errands, i, errands[i].route_east[last], errands[i].route_north[last], plan_edges,
            guard_edges,
        )  # fmt: skip
        _climb_out(poses, errands, i, now, rules)
    elif k < last and distance < CORNER_M:
        errands[i].next = k + 1
        errands[i].closest = math.inf
    elif k == last and distance < ARRIVED_M:
        errands[i].stage = stages.OVER_PAD
        errands[i].progress_at = now


@kernel
def _adrift_at(poses: Records, errands: Records, x: float, y: float, room: float) -> bool:
    """Whether somebody adrift is over (x, y) or near it, at whatever height."""
    for j in range(errands.shape[0]):
        near = _square(x - poses[j].east, y - poses[j].north) < room * room
        if near and errands[j].stage == stages.ADRIFT:
            return True
    return False


@kernel
def _free_place(
    fleet: Records, poses: Records, errands: Records, i: int, x: float, y: float, plan_edges: Floats, room: float
) -> bool:  # fmt: skip
    """Whether vehicle ``i`` may land at (x, y): legal, nobody's pad or landing place, nobody adrift there."""
    if not fence.inside(plan_edges, x, y) or _adrift_at(poses, errands, x, y, room):
        return False
    for j in range(errands.shape[0]):
        if j == i:
            continue
        if _square(x - fleet[j].pad_east, y - fleet[j].pad_north) < room * room:
            return False
        last = errands[j].points - 1  # -1: not on its way home
        if last >= 0 and (
            _square(x - errands[j].route_east[last], y - errands[j].route_north[last]) < room * room
        ):
            return False
    return True


@kernel
def _divert(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, plan_edges: Floats,
    guard_edges: Floats, rules: Records,
) -> None:  # fmt: skip
    """Send vehicle ``i`` to the free landing place nearest to its pad, at the height where it is."""
    room = room_of(rules) + ARRIVED_M
    for circle in range(MOST_CIRCLES):
        for k in range(PLACES_ROUND):
            angle = 2.0 * math.pi * k / PLACES_ROUND
            x = fleet[i].pad_east + 0.5 * room * circle * math.cos(angle)
            y = fleet[i].pad_north + 0.5 * room * circle * math.sin(angle)
            if _free_place(fleet, poses, errands, i, x, y, plan_edges, room):
                _find_route(fleet, poses, errands, i, x, y, plan_edges, guard_edges)
                errands[i].layer = poses[i].up
                errands[i].stage = stages.TRANSIT
                errands[i].progress_at = now
                return
    errands[i].progress_at = now


@kernel
def _give_up_climb(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, plan_edges: Floats,
    guard_edges: Floats, rules: Records,
) -> None:  # fmt: skip
    """Let vehicle ``i`` fly at the height where it is, which it owns, and to another place if its own is taken."""
    errands[i].layer = errands[i].wait_up
    errands[i].stage = stages.CLIMB
    last = errands[i].points - 1
    x, y = errands[i].route_east[last], errands[i].route_north[last]
    if _adrift_at(poses, errands, x, y, room_of(rules)):
        _divert(fleet, poses, errands, i, now, plan_edges, guard_edges, rules)


@kernel
def _sink(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, distance: float, paths: Records,
    rules: Records, wants: Records,
) -> None:  # fmt: skip
    """Over its pad: claim the next layer down once the column is clear; below the last, all down to the ground."""
    other = _climber_below(poses, errands, i, now, room_of(rules))
    if other >= 0:
        _step_aside(poses, i, other, wants)
        return
    if distance > ARRIVED_M or poses[i].up > errands[i].layer + SINKING_ON_M:
        return
    below = errands[i].layer - timetable.LAYER_M
    if below < LANDING_HEIGHT_M + timetable.LAYER_M:
        below = 0.0
    if _in_the_way(paths, i, below, paths[i].high, room_of(rules)) < 0:
        errands[i].stage = stages.DESCEND
        errands[i].layer = below
        errands[i].progress_at = now
        paths[i].low = min(paths[i].low, below)


@kernel
def _come_down(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, rules: Records, plan_edges: Floats,
    guard_edges: Floats, paths: Records, wants: Records,
) -> None:  # fmt: skip
    """From over the pad to the ground."""
    last = errands[i].points - 1
    x, y = errands[i].route_east[last], errands[i].route_north[last]
    distance = _head_for(fleet, poses, i, x, y, True, wants)
    if errands[i].stage == stages.LAND:
        wants[i].up = 0.0
        return
    if errands[i].layer > 0.0:
        _sink(fleet, poses, errands, i, now, distance, paths, rules, wants)
    elif distance < ARRIVED_M and poses[i].up < LANDING_HEIGHT_M + 1.0:
        errands[i].stage = stages.LAND
    wants[i].up = errands[i].layer if errands[i].layer > 0.0 else min(poses[i].up, LANDING_HEIGHT_M)
    if now - errands[i].progress_at > PATIENCE_S and _adrift_at(poses, errands, x, y, room_of(rules)):
        _divert(fleet, poses, errands, i, now, plan_edges, guard_edges, rules)


@kernel
def home(
    fleet: Records, poses: Records, errands: Records, i: int, now: float, rules: Records, plan_edges: Floats,
    guard_edges: Floats, paths: Records, wants: Records,
) -> None:  # fmt: skip
    """What a vehicle on its way home wants at this setpoint tick; moves it on to its next stage."""
    wants[i].v_east, wants[i].v_north, wants[i].up = 0.0, 0.0, errands[i].layer
    stage = errands[i].stage
    if stage == stages.WAIT and now - errands[i].progress_at > PATIENCE_S:
        _give_up_climb(fleet, poses, errands, i, now, plan_edges, guard_edges, rules)
    elif stage == stages.WAIT:
        _wait(fleet, poses, errands, i, now, paths, rules, wants)
    elif stage == stages.CLIMB:
        if abs(poses[i].up - errands[i].layer) < LAYER_REACHED_M:
            errands[i].stage = stages.TRANSIT
            errands[i].closest = math.inf
            errands[i].progress_at = now
    elif stage == stages.TRANSIT:
        _transit(fleet, poses, errands, i, now, plan_edges, guard_edges, rules, wants)
    else:
        _come_down(fleet, poses, errands, i, now, rules, plan_edges, guard_edges, paths, wants)
