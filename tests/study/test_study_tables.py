"""The tables: every figure where its head says, in eighty columns, and nothing cut off."""

import numpy as np
import pytest

from swarmctl.core.arrays import Records
from swarmctl.core.planners import MODULES
from swarmctl.study import tables
from swarmctl.study.figures import CellFigures, figures_of_cell
from swarmctl.study.plan import Plan
from swarmctl.study.runs import RUN

from .studied import small_plan

NEVER = np.inf


def records(times_s: list[list[float]], **fields: list[float]) -> Records:
    """RUN records with these times to the five levels, a row a run."""
    runs = np.zeros(len(times_s), RUN)
    runs["time_s"] = times_s
    runs["min_separation_m"] = 20.0
    for name, values in fields.items():
        runs[name] = values
    return runs


def lines(text: str) -> list[list[str]]:
    return [line.split() for line in text.splitlines()]


def cell_of(plan: Plan, runs: dict[str, Records], number: int = 0) -> CellFigures:
    return figures_of_cell(plan.cells[number], runs)


@pytest.fixture
def told() -> CellFigures:
    fco = records(
        [[10, 20, 30, 40, 60], [20, 30, 40, 50, NEVER], [30, 40, 50, 60, NEVER]],
        final_fraction=[1.0, 0.9, 0.8], in_range=[1.0, 2.0, 3.0], min_separation_m=[20.0, 5.25, 30.0],
    )  # fmt: skip
    bounce = records([[NEVER] * 5, [1, 2, 3, NEVER, NEVER], [4, 5, 6, 90, NEVER]])
    return cell_of(small_plan(("fco", "bounce"), 3), {"fco": fco, "bounce": bounce})


def test_the_tables_say_what_there_is(told: CellFigures) -> None:
    said = lines(tables.render(tables.of_cell(told, 3)))
    assert ["fco", "20±10", "30±10", "40±10", "50±10", "60", "(2)"] in said
    assert ["bounce", "2±2", "(1)", "4±2", "(1)", "4±2", "(1)", "90", "(2)", "never", "(3)"] in said
    assert ["fco", "20", "30", "40", "50", "never"] in said
    assert ["bounce", "4", "5", "6", "never", "never"] in said
    # Wilson: 3 of 3 is at least 3 over 3 + 1.96 squared.  t(0.975, 2) = 4.303, times 10 over root 3: 24.8.
    assert ["fco", "-5", "to", "45", "5", "to", "55", "15", "to", "65", "25", "to", "75", "-"] in said
    assert ["fco", "90.0", "%", "±", "10.0", "0", "2.00", "0.0", "5.2", "m"] in said
    assert ["fco", "before", "bounce", "100.0", "%", "43.9", "-", "100.0", "%", "0", "-", "0.250"] in said


@pytest.mark.parametrize(
    ("fco_s", "bounce_s", "first"), [(100, 70, "bounce before fco"), (70, 100, "fco before bounce")]
)
def test_a_pair_is_told_from_the_side_of_who_is_earlier(fco_s: float, bounce_s: float, first: str) -> None:
    plan = small_plan(("fco", "bounce"), 2)
    runs = {"fco": records([[fco_s] * 5] * 2), "bounce": records([[bounce_s] * 5] * 2)}
    said = lines(tables.render(tables.of_cell(cell_of(plan, runs), 2)))
    assert f"{first} 100.0 % 34.2 - 100.0 % 0 30 s 0.500".split() in said


def test_one_algorithm_has_no_pairs(told: CellFigures) -> None:
    alone = cell_of(small_plan(("fco",), 3), {"fco": told.algorithms["fco"].runs})
    assert "earlier" not in tables.render(tables.of_cell(alone, 3))


def test_flights_have_columns_of_their_own() -> None:
    plan = small_plan(("fco",), 2, ["dynamics=multicopter"])
    runs = records(
        [[10.0] * 5] * 2, outside=[3, 4], not_down=[0, 1], standing=[0.1, 0.2], flight_s=[150.0, 170.0]
    )
    said = tables.render(tables.of_cell(cell_of(plan, {"fco": runs}), 2))
    assert [
        "fco",
        "0.0",
        "%",
        "±",
        "0.0",
        "0",
        "0.00",
        "0.0",
        "20.0",
        "m",
        "7",
        "15.0",
        "%",
        "1",
        "160",
        "s",
    ] in lines(said)
    assert "multicopter dynamics" in said


def test_a_grid_has_a_row_a_setting_and_marks_the_best() -> None:
    plan = small_plan(("fco",), 2, ["planner.inertia=0.1,0.2", "radio.range_m=0,600"])
    late = [[[10, 20, 30, time, NEVER]] * 2 for time in (90, 50, 70, NEVER)]
    cells = [cell_of(plan, {"fco": records(times)}, number) for number, times in enumerate(late)]
    said = lines(tables.render(tables.of_grid(cells)))
    assert said[2][:2] == ["inertia", "range_m"]
    assert ["0.1", "600", "20±0", "50±0", "50*", "0.0", "%", "0.00"] in said
    assert ["0.2", "600", "20±0", "never", "(2)", "120", "0.0", "%", "0.00"] in said


def test_all_algorithms_fit_eighty_columns_and_nothing_is_cut_off() -> None:
    generator = np.random.default_rng(1)
    plan = small_plan(tuple(MODULES), 1000)
    runs = {}
    for name in MODULES:
        times = np.cumsum(generator.exponential(290, (1000, 5)), axis=1)
        runs[name] = records(np.where(times > 1600, NEVER, times).tolist(), in_range_when_any=[25.0] * 1000)
    text = tables.render(tables.of_cell(cell_of(plan, runs), 1000))
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text
    assert "\u00a0" not in text
    assert "\x1b" not in text


def test_figures_of_a_column_stand_below_each_other() -> None:
    cells = tables._aligned(["895±280 (5)", "654±281", "1091±264 (23)"])
    assert [cell.replace(tables.STAYS, ".") for cell in cells] == [
        "895±280 (5).",
        "654±281.....",
        "1091±264 (23)",
    ]
