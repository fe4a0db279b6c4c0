"""A study's charts: what was found when, how times are distributed, and run against run.

- found.png: the mean share found over time, and for each algorithm the band in which eight runs of ten lie;
- times.png: every run's time to 85 %, its quartiles, and how many never got there;
- pairs.png: run against run with the same seed, the best algorithm against each of the others.

An algorithm has one colour in all studies.  Runs that never got there stand in a strip of their own.
"""

from collections.abc import Mapping
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from swarmctl.core.arrays import Floats
from swarmctl.core.planners import MODULES
from swarmctl.record.drawing import COLOURS, GREY, GROUND, INK, PALE, Style, new_figure, plain, save

from .figures import CellFigures, Figures
from .statistics import Paired

LEVEL = "85"
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))
COLUMNS = 4
NEVER_AT, EDGE_AT = 1.07, 1.14  # of the search's length: the middle and the end of the strip for never
MOST_DOTS = 3000  # a run beyond these has no dot: they would only be one blot

Told = Mapping[str, Figures]


def draw_runs(folder: Path, cell: CellFigures) -> None:
    """Write the charts of one combination of settings.  Raises RunFolderError."""
    told = cell.algorithms
    save(found_figure(told), folder / "found.png")
    save(times_figure(told), folder / "times.png")
    if len(told) > 1:
        save(pairs_figure(cell), folder / "pairs.png")


def colour_of(name: str) -> str:
    """The algorithm's colour."""
    return COLOURS[list(MODULES).index(name) % len(COLOURS)]


def line_of(name: str) -> Style:
    """How the algorithm's line is drawn, in colour and dashes."""
    place = list(MODULES).index(name)
    dashes = DASHES[(place + place // len(COLOURS)) % len(DASHES)]
    return {"color": colour_of(name), "linestyle": dashes, "linewidth": 1.9}


def by_rank(told: Told) -> list[str]:
    """The algorithms, the one that is earliest on average first (never being the search's end)."""
    return sorted(told, key=lambda name: told[name].late_s[LEVEL])


def found_figure(told: Told) -> Figure:
    """The share found over time: all means in one panel, and a band for each algorithm."""
    rows = ceil(len(told) / 2)
    figure = new_figure(13.0, max(5.2, 1.75 * rows + 0.6))
    grid = figure.add_gridspec(rows, 4)
    every = figure.add_subplot(grid[:, :2])
    for name in by_rank(told):
        every.plot(told[name].t_s, 100 * told[name].fraction, **line_of(name), label=name)
    every.legend(loc="lower right", frameon=False, fontsize=10, labelcolor=INK, handlelength=3.2)
    every.set_title("mean of all runs", loc="left", fontsize=11, color=INK)
    _share_axes(every, told)
    every.set_xlabel("time since the search began (s)", color=GREY)
    every.set_ylabel("targets found", color=GREY)
    for number, name in enumerate(told):
        panel = figure.add_subplot(grid[number // 2, 2 + number % 2])
        _draw_band(panel, told, name)
        if number + 2 < len(told):
            panel.tick_params(labelbottom=False)
    return figure


def _draw_band(panel: Axes, told: Told, name: str) -> None:
    """One algorithm's mean and band, the other means pale behind them."""
    for other in told:
        panel.plot(told[other].t_s, 100 * told[other].fraction, color=PALE, linewidth=0.9)
    figures, colour = told[name], colour_of(name)
    panel.fill_between(
        figures.t_s, 100 * figures.low, 100 * figures.high, color=colour, alpha=0.22, linewidth=0
    )
    panel.plot(figures.t_s, 100 * figures.fraction, color=colour, linewidth=1.8)
    panel.set_title(f"{name}: mean, and eight runs of ten", loc="left", fontsize=9.5, color=INK, pad=4)
    _share_axes(panel, told)


def _share_axes(axes: Axes, told: Told) -> None:
    axes.set_xlim(0, _end(told))
    axes.set_ylim(0, 101)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.yaxis.set_major_formatter(PercentFormatter(decimals=0, symbol=" %"))
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.grid(color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    plain(axes)


def _end(told: Told) -> float:
    return max(figures.duration_s for figures in told.values())


def times_figure(told: Told) -> Figure:
    """A row an algorithm, the earliest on top: a dot a run, the quartiles of all runs, and who never got there."""
    names = by_rank(told)
    figure = new_figure(11.0, 1.6 + 0.72 * len(names))
    axes = figure.add_subplot()
    end = _end(told)
    _draw_strip(axes, end, upright=True)
    for row, name in enumerate(names):
        _draw_row(axes, row, name, told[name].times(LEVEL), end)
    axes.set_ylim(len(names) - 0.45, -0.75)
    axes.set_yticks(range(len(names)), names)
    axes.set_xlim(0, EDGE_AT * end)
    axes.set_xticks(*_ticks(end))
    axes.grid(axis="x", color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_xlabel("seconds since the search began", color=GREY)
    title = f"Time to {LEVEL} % of the targets: every run, and the quartiles of all runs"
    axes.set_title(title, loc="left", fontsize=11, color=INK)
    plain(axes)
    axes.tick_params(axis="y", labelsize=11, labelcolor=INK)
    return figure


def _ticks(end: float) -> tuple[list[float], list[str]]:
    """Places and labels of ticks within the search, and the strip's."""
    places = [float(tick) for tick in MaxNLocator(6).tick_values(0, end) if 0 <= tick <= 0.985 * end]
    return [*places, NEVER_AT * end], [*(f"{place:g}" for place in places), "never"]


def _draw_strip(axes: Axes, end: float, *, upright: bool) -> None:
    """The place of runs that never got there, beyond the search's end."""
    strip = axes.axvspan if upright else axes.axhspan
    strip(end, EDGE_AT * end, color=GROUND, zorder=0, linewidth=0)


def _draw_row(axes: Axes, row: int, name: str, times_s: Floats, end: float) -> None:
    colour = colour_of(name)
    never = int(np.isinf(times_s).sum())
    dots = _edged(times_s, end)[:MOST_DOTS]
    number = np.arange(len(dots))
    spread = (number * 0.618034) % 1.0 - 0.5  # evenly, and the same every time
    beside = np.where(np.isinf(times_s[:MOST_DOTS]), ((number * 0.754878) % 1.0 - 0.5) * 0.07 * end, 0.0)
    axes.plot(
        dots + beside, row + 0.46 * spread, linestyle="none", marker="o", markersize=2.6, color=colour,
        alpha=0.35, markeredgewidth=0, zorder=2,
    )  # fmt: skip
    low, middle, high = np.quantile(_edged(times_s, end), (0.25, 0.5, 0.75), method="nearest")
    axes.plot([low, high], [row, row], color=INK, linewidth=2.2, solid_capstyle="butt", zorder=3)
    axes.plot(middle, row, marker="D", markersize=6.5, color="white", markeredgecolor=INK, zorder=4)
    if never:
        note = f"{never} ({100 * never / len(times_s):.3g} %)"
        axes.text(
            NEVER_AT * end, row - 0.31, note, ha="center", va="bottom", fontsize=8.5, color=INK,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": GROUND, "edgecolor": "none"},
        )  # fmt: skip


def _edged(times_s: Floats, end: float) -> Floats:
    """Times with never put into its strip."""
    return np.where(np.isinf(times_s), NEVER_AT * end, times_s)


def pairs_figure(cell: CellFigures) -> Figure:
    """The best algorithm's runs against each other's with the same seed."""
    best, *others = by_rank(cell.algorithms)
    columns = min(COLUMNS, len(others))
    rows = ceil(len(others) / columns)
    side = 6.0 if len(others) == 1 else 3.3
    figure = new_figure(side * columns + 0.4, (side + 0.35) * rows + 0.5)
    panels: Any = figure.subplots(rows, columns, squeeze=False)
    for number, panel in enumerate(panels.flat):
        if number < len(others):
            _draw_pair(panel, cell, best, others[number])
        else:
            panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel(f"{best} (s)", color=GREY)
    figure.suptitle(f"Seconds to {LEVEL} % with the same seed: below the line {best} is earlier", color=INK)
    return figure


def _draw_pair(panel: Axes, cell: CellFigures, best: str, other: str) -> None:
    end = _end(cell.algorithms)
    for upright in (True, False):
        _draw_strip(panel, end, upright=upright)
    panel.plot([0, end], [0, end], color=GREY, linewidth=0.9, zorder=1)
    first, second = (_edged(cell.algorithms[name].times(LEVEL), end)[:MOST_DOTS] for name in (best, other))
    panel.plot(
        second, first, linestyle="none", marker="o", markersize=3.2, color=colour_of(other), alpha=0.45,
        markeredgewidth=0, zorder=2, clip_on=False,
    )  # fmt: skip
    places, labels = _ticks(end)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_ticks(places[::2] if len(places) % 2 else places[:-1:2] + places[-1:])
        axis.set_ticklabels(labels[::2] if len(labels) % 2 else labels[:-1:2] + labels[-1:])
    panel.set_xlim(0, EDGE_AT * end)
    panel.set_ylim(0, EDGE_AT * end)
    panel.set_aspect("equal")
    panel.set_xlabel(f"{other} (s)", color=GREY)
    panel.set_title(_lead(cell.paired, best, other), loc="left", fontsize=9.5, color=INK)
    panel.grid(color=PALE, linewidth=0.6)
    panel.set_axisbelow(True)
    plain(panel)


def _lead(paired: Mapping[tuple[str, str, str], Paired], best: str, other: str) -> str:
    backwards = paired.get((other, best, LEVEL))
    wins = 1.0 - backwards.wins if backwards else paired[best, other, LEVEL].wins
    return f"{best} earlier in {100 * wins:.3g} %"
