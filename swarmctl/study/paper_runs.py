"""The runs behind ``swarmctl paper``: who flies them, and where judges and figures find them.

Three kinds.  *Common* runs start at the first seed, for every variant.  *Counted* runs are flown step by step for
what RUN does not have (paper_census.py).  *Fresh* runs, on seeds that nothing else saw, compare points of the
parameter triangle that were chosen for being good on the common ones: a winner among 66 is partly lucky, and only
new layouts tell by how much.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor

import numpy as np

from swarmctl.core.arrays import Floats, Records

from .execute import Done, Simulate, jobs_of, run_jobs
from .paper_census import census
from .paper_variants import Variant, Weights, counted, readings, triangle, wanted, weighted
from .runs import LEVELS_PERCENT, simulate

Batch = tuple[Variant, range]
Contest = dict[tuple[str, float], tuple[Weights, Weights]]
"""For each reading: the point that is claimed to be best, and its strongest rival."""


def fly(batches: Sequence[Batch], executor: Executor, done: Done, run: Simulate = simulate) -> list[Records]:
    """Every batch's records, in the seeds' order; all jobs are given to the executor at once."""
    cut = [jobs_of(flown.mission(), flown.algorithm, seeds) for flown, seeds in batches]
    told = iter(run_jobs([job for jobs in cut for job in jobs], executor, done, run))
    return [np.concatenate([next(told) for _ in jobs]) for jobs in cut]


class Evidence:
    """What the paper's claims are judged by.

    ``runs`` (an algorithm's in the tables) start at seed ``first``.  ``optimum`` and ``region`` hold, by reading, the
    claimed point of the triangle and its rival, for Fig. 14 and for Fig. 15.
    """

    def __init__(self, first: int, runs: int) -> None:
        self.first, self.runs = first, runs
        self.common: dict[Variant, Records] = {}
        self.counted: dict[Variant, Records] = {}
        self.fresh: dict[Variant, Records] = {}
        self.optimum: Contest = {}
        self.region: Contest = {}

    @property
    def flown(self) -> int:
        """How many runs there were in all."""
        kinds: tuple[Mapping[Variant, Records], ...] = (self.common, self.counted, self.fresh)
        return sum(len(records) for kind in kinds for records in kind.values())

    @property
    def fresh_seeds(self) -> range:
        """Seeds that no common run has."""
        return range(self.first + self.runs, self.first + self.runs + max(2, self.runs // 2))

    def times(self, flown: Variant, percent: int) -> Floats:
        """Seconds to a level, infinite for never, in the seeds' order."""
        column: Floats = self.common[flown]["time_s"][:, LEVELS_PERCENT.index(percent)]
        return column

    def figure(self, flown: Variant, field: str) -> Floats:
        """A field of RUN, in the seeds' order."""
        column: Floats = self.common[flown][field]
        return column

    def over_triangle(self, field: str, terms: str, random: float) -> dict[Weights, Floats]:
        """A field of RUN at every point of the triangle, on the seeds that all points were flown on."""
        flown = {point: self.figure(weighted(point, terms, random), field) for point in triangle()}
        fewest = min(len(column) for column in flown.values())
        return {point: column[:fewest] for point, column in flown.items()}


def total(runs: int) -> int:
    """About how many runs a paper of ``runs`` takes: the contests' winners may coincide."""
    contests = 4 * len(list(readings())) * max(2, runs // 2)
    return sum(wanted(runs).values()) + sum(counted(runs).values()) + contests


def gather(evidence: Evidence, executor: Executor, done: Done) -> None:
    """Fly everything."""
    kinds: tuple[tuple[dict[Variant, Records], Simulate, dict[Variant, int]], ...] = (
        (evidence.common, simulate, wanted(evidence.runs)),
        (evidence.counted, census, counted(evidence.runs)),
    )
    for kind, run, numbers in kinds:
        batches = [(flown, range(evidence.first, evidence.first + n)) for flown, n in numbers.items()]
        kind.update(zip(numbers, fly(batches, executor, done, run), strict=True))
    for reading in readings():
        evidence.optimum[reading] = nominated(evidence, "final_fraction", reading, _is_optimum)
        evidence.region[reading] = nominated(evidence, "in_range", reading, in_region)
    again = dict.fromkeys(
        weighted(point, *reading)
        for contest in (evidence.optimum, evidence.region)
        for reading, points in contest.items()
        for point in points
    )
    batches = [(flown, evidence.fresh_seeds) for flown in again]
    evidence.fresh.update(zip(again, fly(batches, executor, done), strict=True))


OPTIMUM: Weights = (9, 1, 0)
"""Where Fig. 14 has its maximum."""


def _is_optimum(point: Weights) -> bool:
    return point == OPTIMUM


def in_region(point: Weights) -> bool:
    """Whether c_p and c_g both lie where Fig. 15 has its best."""
    return all(3 <= value <= 6 for value in point[1:])


def nominated(
    evidence: Evidence, field: str, reading: tuple[str, float], claimed: Callable[[Weights], bool]
) -> tuple[Weights, Weights]:
    """The best of the points that are claimed to be best, and the best of all others."""
    means = {point: float(values.mean()) for point, values in evidence.over_triangle(field, *reading).items()}
    first = max((point for point in means if claimed(point)), key=lambda point: means[point])
    rival = max((point for point in means if not claimed(point)), key=lambda point: means[point])
    return first, rival
