"""How a vehicle that flies ``belief`` chooses where to fly next: the cell that is worth most for the time it takes.

Worth lies in the cells (belief_grid), and a goal has that of the 3 × 3 cells about it.  Cells are looked at outwards
from the vehicle, ring by ring, until none further out could be worth more, whatever lay there; ties go to the cell
with the lower number.  So the choice is that of looking at all cells, in any order.
"""

import math

from ..arrays import Records
from ..jit import kernel
from . import belief_grid as grid

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
def _other_nearer(memory: Records, i: int, since: float, places: int, east: float, north: float, mine: float) -> bool:
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
    column: int, least: float,
) -> float:  # fmt: skip
    """Worth (thousandths) a second of a cell; 0 for one that turns out to be under ``least``."""
    total = _block(memory, i, grid.place(row, column))
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
def choose(
    memory: Records, i: int, fleet: Records, poses: Records, settings: Records, now: float
) -> tuple[int, int, float]:
    """Row and column in the window of the best cell, and its worth a second; a row of -1 where there is none."""
    rows, columns = grid.rows_of(memory, i), grid.columns_of(memory, i)
    row_0 = grid.row_at(memory, i, poses[i].north)
    column_0 = grid.column_at(memory, i, poses[i].east)
    highest = 9 * (memory[i].worth[grid.PROMISING] if memory[i].open_promising > 0 else memory[i].worth[grid.OWN])
    best, best_row, best_column = 0.0, -1, -1
    for ring in range(max(rows, columns)):
        nearest = max(ring - 0.5, 0.0) * memory[i].cell
        if highest / (nearest / fleet[i].speed + settings[0].arrival_s) < best:
            break
        for row in range(max(row_0 - ring, 0), min(row_0 + ring, rows - 1) + 1):
            step = 1 if abs(row - row_0) == ring else 2 * ring
            for column in range(column_0 - ring, column_0 + ring + 1, step):
                if not 0 <= column < columns or memory[i].cells[grid.place(row, column)] >= grid.CLOSED:
                    continue
                value = _value(memory, i, fleet, poses, settings, now, row, column, best)
                lower = row < best_row or (row == best_row and column < best_column)
                if value > best or (value == best and value > 0.0 and lower):
                    best, best_row, best_column = value, row, column
    return best_row, best_column, best
