"""study.json: the keys that scripts are written against, figures that follow from the runs, no NaN anywhere."""

import json
import math
from statistics import fmean, median, stdev
from typing import Any

import numpy as np
import pytest

from swarmctl.study.figures import study_json
from swarmctl.study.report import figures_of_study
from swarmctl.study.study import Study

from .studied import flown, small_plan

LEVELS = ["25", "50", "75", "85", "95"]
SUMMARY = {"mean", "std", "median", "ci95", "missing"}
RUNS = 12


def told(study: Study) -> dict[str, Any]:
    """study.json as a reader gets it."""
    content = study_json(study, figures_of_study(study), "runs/x")
    read: dict[str, Any] = json.loads(json.dumps(content, allow_nan=False))
    return read


@pytest.fixture(scope="module")
def study() -> Study:
    return flown(small_plan(("bounce", "fco"), RUNS))


@pytest.fixture(scope="module")
def content(study: Study) -> dict[str, Any]:
    return told(study)


def test_the_promised_keys_are_there(content: dict[str, Any]) -> None:
    assert content["runs"] == RUNS
    assert content["seed"] == 1
    assert content["wall_s"] == 1.0
    assert content["dynamics"] == "ideal"
    assert content["uav_steps_per_s"] == 3 * 120 * 2 * RUNS / 1.0
    assert content["threads"] == 2
    assert list(content["algorithms"]) == ["bounce", "fco"]
    for figures in content["algorithms"].values():
        assert list(figures["time_to_s"]) == list(figures["per_run"]) == LEVELS
        summaries = ("final_fraction", "mean_targets_in_range", "min_separation_m")
        for summary in (*figures["time_to_s"].values(), *(figures[name] for name in summaries)):
            assert set(summary) == SUMMARY
        assert len(figures["curve"]["t_s"]) == len(figures["curve"]["fraction"])
        assert all(len(values) == RUNS for values in figures["per_run"].values())
    keys = {"a", "b", "level", "wins", "median_difference_s", "p"}
    assert [keys <= set(pair) for pair in content["paired"]] == [True] * len(LEVELS)
    assert [(pair["a"], pair["b"], pair["level"]) for pair in content["paired"]] == [
        ("bounce", "fco", level) for level in LEVELS
    ]
    assert "grid" not in content


@pytest.mark.parametrize("name", ["bounce", "fco"])
@pytest.mark.parametrize("level", LEVELS)
def test_summaries_follow_from_the_runs_that_are_told(content: dict[str, Any], name: str, level: str) -> None:
    figures = content["algorithms"][name]
    times, summary = figures["per_run"][level], figures["time_to_s"][level]
    there = [time for time in times if time is not None]
    assert summary["missing"] == RUNS - len(there)
    assert summary["mean"] == pytest.approx(fmean(there))
    assert summary["std"] == pytest.approx(stdev(there))
    middle = median(math.inf if time is None else time for time in times)
    assert summary["median"] == (middle if math.isfinite(middle) else None)
    late = fmean(120.0 if time is None else time for time in times)
    assert figures["mean_time_never_as_end_s"][level] == pytest.approx(late)


def test_the_tests_have_runs_that_never_got_there(content: dict[str, Any]) -> None:
    missing = [content["algorithms"][name]["time_to_s"]["95"]["missing"] for name in ("bounce", "fco")]
    assert all(0 < count < RUNS - 1 for count in missing)


def test_per_run_figures_are_the_records(study: Study, content: dict[str, Any]) -> None:
    for name, records in study.runs[0].items():
        for k, level in enumerate(LEVELS):
            times = content["algorithms"][name]["per_run"][level]
            assert [math.inf if time is None else time for time in times] == records["time_s"][:, k].tolist()


def test_the_curve_is_the_mean_share_found_within_its_band(study: Study, content: dict[str, Any]) -> None:
    for name, records in study.runs[0].items():
        curve = {key: np.array(values) for key, values in content["algorithms"][name]["curve"].items()}
        assert curve["t_s"][[0, -1]].tolist() == [0.0, 120.0]
        assert curve["fraction"] == pytest.approx(records["curve"].mean(axis=0), abs=1e-6)
        assert curve["fraction"][-1] == pytest.approx(records["final_fraction"].mean(), abs=1e-6)
        assert (curve["p10"] <= curve["p90"]).all()
        assert curve["p10"] == pytest.approx(np.quantile(records["curve"], 0.1, axis=0), abs=1e-6)


def test_wins_follow_from_the_runs_that_are_told(content: dict[str, Any]) -> None:
    for pair in content["paired"]:
        a, b = (
            [
                math.inf if time is None else time
                for time in content["algorithms"][name]["per_run"][pair["level"]]
            ]
            for name in ("bounce", "fco")
        )
        wins = fmean(1.0 if x < y else 0.5 if x == y else 0.0 for x, y in zip(a, b, strict=True))
        assert pair["wins"] == pytest.approx(wins)


def test_a_grid_has_every_setting_and_the_first_one_on_top() -> None:
    content = told(flown(small_plan(("fco",), 4, ["planner.inertia=0.1,0.9", "radio.range_m=0"])))
    assert [cell["settings"] for cell in content["grid"]] == [
        {"planner.inertia": 0.1, "radio.range_m": 0},
        {"planner.inertia": 0.9, "radio.range_m": 0},
    ]
    first, second = content["grid"]
    assert all(content[key] == first[key] for key in ("settings", "dynamics", "algorithms", "paired"))
    assert first["algorithms"]["fco"]["per_run"] != second["algorithms"]["fco"]["per_run"]


def test_one_value_is_no_grid() -> None:
    content = told(flown(small_plan(("fco",), 2, ["planner.inertia=0.1"])))
    assert "grid" not in content
    assert content["settings"] == {"planner.inertia": 0.1}


def test_flights_have_figures_of_their_own() -> None:
    content = told(flown(small_plan(("bounce",), 3, ["dynamics=multicopter", "duration_s=20"])))
    figures = content["algorithms"]["bounce"]
    assert content["dynamics"] == "multicopter"
    assert figures["outside_vehicle_ticks"]["mean"] == figures["not_down"]["mean"] == 0.0
    assert figures["flight_s"]["mean"] > 20.0
    assert 0.0 <= figures["standing_share"]["mean"] < 0.5
    assert figures["min_separation_m"]["mean"] > 15.0


@pytest.mark.parametrize("dynamics", ["ideal", "multicopter"])
def test_what_is_not_defined_is_null(dynamics: str) -> None:
    """A single vehicle has no separation, a single run no spread; without targets nothing is ever found."""
    sets = [f"dynamics={dynamics}", "vehicles.count=1", "targets.count=0", "duration_s=5"]
    content = told(flown(small_plan(("bounce",), 1, sets)))
    figures = content["algorithms"]["bounce"]
    nothing = {"mean": None, "std": None, "median": None, "ci95": None, "missing": 1}
    assert figures["min_separation_m"] == nothing
    assert figures["time_to_s"]["85"] == nothing
    assert figures["per_run"]["85"] == [None]
    assert content["paired"] == []


def test_a_stopped_study_says_so_and_has_what_is_finished(study: Study) -> None:
    stopped = Study(study.plan)
    stopped.runs[0]["bounce"] = study.runs[0]["bounce"]
    content = told(stopped)
    assert content["complete"] is False
    assert list(content["algorithms"]) == ["bounce"]
    assert told(study)["complete"] is True
