"""The charts: all algorithms told apart, runs that never got there shown as such, no label over another.

Whether they are beautiful is for eyes; these tests read places and colours back.
"""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from swarmctl.core.arrays import Records
from swarmctl.core.planners import MODULES
from swarmctl.record.errors import RunFolderError
from swarmctl.study import charts, grid_charts
from swarmctl.study.charts import EDGE_AT, NEVER_AT
from swarmctl.study.figures import CellFigures, figures_of_cell
from swarmctl.study.runs import CURVE_POINTS, RUN

from .studied import small_plan

END = 120.0  # of the small mission's search
ALL = tuple(MODULES)


def made_up(runs: int, speed: float, seed: int = 1) -> Records:
    """Runs of which many never get to 85 %, the more the smaller ``speed`` is."""
    generator = np.random.default_rng(seed)
    records = np.zeros(runs, RUN)
    times = np.cumsum(generator.exponential(30.0 / speed, (runs, 5)), axis=1)
    records["time_s"] = np.where(times > END, np.inf, times)
    rising = np.linspace(0, 1, CURVE_POINTS) * generator.uniform(0.5, 1.0, (runs, 1))
    records["curve"] = rising**0.5
    records["final_fraction"] = rising[:, -1] ** 0.5
    return records


def cell_of(names: tuple[str, ...], runs: int = 50) -> CellFigures:
    plan = small_plan(names, runs)
    told = {name: made_up(runs, 1.0 + 0.2 * k, k) for k, name in enumerate(names)}
    return figures_of_cell(plan.cells[0], told)


def laid_out(figure: Figure) -> Figure:
    figure.draw_without_rendering()
    return figure


def boxes(figure: Figure) -> list[tuple[str, Bbox]]:
    """Everything that is written in the figure, with its place in pixels."""
    texts: list[Text] = [
        text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()
    ]
    hidden = {
        label
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
        for label in (tick.label1, tick.label2)
        if not _shown(axes, axis.axis_name, tick.get_loc())  # type: ignore[attr-defined]
    }
    return [(text.get_text(), text.get_window_extent()) for text in texts if text not in hidden]


def _shown(axes: Axes, name: str, place: float) -> bool:
    low, high = sorted(axes.get_xlim() if name == "x" else axes.get_ylim())
    return low <= place <= high


def assert_legible(figure: Figure) -> None:
    """No text over another, and all within the picture."""
    written = boxes(laid_out(figure))
    meet = [
        (a, b) for (a, one), (b, other) in combinations(written, 2) if one.shrunk(0.98, 0.9).overlaps(other)
    ]
    assert meet == []
    outside = [
        a
        for a, box in written
        if box.x0 < 0 or box.y0 < 0 or box.x1 > figure.bbox.x1 or box.y1 > figure.bbox.y1
    ]
    assert outside == []


def dots(axes: Axes) -> np.ndarray:
    """Places of all dots of runs."""
    return np.concatenate([line.get_xydata() for line in axes.lines if line.get_marker() == "o"])


@pytest.mark.parametrize("names", [ALL[:1], ALL[:2], ALL[:3], ALL])
def test_every_chart_is_legible(names: tuple[str, ...]) -> None:
    cell = cell_of(names)
    assert_legible(charts.found_figure(cell.algorithms))
    assert_legible(charts.times_figure(cell.algorithms))
    if len(names) > 1:
        assert_legible(charts.pairs_figure(cell))


def test_algorithms_differ_in_colour_and_keep_it() -> None:
    assert len({charts.colour_of(name) for name in ALL}) == len(ALL)
    alone, among = cell_of(ALL[3:4]).algorithms, cell_of(ALL).algorithms
    lines = [
        line.get_color()
        for told in (alone, among)
        for line in charts.found_figure(told).axes[0].lines
        if line.get_label() == ALL[3]
    ]
    assert lines == [charts.colour_of(ALL[3])] * 2


def test_the_share_found_is_drawn_with_its_band() -> None:
    told = cell_of(ALL[:2]).algorithms
    every, *panels = charts.found_figure(told).axes
    assert {line.get_label() for line in every.lines} == set(told)
    for panel, figures in zip(panels, told.values(), strict=True):
        (band,) = panel.collections
        corners = band.get_paths()[0].vertices
        assert corners[:, 1].max() == pytest.approx(100 * figures.high.max())
        assert corners[:, 1].min() == pytest.approx(100 * figures.low.min())
        assert any(np.array_equal(line.get_ydata(), 100 * figures.fraction) for line in panel.lines)


def test_runs_that_never_got_there_stand_in_their_strip_and_are_counted() -> None:
    told = cell_of(ALL[:3]).algorithms
    (axes,) = charts.times_figure(told).axes
    never = {name: int(np.isinf(figures.times("85")).sum()) for name, figures in told.items()}
    assert min(never.values()) > 0
    places = dots(axes)
    assert len(places) == 150
    assert (places[:, 0] > END).sum() == sum(never.values())
    assert places[:, 0].max() < EDGE_AT * END
    notes = {text.get_text() for text in axes.texts}
    assert notes == {f"{count} ({2 * count} %)" for count in never.values()}
    assert [label.get_text() for label in axes.get_xticklabels()][-1] == "never"


def test_pairs_have_a_dot_a_seed_and_unfinished_ones_at_the_edge() -> None:
    cell = cell_of(ALL[:3])
    best, *others = charts.by_rank(cell.algorithms)
    for axes, other in zip(charts.pairs_figure(cell).axes, others, strict=True):
        wanted = [
            np.where(np.isinf(times), NEVER_AT * END, times)
            for times in (cell.algorithms[name].times("85") for name in (other, best))
        ]
        assert np.array_equal(dots(axes), np.column_stack(wanted))
        assert axes.get_xlabel() == f"{other} (s)"


def test_the_best_is_the_one_that_is_earliest_with_never_as_the_end() -> None:
    plan = small_plan(("fco", "bounce"), 4)
    lucky, steady = made_up(4, 1.0), made_up(4, 1.0)
    lucky["time_s"][:, 3], steady["time_s"][:, 3] = [1.0, np.inf, np.inf, np.inf], 80.0
    cell = figures_of_cell(plan.cells[0], {"fco": lucky, "bounce": steady})
    assert charts.by_rank(cell.algorithms) == ["bounce", "fco"]
    (axes,) = charts.pairs_figure(cell).axes
    assert axes.get_title(loc="left") == "bounce earlier in 75 %"


def grid_of(sets: list[str], names: tuple[str, ...] = ("fco",)) -> tuple[grid_charts.Plan, list[CellFigures]]:
    plan = small_plan(names, 30, sets)
    return plan, [
        figures_of_cell(cell, {name: made_up(30, 1.0 + 0.1 * k + j, j) for j, name in enumerate(names)})
        for k, cell in enumerate(plan.cells)
    ]


def heat(axes: Axes) -> np.ndarray:
    """The values of a heat map, NaN where it is empty."""
    return np.ma.filled(axes.images[0].get_array(), np.nan)


GRIDS = {
    "numbers": ["planner.inertia=0,0.2,0.4", "planner.random=0,0.1"],
    "many": ["planner.inertia=" + ",".join(f"{k / 20:g}" for k in range(20)), "planner.random=0,0.1"],
    "words": ["dynamics=ideal,multicopter", "planner.terms=unit,metric"],
    "lists": ["stub.wind_mps=" + ",".join(f"[1{k}.25, -1{k}.25]" for k in range(6)), "vehicles.count=3,4"],
    "three keys": ["planner.inertia=0,0.2", "planner.random=0,0.1", "radio.range_m=0,600"],
}


@pytest.mark.parametrize("name", GRIDS)
@pytest.mark.parametrize("turned", [False, True])
def test_heat_maps_are_legible(name: str, turned: bool) -> None:
    plan, cells = grid_of(GRIDS[name][::-1] if turned else GRIDS[name])
    assert_legible(grid_charts.heat_figure("fco", plan.varied, cells))


def test_a_heat_map_has_each_setting_s_mean_at_its_place() -> None:
    plan, cells = grid_of(GRIDS["numbers"])
    times, shares = grid_charts.heat_figure("fco", plan.varied, cells).axes[:2]
    late = [cell.algorithms["fco"].late_s["85"] for cell in cells]
    assert heat(times) == pytest.approx(np.reshape(late, (3, 2)))
    found = [100 * cell.algorithms["fco"].runs["final_fraction"].mean() for cell in cells]
    assert heat(shares) == pytest.approx(np.reshape(found, (3, 2)))
    assert [text.get_text() for text in times.texts] == [f"{value:.0f}" for value in late]
    bold = [text.get_text() for text in times.texts if text.get_fontweight() == "bold"]
    assert bold == [f"{min(late):.0f}"]


def test_of_more_keys_the_best_of_the_others_is_shown() -> None:
    plan, cells = grid_of(GRIDS["three keys"])
    figure = grid_charts.heat_figure("fco", plan.varied, cells)
    late = np.reshape([cell.algorithms["fco"].late_s["85"] for cell in cells], (2, 2, 2))
    assert heat(figure.axes[0]) == pytest.approx(late.min(axis=2))
    assert "best of all radio.range_m" in figure.get_suptitle()


def test_a_place_that_is_not_finished_is_left_empty() -> None:
    plan, cells = grid_of(GRIDS["numbers"])
    figure = laid_out(grid_charts.heat_figure("fco", plan.varied, cells[:4]))
    assert np.isnan(heat(figure.axes[0])).tolist() == [[False] * 2, [False] * 2, [True] * 2]


@pytest.mark.parametrize("values", ["0,0.2,0.4", "0,0.001,5", "1,0"])
def test_lines_over_one_key_are_legible(values: str) -> None:
    plan, cells = grid_of([f"planner.inertia={values}"], ALL[:3])
    assert_legible(grid_charts.line_figure(plan.axes[0], cells))


def test_a_line_has_means_with_their_interval() -> None:
    plan, cells = grid_of(["planner.inertia=0.4,0,0.2"], ("fco", "mdc"))
    axes = grid_charts.line_figure(plan.axes[0], cells).axes[0]
    assert [line.get_label() for line in axes.lines] == ["fco", "mdc"]
    late = [cell.algorithms["fco"].late_s["85"] for cell in cells]
    assert axes.lines[0].get_xdata().tolist() == [0.0, 0.2, 0.4]
    assert axes.lines[0].get_ydata() == pytest.approx([late[1], late[2], late[0]])
    edges = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert edges.min() < min(late) < max(late) < edges.max()


def test_words_stand_one_by_one() -> None:
    plan, cells = grid_of(["dynamics=ideal,multicopter"])
    axes = grid_charts.line_figure(plan.axes[0], cells).axes[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["ideal", "multicopter"]


def test_the_files_are_written(tmp_path: Path) -> None:
    charts.draw_runs(tmp_path, cell_of(ALL[:2]))
    plan, cells = grid_of(GRIDS["numbers"], ("fco", "mdc"))
    grid_charts.draw_grid(tmp_path, plan, cells)
    plan, cells = grid_of(["planner.inertia=0,1"])
    grid_charts.draw_grid(tmp_path, plan, cells)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["found.png", "grid-fco.png", "grid-mdc.png", "pairs.png", "sweep.png", "times.png"]
    assert all(min(imread(tmp_path / name).shape[:2]) > 200 for name in names)


def test_one_algorithm_has_no_pairs(tmp_path: Path) -> None:
    charts.draw_runs(tmp_path, cell_of(ALL[:1]))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["found.png", "times.png"]


def test_a_place_that_takes_no_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match=r"found\.png: cannot write"):
        charts.draw_runs(tmp_path / "absent", cell_of(ALL[:1]))
