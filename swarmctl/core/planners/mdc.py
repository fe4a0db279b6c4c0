"""MDC, maximum density convergence (Wang et al. 2019, section IV): gather where targets are densest.

On a visit to a cluster a vehicle is drawn to the place where it saw most at once, and to the best such place
among the neighbours that are on targets too.  When nothing better turns up for a while it jumps out, straight
on until it sees nothing, and searches on; long after, having found nothing, it returns to the best place it
remembers.  ALGORITHMS' readings of the paper's contradictions are noted where they decide.
"""

import math

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..state import COMMON_MEMORY, record
from . import common
from .parameters import Parameter

TITLE = "maximum density convergence: gather where targets are densest"
LISTS = False
PARAMETERS = (
    Parameter("inertia", 0.4, "w_A, weight of the last direction", "eqs. 7, 8", 0.0, 100.0, (0.0, 1.0)),
    Parameter("personal", 0.3, "C_p, pull to the best place of this visit", "eq. 7", 0.0, 100.0, (0.0, 1.0)),
    Parameter(
        "global",
        0.3,
        "C_g, pull to the best place among neighbours on targets",
        "eq. 8",
        0.0,
        100.0,
        (0.0, 1.0),
    ),
    Parameter("random", 0.05, "φ, size of the random vector", "eqs. 7, 8", 0.0, 100.0, (0.0, 0.5)),
    Parameter(
        "jump_out_s", 15.0, "leave after so long without a better place", "section VII-B", search=(1.0, 60.0)
    ),
    Parameter(
        "return_s",
        200.0,
        "fly back to the best place after so long without a visit",
        "section IV (3)",
        search=(20.0, 1600.0),
    ),
    Parameter("dwell_s", 0.0, "leave after so long on one cluster; 0: never", "section VII-B, Fig. 12"),
)
MEMORY = record(
    *COMMON_MEMORY, "best", "best_east", "best_north", "since_better", "since_arrival", "leaving",
    "record", "record_east", "record_north", "left_at", "returning",
    integers=("best", "leaving", "record", "returning"),
)  # fmt: skip


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """Nothing to prepare: all-zero memory is an unbegun search."""


@kernel
def _note_best(memory: Records, i: int, poses: Records, in_range: int, period: float) -> None:
    """Keep the best place of this visit and of all time (eq. 5: fitness is the number in range now)."""
    memory[i].since_arrival += period
    memory[i].since_better += period
    if in_range > memory[i].best:
        memory[i].best = in_range
        memory[i].best_east = poses[i].east
        memory[i].best_north = poses[i].north
        memory[i].since_better = 0.0
    if memory[i].best > memory[i].record:
        memory[i].record = memory[i].best
        memory[i].record_east = memory[i].best_east
        memory[i].record_north = memory[i].best_north


@kernel
def _end_visit(memory: Records, i: int, now: float) -> None:
    memory[i].leaving = 0
    memory[i].best = 0
    memory[i].left_at = now


@kernel
def _neighbours_best(
    i: int, memory: Records, beacons: Records, heard: Integers, count: int, slot: int
) -> tuple[float, float, bool]:
    """The best place among this vehicle and the neighbours on targets, and whether there is such a neighbour.

    Eq. 8 prints the neighbour's own position; its best place is the reading that reproduces Table 2.
    """
    best = memory[i].best
    east, north = memory[i].best_east, memory[i].best_north
    company = False
    for k in range(count):
        j = heard[slot, i, k]
        if beacons[slot, j].in_range == 0 or beacons[slot, j].best == 0:
            continue
        company = True
        if beacons[slot, j].best > best:
            best = beacons[slot, j].best
            east, north = beacons[slot, j].best_east, beacons[slot, j].best_north
    return east, north, company


@kernel
def _converge(
    memory: Records, i: int, poses: Records, beacons: Records, heard: Integers, count: int, slot: int,
    fleet: Records, rules: Records, settings: Records, tick: int,
) -> None:  # fmt: skip
    """Eq. 7, and eq. 8 in company."""
    x, y = poses[i].east, poses[i].north
    toward_x, toward_y = common.term(rules, memory[i].best_east - x, memory[i].best_north - y)
    pull_x = settings[0].personal * toward_x
    pull_y = settings[0].personal * toward_y
    east, north, company = _neighbours_best(i, memory, beacons, heard, count, slot)
    if company:
        toward_x, toward_y = common.term(rules, east - x, north - y)
        pull_x += settings[0]["global"] * toward_x
        pull_y += settings[0]["global"] * toward_y
    common.follow_rule(memory, i, fleet, rules, tick, settings[0].inertia, pull_x, pull_y, settings[0].random)


@kernel
def _return_visit(memory: Records, i: int, poses: Records, step: float, now: float, after: float) -> None:
    """Long after leaving, with nothing found since, fly back to the best place remembered (section IV (3))."""
    if memory[i].record == 0 or now - memory[i].left_at < after:
        return
    memory[i].returning = 1
    dx = memory[i].record_east - poses[i].east
    dy = memory[i].record_north - poses[i].north
    if math.sqrt(dx * dx + dy * dy) <= step:
        memory[i].returning = 0
        memory[i].left_at = now
        return
    common.turn_to(memory, i, dx, dy)


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    period = rules[0].period
    now = tick * period
    in_range = knowledge[i].in_range
    if memory[i].leaving != 0 and in_range == 0:
        _end_visit(memory, i, now)
    on_visit = in_range > 0 or memory[i].best > 0
    if on_visit and memory[i].leaving == 0:
        if memory[i].best == 0:
            memory[i].returning = 0
            memory[i].since_better = 0.0
            memory[i].since_arrival = 0.0
        _note_best(memory, i, poses, in_range, period)
        stale = memory[i].since_better >= settings[0].jump_out_s
        if stale or 0.0 < settings[0].dwell_s <= memory[i].since_arrival:
            memory[i].leaving = 1
        else:
            _converge(
                memory, i, poses, beacons, heard, heard_count[slot, i], slot, fleet, rules, settings, tick
            )
    elif not on_visit:
        _return_visit(memory, i, poses, fleet[i].speed * period, now, settings[0].return_s)
    hit = common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia)
    if hit and memory[i].returning != 0:  # a blocked return would jitter at the fence: give it up
        memory[i].returning = 0
        memory[i].left_at = now


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """Put this visit's best fitness and place into the beacon."""
    beacons[slot, i].on_visit = 1 if memory[i].best > 0 and memory[i].leaving == 0 else 0
    beacons[slot, i].best = memory[i].best
    beacons[slot, i].best_east = memory[i].best_east
    beacons[slot, i].best_north = memory[i].best_north
