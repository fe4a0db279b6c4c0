"""Charts of a study over settings: a line for one key that varies, a heat map for two.

Settings are compared by the mean time to 85 % with a run that never got there counted as the whole search, which
is defined for all of them, and by the share found in the end.  With more keys, each place of the map shows the best
of the others' combinations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swarmctl.core.arrays import Floats
from swarmctl.record.drawing import GREY, INK, PALE, new_figure, plain, save

from .charts import LEVEL, colour_of, line_of
from .figures import CellFigures, Figures
from .plan import Plan
from .settings import Axis, shown_value
from .statistics import summarise

MOST_NUMBERS = 12  # more places than this along a side have no room for their numbers
LONG_LABEL = 6  # characters; longer ones would meet if they lay flat


@dataclass(frozen=True)
class Measure:
    """What settings are compared by: a value a run, at ``most`` so much, and how it is written."""

    title: str
    values: Callable[[Figures], Floats]
    least_is_best: bool
    form: str
    most: float


MEASURES = (
    Measure(
        f"mean time to {LEVEL} % (s), never = the search's end",
        lambda figures: np.minimum(figures.times(LEVEL), figures.duration_s),
        True,
        "{:.0f}",
        np.inf,
    ),
    Measure(
        "share found in the end (%)",
        lambda figures: 100.0 * figures.runs["final_fraction"],
        False,
        "{:.1f}",
        100.0,
    ),
)


def draw_grid(folder: Path, plan: Plan, cells: Sequence[CellFigures]) -> None:
    """Write the charts of a study over settings.  Raises RunFolderError."""
    axes = plan.varied
    if len(axes) == 1:
        save(line_figure(axes[0], cells), folder / "sweep.png")
        return
    for name in plan.algorithms:
        told = [cell for cell in cells if name in cell.algorithms]
        if told:
            save(heat_figure(name, axes, told), folder / f"grid-{name}.png")


def line_figure(axis: Axis, cells: Sequence[CellFigures]) -> Figure:
    """Both measures over one key, a line an algorithm, with the 95 % interval of the mean."""
    figure = new_figure(12.5, 5.4)
    places, labels = _places(axis)
    names = list(dict.fromkeys(name for cell in cells for name in cell.algorithms))
    for panel, measure in zip(figure.subplots(1, 2), MEASURES, strict=True):
        for name in names:
            _draw_line(panel, measure, name, axis, places, cells)
        panel.set_title(measure.title, loc="left", fontsize=11, color=INK)
        panel.set_xlabel(axis.key, color=GREY)
        panel.set_xticks(places, labels)
        panel.grid(color=PALE, linewidth=0.6)
        panel.set_axisbelow(True)
        plain(panel)
    figure.legend(
        *panel.get_legend_handles_labels(), loc="outside lower center", ncols=len(names), frameon=False,
        labelcolor=INK, handlelength=3.2,
    )  # fmt: skip
    return figure


def _places(axis: Axis) -> tuple[list[float], list[str]]:
    """Where the values stand: numbers where they are, unless two would be too near; others one by one."""
    labels = [shown_value(value) for value in axis.values]
    numbers = [float(v) for v in axis.values if isinstance(v, (int, float)) and not isinstance(v, bool)]
    if len(numbers) == len(labels):
        gaps = np.diff(np.sort(numbers))
        if gaps.min() >= 0.04 * (max(numbers) - min(numbers)):
            return numbers, labels
    return [float(place) for place in range(len(labels))], labels


def _draw_line(
    panel: Axes,
    measure: Measure,
    name: str,
    axis: Axis,
    places: Sequence[float],
    cells: Sequence[CellFigures],
) -> None:
    told = [
        (
            places[axis.values.index(cell.cell.settings[axis.key])],
            summarise(measure.values(cell.algorithms[name])),
        )
        for cell in cells
        if name in cell.algorithms
    ]
    told.sort(key=lambda point: point[0])
    at = [place for place, _ in told]
    means = np.array([one.mean for _, one in told], float)
    panel.plot(at, means, **line_of(name), marker="o", markersize=4.5, label=name)
    bands = [one.ci95 or (one.mean, one.mean) for _, one in told]
    low, high = np.minimum(np.array(bands, float), measure.most).T
    panel.fill_between(at, low, high, color=colour_of(name), alpha=0.13, linewidth=0)


def heat_figure(name: str, axes: Sequence[Axis], cells: Sequence[CellFigures]) -> Figure:
    """Both measures of one algorithm over the first two keys, the best of the others' combinations at each."""
    across, up = axes[1], axes[0]
    width = 2.2 + max(3.2, _side(across, 0.62))
    height = 1.7 + max(2.4, _side(up, 0.5))
    figure = new_figure(2 * width, height)
    for panel, measure in zip(figure.subplots(1, 2), MEASURES, strict=True):
        _draw_heat(panel, measure, _best(name, measure, up, across, cells), up, across)
    rest = ", ".join(axis.key for axis in axes[2:])
    note = f"; at each place the best of all {rest}" if rest else ""
    figure.suptitle(f"{name}{note}", color=INK, fontsize=13)
    return figure


def _side(axis: Axis, with_number: float) -> float:
    """Inches for the places along a side, less for each where numbers are left out."""
    return (with_number if len(axis.values) <= MOST_NUMBERS else 0.32) * len(axis.values)


def _best(name: str, measure: Measure, up: Axis, across: Axis, cells: Sequence[CellFigures]) -> Floats:
    """The measure (rows, columns) of the best combination at each place; NaN where none is finished."""
    sign = 1.0 if measure.least_is_best else -1.0
    best = np.full((len(up.values), len(across.values)), np.nan)
    for cell in cells:
        place = tuple(axis.values.index(cell.cell.settings[axis.key]) for axis in (up, across))
        value = sign * float(measure.values(cell.algorithms[name]).mean())
        best[place] = np.fmin(best[place], value)
    return sign * best


def _draw_heat(panel: Axes, measure: Measure, values: Floats, up: Axis, across: Axis) -> None:
    shades = "viridis_r" if measure.least_is_best else "viridis"
    image = panel.imshow(values, cmap=shades, aspect="auto", origin="lower")
    labels = [shown_value(value) for value in across.values]
    upright = max(map(len, labels)) > LONG_LABEL
    panel.set_xticks(range(len(labels)), labels, rotation=90 if upright else 0)
    panel.set_yticks(range(len(up.values)), [shown_value(value) for value in up.values])
    panel.set_xlabel(across.key, color=GREY)
    panel.set_ylabel(up.key, color=GREY)
    panel.set_title(measure.title, loc="left", fontsize=10.5, color=INK)
    plain(panel.figure.colorbar(image, ax=panel, shrink=0.9).ax)
    if max(values.shape) <= MOST_NUMBERS:
        _write_numbers(panel, measure, values)
    plain(panel)


def _write_numbers(panel: Axes, measure: Measure, values: Floats) -> None:
    """Each place's number, dark on light shades and light on dark ones, the best in bold."""
    low, high = np.nanmin(values), np.nanmax(values)
    best = low if measure.least_is_best else high
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            share = (value - low) / (high - low) if high > low else 0.5
            bright = (1.0 - share if measure.least_is_best else share) > 0.55
            panel.text(
                column, row, measure.form.format(value), ha="center", va="center", fontsize=9,
                color=INK if bright else "white", fontweight="bold" if value == best else "normal",
            )  # fmt: skip
