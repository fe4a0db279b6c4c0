"""Tuning: which setting of an algorithm's parameters is best, as far as its training seeds can tell.

A :class:`Question` says what is sought.  Every trial flies the same training seeds, so that two settings differ by
what they are and not by what they met; the first trial is the setting as it is without tuning.  Optuna proposes
the next one, and a trial that after a part of its seeds is behind half of the others is given up.

Trials are kept in a file, one whole trial at a time.  What Optuna proposes depends on the finished trials and on a
seed of its own a trial, so a tuning that was interrupted goes on to the very trials that it would have made.
"""

import json
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import optuna
import sqlalchemy
from optuna.trial import TrialState

from swarmctl.core import bind, planners
from swarmctl.core.arrays import Floats, Records
from swarmctl.core.planners.parameters import Parameter
from swarmctl.mission.dump import dump
from swarmctl.mission.model import Mission

from .errors import TuneError
from .execute import jobs_of, run_jobs
from .runs import LEVELS_PERCENT

SEEDS_APART = 1_000_000
TRAINING_FROM = 10**12
"""Training seeds lie where neither a study's usual seeds nor a tuning's fresh ones do."""

PARTS = 4
"""A trial's runs are flown in so many parts; after each but the last it may be given up."""

JOB_RUNS = 5
DIGITS = 4
"""Significant digits of a proposed value: what is printed is then exactly what was flown."""

STUDY_NAME = "tune"
FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)

Setting = dict[str, float]
Told = Callable[[list[optuna.trial.FrozenTrial]], None]
"""Called after each trial with all that are finished."""


@dataclass(frozen=True)
class Question:
    """What is sought: the best setting of ``algorithm`` on ``mission`` by ``metric``.

    ``metric`` is t25, t50, t75, t85 or t95 (the time to that level), final (the share found) or in_range (targets
    in a vehicle's range).  A trial is ``runs`` runs; ``seed`` decides which, and what Optuna proposes.
    """

    mission: Mission
    algorithm: str
    metric: str
    runs: int
    seed: int

    @property
    def is_time(self) -> bool:
        """Whether less is better; of the shares and numbers more is."""
        return self.metric.startswith("t")

    @property
    def training(self) -> range:
        """The seeds of every trial."""
        first = TRAINING_FROM + self.seed * SEEDS_APART
        return range(first, first + self.runs)

    @property
    def held(self) -> Mapping[str, float | str]:
        """What the mission says of the algorithm's parameters: not searched, but flown so in every trial."""
        return self.mission.planner.parameters.get(self.algorithm, {})

    @property
    def searched(self) -> list[Parameter]:
        """The parameters that are sought.  Raises TuneError if there are none."""
        own = planners.module(self.algorithm).PARAMETERS
        free = [p for p in own if p.search is not None and p.name not in self.held]
        if not free:
            raise TuneError(
                f"nothing to tune: the mission gives all parameters of {self.algorithm} that have a range to search "
                f"(leave those out that are to be tuned)"
            )
        return free

    @property
    def default(self) -> Setting:
        """The searched parameters as they are without tuning."""
        return {p.name: p.default for p in self.searched}

    def with_setting(self, setting: Setting) -> Mission:
        """The mission flown with that setting."""
        planner = self.mission.planner
        parameters = {**planner.parameters, self.algorithm: {**self.held, **setting}}
        changed = planner.model_copy(update={"algorithm": self.algorithm, "parameters": parameters})
        return self.mission.model_copy(update={"planner": changed})

    def values(self, runs: Records) -> Floats:
        """What each run came to by the metric, (R,): infinity for a level never reached."""
        if self.is_time:
            return np.array(runs["time_s"][:, LEVELS_PERCENT.index(int(self.metric[1:]))])
        return np.array(runs["final_fraction" if self.metric == "final" else "in_range"])

    def score(self, values: Floats) -> float:
        """The mean that is tuned for; a run that never got there counts as the whole search's length."""
        return float(np.minimum(values, self.mission.duration_s).mean() if self.is_time else values.mean())

    def identity(self) -> dict[str, str]:
        """What trials must have in common to be compared, by the name that a message calls it."""
        space = {p.name: (p.default, p.search) for p in self.searched}
        return {
            "algorithm": self.algorithm,
            "metric": self.metric,
            "runs": str(self.runs),
            "seed": str(self.seed),
            "mission": dump(self.mission),
            "parameters": json.dumps(space),
            "version of the kernels": bind.digest(),
        }


def setting_of(trial: optuna.trial.FrozenTrial) -> Setting:
    """The values that a trial flew with."""
    return {name: float(f"{value:.{DIGITS}g}") for name, value in trial.params.items()}


def finished(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    """The trials that came to an end, the default setting's first."""
    return study.get_trials(deepcopy=False, states=FINISHED)


def best_of(question: Question, done: list[optuna.trial.FrozenTrial]) -> tuple[int, float]:
    """Which of the finished trials, counted from 0, is the best of those that were not given up, and its score."""
    scores = {k: trial.value or 0.0 for k, trial in enumerate(done) if trial.state == TrialState.COMPLETE}
    best = (min if question.is_time else max)(scores, key=scores.__getitem__)
    return best, scores[best]


def open_trials(question: Question, file: Path) -> optuna.Study:
    """The trials in ``file``, which is made if need be.  Raises TuneError if they are another question's."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    identity = question.identity()
    try:
        study = _open(question, file)
        known = study.user_attrs.get("question")
        if known is None and not study.get_trials(deepcopy=False):
            study.set_user_attr("question", identity)
            known = identity
    except (sqlalchemy.exc.SQLAlchemyError, optuna.exceptions.OptunaError) as error:
        raise TuneError(f"{file}: cannot be used for trials (choose another --out): {error}") from None
    if known != identity:
        differs = [key for key in identity if (known or {}).get(key) != identity[key]]
        raise TuneError(f"{file}: holds trials with another {', '.join(differs)} (choose another --out)")
    for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        study.tell(trial.number, state=TrialState.FAIL)  # it was interrupted
    return study


def _open(question: Question, file: Path) -> optuna.Study:
    url = sqlalchemy.URL.create("sqlite", database=str(file)).render_as_string(hide_password=False)
    return optuna.create_study(
        storage=optuna.storages.RDBStorage(url),
        study_name=STUDY_NAME,
        direction="minimize" if question.is_time else "maximize",
        pruner=optuna.pruners.MedianPruner(n_startup_trials=10),
        load_if_exists=True,
    )


def tune(question: Question, trials: int, study: optuna.Study, executor: Executor, told: Told) -> None:
    """Make trials until ``trials`` are finished in all, those from before included."""
    space = _space(question)
    while len(done := finished(study)) < trials:
        if not done and not study.get_trials(deepcopy=False, states=(TrialState.WAITING,)):
            study.enqueue_trial(question.default)
        seed = int(np.random.SeedSequence((question.seed, len(done))).generate_state(1)[0])
        study.sampler = optuna.samplers.TPESampler(seed=seed)
        _fly(question, study, study.ask(space), executor)
        told(finished(study))


def _space(question: Question) -> dict[str, optuna.distributions.BaseDistribution]:
    return {p.name: optuna.distributions.FloatDistribution(*p.search) for p in question.searched if p.search}


def _fly(question: Question, study: optuna.Study, trial: optuna.Trial, executor: Executor) -> None:
    """Fly one trial part by part, and tell the study what it came to."""
    mission = question.with_setting(setting_of(study.trials[trial.number]))
    values = np.zeros(0)
    for number, part in enumerate(_parts(question.training)):
        if number:
            trial.report(question.score(values), number)
            if trial.should_prune():
                study.tell(trial, state=TrialState.PRUNED)
                return
        values = np.concatenate((values, fly(question, mission, part, executor)))
    study.tell(trial, question.score(values))


def _parts(seeds: range) -> list[range]:
    """The seeds in PARTS consecutive parts, or as many as there are seeds."""
    size = -(-len(seeds) // PARTS)
    return [seeds[k : k + size] for k in range(0, len(seeds), size)]


def fly(question: Question, mission: Mission, seeds: range, executor: Executor) -> Floats:
    """What each of the seeds' runs came to, in their order."""
    jobs = jobs_of(mission, question.algorithm, seeds, JOB_RUNS)
    return question.values(np.concatenate(run_jobs(jobs, executor)))
