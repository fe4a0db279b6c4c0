"""Sweep, the baseline every search team knows: parallel lanes, a strip of the area for each vehicle.

The strips are agreed at launch by vehicle number, from west to east of the area's bounding box, each as wide as its
vehicle's speed and sensor make it; lanes run north and south and end where the area does.  A keep-out is passed on
whichever side turns least, and the lane rejoined behind it.  The lanes are flown to and fro until the search ends;
neither detections nor the radio are used.
"""

import math

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..state import COMMON_MEMORY, record
from . import common
from .parameters import Parameter

TITLE = "baseline: boustrophedon strips agreed at launch"
LISTS = False
PARAMETERS = (
    Parameter("inertia", 0.4, "w in the fence response", "Algorithm 1, line 27", 0.0, 100.0, (0.0, 1.0)),
    Parameter(
        "overlap",
        0.3,
        "share by which neighbouring lanes' sensor swaths overlap",
        "ours",
        -1.0,
        0.95,
        search=(-0.5, 0.6),
    ),
)
TRANSFER, ALONG = 0, 1
PATIENCE = 3.0  # a leg is given up after so many times its straight flight
MEMORY = record(
    *COMMON_MEMORY, "west", "width", "lane", "lanes", "order", "mode", "north_end", "goal_east", "goal_north",
    "give_up_at", "side",
    integers=("lane", "lanes", "order", "mode", "north_end"),
)  # fmt: skip


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """Agree on the strips: the bounding box cut into as many as there are vehicles, all swept in the same time."""
    west, east = math.inf, -math.inf
    for k in range(edges.shape[0]):
        west, east = min(west, edges[k, 0]), max(east, edges[k, 0])
    before, whole = 0.0, 0.0
    for j in range(fleet.shape[0]):
        if j == i:
            before = whole
        whole += common.sweep_rate(fleet, j)
    memory[i].width = (east - west) * common.sweep_rate(fleet, i) / whole
    memory[i].west = west + (east - west) * before / whole
    memory[i].lanes = 0  # laid out at the first step, where the settings are at hand
    memory[i].order = 1


@kernel
def _lane_end(memory: Records, i: int, edges: Floats, north: bool, inset: float) -> tuple[float, float]:
    """The northern or southern end of the current lane, ``inset`` metres inside the area."""
    x = memory[i].west + memory[i].width * (memory[i].lane + 0.5) / memory[i].lanes
    low, high = math.inf, -math.inf
    for k in range(edges.shape[0]):
        x0, x1 = edges[k, 0], edges[k, 2]
        if (x0 > x) != (x1 > x):
            y = edges[k, 1] + (x - x0) * (edges[k, 3] - edges[k, 1]) / (x1 - x0)
            low, high = min(low, y), max(high, y)
    if high - low < 2.0 * inset:
        return x, 0.5 * (low + high)
    return x, (high - inset if north else low + inset)


@kernel
def _set_goal(
    memory: Records, i: int, fleet: Records, poses: Records, edges: Floats, inset: float, now: float
) -> None:
    """Aim at the end of the lane that ``north_end`` names."""
    x, y = _lane_end(memory, i, edges, memory[i].north_end != 0, inset)
    memory[i].goal_east, memory[i].goal_north = x, y
    dx, dy = x - poses[i].east, y - poses[i].north
    memory[i].give_up_at = now + 30.0 + PATIENCE * math.sqrt(dx * dx + dy * dy) / fleet[i].speed


@kernel
def _first_lane(
    memory: Records, i: int, fleet: Records, poses: Records, edges: Floats, settings: Records
) -> None:
    """Lay out the lanes, and begin at the corner of the strip that is nearest."""
    swath = 2.0 * fleet[i].sensor_range * (1.0 - settings[0].overlap)
    memory[i].lanes = max(math.ceil(memory[i].width / swath - 1e-9), 1)
    best = math.inf
    choice, choice_north = 0, 0
    for end in range(4):
        memory[i].lane = 0 if end < 2 else memory[i].lanes - 1
        x, y = _lane_end(memory, i, edges, end % 2 == 1, 0.0)
        dx, dy = x - poses[i].east, y - poses[i].north
        if dx * dx + dy * dy < best:
            best = dx * dx + dy * dy
            choice, choice_north = memory[i].lane, end % 2
    memory[i].lane, memory[i].north_end = choice, choice_north
    memory[i].order = 1 if choice == 0 else -1
    memory[i].mode = TRANSFER


@kernel
def _next_goal(memory: Records, i: int) -> None:
    """At a lane's beginning fly along it; at its end change to the next lane, at the last one turn back."""
    if memory[i].mode == TRANSFER:
        memory[i].mode = ALONG
        memory[i].north_end = 1 - memory[i].north_end
        return
    memory[i].mode = TRANSFER
    following = memory[i].lane + memory[i].order
    if 0 <= following < memory[i].lanes:
        memory[i].lane = following
    else:
        memory[i].order = -memory[i].order


@kernel
def _aim(memory: Records, i: int, poses: Records, carrot: float) -> None:
    """Head for the goal; along a lane, for a point on the lane a little ahead."""
    y = memory[i].goal_north
    if memory[i].mode == ALONG:
        ahead = y - poses[i].north
        y = poses[i].north + min(max(ahead, -carrot), carrot)
    common.aim_at(memory, i, poses, memory[i].goal_east, y)


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    now = tick * rules[0].period
    reach = common.look_ahead(fleet, i, rules)
    if memory[i].lanes == 0:
        _first_lane(memory, i, fleet, poses, edges, settings)
        _set_goal(memory, i, fleet, poses, edges, reach, now)
    dx = memory[i].goal_east - poses[i].east
    dy = memory[i].goal_north - poses[i].north
    near = math.sqrt(dx * dx + dy * dy) <= max(0.5 * reach, fleet[i].speed * rules[0].period)
    if near or now > memory[i].give_up_at:
        _next_goal(memory, i)
        _set_goal(memory, i, fleet, poses, edges, reach, now)
    _aim(memory, i, poses, 2.0 * reach)
    common.pass_by(memory, i, poses, edges, reach)
    common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia)


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """Nothing beside what every beacon carries."""
