"""How a vehicle that flies ``belief`` chooses where to fly next: the cell that is worth most for the time it takes.

Worth lies in the cells (belief_grid), and a goal has that of the 3 × 3 cells about it.  Blocks of cells have ceilings
on what a goal in them can be worth; those where even that, at the block's nearest corner, would not be enough are
passed over.  Ties go to the cell with the lower number.  So the choice is that of looking at all cells in any order.
"""

import math

from ..arrays import Records
from ..jit import kernel
from . import belief_grid as grid

SLACK = 1.0 - 1e-9  # for what rounding adds to a distance
MET = 32  # places in the table of the vehicles met
FIELDS = (
    ("met", MET), ("met_at", MET), ("met_east", MET), ("met_north", MET),
)  # fmt: skip


@kernel
def meet(memory: Records, i: int, j: int, at: float, east: float, north: float) -> None:
    """Take in where vehicle ``j`` was at a time, unless something newer has its place in the table."""
    k = j % MET
    if j != i and at > memory[i].met_at[k]:
        memory[i].met[k], memory[i].met_at[k] = j, at
        memory[i].met_east[k], memory[i].met_north[k] = east, north


@kernel
def _other_nearer(
    memory: Records, i: int, since: float, places: int, east: float, north: float, mine: float
) -> bool:
    """Whether a vehicle heard of since then was nearer to a place than ``mine`` metres."""
    for k in range(places):
        if memory[i].met_at[k] >= since:
            dx, dy = memory[i].met_east[k] - east, memory[i].met_north[k] - north
            if dx * dx + dy * dy < mine * mine:
                return True
    return False


@kernel
def _block(memory: Records, i: int, k: int) -> int:
    """What the 3 × 3 cells about place ``k`` are worth, in thousandths."""
    cells, worth = memory[i].cells, memory[i].worth
    total = 0
    for row in range(k - grid.STRIDE, k + 2 * grid.STRIDE, grid.STRIDE):
        total += worth[cells[row - 1]] + worth[cells[row]] + worth[cells[row + 1]]
    return int(total)


@kernel
def _value(
    memory: Records, i: int, fleet: Records, poses: Records, settings: Records, now: float, row: int,
    column: int, total: int, least: float,
) -> float:  # fmt: skip
    """Worth a second of a cell whose block is worth ``total``; 0 for one that turns out to be under ``least``."""
    east, north = grid.east_of(memory, i, column), grid.north_of(memory, i, row)
    dx, dy = east - poses[i].east, north - poses[i].north
    distance = math.sqrt(dx * dx + dy * dy)
    takes = distance / fleet[i].speed + settings[0].arrival_s
    if total / takes < least:
        return 0.0
    ahead, aside = _turned(memory, i, dx, dy)
    value = total / (takes + settings[0].turn_s * abs(math.atan2(aside, ahead)))
    if value < least:
        return 0.0
    places = min(fleet.shape[0], MET)
    if _other_nearer(memory, i, now - settings[0].seen_s, places, east, north, distance):
        value *= settings[0].nearer
    return float(value)


@kernel
def _turned(memory: Records, i: int, x: float, y: float) -> tuple[float, float]:
    """(x, y) as along and across the commanded heading."""
    ahead = memory[i].heading_east * x + memory[i].heading_north * y
    return ahead, memory[i].heading_east * y - memory[i].heading_north * x


@kernel
def _away(low: float, value: float, high: float) -> float:
    """How far a number lies outside of an interval."""
    return max(low - value, 0.0, value - high)


@kernel
def _least_time(
    memory: Records, i: int, fleet: Records, poses: Records, settings: Records, block: int
) -> float:
    """Less time (s) than any cell of a block takes."""
    row, column = grid.BLOCK * (block // grid.BLOCKS), grid.BLOCK * (block % grid.BLOCKS)
    side = (grid.BLOCK - 1) * memory[i].cell
    west, south = grid.east_of(memory, i, column), grid.north_of(memory, i, row)
    x, y = _away(west, poses[i].east, west + side), _away(south, poses[i].north, south + side)
    return float(SLACK * math.sqrt(x * x + y * y) / fleet[i].speed + settings[0].arrival_s)


@kernel
def _search_block(
    memory: Records, i: int, fleet: Records, poses: Records, settings: Records, now: float, block: int,
    best: float, best_row: int, best_column: int,
) -> tuple[float, int, int]:  # fmt: skip
    """The best so far, or a better cell of the block; what the block's best is worth becomes its ceiling."""
    first_row, first_column = grid.BLOCK * (block // grid.BLOCKS), grid.BLOCK * (block % grid.BLOCKS)
    ceiling = 0
    for row in range(first_row, first_row + grid.BLOCK):
        if memory[i].visited[row] >> first_column & grid.BLOCK_BITS == grid.BLOCK_BITS:
            continue
        for column in range(first_column, first_column + grid.BLOCK):
            k = grid.place(row, column)
            if memory[i].cells[k] >= grid.CLOSED:
                continue
            total = _block(memory, i, k)
            ceiling = max(ceiling, total)
            value = _value(memory, i, fleet, poses, settings, now, row, column, total, best)
            lower = row < best_row or (row == best_row and column < best_column)
            if value > best or (value == best and value > 0.0 and lower):
                best, best_row, best_column = value, row, column
    memory[i].ceilings[block] = ceiling
    return best, best_row, best_column


@kernel
def choose(
    memory: Records, i: int, fleet: Records, poses: Records, settings: Records, now: float, row: int,
    column: int,
) -> tuple[int, int, float]:  # fmt: skip
    """Row and column in the window of the best cell, and its worth a second; a row of -1 where there is none.

    It is looked for about the given cell first: the sooner a good one is found, the more blocks are passed over.
    """
    first = grid.block_of(row, column)
    best, row, column = _search_block(memory, i, fleet, poses, settings, now, first, 0.0, -1, -1)
    for block in range(grid.BLOCKS * grid.BLOCKS):
        ceiling = memory[i].ceilings[block]
        if ceiling == 0 or block == first or ceiling < SLACK * best * settings[0].arrival_s:
            continue
        if ceiling / _least_time(memory, i, fleet, poses, settings, block) >= best:
            best, row, column = _search_block(
                memory, i, fleet, poses, settings, now, block, best, row, column
            )
    return row, column, best
