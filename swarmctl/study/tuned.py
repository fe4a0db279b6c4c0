"""What a tuning came to: the best setting against the default, on seeds that no trial has seen.

The best of many trials owes some of its lead to luck with the training seeds.  So both settings fly fresh seeds,
pair by pair, and the setting counts as better only if it is ahead there by more than chance would have it.
"""

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import yaml

from swarmctl.core.arrays import Floats
from swarmctl.mission.model import Planner
from swarmctl.mission.yaml_reader import Dumper

from .statistics import Paired, compare, summarise
from .tune import SEEDS_APART, TRAINING_FROM, Question, Setting, Trials, fly

FRESH_FROM = 2 * TRAINING_FROM
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Answer:
    """The best setting found and how it does on fresh seeds: ``default`` and ``best`` are values a run, (R,)."""

    trials: Trials
    fresh: range
    default: Floats
    best: Floats

    @property
    def question(self) -> Question:
        """What was sought."""
        return self.trials.question

    @property
    def setting(self) -> Setting:
        """The best setting."""
        return self.trials.setting(self.trials.best)

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
        if self.trials.best == 0:
            return "no setting that was tried beats the default on the training seeds: keep the default"
        if self.is_better:
            return "the setting is better on fresh seeds too"
        return "the setting is NOT better on fresh seeds, or by no more than chance would have it: keep the default"

    def lines(self) -> list[str]:
        """What a person wants to know of it."""
        question, trials = self.question, self.trials
        counted = f"; a run that never got there counts as {question.mission.duration_s:g} s"
        default, best = self._score(trials.score(0)), self._score(trials.score(trials.best))
        lines = [
            f"{question.algorithm} on {question.mission.name} by {question.metric}: {len(trials.done)} trials "
            f"({trials.given_up} given up early) of {question.runs} runs, seeds from {question.training.start}"
            + (counted if question.is_time else ""),
            f"training: default {default}, best {best} (trial {trials.best})",
            f"fresh: {len(self.fresh)} runs, seeds from {self.fresh.start}: default {self._told(self.default)}",
        ]
        if self.trials.best:
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
            "trials": len(self.trials.done),
            "given_up": self.trials.given_up,
            "parameters": self.setting,
            "better": self.is_better,
            "verdict": self.verdict,
            "training": {
                "runs": question.runs,
                "first_seed": question.training.start,
                "default": self.trials.score(0),
                "best": self.trials.score(self.trials.best),
                "best_trial": self.trials.best,
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


def answer(trials: Trials, runs: int, executor: Executor) -> Answer:
    """Fly the best of the finished trials, and the default, on ``runs`` fresh seeds."""
    question, best = trials.question, trials.best
    seeds = fresh_seeds(question, runs)
    default = fly(question, question.with_setting(question.default), seeds, executor)
    tuned = question.with_setting(trials.setting(best))
    values = default if best == 0 else fly(question, tuned, seeds, executor)
    return Answer(trials, seeds, default, values)
