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
from optuna.study import StudyDirection
from optuna.trial import TrialState

from swarmctl.core import bind, planners
from swarmctl.core.arrays import Floats, Records
from swarmctl.core.planners.parameters import Parameter
from swarmctl.mission.dump import dump
from swarmctl.mission.model import Mission

from .errors import TuneError
from .execute import jobs_of, run_jobs
from .runs import LEVELS_PERCENT
from .study import chunk_of, threads_of

SEEDS_APART = 1_000_000
TRAINING_FROM = 10**12
"""Training seeds lie where neither a study's usual seeds nor a tuning's fresh ones do."""

PARTS = 4
"""A trial's runs are flown in so many parts; after each but the last it may be given up."""

DIGITS = 4
"""Significant digits of a proposed value: what is printed is then exactly what was flown."""

STARTING = 10
"""Trials at random before Optuna learns from them, and before any is given up."""

STUDY_NAME = "tune"

Setting = dict[str, float]
Told = Callable[["Trials"], None]
"""Called after each trial."""


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
        return {p.name: p.number(p.default) for p in self.searched}

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


class Trials:
    """The finished trials of a question: Optuna's, and in ``file`` as an Optuna study in SQLite.

    The file only ever holds whole trials.  Raises TuneError if it cannot be used, or holds another question's.
    """

    def __init__(self, question: Question, file: Path) -> None:
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self.question = question
        direction = StudyDirection.MINIMIZE if question.is_time else StudyDirection.MAXIMIZE
        identity = question.identity()
        try:
            self._kept = optuna.create_study(
                storage=_url(file), study_name=STUDY_NAME, direction=direction, load_if_exists=True
            )
            before = self._kept.get_trials()
            if not before:
                self._kept.set_user_attr("question", identity)
            known = self._kept.user_attrs.get("question", {})
        except (sqlalchemy.exc.SQLAlchemyError, optuna.exceptions.OptunaError) as error:
            raise TuneError(f"{file}: cannot be used for trials (choose another --out): {error}") from None
        differs = [key for key in identity if known.get(key) != identity[key]]
        if differs:
            raise TuneError(f"{file}: holds trials with another {', '.join(differs)} (choose another --out)")
        self._study = optuna.create_study(direction=direction, pruner=optuna.pruners.MedianPruner(STARTING))
        self._study.add_trials(before)

    @property
    def done(self) -> list[optuna.trial.FrozenTrial]:
        """All finished trials, the default setting's first."""
        return self._study.get_trials(deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED))

    @property
    def given_up(self) -> int:
        """How many of them were not flown to the end."""
        return sum(trial.state == TrialState.PRUNED for trial in self.done)

    @property
    def best(self) -> int:
        """Which of the trials flown to the end is the best, the first of equals."""
        whole = [trial.number for trial in self.done if trial.state == TrialState.COMPLETE]
        return (min if self.question.is_time else max)(whole, key=self.score)

    def score(self, number: int) -> float:
        """What a trial came to."""
        return float(self.done[number].value or 0.0)

    def setting(self, number: int) -> Setting:
        """What a trial flew with."""
        return _rounded(self.done[number].params)

    def propose(self) -> optuna.Trial:
        """The next trial, from what the finished ones came to and a seed of its own."""
        number = len(self.done)
        if number == 0:
            self._study.enqueue_trial(self.question.default)
        seed = int(np.random.SeedSequence((self.question.seed, number)).generate_state(1)[0])
        self._study.sampler = optuna.samplers.TPESampler(n_startup_trials=STARTING, seed=seed)
        return self._study.ask(_space(self.question))

    def finish(self, trial: optuna.Trial, score: float | None) -> None:
        """Keep a trial and its score; None: it was given up."""
        state = TrialState.PRUNED if score is None else TrialState.COMPLETE
        self._kept.add_trial(self._study.tell(trial, score, state))


def _url(file: Path) -> str:
    return sqlalchemy.URL.create("sqlite", database=str(file)).render_as_string(hide_password=False)


def _rounded(params: Mapping[str, float]) -> Setting:
    return {name: float(f"{value:.{DIGITS}g}") for name, value in params.items()}


def _space(question: Question) -> dict[str, optuna.distributions.BaseDistribution]:
    return {p.name: optuna.distributions.FloatDistribution(*p.search) for p in question.searched if p.search}


def tune(trials: Trials, wanted: int, executor: Executor, told: Told) -> None:
    """Make trials until ``wanted`` are finished in all, those from before included."""
    while len(trials.done) < wanted:
        trial = trials.propose()
        trials.finish(trial, _score(trials.question, trial, executor))
        told(trials)


def _score(question: Question, trial: optuna.Trial, executor: Executor) -> float | None:
    """Fly a trial part by part: its score, or None if it is given up."""
    mission = question.with_setting(_rounded(trial.params))
    values = np.zeros(0)
    for number, part in enumerate(_parts(question.training)):
        if number:
            trial.report(question.score(values), number)
            if trial.should_prune():
                return None
        values = np.concatenate((values, fly(question, mission, part, executor)))
    return question.score(values)


def _parts(seeds: range) -> list[range]:
    """The seeds in PARTS consecutive parts, or as many as there are seeds."""
    size = -(-len(seeds) // PARTS)
    return [seeds[k : k + size] for k in range(0, len(seeds), size)]


def fly(question: Question, mission: Mission, seeds: range, executor: Executor) -> Floats:
    """What each of the seeds' runs came to, in their order."""
    chunk = chunk_of(mission, len(seeds), threads_of(executor))
    jobs = jobs_of(mission, question.algorithm, seeds, chunk)
    return question.values(np.concatenate(run_jobs(jobs, executor)))
