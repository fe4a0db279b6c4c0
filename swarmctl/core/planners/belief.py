"""Belief sweep: fly where most is to be found for the time it takes, by what is known of the ground.

Each vehicle holds a map of cells: visited, promising (near a known target), unknown.  Vehicles exchange their maps
and where they last met others, and each has a sector of the area, agreed at launch, or a home, where vehicles start
all over it.  With a sector it flies out on the line that halves it until it sees a target or meets the fence.  Then,
every few seconds and whenever it arrives, it chooses the cell that is worth most a second: promising ones most, those
with many empty cells about least, those of another's sector half, those that another vehicle is nearer to a third.
"""

import math

import numpy as np

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..know import first_new
from ..state import BEACON as COMMON_BEACON
from ..state import COMMON_MEMORY, record
from . import belief_choice as choice
from . import belief_end as end
from . import belief_grid as grid
from . import common, sectors
from .parameters import Parameter

TITLE = "ours: fly where most is to be found for the time it takes, on a shared map"
LISTS = True
PARAMETERS = (
    Parameter(
        "inertia", 0.4, "w in the fence response", "Algorithm 1, line 27", 0.0, 100.0,
        search=(0.0, 1.0),
    ),
    Parameter("cell", 0.75, "width of a cell, in sensor ranges", "ours", 0.05, 1.5),
    Parameter("cell_most", 1.5, "width of a cell where the area is large, in sensor ranges", "ours", 0.05, 10.0),
    Parameter(
        "visited", 1.0, "a cell is visited within so many sensor ranges of its centre", "ours", 0.0, 10.0,
        search=(0.5, 1.5),
    ),
    Parameter(
        "near_target", 1.0, "a cell is promising within so many sensor ranges of a target", "ours", 0.0, 10.0,
        search=(0.3, 2.0),
    ),
    Parameter(
        "promising", 3.0, "worth of a promising cell; an unknown one's is 1", "ours", 0.0, 1000.0,
        search=(1.0, 10.0),
    ),
    Parameter(
        "emptiness", 0.7, "what an unknown cell among empty ones loses of its worth", "ours", 0.0, 1.0,
        search=(0.0, 1.0),
    ),
    Parameter(
        "empty_share", 0.5, "share of empty cells in 5 x 5 at which it has lost all of that", "ours", 0.04, 1.0,
        search=(0.1, 1.0),
    ),
    Parameter(
        "foreign", 0.5, "what an unknown cell of another's sector keeps of its worth", "ours", 0.0, 1.0,
        search=(0.0, 1.0),
    ),
    Parameter(
        "nearer", 0.3, "what a cell that another vehicle is nearer to keeps of its worth", "ours", 0.0, 1.0,
        search=(0.0, 1.0),
    ),
    Parameter(
        "seen_s", 120.0, "another vehicle counts for so long after it was heard of", "ours",
        search=(0.0, 300.0),
    ),
    Parameter(
        "arrival_s", 10.0, "time that every cell takes, beside the way there", "ours", 0.001,
        search=(1.0, 30.0),
    ),
    Parameter("turn_s", 4.0, "time that a turn takes, for each radian", "ours", search=(0.0, 15.0)),
    Parameter("decide_s", 3.0, "a new choice after so long, or on arrival", "ours", search=(1.0, 15.0)),
    Parameter(
        "then", "hold", "when little is left: search all over again, or converge on the densest known spot", "ours",
        choices=("hold", "converge"),
    ),
    Parameter("enough", 0.03, "with converge: little is left where no cell is worth so much a second", "ours"),
    Parameter("patience", 3.0, "a goal is given up after so many times its straight flight", "ours", 1.0),
)  # fmt: skip
SETTLE_S = 30.0  # and so much on top, for short ways
HOLD, CONVERGE = 0, 1
FIRST_LEG, SEARCH, CONVERGING, LOST = 0, 1, 2, 3
LOOK_S = 30.0  # between two looks for a spot that is denser yet
_INTEGERS = (
    "wide", "columns", "rows", "first_column", "first_row", "visited", "worth", "ceilings", "met", "mode",
    "laid", "goal_row", "goal_column", "lap", "counted",
)  # fmt: skip
_OWN = record(
    *COMMON_MEMORY, "side", "mode", "laid", "was_east", "was_north", "goal_row", "goal_column", "decide_at",
    "give_up_at", "lap", "counted", "spot_east", "spot_north", *sectors.FIELDS, *grid.FIELDS, *choice.FIELDS,
    integers=_INTEGERS,
)  # fmt: skip
MEMORY = np.dtype([*_OWN.descr, ("cells", "<i1", (grid.STRIDE * grid.STRIDE,))])
_TOLD = record("lap", "first_column", "first_row", ("visited", grid.SIDE), *choice.FIELDS, integers=_INTEGERS)
BEACON = np.dtype([*COMMON_BEACON.descr, *_TOLD.descr])
LONG_AGO = -1e9


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """Agree on the sectors; cells are laid at the first step, where the settings are at hand."""
    sectors.agree(memory, i, fleet, edges)
    memory[i].mode = FIRST_LEG if memory[i].home == 0.0 else SEARCH
    memory[i].laid, memory[i].lap = 0, 0
    memory[i].goal_row, memory[i].goal_column, memory[i].counted = -1, -1, 0
    memory[i].decide_at, memory[i].give_up_at, memory[i].side = 0.0, 0.0, 0.0
    for k in range(choice.MET):
        memory[i].met_at[k] = LONG_AGO


@kernel
def _set_worths(memory: Records, i: int, settings: Records) -> None:
    """Worth of each kind of cell in thousandths: whole numbers, whose sums do not hang on their order."""
    for code in range(grid.CODES):
        memory[i].worth[code] = 0
    for empty in range(26):
        share = min(1.0, empty / (25.0 * settings[0].empty_share))
        worth = 1000.0 * (1.0 - settings[0].emptiness * share)
        memory[i].worth[grid.OWN + empty] = round(worth)
        memory[i].worth[grid.FOREIGN + empty] = round(settings[0].foreign * worth)
    memory[i].worth[grid.PROMISING] = round(1000.0 * settings[0].promising)


@kernel
def _lay_out(
    memory: Records, i: int, fleet: Records, poses: Records, edges: Floats, settings: Records
) -> None:
    """Lay the cells and open the window on them, before anything is known."""
    _set_worths(memory, i, settings)
    # A vehicle with a home needs no map of the whole of a large area.
    most = settings[0].cell_most if memory[i].home == 0.0 else settings[0].cell
    grid.lay_cells(memory, i, fleet, edges, settings[0].cell, most)
    grid.centre_window(memory, i, poses[i].east, poses[i].north)
    memory[i].was_east, memory[i].was_north = poses[i].east, poses[i].north
    for row in range(grid.SIDE):
        memory[i].visited[row] = 0
    memory[i].laid = 1


@kernel
def _see(memory: Records, i: int, poses: Records, reach: float) -> bool:
    """Mark what was passed since the last period visited; whether anything was new."""
    dx, dy = poses[i].east - memory[i].was_east, poses[i].north - memory[i].was_north
    points = max(math.ceil(math.sqrt(dx * dx + dy * dy) / (0.5 * memory[i].cell)), 1)
    some = False
    for k in range(points):
        back = k / points
        some = grid.visit(memory, i, poses[i].east - back * dx, poses[i].north - back * dy, reach) or some
    memory[i].was_east, memory[i].was_north = poses[i].east, poses[i].north
    return some


@kernel
def _hear(
    memory: Records, i: int, beacons: Records, heard: Integers, count: int, slot: int, sent_at: float,
    places: int,
) -> None:  # fmt: skip
    """Take over the maps of those heard that are of this lap, and whom they met."""
    for h in range(count):
        j = heard[slot, i, h]
        if beacons[slot, j].lap == memory[i].lap:
            grid.take_over(memory, i, beacons, slot, j)
        choice.meet(memory, i, j, sent_at, beacons[slot, j].east, beacons[slot, j].north)
        for k in range(places):
            choice.meet(
                memory, i, beacons[slot, j].met[k], beacons[slot, j].met_at[k], beacons[slot, j].met_east[k],
                beacons[slot, j].met_north[k],
            )  # fmt: skip


@kernel
def _remembered(knowledge: Records, i: int, contacts: Records) -> int:
    """How many rows of vehicle ``i``'s contacts hold one."""
    return int(min(knowledge[i].known, contacts.shape[1]))


@kernel
def _learn(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records, edges: Floats,
    settings: Records,
) -> bool:  # fmt: skip
    """Bring the map up to date with where the vehicle is and what it knows; whether it saw ground that was new."""
    reach = settings[0].near_target * fleet[i].sensor_range
    if memory[i].laid == 0:
        _lay_out(memory, i, fleet, poses, edges, settings)
        grid.fill_window(memory, i, edges, contacts, _remembered(knowledge, i, contacts), reach)
    elif grid.move_window(memory, i, poses[i].east, poses[i].north):
        grid.fill_window(memory, i, edges, contacts, _remembered(knowledge, i, contacts), reach)
    for k in range(first_new(knowledge, i, contacts), knowledge[i].known):
        c = k & (contacts.shape[1] - 1)
        grid.promise(memory, i, contacts[i, c].east, contacts[i, c].north, reach)
    return _see(memory, i, poses, settings[0].visited * fleet[i].sensor_range)


@kernel
def _goal_is_open(memory: Records, i: int) -> bool:
    """Whether there is a goal, and still something to be had there."""
    row, column = memory[i].goal_row - memory[i].first_row, memory[i].goal_column - memory[i].first_column
    if memory[i].goal_row < 0 or not (0 <= row < grid.SIDE and 0 <= column < grid.SIDE):
        return False
    return bool(memory[i].cells[grid.place(row, column)] < grid.CLOSED)


@kernel
def _begin_lap(
    memory: Records, i: int, fleet: Records, knowledge: Records, contacts: Records, edges: Floats, settings: Records,
    number: int,
) -> None:  # fmt: skip
    """Search all over again, as if nothing had been visited."""
    memory[i].lap = number
    for row in range(grid.SIDE):
        memory[i].visited[row] = 0
    reach = settings[0].near_target * fleet[i].sensor_range
    grid.fill_window(memory, i, edges, contacts, _remembered(knowledge, i, contacts), reach)


@kernel
def _latest_lap(memory: Records, i: int, beacons: Records, heard: Integers, count: int, slot: int) -> int:
    """The latest lap that anybody heard is in, this vehicle included."""
    latest = memory[i].lap
    for h in range(count):
        latest = max(latest, beacons[slot, heard[slot, i, h]].lap)
    return int(latest)


@kernel
def _converge(
    memory: Records, i: int, fleet: Records, knowledge: Records, contacts: Records, edges: Floats, rules: Records,
    now: float,
) -> None:  # fmt: skip
    """Look for the densest spot, if more is known than at the last look."""
    if now < memory[i].decide_at or knowledge[i].known == memory[i].counted:
        return
    memory[i].decide_at, memory[i].counted = now + LOOK_S, knowledge[i].known
    east, north = end.densest(contacts, i, _remembered(knowledge, i, contacts), fleet[i].sensor_range)
    east, north = end.own_place(i, rules[0].separation, edges, east, north)
    memory[i].spot_east, memory[i].spot_north = east, north


@kernel
def _decide(
    memory: Records, i: int, fleet: Records, poses: Records, settings: Records, now: float, fresh: bool
) -> float:
    """Choose a goal and return what it is worth a second.

    ``fresh``: what became of the last goal is no reason to give this one less time.
    """
    if not fresh and now > memory[i].give_up_at:
        row, column = memory[i].goal_row - memory[i].first_row, memory[i].goal_column - memory[i].first_column
        grid.give_up(memory, i, row, column)
        fresh = True
    row, column = grid.row_at(memory, i, poses[i].north), grid.column_at(memory, i, poses[i].east)
    if _goal_is_open(memory, i):
        row, column = memory[i].goal_row - memory[i].first_row, memory[i].goal_column - memory[i].first_column
    row, column, best = choice.choose(memory, i, fleet, poses, settings, now, row, column)
    memory[i].decide_at = now + settings[0].decide_s
    memory[i].goal_row = row + memory[i].first_row if row >= 0 else -1
    memory[i].goal_column = column + memory[i].first_column
    if fresh and row >= 0:
        dx = grid.east_of(memory, i, column) - poses[i].east
        dy = grid.north_of(memory, i, row) - poses[i].north
        flight = math.sqrt(dx * dx + dy * dy) / fleet[i].speed
        memory[i].give_up_at = now + SETTLE_S + settings[0].patience * flight
    return float(best)


@kernel
def _search(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records, edges: Floats,
    settings: Records, now: float, progress: bool,
) -> None:  # fmt: skip
    """Choose anew on arrival or after a while; where little or nothing is left, do what ``then`` says."""
    is_open = _goal_is_open(memory, i)
    if is_open and now < memory[i].decide_at:
        return
    best = _decide(memory, i, fleet, poses, settings, now, progress or not is_open)
    if settings[0].then == CONVERGE and best < 1000.0 * settings[0].enough and knowledge[i].known > 0:
        memory[i].mode, memory[i].decide_at = CONVERGING, now
    elif memory[i].goal_row < 0:
        _begin_lap(memory, i, fleet, knowledge, contacts, edges, settings, memory[i].lap + 1)
        _decide(memory, i, fleet, poses, settings, now, True)
        if memory[i].goal_row < 0:
            memory[i].mode = LOST


@kernel
def _head(memory: Records, i: int, poses: Records, edges: Floats, reach: float) -> None:
    """Aim at the goal or the spot, round what is in the way; without either, straight on."""
    if memory[i].mode == SEARCH:
        column, row = memory[i].goal_column - memory[i].first_column, memory[i].goal_row - memory[i].first_row
        common.aim_at(memory, i, poses, grid.east_of(memory, i, column), grid.north_of(memory, i, row))
        common.pass_by(memory, i, poses, edges, reach)
    elif memory[i].mode == CONVERGING:
        common.aim_at(memory, i, poses, memory[i].spot_east, memory[i].spot_north)
        common.pass_by(memory, i, poses, edges, reach)


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    now = tick * rules[0].period
    reach = common.look_ahead(fleet, i, rules)
    count = heard_count[slot, i]
    progress = _learn(memory, i, fleet, poses, knowledge, contacts, edges, settings)
    latest = _latest_lap(memory, i, beacons, heard, count, slot)
    if latest > memory[i].lap:
        _begin_lap(memory, i, fleet, knowledge, contacts, edges, settings, latest)
    sent_at = now - rules[0].radio_delay * rules[0].period
    _hear(memory, i, beacons, heard, count, slot, sent_at, min(fleet.shape[0], choice.MET))
    if memory[i].mode == FIRST_LEG and (
        knowledge[i].in_range > 0 or common.blocked(memory, i, poses, edges, reach)
    ):
        memory[i].mode = SEARCH
    if memory[i].mode == SEARCH:
        _search(memory, i, fleet, poses, knowledge, contacts, edges, settings, now, progress)
    if memory[i].mode == CONVERGING:
        _converge(memory, i, fleet, knowledge, contacts, edges, rules, now)
        if end.approach(memory, i, fleet, poses, edges, rules, memory[i].spot_east, memory[i].spot_north):
            return
    _head(memory, i, poses, edges, reach)
    common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia)


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """The map, its lap, and the table of the vehicles met."""
    beacons[slot, i].lap = memory[i].lap
    beacons[slot, i].first_column = memory[i].first_column
    beacons[slot, i].first_row = memory[i].first_row
    for row in range(grid.rows_of(memory, i)):
        beacons[slot, i].visited[row] = memory[i].visited[row]
    for k in range(choice.MET):
        beacons[slot, i].met[k], beacons[slot, i].met_at[k] = memory[i].met[k], memory[i].met_at[k]
        beacons[slot, i].met_east[k] = memory[i].met_east[k]
        beacons[slot, i].met_north[k] = memory[i].met_north[k]
