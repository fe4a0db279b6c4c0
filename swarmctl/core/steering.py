"""The setpoint loop, several times a planner period: homing → guard → setpoint, the same for every planner."""

import math

from . import anchor, fence, guard, homing, levelling, motion, stages, wire
from .arrays import Floats, Records
from .jit import inlined_kernel, kernel


@kernel
def _wanted_up(fleet: Records, errands: Records, poses: Records, i: int) -> float:
    """The height a vehicle is on its way to."""
    stage = errands[i].stage
    if stage == stages.WAIT:
        return float(errands[i].wait_up)
    if stage == stages.ADRIFT:
        return float(poses[i].up)
    if stage == stages.TAKEN:
        return levelling.kept_height(poses, errands, i)
    if stage < stages.WAIT or stage == stages.LEVEL:
        return float(fleet[i].altitude)
    return 0.0 if stage == stages.LAND else float(errands[i].layer)


@kernel
def _anybody_changes_height(errands: Records) -> bool:
    """Whether a vehicle is on its way home, or to its search height."""
    changing = 0
    for i in range(errands.shape[0]):
        changing += 1 if stages.changes_height(errands[i].stage) else 0
    return changing > 0


@kernel
def steer(
    fleet: Records, poses: Records, errands: Records, wishes: Records, now: float, rules: Records,
    plan_edges: Floats, guard_edges: Floats, paths: Records, wants: Records, sent: Floats, setpoints: Records,
) -> None:  # fmt: skip
    """One setpoint tick: every airborne vehicle's want, guarded, as its setpoint."""
    for i in range(fleet.shape[0]):
        anchor.settle(fleet, i, poses, rules, guard_edges, paths)
    shown = _anybody_changes_height(errands)  # who looks at everybody's paths; else only neighbours do
    for i in range(fleet.shape[0]):
        if shown or paths[i].near != 0:
            airborne = stages.airborne(errands[i].stage)
            up = _wanted_up(fleet, errands, poses, i)
            guard.own_path(fleet, i, poses, sent, rules[0].interval, up, airborne, paths)
    for i in range(fleet.shape[0]):
        stage = errands[i].stage
        wants[i].v_east, wants[i].v_north, wants[i].up = 0.0, 0.0, fleet[i].altitude
        if stage == stages.SEARCH:
            wants[i].v_east, wants[i].v_north = wishes[i].v_east, wishes[i].v_north
        elif stages.WAIT <= stage <= stages.LAND:
            homing.home(fleet, poses, errands, i, now, rules, plan_edges, guard_edges, paths, wants)
        elif stage >= stages.TAKEN:
            levelling.level(fleet, poses, errands, i, rules, guard_edges, paths, wants)
        setpoints[i].up = wants[i].up
        if stages.guarded(stage):
            guard.guard(
                fleet, i, poses, wants[i].v_east, wants[i].v_north, rules, guard_edges, paths, sent, setpoints,
                shown,
            )  # fmt: skip
        else:
            setpoints[i].v_east, setpoints[i].v_north = 0.0, 0.0
            setpoints[i].outcome = guard.UNGUARDED
        for h in range(guard.under_way(fleet, i, rules[0].interval), 0, -1):
            sent[i, h, 0], sent[i, h, 1] = sent[i, h - 1, 0], sent[i, h - 1, 1]
        sent[i, 0, 0], sent[i, 0, 1] = setpoints[i].v_east, setpoints[i].v_north


@inlined_kernel
def _fly(
    fleet: Records, truth: Records, i: int, c_east: float, c_north: float, c_up: float, descent: float,
    rules: Records,
) -> None:  # fmt: skip
    """Vehicle ``i`` flies a setpoint as it arrived, for one interval; ``descent`` limits the way down to ``c_up``."""
    if rules[0].wind_east != 0.0 or rules[0].wind_north != 0.0:
        airspeed = motion.AIRSPEED_SHARE * fleet[i].speed
        c_east, c_north = motion.against_wind(
            c_east, c_north, airspeed, rules[0].wind_east, rules[0].wind_north
        )
    agility = fleet[i].climb_acceleration
    rate = motion.climb_rate_towards(truth[i].up, c_up, fleet[i].climb, descent, agility)
    motion.carry_on(
        truth, i, c_east, c_north, rate, fleet[i].speed, fleet[i].acceleration, fleet[i].braking, fleet[i].lag,
        fleet[i].climb, fleet[i].descent, agility, rules[0].interval,
    )  # fmt: skip


@kernel
def move(
    fleet: Records, truth: Records, errands: Records, sent: Floats, setpoints: Records, rules: Records
) -> None:
    """Let every airborne vehicle of a study follow, for one interval, the setpoint that its latency lets act now."""
    for i in range(fleet.shape[0]):
        if errands[i].stage < stages.TAKE_OFF or errands[i].stage > stages.LAND:
            continue
        late = guard.under_way(fleet, i, rules[0].interval)
        c_east, c_north = wire.told_speed(sent[i, late, 0], rules), wire.told_speed(sent[i, late, 1], rules)
        descent = rules[0].landing_speed if errands[i].stage == stages.LAND else fleet[i].descent
        _fly(fleet, truth, i, c_east, c_north, wire.told_height(setpoints[i].up, rules), descent, rules)
        if errands[i].stage == stages.TAKE_OFF and abs(truth[i].up - fleet[i].altitude) < 0.5:
            errands[i].stage = stages.HOLD
        elif errands[i].stage == stages.LAND and truth[i].up < 0.05:
            errands[i].stage = stages.LANDED


@kernel
def go_on(
    fleet: Records, truth: Records, poses: Records, errands: Records, wishes: Records, now: float,
    rules: Records, plan_edges: Floats, guard_edges: Floats, raw_edges: Floats, paths: Records,
    wants: Records, sent: Floats, setpoints: Records, account: Floats,
) -> None:  # fmt: skip
    """One setpoint tick of a study: steer by what is seen, move what is there, and look."""
    steer(fleet, poses, errands, wishes, now, rules, plan_edges, guard_edges, paths, wants, sent, setpoints)
    move(fleet, truth, errands, sent, setpoints, rules)
    watch(truth, errands, raw_edges, paths, account)
    wire.observe(truth, poses, rules)


@kernel
def release(errands: Records) -> bool:
    """The barrier: when every vehicle holds, all begin to search; returns whether they do."""
    for i in range(errands.shape[0]):
        if errands[i].stage != stages.HOLD:
            return False
    for i in range(errands.shape[0]):
        errands[i].stage = stages.SEARCH
    return True


@kernel
def all_landed(errands: Records) -> bool:
    """Whether every vehicle's flight is over."""
    landed = 0
    for i in range(errands.shape[0]):
        landed += 1 if errands[i].stage == stages.LANDED else 0
    return bool(landed == errands.shape[0])


@kernel
def watch(poses: Records, errands: Records, raw_edges: Floats, paths: Records, account: Floats) -> None:
    """Add this tick to ``account``: nearest approach (m), vehicle-ticks outside, standing, searching."""
    for i in range(poses.shape[0]):
        if not stages.airborne(errands[i].stage):
            continue
        x, y = poses[i].east, poses[i].north
        if not anchor.surely_inside(paths, i, x, y) and not fence.inside(raw_edges, x, y):
            account[1] += 1.0
        if errands[i].stage == stages.SEARCH:
            speed = math.sqrt(poses[i].v_east * poses[i].v_east + poses[i].v_north * poses[i].v_north)
            account[2] += 1.0 if speed < 0.5 else 0.0
            account[3] += 1.0
        for j in range(i):
            dx, dy = x - poses[j].east, y - poses[j].north
            squared = dx * dx + dy * dy
            if squared > account[0] * account[0] or not stages.airborne(errands[j].stage):
                continue
            if abs(poses[i].up - poses[j].up) < guard.HEIGHT_SEPARATION_M:
                account[0] = min(account[0], math.sqrt(squared))
