"""Statistics of runs that may never get there.

A time is infinite where a run never reached the level (NaN is taken the same way), and what is said of many runs
must not quietly leave those out:

- mean, standard deviation and the mean's interval can only be of the runs that got there, so ``missing`` always
  stands beside them: a mean of few lucky runs looks good;
- the median is of all runs, never being later than ever.  It is None where half of them or more never got there;
- a comparison pairs runs of one seed.  One that never got there is later than any that did, by more than any
  difference between two that did; two that never did are a tie, half a win each.

None stands for what is not defined, since JSON has neither NaN nor infinity.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from swarmctl.core.arrays import Floats

CONFIDENCE = 0.95
FEW = 13
"""Pairs up to which SciPy's test, where some differ by as much as others, takes up to a second each."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Summary:
    """What some values come to, in their own unit.

    ``mean``, ``std`` (of a sample: over n - 1) and ``ci95`` (Student's interval of the mean) are of the values that
    are finite, ``median`` is of all, and ``missing`` counts the others.
    """

    mean: float | None
    std: float | None
    median: float | None
    ci95: Interval | None
    missing: int

    def as_json(self) -> dict[str, object]:
        """As it stands in study.json."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Paired:
    """How the times of a compare with those of b, seed by seed.

    ``wins`` is the share of pairs in which a is earlier, a tie half a win, with Wilson's interval ``wins_ci95``;
    ``earlier``, ``tied`` and ``later`` count a's pairs.  ``median_difference_s`` is of a - b: negative where a is
    earlier, None where the median pair has one run that never got there.  ``p`` is that of Wilcoxon's signed-rank
    test, both sides.
    """

    wins: float
    wins_ci95: Interval
    median_difference_s: float | None
    p: float
    earlier: int
    tied: int
    later: int

    def as_json(self) -> dict[str, object]:
        """As it stands in study.json."""
        return asdict(self)


def summarise(values: ArrayLike) -> Summary:
    """The summary of values (n,), infinite or NaN where a run has none."""
    every = _never_as_infinity(values)
    there = every[np.isfinite(every)]
    missing = len(every) - len(there)
    median = _finite(np.median(every)) if len(every) else None
    if len(there) == 0:
        return Summary(None, None, median, None, missing)
    mean = float(there.mean())
    if len(there) == 1:
        return Summary(mean, None, median, None, missing)
    std = float(there.std(ddof=1))
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, len(there) - 1)) * std / len(there) ** 0.5
    return Summary(mean, std, median, (mean - half, mean + half), missing)


def compare(a: ArrayLike, b: ArrayLike) -> Paired:
    """Compare times a (n,) with b (n,), paired by place.  Raises ValueError for none, or not as many of each."""
    first, second = _never_as_infinity(a), _never_as_infinity(b)
    if len(first) != len(second) or len(first) == 0:
        raise ValueError(f"{len(first)} and {len(second)} runs are no pairs")
    differences = _differences(first, second)
    earlier, later = int((differences < 0).sum()), int((differences > 0).sum())
    tied = len(differences) - earlier - later
    wins = (earlier + 0.5 * tied) / len(differences)
    interval = wilson(wins, len(differences))
    with np.errstate(invalid="ignore"):  # the two in the middle may be infinite both ways
        median = _finite(np.median(differences))
    return Paired(wins, interval, median, _signed_rank(differences), earlier, tied, later)


def wilson(share: float, count: int) -> Interval:
    """Wilson's interval of a share seen in ``count`` trials: within 0 and 1, and sound where all or none won."""
    z = float(stats.norm.ppf(0.5 + CONFIDENCE / 2.0))
    middle = share + z * z / (2 * count)
    half = z * (share * (1 - share) / count + z * z / (4 * count * count)) ** 0.5
    whole = 1 + z * z / count
    # The share lies within by right; rounding alone would leave none of n outside.
    return min(share, (middle - half) / whole), max(share, (middle + half) / whole)


def numbers(values: ArrayLike) -> list[float | None]:
    """The values as JSON has them: None for those that are infinite or NaN."""
    return [_finite(value) for value in np.asarray(values, float)]


def shares(values: ArrayLike, quantiles: Sequence[float]) -> Floats:
    """Quantiles of values (runs, ...) over the runs: bands of curves."""
    found: Floats = np.quantile(np.asarray(values, float), quantiles, axis=0)
    return found


def _never_as_infinity(values: ArrayLike) -> Floats:
    every = np.asarray(values, float)
    return np.where(np.isnan(every), np.inf, every)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _differences(first: Floats, second: Floats) -> Floats:
    """First less second; infinite where one of them never got there, zero where neither did."""
    neither = np.isinf(first) & np.isinf(second)
    return np.subtract(first, second, out=np.zeros(len(first)), where=~neither)


def _signed_rank(differences: Floats) -> float:
    """The p of Wilcoxon's test; ties are left out as usual, and where nothing else is left nothing is shown: 1."""
    told = differences[differences != 0]
    if len(told) <= FEW:
        return _exact_signed_rank(told)
    known = np.abs(told[np.isfinite(told)])
    beyond = 1.0 + 2.0 * (known.max() if len(known) else 0.0)  # ranks above all that is known
    return float(stats.wilcoxon(np.clip(told, -beyond, beyond)).pvalue)


def _exact_signed_rank(told: Floats) -> float:
    """The same from all 2^n signings of few ranks, which SciPy goes through one by one where ranks are shared."""
    doubled = np.rint(2.0 * stats.rankdata(np.abs(told))).astype(np.int64)  # shared ranks may be halves
    ways = np.zeros(doubled.sum() + 1, np.int64)  # how many signings give each sum of the positive ranks
    ways[0] = 1
    for rank in doubled:
        ways[rank:] += ways[: len(ways) - rank].copy()
    positive = doubled[told > 0].sum()
    less = min(positive, doubled.sum() - positive)
    return min(1.0, 2.0 * float(ways[: less + 1].sum()) / 2.0 ** len(told))
