"""ACE, accurate coverage exploration (Wang et al. 2019, section VI): mow every cluster on line.

The first target of a cluster starts lanes perpendicular to the heading it was found on.  A lane ends some steps
after its last hit (α), the next one lies a spacing further along the old heading and runs back (no further than the
vehicle sees to both sides, or there would be ground between that nobody saw); a lane with no hit at all (β) ends the
cluster.  Of two vehicles that mow one cluster and hear each other, the one that has
found fewer there leaves with a random turn.
"""

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..randoms import CHOICE, normal, uniform
from ..state import COMMON_MEMORY, record
from . import common
from .parameters import Parameter

TITLE = "accurate coverage: mow every cluster found"
LISTS = True
PARAMETERS = (
    Parameter(
        "inertia",
        0.4,
        "w_C, weight of the last direction in the fence response",
        "Algorithm 3",
        0.0,
        100.0,
        (0.0, 1.0),
    ),
    Parameter("alpha_s", 4.0, "α, a lane ends so long after its last hit", "eq. 12", search=(1.0, 20.0)),
    Parameter(
        "beta_s", 10.0, "β, a lane without a hit for so long ends the cluster", "eq. 13", search=(1.0, 30.0)
    ),
    Parameter(
        "spacing_m",
        300.0,
        "distance of the lanes, at most twice the sensor's range",
        "ours: the paper gives none",
        1.0,
        search=(50.0, 600.0),
    ),
    Parameter(
        "random", 1.0, "φ, size of the random turn on leaving", "Algorithm 3, line 19", 0.0, 100.0, (0.0, 2.0)
    ),
)
SEARCHING, LANE, SHIFT, LEAVING = 0, 1, 2, 3
MEMORY = record(
    *COMMON_MEMORY, "mode", "lane_east", "lane_north", "shift_east", "shift_north", "hits", "since_hit",
    "shift_left", "found_here",
    integers=("mode", "hits", "found_here"),
)  # fmt: skip


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """Nothing to prepare: all-zero memory is an unbegun search."""


@kernel
def _begin_lane(memory: Records, i: int, east: float, north: float) -> None:
    memory[i].mode = LANE
    memory[i].lane_east, memory[i].lane_north = east, north
    memory[i].hits = 0
    memory[i].since_hit = 0.0


@kernel
def _begin_mowing(memory: Records, i: int, rules: Records, tick: int) -> None:
    """The first lane: perpendicular to the heading, the side drawn at random."""
    east, north = memory[i].heading_east, memory[i].heading_north
    side = 1.0 if uniform(rules[0].seed, i, tick, CHOICE) < 0.5 else -1.0
    memory[i].shift_east, memory[i].shift_north = east, north
    memory[i].found_here = 0
    _begin_lane(memory, i, side * north, -side * east)


@kernel
def _end_lane(memory: Records, i: int, fleet: Records, settings: Records) -> None:
    """A lane with hits is followed by the next one; a lane without ends the cluster."""
    if memory[i].hits == 0:
        memory[i].mode = LEAVING
        return
    memory[i].mode = SHIFT
    memory[i].shift_left = min(settings[0].spacing_m, 2.0 * fleet[i].sensor_range)


@kernel
def _mow(memory: Records, i: int, fleet: Records, in_range: int, period: float, settings: Records) -> None:
    """One period on a lane or between two."""
    if memory[i].mode == SHIFT:
        memory[i].shift_left -= fleet[i].speed * period
        if memory[i].shift_left <= 0.0:
            _begin_lane(memory, i, -memory[i].lane_east, -memory[i].lane_north)
        return
    memory[i].since_hit += period
    if in_range > 0:
        memory[i].hits += 1
        memory[i].since_hit = 0.0
    patience = settings[0].alpha_s if memory[i].hits > 0 else settings[0].beta_s
    if memory[i].since_hit >= patience:
        _end_lane(memory, i, fleet, settings)


@kernel
def _outdone(memory: Records, i: int, beacons: Records, heard: Integers, count: int, slot: int) -> bool:
    """Whether a neighbour mows too and has found more here (of two equal, the higher number leaves)."""
    for k in range(count):
        j = heard[slot, i, k]
        if beacons[slot, j].on_visit == 0:
            continue
        theirs = beacons[slot, j].best
        if theirs > memory[i].found_here or (theirs == memory[i].found_here and j < i):
            return True
    return False


@kernel
def _set_heading(memory: Records, i: int) -> None:
    if memory[i].mode == LANE:
        common.turn_to(memory, i, memory[i].lane_east, memory[i].lane_north)
    elif memory[i].mode == SHIFT:
        common.turn_to(memory, i, memory[i].shift_east, memory[i].shift_north)


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    in_range = knowledge[i].in_range
    if memory[i].mode == LEAVING and in_range == 0:
        memory[i].mode = SEARCHING
    if memory[i].mode == SEARCHING and knowledge[i].seen > 0:
        _begin_mowing(memory, i, rules, tick)
    if memory[i].mode == LANE or memory[i].mode == SHIFT:
        memory[i].found_here += knowledge[i].seen
        if _outdone(memory, i, beacons, heard, heard_count[slot, i], slot):
            memory[i].mode = LEAVING
            phi = settings[0].random
            common.turn_to(
                memory, i,
                memory[i].heading_east + phi * normal(rules[0].seed, i, tick, CHOICE + 1),
                memory[i].heading_north + phi * normal(rules[0].seed, i, tick, CHOICE + 2),
            )  # fmt: skip
        else:
            _mow(memory, i, fleet, in_range, rules[0].period, settings)
            _set_heading(memory, i)
    _meet_fence(memory, i, fleet, poses, edges, rules, settings, tick)


@kernel
def _meet_fence(
    memory: Records, i: int, fleet: Records, poses: Records, edges: Floats, rules: Records, settings: Records,
    tick: int,
) -> None:  # fmt: skip
    """A lane that meets the fence ends there; a shift that meets it ends the cluster."""
    reach = common.look_ahead(fleet, i, rules)
    if memory[i].mode == LANE and common.blocked(memory, i, poses, edges, reach):
        _end_lane(memory, i, fleet, settings)
        _set_heading(memory, i)
    met = common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia)
    if met and memory[i].mode != SEARCHING:
        memory[i].mode = LEAVING


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """Put whether this vehicle mows, and how many it has found here, into the beacon."""
    mowing = memory[i].mode == LANE or memory[i].mode == SHIFT
    beacons[slot, i].on_visit = 1 if mowing else 0
    beacons[slot, i].best = memory[i].found_here
