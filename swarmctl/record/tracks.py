"""tracks.png: one look at a run.

Left the map: where everybody flew, what was found and what was missed.  Right the share found over time with
the moments at which it crossed the levels of the summary.  Long areas put the curve below the map instead.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from swarmctl.mission.model import Mission

from .drawing import COLOURS, DPI, GREY, GROUND, INK, LIGHT_COLOURS, PALE, Style, new_figure, plain, save

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

KEEP_OUT_FACE, KEEP_OUT_EDGE = "#F6DEDA", "#B5483A"
TRACK_POINTS = 6000  # a track is thinned to at most twice this many
BADGE_PIXELS = 21.0  # across one vehicle's number
BADGE_PLACES = 60  # along a track, tried for its number
LONG_AREA = 2.2  # width over height from which the curve goes below the map
KILOMETRES_FROM_M = 2000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Map:
    """What is drawn of a run on the ground.  Positions are metres east and north, shape (n, 2).

    Targets are drawn where they were laid out, also those that move from there (``subtitle_of`` says so).
    ``found`` (T,) tells which of the targets (T, 2) were; ``tracks`` has one track a vehicle.
    """

    border: Floats
    keep_outs: Sequence[Floats]
    targets: Floats
    found: Flags
    tracks: Sequence[Floats]
    returns: Sequence[Floats] = ()  #: ways home, (n, 2) each; ``tracks`` then end where the search did


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture(Map):
    """What is drawn in tracks.png: the map, and the curve beside it.  Times are seconds of search.

    ``fraction`` (P,), 0 to 1, is the share found at ``times_s`` (P,); ``crossings`` has the time of each level in
    percent, None where it was not reached.
    """

    algorithm: str
    times_s: Floats
    fraction: Floats
    crossings: Mapping[str, float | None]
    duration_s: float
    subtitle: str = ""


def subtitle_of(mission: Mission, seed: int) -> str:
    """Which run a picture is of, and how its targets are to be read."""
    moving = "; targets move, drawn where they started" if mission.targets.move else ""
    return f"{mission.name}, seed {seed}{moving}"


def draw(path: Path, picture: Picture) -> None:
    """Write the picture as PNG.  Raises RunFolderError where ``path`` cannot be written."""
    figure, chart, curve = _figure(picture)
    draw_map(chart, picture)
    _draw_curve(curve, picture)
    draw_legend(figure, picture)
    _draw_title(figure, chart, picture)
    settle(figure)
    draw_numbers(chart, picture)
    save(figure, path)


def draw_map(chart: Axes, shown: Map) -> None:
    """Everything of a map but its numbers."""
    _draw_area(chart, shown)
    _draw_tracks(chart, shown)
    _draw_targets(chart, shown)
    _draw_axes(chart, shown)


def settle(figure: Figure) -> None:
    """Fix the layout, which the numbers' places depend on."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


def _figure(picture: Picture) -> tuple[Figure, Axes, Axes]:
    """A figure whose map has the area's shape, and its two axes."""
    grid: Style
    east_m, north_m = np.ptp(picture.border, axis=0)
    shape = float(east_m / north_m)
    if shape >= LONG_AREA:
        height = max(13.0 / shape, 1.2)
        size, grid = (14.0, height + 5.9), {"nrows": 2, "height_ratios": (height, 3.4)}
    else:
        width, height = max(min(7.6 * shape, 9.0), 1.6), min(7.6, 9.0 / shape)
        size, grid = (width + 7.4, height + 1.9), {"ncols": 2, "width_ratios": (width, 5.6)}
    figure = new_figure(*size)
    panels: Any = figure.subplots(**grid)
    return figure, panels[0], panels[1]


def _draw_area(chart: Axes, shown: Map) -> None:
    """The ground, the area on it and the keep-outs in it."""
    chart.set_facecolor(GROUND)
    chart.add_patch(Polygon(shown.border, facecolor="white", edgecolor=INK, linewidth=1.4, zorder=1))
    for keep_out in shown.keep_outs:
        chart.add_patch(_keep_out(keep_out))


def _keep_out(corners: Floats) -> Polygon:
    """A hatched polygon; also the legend's sample of it."""
    return Polygon(
        corners, facecolor=KEEP_OUT_FACE, edgecolor=KEEP_OUT_EDGE, hatch="////", linewidth=1.1, zorder=2
    )


def colour_of(vehicle: int) -> str:
    return COLOURS[vehicle % len(COLOURS)]


def _draw_tracks(chart: Axes, shown: Map) -> None:
    """Every track, thinner where there are many, with its launch and its end."""
    many = len(shown.tracks) > 12
    width, size = (0.6, 4.5) if many else (1.0, 7.0)
    for vehicle, way in enumerate(shown.returns):
        if len(way):
            home: Style = {"linestyle": (0, (5, 4)), "linewidth": 0.8 * width, "alpha": 0.45}
            chart.plot(*_thinned(way).T, **home, color=colour_of(vehicle), zorder=2.5)
    for vehicle, track in enumerate(shown.tracks):
        if len(track) == 0:
            continue
        colour = colour_of(vehicle)
        chart.plot(*_thinned(track).T, color=colour, linewidth=width, alpha=0.75, zorder=3)
        end: Style = {
            "marker": "s",
            "markersize": size + 2,
            "markerfacecolor": "white",
            "markeredgecolor": colour,
        }
        chart.plot(*track[-1], **end, markeredgewidth=1.4, zorder=6)
        launch: Style = {
            "marker": "^",
            "markersize": size,
            "markerfacecolor": colour,
            "markeredgecolor": "white",
        }
        chart.plot(*track[0], **launch, markeredgewidth=0.5, zorder=7)


def _thinned(track: Floats) -> Floats:
    """Every n-th point, and the last."""
    step = max(1, len(track) // TRACK_POINTS)
    return np.concatenate([track[:-1:step], track[-1:]])


def _draw_targets(chart: Axes, shown: Map) -> None:
    """Found ones filled, missed ones hollow, on top of the tracks."""
    size = float(np.clip(60.0 / max(1.0, np.sqrt(len(shown.targets))), 2.2, 6.0))
    dots: Style = {
        "linestyle": "none",
        "marker": "o",
        "markersize": size,
        "markeredgewidth": 0.7,
        "zorder": 5,
    }
    found, missed = shown.targets[shown.found], shown.targets[~shown.found]
    chart.plot(*missed.T, **dots, markerfacecolor="white", markeredgecolor=INK)
    chart.plot(*found.T, **dots, markerfacecolor=INK, markeredgecolor="white")


def _draw_axes(chart: Axes, shown: Map) -> None:
    """Equal scales, in metres or kilometres, a little more than the area in view."""
    low, high = shown.border.min(axis=0), shown.border.max(axis=0)
    room = 0.03 * float(np.max(high - low))
    chart.set_xlim(low[0] - room, high[0] + room)
    chart.set_ylim(low[1] - room, high[1] + room)
    chart.set_aspect("equal")
    kilometres = float(np.max(high - low)) >= KILOMETRES_FROM_M
    unit, scale = ("km", 1000.0) if kilometres else ("m", 1.0)
    chart.set_xlabel(f"east ({unit})", color=GREY)
    chart.set_ylabel(f"north ({unit})", color=GREY)
    for axis, extent in ((chart.xaxis, high[0] - low[0]), (chart.yaxis, high[1] - low[1])):
        axis.set_major_locator(
            MaxNLocator(_tick_count(extent, float(np.max(high - low))), steps=(1, 2, 5, 10))
        )
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / scale:g}"))
    plain(chart)


def _tick_count(extent_m: float, longest_m: float) -> int:
    """As many ticks as have room on an axis that may be much shorter than the other."""
    return int(np.clip(round(6 * extent_m / longest_m), 2, 6))


def _draw_curve(curve: Axes, picture: Picture) -> None:
    """The share found over time, with its level crossings."""
    curve.set_xlim(0, max(picture.duration_s, 1e-9))
    curve.set_ylim(0, 100)
    curve.set_xlabel("time since the search began (s)", color=GREY)
    curve.set_ylabel("targets found", color=GREY)
    curve.yaxis.set_major_formatter(PercentFormatter(decimals=0, symbol=" %"))
    curve.grid(color=PALE, linewidth=0.6)
    curve.set_axisbelow(True)
    plain(curve)
    if len(picture.targets) == 0:
        curve.text(0.5, 0.5, "no targets in this mission", transform=curve.transAxes, ha="center", color=GREY)
        return
    share = 100 * picture.fraction
    curve.fill_between(picture.times_s, share, step="post", color=COLOURS[0], alpha=0.10, linewidth=0)
    curve.plot(picture.times_s, share, drawstyle="steps-post", color=COLOURS[0], linewidth=2.2, clip_on=False)
    _draw_crossings(curve, picture)


def _draw_crossings(curve: Axes, picture: Picture) -> None:
    """A dot and a label at each level reached; one line about the others."""
    for level, time_s in picture.crossings.items():
        if time_s is not None:
            _draw_crossing(curve, level, time_s, late=time_s > 0.7 * picture.duration_s)
    never = [f"{level} %" for level, time_s in picture.crossings.items() if time_s is None]
    if never:
        note = f"not reached: {', '.join(never)}"
        curve.text(0.99, 0.98, note, transform=curve.transAxes, ha="right", va="top", color=GREY, fontsize=9)


def _draw_crossing(curve: Axes, level: str, time_s: float, *, late: bool) -> None:
    """The label stands right below its dot, where no rising curve is, or left above near the right edge."""
    share = float(level)
    curve.plot([0, time_s], [share, share], color=GREY, linewidth=0.8, linestyle=(0, (2, 2)))
    dot: Style = {"markerfacecolor": "white", "markeredgecolor": COLOURS[0], "markeredgewidth": 1.8}
    curve.plot(time_s, share, marker="o", markersize=7, **dot, zorder=4, clip_on=False)
    offset, across, upright = ((-8, 3), "right", "bottom") if late else ((8, -3), "left", "top")
    curve.annotate(
        f"{level} % at {time_s:.0f} s",
        (time_s, share),
        offset,
        textcoords="offset points",
        ha=across,
        va=upright,
        color=INK,
        fontsize=9.5,
        bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
    )


def draw_legend(figure: Figure, shown: Map, rows: int = 1) -> None:
    """What the map's signs mean, below everything."""
    found = int(np.count_nonzero(shown.found))
    dot: Style = {"linestyle": "none", "marker": "o", "markersize": 6}
    square: Style = {"linestyle": "none", "marker": "s", "markersize": 8, "markerfacecolor": "white"}
    handles: list[Line2D | Patch] = [
        Line2D([], [], linestyle="none", marker="^", markersize=7, color=GREY, label="launch"),
        Line2D([], [], **square, markeredgecolor=GREY, label="end of the search" if shown.returns else "end"),
        Line2D([], [], **dot | {"markersize": 11}, color=GREY, label="vehicle's number"),
    ]
    if shown.returns:
        handles.append(Line2D([], [], linestyle=(0, (5, 4)), linewidth=0.9, color=GREY, label="way home"))
    if len(shown.targets):
        missed = len(shown.targets) - found
        handles.append(Line2D([], [], **dot, color=INK, label=f"found: {found}"))
        hollow: Style = {"markerfacecolor": "white", "markeredgecolor": INK}
        handles.append(Line2D([], [], **dot, **hollow, label=f"missed: {missed}"))
    if shown.keep_outs:
        sample = _keep_out(np.zeros((3, 2)))
        sample.set_label("keep-out")
        handles.append(sample)
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=-(-len(handles) // rows),
        frameon=False,
        fontsize=9.5,
        labelcolor=INK,
        columnspacing=2.0,
    )


def _draw_title(figure: Figure, chart: Axes, picture: Picture) -> None:
    """Algorithm, vehicles, share found; what the caller adds, small over the map."""
    count, total = len(picture.tracks), len(picture.targets)
    found = int(np.count_nonzero(picture.found))
    share = f"{100 * found / total:.1f} % of {total} targets found" if total else "no targets"
    vehicles = f"{count} vehicle{'s' if count != 1 else ''}"
    figure.suptitle(f"{picture.algorithm} · {vehicles} · {share}", fontsize=15, color=INK)
    chart.set_title(picture.subtitle, fontsize=10, color=GREY, loc="left", pad=8)


def draw_numbers(chart: Axes, shown: Map) -> None:
    """Each vehicle's number in a badge on its track, there where it is furthest from all other signs.

    A vehicle whose whole track lies under other signs gets none.
    """
    flown = [(vehicle, track) for vehicle, track in enumerate(shown.tracks) if len(track)]
    taken = [chart.transData.transform(track[end]) for _, track in flown for end in (0, -1)]
    for vehicle, track in flown:
        places = track[np.linspace(0, len(track) - 1, BADGE_PLACES).astype(int)]
        pixels = chart.transData.transform(places)
        nearest = np.min([np.hypot(*(pixels - sign).T) for sign in taken], axis=0)
        best = int(np.argmax(nearest))
        if nearest[best] >= BADGE_PIXELS:
            taken.append(pixels[best])
            draw_badge(chart, vehicle, places[best])


def draw_badge(chart: Axes, vehicle: int, place: Floats) -> None:
    """The number, counted from 1, on a disc of the vehicle's colour."""
    colour = colour_of(vehicle)
    points = BADGE_PIXELS * 72 / DPI
    disc: Style = {"markerfacecolor": colour, "markeredgecolor": "white", "markeredgewidth": 0.8}
    chart.plot(*place, marker="o", markersize=points, **disc, zorder=8)
    ink = INK if colour in LIGHT_COLOURS else "white"
    text: Style = {"ha": "center", "va": "center_baseline", "fontsize": 7.5, "fontweight": "bold"}
    chart.text(place[0], place[1], str(vehicle + 1), **text, color=ink, zorder=9)
