"""FCO, fast cross-over (Wang et al. 2019, section V): cross a cluster towards the furthest new target.

Whatever is new this period, seen or told, pulls the vehicle to its furthest member; nothing new, straight on.
Neighbours push each other away while either is on targets.  After a while with nothing new a vehicle revisits
the surroundings of the last place it aimed at.
"""

import math

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..know import first_new
from ..randoms import CHOICE, uniform
from ..state import COMMON_MEMORY, record
from . import common
from .parameters import Parameter

TITLE = "fast cross-over: cross a cluster towards the furthest new target"
LISTS = True
PARAMETERS = (
    Parameter("inertia", 0.4, "w_B, weight of the last direction", "eqs. 10, 11", 0.0, 100.0, (0.0, 1.0)),
    Parameter("personal", 0.4, "C_p, pull to the furthest new target", "eq. 10", 0.0, 100.0, (0.0, 1.0)),
    Parameter("global", 0.2, "C_g, push away from neighbours", "eq. 11", 0.0, 100.0, (0.0, 1.0)),
    Parameter("random", 0.05, "φ, size of the random vector", "eqs. 10, 11", 0.0, 100.0, (0.0, 0.5)),
    Parameter(
        "revisit_s",
        200.0,
        "revisit after so long with nothing new",
        "section V, Fig. 18",
        search=(20.0, 1600.0),
    ),
    Parameter(
        "revisit_radius_m",
        200.0,
        "a revisit aims within so much of the last aim",
        "section V",
        search=(0.0, 1000.0),
    ),
)
MEMORY = record(
    *COMMON_MEMORY, "aim_east", "aim_north", "last_new", "begun", "goal_east", "goal_north", "revisiting",
    integers=("begun", "revisiting"),
)  # fmt: skip


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """Nothing to prepare: all-zero memory is an unbegun search."""


@kernel
def _furthest_new(i: int, poses: Records, knowledge: Records, contacts: Records) -> tuple[float, float]:
    """The furthest of the targets learned this period (the set difference; eq. 9 prints an intersection)."""
    furthest = -1.0
    east, north = 0.0, 0.0
    for k in range(first_new(knowledge, i, contacts), knowledge[i].known):
        c = k & (contacts.shape[1] - 1)
        dx = contacts[i, c].east - poses[i].east
        dy = contacts[i, c].north - poses[i].north
        if dx * dx + dy * dy > furthest:
            furthest = dx * dx + dy * dy
            east, north = contacts[i, c].east, contacts[i, c].north
    return east, north


@kernel
def _exclusion(
    i: int, poses: Records, in_range: int, beacons: Records, heard: Integers, count: int, slot: int,
    rules: Records,
) -> tuple[float, float, bool]:  # fmt: skip
    """The push away from neighbours (eq. 11), felt when either of the two is on targets."""
    push_x, push_y = 0.0, 0.0
    felt = False
    for k in range(count):
        j = heard[slot, i, k]
        if in_range == 0 and beacons[slot, j].in_range == 0:
            continue
        away_x, away_y = common.term(
            rules, poses[i].east - beacons[slot, j].east, poses[i].north - beacons[slot, j].north
        )
        push_x += away_x
        push_y += away_y
        felt = True
    return push_x, push_y, felt


@kernel
def _revisit(
    memory: Records, i: int, poses: Records, reach: float, rules: Records, settings: Records, tick: int
) -> None:
    """Nothing new for long: fly to a random point round the last aim."""
    now = tick * rules[0].period
    if memory[i].revisiting == 0:
        if memory[i].begun == 0 or now - memory[i].last_new < settings[0].revisit_s:
            return
        angle = 2.0 * math.pi * uniform(rules[0].seed, i, tick, CHOICE)
        off = settings[0].revisit_radius_m * math.sqrt(uniform(rules[0].seed, i, tick, CHOICE + 1))
        memory[i].goal_east = memory[i].aim_east + off * math.cos(angle)
        memory[i].goal_north = memory[i].aim_north + off * math.sin(angle)
        memory[i].revisiting = 1
    dx = memory[i].goal_east - poses[i].east
    dy = memory[i].goal_north - poses[i].north
    if math.sqrt(dx * dx + dy * dy) <= reach:
        memory[i].revisiting = 0
        memory[i].last_new = now
        return
    common.turn_to(memory, i, dx, dy)


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    now = tick * rules[0].period
    push_x, push_y, felt = _exclusion(
        i, poses, knowledge[i].in_range, beacons, heard, heard_count[slot, i], slot, rules
    )
    pull_x = settings[0]["global"] * push_x
    pull_y = settings[0]["global"] * push_y
    new = knowledge[i].known > knowledge[i].before
    if new:
        east, north = _furthest_new(i, poses, knowledge, contacts)
        memory[i].aim_east, memory[i].aim_north = east, north
        memory[i].last_new, memory[i].begun, memory[i].revisiting = now, 1, 0
        toward_x, toward_y = common.term(rules, east - poses[i].east, north - poses[i].north)
        pull_x += settings[0].personal * toward_x
        pull_y += settings[0].personal * toward_y
    else:
        _revisit(memory, i, poses, fleet[i].speed * rules[0].period, rules, settings, tick)
    if new or felt:
        common.follow_rule(
            memory, i, fleet, rules, tick, settings[0].inertia, pull_x, pull_y, settings[0].random
        )
    hit = common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia)
    if hit and memory[i].revisiting != 0:  # a blocked revisit would jitter at the fence: give it up
        memory[i].revisiting, memory[i].last_new = 0, now


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """Exclusion needs only where a vehicle is and whether it is on targets, which every beacon carries."""
