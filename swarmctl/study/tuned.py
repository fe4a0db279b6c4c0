"""What a tuning came to: the best setting against the default, on seeds that no trial has seen.

The best of many trials owes some of its lead to luck with the training seeds.  So both settings fly fresh seeds,
pair by pair, and the setting counts as better only if it is ahead there by more than chance would have it.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import optuna
import yaml
from optuna.trial import TrialState

from swarmctl.core.arrays import Floats
from swarmctl.mission.model import Planner
from swarmctl.mission.yaml_reader import Dumper

from .statistics import Paired, compare, summarise
from .tune import SEEDS_APART, TRAINING_FROM, Question, Setting, best_of, finished, fly, setting_of

FRESH_FROM = 2 * TRAINING_FROM
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Answer:
    """The best setting found and how it does on fresh seeds: ``default`` and ``best`` are values a run, (R,)."""

    question: Question
    setting: Setting
    trials: int
    given_up: int
    best_trial: int
    training_default: float
    training_best: float
    fresh: range
    default: Floats
    best: Floats

    @cached_property
    def paired(self) -> Paired:
        """How the setting compares with the default, seed by seed; ``earlier`` is better."""
        sign = 1.0 if self.question.is_time else -1.0
        return compare(sign * self.best, sign * self.default)

    @property
    def is_better(self) -> bool:
        """Whether the setting is ahead on fresh seeds in the mean and in the pairs, and not by chance."""
        gain = self.question.score(self.default) - self.question.score(self.best)
        ahead = gain > 0.0 if self.question.is_time else gain < 0.0
        return ahead and self.paired.wins > 0.5 and self.paired.p < SIGNIFICANT

    @property
    def verdict(self) -> str:
        """The answer in a sentence."""
        if self.best_trial == 0:
            return "no setting that was tried beats the default on the training seeds: keep the default"
        if self.is_better:
            return "the setting is better on fresh seeds too"
        return "the setting is NOT better on fresh seeds, its lead in training was luck: keep the default"

    def lines(self) -> list[str]:
        """What a person wants to know of it."""
        question = self.question
        counted = f"a run that never got there counts as {question.mission.duration_s:g} s"
        lines = [
            f"{question.algorithm} on {question.mission.name} by {question.metric}: {self.trials} trials "
            f"({self.given_up} given up early) of {question.runs} runs, seeds from {question.training.start}"
            + (f"; {counted}" if question.is_time else ""),
            f"training: default {self._score(self.training_default)}, best {self._score(self.training_best)} "
            f"(trial {self.best_trial})",
            f"fresh: {len(self.fresh)} runs, seeds from {self.fresh.start}: default {self._told(self.default)}",
        ]
        if self.best_trial:
            lines[-1] += f", best {self._told(self.best)}"
            lines.append(self._pairs())
        return [*lines, self.verdict]

    def _score(self, score: float) -> str:
        return f"{score:.1f} s" if self.question.is_time else f"{score:.4g}"

    def _told(self, values: Floats) -> str:
        never = int(np.isinf(values).sum())
        return self._score(self.question.score(values)) + (
            f" ({never} never)" if self.question.is_time else ""
        )

    def _pairs(self) -> str:
        low, high = (100.0 * share for share in self.paired.wins_ci95)
        wins = f"the best is ahead in {100.0 * self.paired.wins:.0f} % of pairs (95 %: {low:.0f} to {high:.0f} %)"
        return f"{wins}, p = {self.paired.p:.2g}"

    def mission_yaml(self) -> str:
        """The planner section of a mission that flies with the setting."""
        planner = self.question.with_setting(self.setting).planner
        own = {self.question.algorithm: planner.parameters[self.question.algorithm]}
        given = Planner(**{**planner.model_dump(), "parameters": own}).model_dump(exclude_defaults=True)
        section = {"algorithm": self.question.algorithm, **given}
        return yaml.dump(
            {"planner": section}, Dumper=Dumper, sort_keys=False, default_flow_style=None, width=110
        )

    def as_json(self) -> dict[str, object]:
        """As it stands in tune.json."""
        question = self.question
        return {
            "algorithm": question.algorithm,
            "metric": question.metric,
            "seed": question.seed,
            "trials": self.trials,
            "given_up": self.given_up,
            "parameters": self.setting,
            "better": self.is_better,
            "verdict": self.verdict,
            "training": {
                "runs": question.runs,
                "first_seed": question.training.start,
                "default": self.training_default,
                "best": self.training_best,
                "best_trial": self.best_trial,
            },
            "fresh": {
                "runs": len(self.fresh),
                "first_seed": self.fresh.start,
                "default": self._side(self.default),
                "best": self._side(self.best),
                "paired": self.paired.as_json(),
            },
            "yaml": self.mission_yaml(),
        }

    def _side(self, values: Floats) -> dict[str, object]:
        return {"score": self.question.score(values), **summarise(values).as_json()}


def fresh_seeds(question: Question, runs: int) -> range:
    """Seeds that no training of any tuning flies, nor a study unless it is told to."""
    first = FRESH_FROM + question.seed * SEEDS_APART
    return range(first, first + runs)


def answer(
    question: Question, study: optuna.Study, runs: int, executor: Executor, say: Callable[[str], None]
) -> Answer:
    """Fly the best of the finished trials, and the default, on ``runs`` fresh seeds."""
    done = finished(study)
    best, score = best_of(question, done)
    seeds = fresh_seeds(question, runs)
    say(f"flying the default and the best setting on {runs} fresh seeds")
    default_values = fly(question, question.with_setting(question.default), seeds, executor)
    setting = setting_of(done[best])
    values = default_values if best == 0 else fly(question, question.with_setting(setting), seeds, executor)
    return Answer(
        question, setting, len(done), sum(trial.state == TrialState.PRUNED for trial in done), best,
        float(done[0].value or 0.0), score, seeds, default_values, values,
    )  # fmt: skip
