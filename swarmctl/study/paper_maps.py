"""The paper's path figures: maps drawn as tracks.png is, and the enlargements of Figs. 18 and 21."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from swarmctl.core.arrays import Floats
from swarmctl.mission.geometry import regions
from swarmctl.mission.scenario import Scenario
from swarmctl.record.drawing import GREY, INK, Style, new_figure, save
from swarmctl.record.tracks import Map, colour_of, draw_badge, draw_legend, draw_map, draw_numbers, settle

from .paper_paths import Search
from .paper_scenes import Moment, Scene
from .paper_variants import mdc

SIDE_IN = 7.6
BEFORE_S, AFTER_S = 60, 90
"""An enlargement shows so much of the tracks before and after its moment."""

HALF_M = 450.0
HEADING_M = 700.0


def map_of(search: Search, tracks: bool = True) -> Map:
    """What is drawn of a search."""
    area = regions(search.flown.mission())
    vehicles = range(search.places.shape[1]) if tracks else ()
    return Map(
        border=area.border,
        keep_outs=area.keep_outs,
        targets=search.targets,
        found=search.found,
        tracks=[search.places[:, i] for i in vehicles],
    )


def draw_environment(seed: int, file: Path) -> None:
    """Fig. 11: clusters, forbidden zones, the launch and the initial headings."""
    world = Scenario(mdc().mission(), ideal=True).world(seed)
    search = Search(mdc(), seed, world, np.stack((world.poses["east"], world.poses["north"]), axis=1)[None])
    figure = new_figure(SIDE_IN, SIDE_IN + 0.5)
    chart = figure.add_subplot()
    world.found[:] = 0  # all dots alike: nothing is searched for yet
    draw_map(chart, map_of(search, tracks=False))
    for i, row in enumerate(world.fleet):
        way = HEADING_M * np.array([row["heading_east"], row["heading_north"]])
        start = search.places[0, i]
        style: Style = {
            "arrowstyle": "-|>",
            "color": colour_of(i),
            "linewidth": 1.6,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        chart.annotate("", start + way, start, arrowprops=style, zorder=6)
    dot: Style = {"linestyle": "none", "marker": "o", "markersize": 6, "color": INK}
    handles = [
        Line2D([], [], **dot, label=f"{len(search.targets)} targets in 6 clusters"),
        Line2D([], [], linewidth=1.6, color=GREY, marker=">", label="initial headings from the launch"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, labelcolor=INK)
    chart.set_title(f"seed {seed}", fontsize=10, color=GREY, loc="left", pad=8)
    save(figure, file)


def draw_scene(scene: Scene, title: str, file: Path) -> None:
    """One map."""
    figure = new_figure(SIDE_IN, SIDE_IN + 0.8)
    chart = figure.add_subplot()
    shown = map_of(scene.search)
    draw_map(chart, shown)
    draw_legend(figure, shown, rows=2)
    _title(chart, title, scene.search)
    settle(figure)
    draw_numbers(chart, shown)
    save(figure, file)


def _title(chart: Axes, title: str, search: Search) -> None:
    chart.set_title(
        f"{title} · seed {search.seed}, {len(search.places) - 1} s",
        fontsize=10,
        color=GREY,
        loc="left",
        pad=8,
    )


def draw_enlarged(scene: Scene, title: str, file: Path) -> None:
    """The map (a), and beside it its first moment enlarged (b); a scene without one has its map alone."""
    if not scene.moments:
        draw_scene(scene, title, file)
        return
    moment = scene.moments[0]
    figure = new_figure(2 * SIDE_IN, SIDE_IN + 0.6)
    charts: Any = figure.subplots(ncols=2)
    shown = map_of(scene.search)
    centre, half = _frame(scene.search, moment)
    draw_map(charts[0], shown)
    charts[0].add_patch(
        Rectangle(
            tuple(centre - half), 2 * half, 2 * half, fill=False, edgecolor=INK, linewidth=1.6, zorder=7
        )
    )
    _title(charts[0], f"(a) {title}", scene.search)
    draw_map(charts[1], map_of(scene.search, tracks=False))
    _draw_enlargement(charts[1], scene, moment, centre, half)
    draw_legend(figure, shown)
    settle(figure)
    draw_numbers(charts[0], shown)
    save(figure, file)


def _frame(search: Search, moment: Moment) -> tuple[Floats, float]:
    """The middle and half the side of what is enlarged: both vehicles with room about them."""
    pair = search.places[moment.tick, [moment.vehicle, moment.other]]
    return pair[0], max(HALF_M, 1.2 * float(np.abs(pair[1] - pair[0]).max()))


def _draw_enlargement(chart: Axes, scene: Scene, moment: Moment, centre: Floats, half: float) -> None:
    """Tracks about the moment, who hears whom, and how the vehicle would have flown without radio."""
    part = slice(max(0, moment.tick - BEFORE_S), moment.tick + AFTER_S)
    now = scene.search.places[moment.tick]
    for i in range(len(now)):
        colour = colour_of(i)
        chart.plot(*scene.search.places[part, i].T, color=colour, linewidth=1.8, zorder=4)
        if (np.abs(now[i] - centre) < 0.95 * half).all():
            draw_badge(chart, i, now[i])
    if scene.silent is not None:
        way = scene.silent.places[moment.tick : moment.tick + AFTER_S, moment.vehicle]
        chart.plot(*way.T, color=colour_of(moment.vehicle), linewidth=1.8, linestyle=(0, (3, 2)), zorder=4)
    pair = now[[moment.vehicle, moment.other]]
    chart.plot(*pair.T, color=INK, linewidth=1.2, linestyle=(0, (1, 2)), zorder=5)
    chart.set_xlim(centre[0] - half, centre[0] + half)
    chart.set_ylim(centre[1] - half, centre[1] + half)
    distance = float(np.hypot(*(pair[1] - pair[0])))
    said = f"(b) at {moment.tick} s: radio contact over {distance:.0f} m (dotted)"
    dashed = ", the way without radio (dashed)" if scene.silent is not None else ""
    chart.set_title(said + dashed, fontsize=10, color=GREY, loc="left", pad=8)
