"""What a vehicle that flies ``belief`` holds of the ground: a window of cells, each visited or not, promising or not.

All vehicles lay the same cells over the area, so that what one visited another can take over bit by bit.  A window
of SIDE by SIDE of them is remembered, its place counted in cells from the area's south-west corner.  Where the area
is larger, cells grow up to a limit, and then the window follows the vehicle.

What is told lies in ``visited``, a word a row.  What decisions are made on lies in ``cells``, one byte a cell, two
cells of border all round: for a cell neither visited nor promising the number of empty cells (visited, nothing found)
in the 5 × 5 block about it, brought up to date cell by cell as visits and targets turn up.  It says no more than
``visited`` and the known targets do, in whatever order they came.
"""

import math

from ..arrays import Floats, Records
from ..jit import kernel
from . import sectors

SIDE = 60  # cells of a window a side; a row's bits and its sign fit one word
STRIDE = 64
BORDER = 2
BLOCK = 4  # cells of a block a side
BLOCKS = SIDE // BLOCK  # blocks of a window a side
BLOCK_BITS = (1 << BLOCK) - 1
MARGIN = 12  # cells from the window's edge at which it is moved

# What a cell is.  Unknown cells count their empty neighbours, up to 25.
OWN, FOREIGN = 0, 32  # unknown, in the own sector or another's
PROMISING = 64
CLOSED = 65  # and all above: nothing to be had there any more
EMPTY, RICH = 65, 66  # visited, with no target near or with some
BARRED = 67  # out of bounds, or given up
CODES = 68
FIELDS = (
    "cell", "west", "south", "columns", "rows", "first_column", "first_row",
    ("visited", SIDE), ("worth", CODES), ("ceilings", BLOCKS * BLOCKS),
)  # fmt: skip


@kernel
def place(row: int, column: int) -> int:
    """The index into ``cells`` of a cell of the window."""
    return (row + BORDER) * STRIDE + column + BORDER


@kernel
def within(low: int, value: int, high: int) -> int:
    """``value``, but not less than ``low`` nor more than ``high``."""
    return min(max(value, low), high)


@kernel
def rows_of(memory: Records, i: int) -> int:
    """How many rows the window has."""
    return int(min(memory[i].rows, SIDE))


@kernel
def columns_of(memory: Records, i: int) -> int:
    """How many columns the window has."""
    return int(min(memory[i].columns, SIDE))


@kernel
def east_of(memory: Records, i: int, column: int) -> float:
    """Where the centre of a cell of this column of the window is."""
    return float(memory[i].west + (memory[i].first_column + column + 0.5) * memory[i].cell)


@kernel
def north_of(memory: Records, i: int, row: int) -> float:
    """Where the centre of a cell of this row of the window is."""
    return float(memory[i].south + (memory[i].first_row + row + 0.5) * memory[i].cell)


@kernel
def row_at(memory: Records, i: int, north: float) -> int:
    """The window's row in which a place lies, or the nearest one."""
    row = math.floor((north - memory[i].south) / memory[i].cell) - memory[i].first_row
    return within(0, row, rows_of(memory, i) - 1)


@kernel
def column_at(memory: Records, i: int, east: float) -> int:
    """The window's column in which a place lies, or the nearest one."""
    column = math.floor((east - memory[i].west) / memory[i].cell) - memory[i].first_column
    return within(0, column, columns_of(memory, i) - 1)


@kernel
def lay_cells(memory: Records, i: int, fleet: Records, edges: Floats, share: float, most: float) -> None:
    """Lay the cells that all agree on: ``share`` of the least sensor range wide, up to ``most`` where they are many."""
    west, east, south, north = math.inf, -math.inf, math.inf, -math.inf
    for k in range(edges.shape[0]):
        west, east = min(west, edges[k, 0]), max(east, edges[k, 0])
        south, north = min(south, edges[k, 1]), max(north, edges[k, 1])
    reach = math.inf
    for j in range(fleet.shape[0]):
        reach = min(reach, fleet[j].sensor_range)
    size = max(east - west, north - south)
    cell = min(max(share * reach, size / SIDE), most * reach)
    columns, rows = max(round((east - west) / cell), 1), max(round((north - south) / cell), 1)
    memory[i].cell, memory[i].columns, memory[i].rows = cell, columns, rows
    memory[i].west = 0.5 * (west + east - columns * cell)
    memory[i].south = 0.5 * (south + north - rows * cell)


@kernel
def centre_window(memory: Records, i: int, east: float, north: float) -> None:
    """Put the window about a place, within the area."""
    column = math.floor((east - memory[i].west) / memory[i].cell) - SIDE // 2
    row = math.floor((north - memory[i].south) / memory[i].cell) - SIDE // 2
    memory[i].first_column = within(0, column, max(memory[i].columns - SIDE, 0))
    memory[i].first_row = within(0, row, max(memory[i].rows - SIDE, 0))


@kernel
def _legal_columns(memory: Records, i: int, edges: Floats, row: int) -> int:
    """A word of those cells of a row whose centres are legal: between an odd edge crossed and an even one."""
    north = north_of(memory, i, row)
    word = 0
    for k in range(edges.shape[0]):
        y0, y1 = edges[k, 1], edges[k, 3]
        if (y0 > north) != (y1 > north):
            crossing = edges[k, 0] + (north - y0) * (edges[k, 2] - edges[k, 0]) / (y1 - y0)
            for column in range(columns_of(memory, i)):
                if east_of(memory, i, column) < crossing:
                    word ^= 1 << column
    return word


@kernel
def fill_window(memory: Records, i: int, edges: Floats, contacts: Records, known: int, reach: float) -> None:
    """Work ``cells`` out anew from what is legal, known and visited."""
    cells = memory[i].cells
    for k in range(STRIDE * STRIDE):
        cells[k] = BARRED
    for row in range(rows_of(memory, i)):
        legal = _legal_columns(memory, i, edges, row)
        for column in range(columns_of(memory, i)):
            if (legal >> column) & 1:
                ours = sectors.own(memory, i, east_of(memory, i, column), north_of(memory, i, row))
                cells[place(row, column)] = OWN if ours else FOREIGN
    for block in range(BLOCKS * BLOCKS):
        inside = block // BLOCKS * BLOCK < rows_of(memory, i) and block % BLOCKS * BLOCK < columns_of(
            memory, i
        )
        memory[i].ceilings[block] = 9 * memory[i].worth[PROMISING] if inside else 0
    for row in range(SIDE):
        word = memory[i].visited[row]
        memory[i].visited[row] = 0
        visit_row(memory, i, row, word)
    for c in range(known):
        promise(memory, i, contacts[i, c].east, contacts[i, c].north, reach)


@kernel
def _shifted(word: int, columns: int) -> int:
    """A row's word with its cells so many columns further on; those beyond the window fall off."""
    if abs(columns) >= SIDE:
        return 0
    return (word << columns) & ((1 << SIDE) - 1) if columns >= 0 else word >> -columns


@kernel
def move_window(memory: Records, i: int, east: float, north: float) -> bool:
    """Centre the window on a place that is near its edge, if there is area beyond; whether it moved."""
    row, column = row_at(memory, i, north), column_at(memory, i, east)
    if min(row, column, rows_of(memory, i) - 1 - row, columns_of(memory, i) - 1 - column) >= MARGIN:
        return False
    old_row, old_column = memory[i].first_row, memory[i].first_column
    centre_window(memory, i, east, north)
    up, across = old_row - memory[i].first_row, old_column - memory[i].first_column
    if up == 0 and across == 0:
        return False
    for k in range(SIDE):
        row = k if up <= 0 else SIDE - 1 - k
        word = memory[i].visited[row - up] if 0 <= row - up < SIDE else 0
        memory[i].visited[row] = _shifted(word, across)
    return True


@kernel
def _count(cells: Records, k: int, change: int) -> None:
    """One empty cell more, or less, in the blocks of the cells about ``k``."""
    for row in range(k - 2 * STRIDE, k + 3 * STRIDE, STRIDE):
        for near in range(row - 2, row + 3):
            if cells[near] < PROMISING:
                cells[near] += change


@kernel
def visit_row(memory: Records, i: int, row: int, word: int) -> bool:
    """Mark the cells of a row of the window that have a bit in ``word`` visited; whether any was not yet."""
    new = word & ~memory[i].visited[row]
    if new == 0:
        return False
    memory[i].visited[row] |= new
    cells = memory[i].cells
    for column in range(SIDE):
        if (new >> column) & 1:
            k = place(row, column)
            if cells[k] < PROMISING:
                cells[k] = EMPTY
                _count(cells, k, 1)
            elif cells[k] == PROMISING:
                cells[k] = RICH
    return True


@kernel
def give_up(memory: Records, i: int, row: int, column: int) -> None:
    """Bar a goal that proved out of reach, and the open cells next to it, for this vehicle alone."""
    cells = memory[i].cells
    for r in range(max(row - 1, 0), min(row + 2, SIDE)):
        for c in range(max(column - 1, 0), min(column + 2, SIDE)):
            if cells[place(r, c)] < CLOSED:
                cells[place(r, c)] = BARRED


@kernel
def visit(memory: Records, i: int, east: float, north: float, reach: float) -> bool:
    """Mark the cells with their centre within ``reach`` of a place visited; whether any was not yet."""
    some = False
    for row in range(row_at(memory, i, north - reach), row_at(memory, i, north + reach) + 1):
        away = north_of(memory, i, row) - north
        rest = reach * reach - away * away
        if rest < 0.0:
            continue
        half = math.sqrt(rest)
        left = math.ceil((east - half - memory[i].west) / memory[i].cell - 0.5) - memory[i].first_column
        right = math.floor((east + half - memory[i].west) / memory[i].cell - 0.5) - memory[i].first_column
        left, right = max(left, 0), min(right, columns_of(memory, i) - 1)
        if left <= right:
            some = visit_row(memory, i, row, ((1 << (right - left + 1)) - 1) << left) or some
    return some


@kernel
def block_of(row: int, column: int) -> int:
    """The number of the block in which a cell of the window lies."""
    return (row // BLOCK) * BLOCKS + column // BLOCK


@kernel
def _raise_ceilings(memory: Records, i: int, row: int, column: int) -> None:
    """Where a cell's worth rose, that of goals up to three cells off may have."""
    highest = 9 * memory[i].worth[PROMISING]
    for r in range(max(row - 3, 0) // BLOCK, min(row + 3, SIDE - 1) // BLOCK + 1):
        for c in range(max(column - 3, 0) // BLOCK, min(column + 3, SIDE - 1) // BLOCK + 1):
            memory[i].ceilings[r * BLOCKS + c] = highest


@kernel
def promise(memory: Records, i: int, east: float, north: float, reach: float) -> None:
    """Mark the cells with their centre within ``reach`` of a target promising."""
    cells = memory[i].cells
    for row in range(row_at(memory, i, north - reach), row_at(memory, i, north + reach) + 1):
        y = north_of(memory, i, row) - north
        for column in range(column_at(memory, i, east - reach), column_at(memory, i, east + reach) + 1):
            x = east_of(memory, i, column) - east
            k = place(row, column)
            if x * x + y * y > reach * reach or PROMISING <= cells[k] != EMPTY:
                continue
            if cells[k] == EMPTY:
                cells[k] = RICH
                _count(cells, k, -1)
            else:
                cells[k] = PROMISING
            _raise_ceilings(memory, i, row, column)


@kernel
def take_over(memory: Records, i: int, beacons: Records, slot: int, j: int) -> None:
    """Mark what vehicle ``j`` says was visited, as far as the two windows overlap."""
    across = beacons[slot, j].first_column - memory[i].first_column
    up = beacons[slot, j].first_row - memory[i].first_row
    rows = rows_of(memory, i)
    for row in range(max(up, 0), min(rows + up, rows)):
        visit_row(memory, i, row, _shifted(beacons[slot, j].visited[row - up], across))
