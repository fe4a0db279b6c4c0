"""Tuning: finds what there is to find, says when there is nothing, goes on where it was stopped.

Most of these plant the optimum: in place of flying, a run's time is a known function of the setting and its seed.
"""

import json
import math
from collections.abc import Iterator
from concurrent.futures import Executor
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yaml
from optuna.trial import TrialState

from swarmctl.core import planners
from swarmctl.core.arrays import Records
from swarmctl.mission.load import load
from swarmctl.study import execute
from swarmctl.study.errors import TuneError
from swarmctl.study.runs import RUN, Job
from swarmctl.study.tune import Question, Trials, tune
from swarmctl.study.tuned import Answer, answer, fresh_seeds

PLANTED = {"inertia": 0.85, "personal": 0.15}
HELD = {"global": 0.2, "random": 0.05, "revisit_s": 200.0, "revisit_radius_m": 200.0}
SWARM = {f"planner.{name}": value for name, value in HELD.items()}


class Valley:
    """Stands in for flying: 300 s in the planted optimum, later away from it, with each seed's own luck."""

    def __init__(self) -> None:
        self.depth = 1.0
        self.flown: list[Job] = []
        self.stop_after = math.inf

    def simulate(self, job: Job) -> Records:
        if len(self.flown) >= self.stop_after:
            raise KeyboardInterrupt
        self.flown.append(job)
        setting = {"inertia": 0.4, "personal": 0.4, **job.mission.planner.parameters[job.algorithm]}
        away = sum((float(setting[name]) - best) ** 2 for name, best in PLANTED.items())
        runs = np.zeros(len(job.seeds), RUN)
        for run, seed in zip(runs, job.seeds, strict=True):
            luck = float(np.random.default_rng(seed).normal(0.0, 20.0))
            run["seed"], run["time_s"] = seed, 300.0 + 500.0 * self.depth * away + luck
            run["final_fraction"] = 0.9 - 0.5 * away
        return runs


@pytest.fixture
def valley(monkeypatch: pytest.MonkeyPatch) -> Valley:
    valley = Valley()
    monkeypatch.setattr(execute, "simulate", valley.simulate)
    return valley


@pytest.fixture
def executor() -> Iterator[Executor]:
    with execute.local(1) as threads:
        yield threads


def question(metric: str = "t85", runs: int = 20, seed: int = 3, **settings: object) -> Question:
    return Question(load(settings={**SWARM, **settings}), "fco", metric, runs, seed)


def trials_of(asked: Question, file: Path, count: int, executor: Executor) -> Trials:
    trials = Trials(asked, file)
    tune(trials, count, executor, lambda trials: None)
    return trials


def tuned(asked: Question, file: Path, count: int, executor: Executor) -> Answer:
    return answer(trials_of(asked, file, count, executor), 100, executor)


def told(trials: Trials) -> list[object]:
    """Everything that the finished trials came to."""
    return [(t.number, t.params, t.value, t.state, t.intermediate_values) for t in trials.done]


@pytest.mark.parametrize("metric", ["t85", "final"])
def test_it_finds_the_planted_optimum(
    metric: str, valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    got = tuned(question(metric), tmp_path / "t.db", 50, executor)
    assert got.setting == pytest.approx(PLANTED, abs=0.12)
    assert got.is_better
    assert got.paired.wins > 0.95
    assert "better on fresh seeds too" in got.verdict


def test_the_first_trial_is_the_setting_without_tuning(
    valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    trials = trials_of(question(), tmp_path / "t.db", 1, executor)
    assert trials.setting(0) == {"inertia": 0.4, "personal": 0.4}
    assert valley.flown[0].mission.planner.parameters["fco"] == {**HELD, "inertia": 0.4, "personal": 0.4}


def test_every_trial_flies_the_same_seeds(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    trials_of(question(), tmp_path / "t.db", 3, executor)
    seeds = [seed for job in valley.flown for seed in job.seeds]
    assert seeds == [*question().training] * 3


def test_fresh_seeds_meet_no_training_and_no_usual_study() -> None:
    sides = [(Question(load(), "fco", "t85", 1_000_000, seed)) for seed in (0, 1, 999_999)]
    training = [q.training for q in sides]
    fresh = [fresh_seeds(q, 1_000_000) for q in sides]
    spans = sorted((r.start, r.stop) for r in [range(10_000_000), *training, *fresh])
    assert all(before[1] <= after[0] for before, after in pairwise(spans))
    assert spans[-1][1] < 2**62


def test_the_answer_is_told_on_the_fresh_seeds(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    trials = trials_of(question(), tmp_path / "t.db", 20, executor)
    before = len(valley.flown)
    got = answer(trials, 100, executor)
    seeds = [seed for job in valley.flown[before:] for seed in job.seeds]
    assert seeds == [*fresh_seeds(question(), 100)] * 2
    assert got.best.shape == got.default.shape == (100,)


def test_a_lead_that_was_luck_is_said_to_be_none(
    valley: Valley, tmp_path: Path, executor: Executor, monkeypatch: pytest.MonkeyPatch
) -> None:
    valley.depth = 0.0
    asked = question()

    def lucky(job: Job) -> Records:
        runs = valley.simulate(job)
        if job.seeds[0] in asked.training:  # what helps on the training seeds helps nowhere else
            runs["time_s"] -= 100.0 * float(job.mission.planner.parameters["fco"]["inertia"])
        return runs

    monkeypatch.setattr(execute, "simulate", lucky)
    got = tuned(asked, tmp_path / "t.db", 15, executor)
    assert got.trials.score(got.trials.best) < got.trials.score(0)
    assert not got.is_better
    assert "NOT better" in got.verdict


@pytest.mark.parametrize(("lead_s", "better"), [(20.0, False), (100.0, True), (-100.0, False)])
def test_a_lead_counts_if_chance_would_hardly_have_it(
    lead_s: float, better: bool, valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    trials = trials_of(question(), tmp_path / "t.db", 1, executor)
    luck = np.random.default_rng(2).normal(0.0, 200.0, 100)
    default = np.full(100, 600.0)
    best = default - lead_s + luck - luck.mean()  # so that the means differ by just that
    assert Answer(trials, range(100), default, best).is_better is better


def test_a_default_that_nothing_beats_is_kept(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    valley.depth = 0.0
    got = tuned(question(), tmp_path / "t.db", 5, executor)
    assert got.trials.best == 0
    assert not got.is_better
    assert "keep the default" in got.verdict


@pytest.mark.parametrize("stop_after", [0, 2, 30])
def test_interrupted_anywhere_it_goes_on_to_the_same_trials(
    stop_after: int, valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    whole = told(trials_of(question(), tmp_path / "whole.db", 15, executor))
    valley.flown.clear()
    valley.stop_after = stop_after
    with pytest.raises(KeyboardInterrupt):
        trials_of(question(), tmp_path / "parts.db", 15, executor)
    valley.stop_after = math.inf
    parts = trials_of(question(), tmp_path / "parts.db", 15, executor)
    assert told(parts) == whole
    assert told(Trials(question(), tmp_path / "parts.db")) == whole


def test_more_trials_than_asked_for_are_not_made(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    trials_of(question(), tmp_path / "t.db", 4, executor)
    before = len(valley.flown)
    assert len(trials_of(question(), tmp_path / "t.db", 3, executor).done) == 4
    assert len(valley.flown) == before


def test_hopeless_trials_are_given_up_after_a_part(
    valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    trials = trials_of(question(), tmp_path / "t.db", 30, executor)
    pruned = [t for t in trials.done if t.state == TrialState.PRUNED]
    assert pruned
    flown = sum(len(job.seeds) for job in valley.flown)
    assert flown == 20 * (30 - len(pruned)) + sum(5 * (t.last_step or 0) for t in pruned)
    assert trials.score(trials.best) == min(t.value for t in trials.done if t not in pruned and t.value)


@pytest.mark.parametrize(
    ("other", "word"),
    [
        (question("t95"), "metric"),
        (question(seed=4), "seed"),
        (question(runs=21), "runs"),
        (question(**{"vehicles.count": 5}), "mission"),
        (question(**{"planner.inertia": 0.3}), "parameters"),
        (Question(load(settings=SWARM), "mdc", "t85", 20, 3), "algorithm"),
    ],
)
def test_trials_of_another_question_are_refused(
    other: Question, word: str, valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    trials_of(question(), tmp_path / "t.db", 1, executor)
    with pytest.raises(TuneError, match=rf"t\.db: holds trials with another .*{word}"):
        Trials(other, tmp_path / "t.db")
    assert len(Trials(question(), tmp_path / "t.db").done) == 1


def test_a_file_that_is_no_database_is_refused(tmp_path: Path) -> None:
    (tmp_path / "t.db").write_text("no database at all, but long enough to look like one" * 50)
    with pytest.raises(TuneError, match=r"t\.db: cannot be used for trials"):
        Trials(question(), tmp_path / "t.db")


def test_a_folder_may_be_called_anything(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    folder = tmp_path / "50% of what? #1 & more"
    folder.mkdir()
    trials_of(question(), folder / "t.db", 1, executor)
    assert [file.name for file in folder.iterdir()] == ["t.db"]


def test_the_yaml_is_a_mission_that_flies_with_the_setting(
    valley: Valley, tmp_path: Path, executor: Executor
) -> None:
    got = tuned(question(**{"planner.period_s": 2.0}), tmp_path / "t.db", 15, executor)
    (tmp_path / "planner.yaml").write_text(got.mission_yaml())
    mission = load(tmp_path / "planner.yaml")
    assert (mission.planner.algorithm, mission.planner.period_s) == ("fco", 2.0)
    assert mission.planner.parameters == {"fco": {**HELD, **got.setting}}
    assert list(yaml.safe_load(got.mission_yaml())) == ["planner"]


def test_what_is_printed_is_what_was_flown(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    got = tuned(question(), tmp_path / "t.db", 15, executor)
    flown = [
        job.mission.planner.parameters["fco"] for job in valley.flown if job.seeds[0] in question().training
    ]
    assert {**HELD, **got.setting} in flown
    assert all(float(f"{value:.4g}") == value for value in got.setting.values())


def test_nothing_is_left_out_of_the_json(valley: Valley, tmp_path: Path, executor: Executor) -> None:
    got = json.loads(
        json.dumps(tuned(question(), tmp_path / "t.db", 15, executor).as_json(), allow_nan=False)
    )
    assert got["better"] is True
    assert got["fresh"]["runs"] == 100
    assert got["fresh"]["best"]["score"] < got["fresh"]["default"]["score"]
    assert yaml.safe_load(got["yaml"])["planner"]["parameters"]["fco"].items() >= got["parameters"].items()


def test_a_run_that_never_got_there_counts_as_the_whole_search() -> None:
    runs = np.zeros(3, RUN)
    runs["time_s"][:, 3] = 100.0, math.inf, 400.0
    runs["final_fraction"] = 0.5, 0.7, 0.9
    assert question("t85").score(question("t85").values(runs)) == pytest.approx((100 + 1600 + 400) / 3)
    assert question("final").score(question("final").values(runs)) == pytest.approx(0.7)


def test_a_mission_that_gives_every_parameter_leaves_nothing_to_tune() -> None:
    with pytest.raises(TuneError, match=r"nothing to tune: the mission gives all parameters of fco"):
        question(**{"planner.inertia": 0.4, "planner.personal": 0.4}).identity()


@pytest.mark.parametrize("name", planners.MODULES)
def test_what_is_searched_is_valid_and_holds_the_default(name: str) -> None:
    searched = [p for p in planners.module(name).PARAMETERS if p.search is not None]
    assert searched
    for p in searched:
        assert p.low <= p.search[0] <= p.default <= p.search[1] <= p.high


def test_the_papers_baseline_stays_without_a_random_vector() -> None:
    assert "random" not in Question(load(), "dpso-u", "t85", 1, 1).default
