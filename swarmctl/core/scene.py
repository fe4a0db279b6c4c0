"""What there is to find: clusters of targets, drawn anew for every run, and the grid they are found through.

Clusters are the reference scenario's: star-shaped outlines, more targets in larger clusters, part of them in
a hot spot off the centre, none outside the area or in a keep-out.  Targets are rows sorted by grid cell; a
row's number is the target's serial number.  How targets move from there is in core/roam.py.
"""

import math

from . import fence
from .arrays import Floats, Integers, Records
from .jit import kernel
from .randoms import LAYOUT, normal, uniform

TURN = 2.0 * math.pi
TRIES = 4000


@kernel
def _draw(seed: int, item: int, attempt: int, which: int) -> float:
    return uniform(seed, item, attempt, LAYOUT + which)


@kernel
def place_centres(
    seed: int, count: int, radius: float, raw: Floats, box: Floats, starts: Floats, centres: Floats
) -> None:
    """Draw ``count`` cluster centres into ``centres`` (count, 2).

    At least 3 radii from every point of ``starts`` (S, 2) and 2.9 radii from one another; both distances
    give way by 0.5 % a try.  ``box`` (2, 4): west, east, south, north of where centres are drawn, and of the whole
    area, from which they are drawn when the first has held nothing legal for long.  So it always ends: a cluster for
    which no legal place is found at all lies at the first start.
    """
    attempt = 0
    for k in range(count):
        ease = 1.0
        centres[k, 0], centres[k, 1] = starts[0, 0], starts[0, 1]
        for trial in range(4 * TRIES):
            attempt += 1
            ease *= 0.995
            b = 0 if trial < TRIES else 1
            x = box[b, 0] + (box[b, 1] - box[b, 0]) * _draw(seed, k, attempt, 0)
            y = box[b, 2] + (box[b, 3] - box[b, 2]) * _draw(seed, k, attempt, 1)
            if not fence.inside(raw, x, y):
                continue
            clear = True
            for s in range(starts.shape[0]):
                dx, dy = x - starts[s, 0], y - starts[s, 1]
                if dx * dx + dy * dy < (3.0 * radius * ease) * (3.0 * radius * ease):
                    clear = False
                    break
            for j in range(k if clear else 0):
                dx, dy = x - centres[j, 0], y - centres[j, 1]
                if dx * dx + dy * dy < (2.9 * radius * ease) * (2.9 * radius * ease):
                    clear = False
                    break
            if clear:
                centres[k, 0] = x
                centres[k, 1] = y
                break


@kernel
def _outline(seed: int, k: int, theta: float) -> float:
    """The star-shaped outline of cluster ``k`` at angle ``theta``, as a share of its radius."""
    a2 = 0.35 * _draw(seed, k, 0, 12)
    a3 = 0.25 * _draw(seed, k, 0, 13)
    a5 = 0.15 * _draw(seed, k, 0, 14)
    return (
        1.0
        + a2 * math.cos(2.0 * theta + TURN * _draw(seed, k, 0, 15))
        + a3 * math.cos(3.0 * theta + TURN * _draw(seed, k, 0, 16))
        + a5 * math.cos(5.0 * theta + TURN * _draw(seed, k, 0, 17))
    )


@kernel
def _share_out(seed: int, count: int, radius: float, sizes: Floats, numbers: Integers) -> None:
    """Radii of the clusters, and how many of the ``count`` targets each gets: in proportion to R² × U(0.7, 1.3)."""
    total = 0.0
    for k in range(sizes.shape[0]):
        sizes[k] = radius * (0.7 + 0.6 * _draw(seed, k, 0, 10))
        total += sizes[k] * sizes[k] * (0.7 + 0.6 * _draw(seed, k, 0, 11))
    share = 0.0
    given = 0
    for k in range(sizes.shape[0]):
        share += sizes[k] * sizes[k] * (0.7 + 0.6 * _draw(seed, k, 0, 11)) / total
        upto = count if k == sizes.shape[0] - 1 else round(share * count)
        numbers[k] = upto - given
        given = upto


@kernel
def _candidate(
    seed: int, k: int, item: int, attempt: int, hot: bool, centre_x: float, centre_y: float, size: float
) -> tuple[float, float]:
    """A place for one target of cluster ``k``: in its hot spot, or evenly within its outline."""
    if hot:
        angle = TURN * _draw(seed, k, 0, 18)
        off = 0.5 * size * _draw(seed, k, 0, 19)
        spread = 0.3 * size
        return (
            centre_x + off * math.cos(angle) + spread * normal(seed, item, attempt, LAYOUT + 21),
            centre_y + off * math.sin(angle) + spread * normal(seed, item, attempt, LAYOUT + 22),
        )
    theta = TURN * _draw(seed, item, attempt, 21)
    distance = size * _outline(seed, k, theta) * math.sqrt(_draw(seed, item, attempt, 22))
    return centre_x + distance * math.cos(theta), centre_y + distance * math.sin(theta)


@kernel
def lay_out(
    seed: int, radius: float, hot_share: float, raw: Floats, centres: Floats, sizes: Floats, numbers: Integers,
    places: Floats, clusters: Integers,
) -> None:  # fmt: skip
    """Fill ``places`` (T, 2) and ``clusters`` (T,) with targets round the drawn ``centres``.

    ``sizes`` and ``numbers`` (clusters,) are scratch.  A target whose cluster leaves no legal place within
    many tries lies at the cluster's centre.
    """
    _share_out(seed, places.shape[0], radius, sizes, numbers)
    item = 0
    for k in range(centres.shape[0]):
        hot_count = round(hot_share * numbers[k])
        for n in range(numbers[k]):
            x, y = centres[k, 0], centres[k, 1]
            for attempt in range(TRIES):
                tx, ty = _candidate(
                    seed, k, 64 + item, attempt, n < hot_count, centres[k, 0], centres[k, 1], sizes[k]
                )
                if fence.inside(raw, tx, ty):
                    x, y = tx, ty
                    break
            places[item, 0] = x
            places[item, 1] = y
            clusters[item] = k
            item += 1


@kernel
def cell_of(grid: Records, x: float, y: float) -> int:
    """The number of the grid cell a point lies in (points outside: the nearest cell)."""
    column = min(max(math.floor((x - grid[0].east) / grid[0].cell), 0), grid[0].columns - 1)
    row = min(max(math.floor((y - grid[0].north) / grid[0].cell), 0), grid[0].rows - 1)
    return int(row * grid[0].columns + column)


@kernel
def bounds(places: Floats) -> tuple[float, float, float, float]:
    """West, south, east and north of all ``places`` (T, 2); zeros if there are none."""
    if places.shape[0] == 0:
        return 0.0, 0.0, 0.0, 0.0
    west, south, east, north = places[0, 0], places[0, 1], places[0, 0], places[0, 1]
    for t in range(1, places.shape[0]):
        west, east = min(west, places[t, 0]), max(east, places[t, 0])
        south, north = min(south, places[t, 1]), max(north, places[t, 1])
    return west, south, east, north


@kernel
def sort_into(grid: Records, places: Floats, clusters: Integers, targets: Records, starts: Integers) -> None:
    """Copy the targets into ``targets`` sorted by cell, and fill in ``starts`` (cells + 1, 2).

    Cell c holds rows ``starts[c, 0]`` to ``starts[c + 1, 0]``; ``starts[c, 1]`` counts the targets of the cells up to
    ``block`` of the grid away from it, itself among them.
    """
    starts[:] = 0
    for t in range(places.shape[0]):
        starts[cell_of(grid, places[t, 0], places[t, 1]) + 1, 0] += 1
    for c in range(1, starts.shape[0]):
        starts[c, 0] += starts[c - 1, 0]
    for t in range(places.shape[0]):
        c = cell_of(grid, places[t, 0], places[t, 1])
        row = starts[c, 0]
        starts[c, 0] += 1
        targets[row].east = places[t, 0]
        targets[row].north = places[t, 1]
        targets[row].cluster = clusters[t]
    for c in range(starts.shape[0] - 1, 0, -1):
        starts[c, 0] = starts[c - 1, 0]
    starts[0, 0] = 0
    for row in range(grid[0].rows):
        for column in range(grid[0].columns):
            for r in range(max(row - grid[0].block, 0), min(row + grid[0].block, grid[0].rows - 1) + 1):
                first = r * grid[0].columns + max(column - grid[0].block, 0)
                last = r * grid[0].columns + min(column + grid[0].block, grid[0].columns - 1)
                starts[row * grid[0].columns + column, 1] += starts[last + 1, 0] - starts[first, 0]
