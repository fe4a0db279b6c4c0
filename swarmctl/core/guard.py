"""Guard: the last word on every setpoint.

Every airborne vehicle owns a *stop path*: from where it is, on for its latency, then braking to standstill.
It lies inside the fence and at least the separation from every other vehicle's stop path at its height.  A
velocity is accepted only if the stop path after one more setpoint interval keeps this; otherwise it is turned
or slowed until it does; otherwise the vehicle brakes, along the path it already owns.  Vehicles are taken in a
fixed order, each against the paths the others own by then, so the invariant passes from tick to tick.

What the planner says does not matter for safety: not-a-number and infinity mean "stand still".
"""

import math

from . import fence, motion
from .arrays import Floats, Records
from .jit import inlined_kernel, kernel

HEIGHT_SEPARATION_M = 5.0  # vehicles nearer than this in height must be separated horizontally
HEIGHT_MARGIN_M = 0.7  # two vehicles' height errors together
SEPARATION_MARGIN_M = 0.5  # rounding of positions and velocities on the wire, curvature of a turn
BRAKING_SHARE = 0.9  # of the vehicle's braking is counted on
MOST_UNDER_WAY = 32  # setpoints within the latency
RECOVERY_MPS = 3.0  # back towards the fence from outside

KEPT, TURNED, BRAKED, RECOVERING, UNGUARDED = 0, 1, 2, 3, 4
OUTCOMES = ("kept", "turned", "braked", "recovering", "unguarded")

# The turns tried, in degrees, nearest to the wish first; right before left, so that two that meet pass.
TURNS = (0.0, -20.0, 20.0, -40.0, 40.0, -65.0, 65.0, -90.0, 90.0, -120.0, 120.0, 180.0)
SPEEDS = (1.0, 0.5, 0.2)
COSINES = tuple(math.cos(math.radians(a)) for a in TURNS)
SINES = tuple(math.sin(math.radians(a)) for a in TURNS)


@inlined_kernel
def _stop(fleet: Records, i: int, x: float, y: float, vx: float, vy: float) -> tuple[float, float, float]:
    """Where vehicle ``i``, braking from velocity (vx, vy) at (x, y), stands still, and how far (m) that is."""
    speed = math.sqrt(vx * vx + vy * vy)
    if speed < 1e-9:
        return x, y, 0.0
    braking = BRAKING_SHARE * fleet[i].braking
    lag = fleet[i].lag
    distance = speed * speed / (2.0 * braking) + min(speed, braking * lag) * lag
    return x + distance * vx / speed, y + distance * vy / speed, distance


@inlined_kernel
def under_way(fleet: Records, i: int, interval: float) -> int:
    """How many setpoints were sent and have not acted yet: the vehicle's latency in whole intervals, rounded up."""
    if fleet[i].latency == 0.0:
        return 0
    intervals: int = math.ceil(fleet[i].latency / interval - 1e-9)
    return min(intervals, MOST_UNDER_WAY)


@inlined_kernel
def _coast(
    fleet: Records, i: int, poses: Records, sent: Floats, cx: float, cy: float, interval: float, last: bool
) -> tuple[float, float, float, float]:
    """Position and velocity when the setpoints under way have acted, and (``last``) then (cx, cy) for an interval."""
    x, y, vx, vy = poses[i].east, poses[i].north, poses[i].v_east, poses[i].v_north
    speed, acceleration, lag = fleet[i].speed, fleet[i].acceleration, fleet[i].lag
    for h in range(under_way(fleet, i, interval) - 1, -1, -1):
        x, y, vx, vy = motion.horizontal(
            x, y, vx, vy, sent[i, h, 0], sent[i, h, 1], speed, acceleration, lag, interval
        )
    if last:
        x, y, vx, vy = motion.horizontal(x, y, vx, vy, cx, cy, speed, acceleration, lag, interval)
    return x, y, vx, vy


@inlined_kernel
def _write_path(
    fleet: Records, i: int, poses: Records, sent: Floats, cx: float, cy: float, interval: float, last: bool,
    paths: Records, row: int,
) -> None:  # fmt: skip
    """Write into ``paths[row]`` the path vehicle ``i`` owns, or will own after an interval of (cx, cy)."""
    x, y, vx, vy = _coast(fleet, i, poses, sent, cx, cy, interval, last)
    end_x, end_y, distance = _stop(fleet, i, x, y, vx, vy)
    paths[row].east_0, paths[row].north_0 = poses[i].east, poses[i].north
    paths[row].east_1, paths[row].north_1 = x, y
    paths[row].east_2, paths[row].north_2 = end_x, end_y
    intervals = under_way(fleet, i, interval) + (1 if last else 0)
    paths[row].reach = intervals * interval * paths[i].fastest + distance


@inlined_kernel
def own_path(
    fleet: Records, i: int, poses: Records, sent: Floats, interval: float, wanted_up: float, airborne: bool,
    paths: Records,
) -> None:  # fmt: skip
    """Write the stop path that vehicle ``i`` owns as it is now, braking as soon as it can be told to."""
    _write_path(fleet, i, poses, sent, 0.0, 0.0, interval, False, paths, i)
    paths[i].low = min(poses[i].up, wanted_up)
    paths[i].high = max(poses[i].up, wanted_up)
    paths[i].airborne = 1 if airborne else 0


@kernel
def path_distance(paths: Records, a: int, b: int) -> float:
    """Squared horizontal distance (m²) between two stop paths."""
    closest = math.inf
    for first in range(2):
        if first == 0:
            ax, ay, bx, by = paths[a].east_0, paths[a].north_0, paths[a].east_1, paths[a].north_1
        else:
            ax, ay, bx, by = paths[a].east_1, paths[a].north_1, paths[a].east_2, paths[a].north_2
        closest = min(
            closest,
            fence.segment_to_segment(
                ax, ay, bx, by, paths[b].east_0, paths[b].north_0, paths[b].east_1, paths[b].north_1
            ),
            fence.segment_to_segment(
                ax, ay, bx, by, paths[b].east_1, paths[b].north_1, paths[b].east_2, paths[b].north_2
            ),
        )
    return closest


@inlined_kernel
def same_height(paths: Records, a: int, b: int) -> bool:
    """Whether two paths' heights come so near that horizontal separation is needed."""
    gap = max(paths[a].low - paths[b].high, paths[b].low - paths[a].high)
    return bool(gap < HEIGHT_SEPARATION_M + HEIGHT_MARGIN_M)


@kernel
def _ahead_distance(paths: Records, a: int, b: int) -> float:
    """Squared distance (m²) of what path ``a`` holds after the coming interval from all of path ``b``."""
    ax, ay, bx, by = paths[a].east_1, paths[a].north_1, paths[a].east_2, paths[a].north_2
    return min(
        fence.segment_to_segment(
            ax, ay, bx, by, paths[b].east_0, paths[b].north_0, paths[b].east_1, paths[b].north_1
        ),
        fence.segment_to_segment(
            ax, ay, bx, by, paths[b].east_1, paths[b].north_1, paths[b].east_2, paths[b].north_2
        ),
    )


@kernel
def _here_distance(paths: Records, a: int, b: int) -> float:
    """Squared distance (m²) of where vehicle ``a`` is from all of path ``b``."""
    x, y = paths[a].east_0, paths[a].north_0
    return min(
        fence.point_to_segment(x, y, paths[b].east_0, paths[b].north_0, paths[b].east_1, paths[b].north_1),
        fence.point_to_segment(x, y, paths[b].east_1, paths[b].north_1, paths[b].east_2, paths[b].north_2),
    )


@inlined_kernel
def _apart(paths: Records, i: int, row: int, separation: float, gain: float) -> bool:
    """Whether candidate ``paths[row]`` of vehicle ``i`` keeps clear of every other vehicle's path.

    Where the path vehicle ``i`` owns is already nearer than that (rounding, wind, two launched so), the candidate
    must lead apart by ``gain`` metres in the coming interval.  Not coming nearer would not do: what rounding
    hides, a millimetre a tick, would add up.  So would the chord of the turn under way, which runs nearer to one
    whom the vehicle flies round than the turn itself: it does not count.
    """
    wanted = separation + SEPARATION_MARGIN_M
    for j in range(paths.shape[0] - 1):
        if j == i or paths[j].near == 0 or paths[j].airborne == 0 or not same_height(paths, i, j):
            continue
        dx = paths[j].east_0 - paths[row].east_0
        dy = paths[j].north_0 - paths[row].north_0
        room = wanted + paths[row].reach + paths[j].reach
        if dx * dx + dy * dy > room * room:
            continue
        if path_distance(paths, row, j) >= wanted * wanted:
            continue
        owned = math.sqrt(min(_here_distance(paths, i, j), _ahead_distance(paths, i, j)))
        if owned >= wanted or math.sqrt(_ahead_distance(paths, row, j)) < owned + gain:
            return False
    return True


@kernel
def _within(paths: Records, row: int, edges: Floats) -> bool:
    """Whether a path that begins inside the fence stays there; its end may not lie beyond a corner it touched."""
    return fence.inside(edges, paths[row].east_2, paths[row].north_2) and not (
        fence.crosses(edges, paths[row].east_0, paths[row].north_0, paths[row].east_1, paths[row].north_1)
        or fence.crosses(edges, paths[row].east_1, paths[row].north_1, paths[row].east_2, paths[row].north_2)
    )


@inlined_kernel
def _accept(
    fleet: Records, i: int, poses: Records, sent: Floats, setpoints: Records, cx: float, cy: float,
    rules: Records, edges: Floats, paths: Records, fenced: bool,
) -> bool:  # fmt: skip
    """Whether vehicle ``i`` may be told (cx, cy); if so it owns the new path, and the setpoint is written."""
    row = paths.shape[0] - 1
    interval = rules[0].interval
    _write_path(fleet, i, poses, sent, cx, cy, interval, True, paths, row)
    if fenced and not _fence_is_far(paths, i) and not _within(paths, row, edges):
        return False
    gain = 0.25 * fleet[i].acceleration * interval * interval
    if paths[i].near != 0 and not _apart(paths, i, row, rules[0].separation, gain):
        return False
    paths[i].east_1, paths[i].north_1 = paths[row].east_1, paths[row].north_1
    paths[i].east_2, paths[i].north_2 = paths[row].east_2, paths[row].north_2
    paths[i].reach = paths[row].reach
    setpoints[i].v_east, setpoints[i].v_north = cx, cy
    return True


@kernel
def _brake(setpoints: Records, i: int) -> None:
    setpoints[i].v_east = 0.0
    setpoints[i].v_north = 0.0
    setpoints[i].outcome = BRAKED


@kernel
def _recover(
    fleet: Records, i: int, poses: Records, sent: Floats, setpoints: Records, rules: Records, edges: Floats,
    paths: Records,
) -> None:  # fmt: skip
    """Outside the fence (wind, a pilot): slowly back by the shortest way, if others leave room."""
    x, y = fence.nearest(edges, poses[i].east, poses[i].north)
    dx, dy = x - poses[i].east, y - poses[i].north
    size = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    speed = min(RECOVERY_MPS, fleet[i].speed)
    if _accept(
        fleet, i, poses, sent, setpoints, speed * dx / size, speed * dy / size, rules, edges, paths, False
    ):
        setpoints[i].outcome = RECOVERING
    else:
        _brake(setpoints, i)


@kernel
def _changed(wish_x: float, wish_y: float, s: int, k: int) -> tuple[float, float]:
    """A wish turned and slowed."""
    return (
        SPEEDS[s] * (COSINES[k] * wish_x - SINES[k] * wish_y),
        SPEEDS[s] * (SINES[k] * wish_x + COSINES[k] * wish_y),
    )


@inlined_kernel
def _fence_is_far(paths: Records, i: int) -> bool:
    """Whether no stop path of vehicle ``i`` can reach the fence from within its anchor's circle."""
    return bool(paths[i].hold <= paths[i].clear)


@inlined_kernel
def free(paths: Records, i: int) -> bool:
    """Whether vehicle ``i`` can do what it wishes: neither the fence nor anybody is near its anchor's circle."""
    return bool(paths[i].near == 0 and _fence_is_far(paths, i))


@kernel
def _find(
    fleet: Records, i: int, poses: Records, wish_x: float, wish_y: float, rules: Records, edges: Floats,
    paths: Records, sent: Floats, setpoints: Records,
) -> None:  # fmt: skip
    """Try the wish, then what is near to it; where nothing keeps the invariant, brake."""
    if not _fence_is_far(paths, i) and not fence.inside(edges, poses[i].east, poses[i].north):
        _recover(fleet, i, poses, sent, setpoints, rules, edges, paths)
        return
    for s in range(len(SPEEDS)):
        for k in range(len(COSINES)):
            cx, cy = _changed(wish_x, wish_y, s, k)
            if _accept(fleet, i, poses, sent, setpoints, cx, cy, rules, edges, paths, True):
                setpoints[i].outcome = KEPT if s == 0 and k == 0 else TURNED
                return
    _brake(setpoints, i)


@inlined_kernel
def guard(
    fleet: Records, i: int, poses: Records, wish_x: float, wish_y: float, rules: Records, edges: Floats,
    paths: Records, sent: Floats, setpoints: Records, shown: bool,
) -> None:  # fmt: skip
    """Write vehicle ``i``'s setpoint: the wish (m/s), or the nearest velocity to it that keeps the invariant.

    ``paths`` (V + 1,) holds every vehicle's stop path, and a row for the candidate; that of a free vehicle is written
    only if it is ``shown`` to others.  ``sent`` (V, 33, 2) are the velocities set before, the newest first.
    """
    if not (math.isfinite(wish_x) and math.isfinite(wish_y)):
        wish_x, wish_y = 0.0, 0.0
    size = math.sqrt(wish_x * wish_x + wish_y * wish_y)
    if size > fleet[i].speed:
        wish_x *= fleet[i].speed / size
        wish_y *= fleet[i].speed / size
    if free(paths, i):
        cx, cy = _changed(wish_x, wish_y, 0, 0)
        setpoints[i].v_east, setpoints[i].v_north, setpoints[i].outcome = cx, cy, KEPT
        if shown:
            _write_path(fleet, i, poses, sent, cx, cy, rules[0].interval, True, paths, i)
        return
    _find(fleet, i, poses, wish_x, wish_y, rules, edges, paths, sent, setpoints)
