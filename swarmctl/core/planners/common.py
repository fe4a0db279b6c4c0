"""What all planners share: the terms of a velocity rule, and the fence response.

A planner plans a direction; the speed is the vehicle's.  A rule adds up weighted terms and is renormalised.
With ``terms: unit`` each term is a unit vector; with ``terms: metric`` it is the literal equation, distances
in metres and velocities in m/s.  In both, the velocity in a rule is the last *commanded* direction, kept in
memory: the measured one would carry the guard's and the vehicle's hesitation into the plan.
"""

import math

from .. import fence
from ..arrays import Floats, Records
from ..jit import kernel
from ..motion import stopping_distance
from ..randoms import FENCE, RULE, normal

FENCE_PHI = 1.0  # magnitude of the fence response's random vector
FENCE_TRIES = 64
TURN_STEP = math.radians(10.0)
TURNS = 17  # steps to either side, short of straight back


@kernel
def term(rules: Records, dx: float, dy: float) -> tuple[float, float]:
    """The vector (dx, dy) from the vehicle to a point, as a rule takes it."""
    if rules[0].metric != 0:
        return dx, dy
    size = math.sqrt(dx * dx + dy * dy)
    if size < 1e-9:
        return 0.0, 0.0
    return dx / size, dy / size


@kernel
def scale(rules: Records, fleet: Records, i: int) -> float:
    """The size of a full velocity in a rule: 1 with unit terms, the vehicle's speed with metric ones."""
    return float(fleet[i].speed) if rules[0].metric != 0 else 1.0


@kernel
def sweep_rate(fleet: Records, i: int) -> float:
    """How fast (m²/s) a vehicle's sensor sweeps the ground to one side: its share of what is divided at launch."""
    return float(fleet[i].speed * fleet[i].sensor_range)


@kernel
def turn_to(memory: Records, i: int, x: float, y: float) -> None:
    """Make (x, y), of any size but zero, the commanded direction."""
    size = math.sqrt(x * x + y * y)
    if size > 1e-9:
        memory[i].heading_east = x / size
        memory[i].heading_north = y / size


@kernel
def aim_at(memory: Records, i: int, poses: Records, x: float, y: float) -> None:
    """Head straight for a point."""
    turn_to(memory, i, x - poses[i].east, y - poses[i].north)


@kernel
def follow_rule(
    memory: Records, i: int, fleet: Records, rules: Records, tick: int, inertia: float, pull_x: float,
    pull_y: float, phi: float,
) -> None:  # fmt: skip
    """v' = w v + (pull) + φ randn, renormalised (eqs. 7, 8, 10, 11)."""
    size = scale(rules, fleet, i)
    x = inertia * size * memory[i].heading_east + pull_x
    y = inertia * size * memory[i].heading_north + pull_y
    if phi > 0.0:
        x += phi * size * normal(rules[0].seed, i, tick, RULE)
        y += phi * size * normal(rules[0].seed, i, tick, RULE + 1)
    turn_to(memory, i, x, y)


@kernel
def look_ahead(fleet: Records, i: int, rules: Records) -> float:
    """How far ahead (m) the fence is looked for: a period's flight, and the way to a stop of a real vehicle."""
    speed = fleet[i].speed
    if rules[0].ideal != 0:
        return float(speed * rules[0].period)
    return float(speed * rules[0].period + stopping_distance(speed, fleet[i].braking, 0.0))


@kernel
def _known_clear(memory: Records, i: int, x: float, y: float, reach: float) -> bool:
    """Whether all that lies within ``reach`` of (x, y) is in the circle that no fence reaches into."""
    room = memory[i].clear_radius - reach
    dx, dy = x - memory[i].clear_east, y - memory[i].clear_north
    return bool(room > 0.0 and dx * dx + dy * dy < room * room)


@kernel
def _look_about(memory: Records, i: int, edges: Floats, x: float, y: float) -> None:
    """Remember the circle round (x, y) that no fence reaches into; none where that is outside."""
    memory[i].clear_radius = 0.0
    if fence.inside(edges, x, y):
        near_x, near_y = fence.nearest(edges, x, y)
        dx, dy = near_x - x, near_y - y
        # Less what rounding could hide.
        memory[i].clear_radius = math.sqrt(dx * dx + dy * dy) * (1.0 - 1e-9) - 1e-6
    memory[i].clear_east, memory[i].clear_north = x, y


@kernel
def blocked(memory: Records, i: int, poses: Records, edges: Floats, reach: float) -> bool:
    """Whether the fence lies within ``reach`` metres ahead along the commanded direction.

    Far from any fence, which is mostly, the circle remembered says so at once.
    """
    x, y = poses[i].east, poses[i].north
    if _known_clear(memory, i, x, y, reach):
        return False
    if x != memory[i].clear_east or y != memory[i].clear_north:
        _look_about(memory, i, edges, x, y)
        if _known_clear(memory, i, x, y, reach):
            return False
    ahead_x = x + reach * memory[i].heading_east
    ahead_y = y + reach * memory[i].heading_north
    return not fence.legal(edges, x, y, ahead_x, ahead_y)


@kernel
def pass_by(memory: Records, i: int, poses: Records, edges: Floats, reach: float) -> None:
    """Turn by the least angle that leaves the way ahead free; once on a ``side``, stay on it while it is not."""
    if not blocked(memory, i, poses, edges, reach):
        memory[i].side = 0.0
        return
    east, north = memory[i].heading_east, memory[i].heading_north
    for attempt in range(2 * TURNS):
        if memory[i].side == 0.0:
            side = 1.0 if attempt % 2 == 0 else -1.0
            turn = attempt // 2 + 1
        else:
            side = memory[i].side if attempt < TURNS else -memory[i].side
            turn = attempt % TURNS + 1
        c, s = math.cos(side * turn * TURN_STEP), math.sin(side * turn * TURN_STEP)
        memory[i].heading_east = c * east - s * north
        memory[i].heading_north = s * east + c * north
        if not blocked(memory, i, poses, edges, reach):
            memory[i].side = side
            return


@kernel
def respond_to_fence(
    memory: Records, i: int, poses: Records, fleet: Records, edges: Floats, rules: Records, tick: int,
    inertia: float,
) -> bool:  # fmt: skip
    """Turn away if the fence is ahead (Algorithm 1, lines 26-29): v = −w v + φ_f randn until it is legal.

    A vehicle that finds itself in the fence's margin heads back in by the shortest way; one that finds no
    legal direction stands for this period.  Returns whether the fence was ahead.
    """
    memory[i].throttle = 1.0
    reach = look_ahead(fleet, i, rules)
    if not blocked(memory, i, poses, edges, reach):
        return False
    x, y = poses[i].east, poses[i].north
    if rules[0].ideal == 0 and not fence.inside(edges, x, y):
        back_x, back_y = fence.nearest(edges, x, y)
        turn_to(memory, i, back_x - x, back_y - y)
        return True
    old_x, old_y = memory[i].heading_east, memory[i].heading_north
    for attempt in range(FENCE_TRIES):
        stream = FENCE + 2 * attempt
        turn_x = -inertia * old_x + FENCE_PHI * normal(rules[0].seed, i, tick, stream)
        turn_y = -inertia * old_y + FENCE_PHI * normal(rules[0].seed, i, tick, stream + 1)
        turn_to(memory, i, turn_x, turn_y)
        if not blocked(memory, i, poses, edges, reach):
            return True
    memory[i].throttle = 0.0
    return True
