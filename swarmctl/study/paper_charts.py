"""The paper's charts: the parameter triangle of Figs. 14 and 15, and the bars of Fig. 20."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from swarmctl.record.drawing import GREY, INK, PALE, Style, new_figure, plain, save

from .charts import colour_of
from .paper_judges import SHARE
from .paper_runs import Evidence
from .paper_variants import LEVELS_PRINTED, RANDOM, STEPS, TERMS, Weights, variant
from .statistics import summarise

COLOURS = colormaps["cividis"]
OUTLINE = "#D55E00"
FIELDS = {SHARE: (100.0, "targets found (%)"), "in_range": (1.0, "targets in a vehicle's range, on average")}
"""How fields of RUN are told: scale and words."""

Means = dict[Weights, float]


def triangle_means(evidence: Evidence, field: str, terms: str, random: float) -> Means:
    """The mean of a field at every point of the triangle, scaled as it is told."""
    values = evidence.over_triangle(field, terms, random)
    return {point: FIELDS[field][0] * float(column.mean()) for point, column in values.items()}


def draw_triangles(
    evidence: Evidence, field: str, claimed: Sequence[Weights], random: float, file: Path
) -> None:
    """Both terms with one random vector, every point with its figure; ``claimed`` points are outlined."""
    figure = new_figure(15.2, 7.6)
    panels: Any = figure.subplots(ncols=len(TERMS))
    every = {terms: triangle_means(evidence, field, terms, random) for terms in TERMS}
    norm = _norm(every.values())
    for panel, (terms, means) in zip(panels, every.items(), strict=True):
        _draw_cells(panel, means, norm, claimed, figures=True)
        panel.set_title(f"terms {terms}, φ {random:g}", fontsize=11, color=INK, loc="left", pad=8)
        panel.set_xlabel("inertia weight w", color=GREY)
        panel.set_ylabel("personal-best weight c_p", color=GREY)
        note = "c_g = 1 − w − c_p: none on the slope, all in the corner"
        panel.text(
            0.99, 0.97, note, transform=panel.transAxes, ha="right", va="top", color=GREY, fontsize=9.5
        )
        best = "★ the highest; outlined what the paper says is"
        panel.text(
            0.99, 0.925, best, transform=panel.transAxes, ha="right", va="top", color=GREY, fontsize=9.5
        )
    _bar(figure, panels, norm, FIELDS[field][1])
    save(figure, file)


def draw_all_triangles(evidence: Evidence, field: str, claimed: Sequence[Weights], file: Path) -> None:
    """Every reading, small: terms by size of the random vector."""
    figure = new_figure(15.2, 6.6)
    panels: Any = figure.subplots(nrows=len(TERMS), ncols=len(RANDOM), sharex=True, sharey=True)
    every = {
        (terms, random): triangle_means(evidence, field, terms, random)
        for terms in TERMS
        for random in RANDOM
    }
    norm = _norm(every.values())
    for panel, ((terms, random), means) in zip(panels.flat, every.items(), strict=True):
        _draw_cells(panel, means, norm, claimed, figures=False)
        panel.set_title(f"terms {terms}, φ {random:g}", fontsize=10, color=INK, loc="left", pad=4)
    for panel in panels[-1]:
        panel.set_xlabel("w", color=GREY)
    for panel in panels[:, 0]:
        panel.set_ylabel("c_p", color=GREY)
    _bar(figure, panels, norm, FIELDS[field][1])
    save(figure, file)


def _norm(every: Any) -> Normalize:
    values = [value for means in every for value in means.values()]
    return Normalize(min(values), max(values) if max(values) > min(values) else min(values) + 1.0)


def _bar(figure: Figure, panels: Any, norm: Normalize, label: str) -> None:
    from matplotlib.cm import ScalarMappable

    bar = figure.colorbar(ScalarMappable(norm, COLOURS), ax=panels, shrink=0.8, pad=0.02)
    bar.set_label(label, color=GREY)
    bar.outline.set_visible(False)
    bar.ax.tick_params(length=0, colors=GREY, labelsize=9)


def _draw_cells(
    panel: Axes, means: Means, norm: Normalize, claimed: Sequence[Weights], *, figures: bool
) -> None:
    """A square for every point, w to the right and c_p upwards; c_g is what is left."""
    best = max(means, key=lambda point: means[point])
    for point, value in means.items():
        colour = COLOURS(norm(value))
        w, p, _ = (weight / STEPS for weight in point)
        half = 0.5 / STEPS
        panel.add_patch(Rectangle((w - half, p - half), 2 * half, 2 * half, facecolor=colour, linewidth=0))
        ink = INK if np.dot(colour[:3], (0.3, 0.59, 0.11)) > 0.5 else "white"
        text: Style = {"ha": "center", "va": "center_baseline", "color": ink}
        star = "★" if point == best else ""
        if figures:
            panel.text(w, p, f"{_short(value)}{star}", fontsize=8.5, **text)
        elif star:
            panel.text(w, p, star, fontsize=9, **text)
        if point in claimed:
            inset = 0.08 / STEPS
            side = 2 * (half - inset)
            frame = Rectangle((w - half + inset, p - half + inset), side, side, fill=False, edgecolor=OUTLINE)
            frame.set_linewidth(2.4 if figures else 1.3)
            panel.add_patch(frame)
    panel.set_xlim(-0.06, 1.06)
    panel.set_ylim(-0.06, 1.06)
    panel.set_aspect("equal")
    plain(panel)


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 20 else f"{value:.1f}"


def draw_times(evidence: Evidence, names: Sequence[str], file: Path) -> None:
    """Fig. 20: mean times with standard deviations, and how many runs never got there."""
    figure = new_figure(11.5, 6.2)
    chart = figure.add_subplot()
    width = 0.82 / len(names)
    for k, name in enumerate(names):
        for at, percent in enumerate(LEVELS_PRINTED):
            summary = summarise(evidence.times(variant(name), percent))
            place = at + (k - (len(names) - 1) / 2) * width
            mean, std = summary.mean or 0.0, summary.std or 0.0
            label = name if at == 0 else None
            chart.bar(place, mean, 0.9 * width, color=colour_of(name), label=label, zorder=2)
            chart.errorbar(place, mean, std, color=INK, linewidth=1.1, capsize=3, zorder=3)
            if summary.missing:
                plate = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none"}
                style: Style = {"ha": "center", "va": "bottom", "fontsize": 8.5, "color": INK, "bbox": plate}
                chart.annotate(
                    f"{summary.missing}", (place, mean + std), (0, 3), textcoords="offset points", **style
                )
    chart.set_xticks(range(len(LEVELS_PRINTED)), [f"{percent} %" for percent in LEVELS_PRINTED])
    chart.set_xlabel("targets found", color=GREY)
    chart.set_ylabel("seconds: mean and standard deviation", color=GREY)
    note = f"above a bar: how many of {evidence.runs} runs never got there (they are not in its mean)"
    chart.set_title(note, fontsize=10, color=GREY, loc="left", pad=8)
    chart.grid(axis="y", color=PALE, linewidth=0.6)
    chart.set_axisbelow(True)
    ground: Style = {"facecolor": "white", "edgecolor": "none", "framealpha": 1.0}
    chart.legend(loc="upper left", fontsize=10, labelcolor=INK, ncols=2, **ground)
    plain(chart)
    save(figure, file)
