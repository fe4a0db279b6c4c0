"""How a claim is judged: verdicts on single readings, and what they come to together.

The paper leaves much open (ALGORITHMS lists its contradictions), so a claim is put to every reading of it that was
flown.  Each :class:`Case` is one reading with its verdict: it *holds* or *does not hold* where a 95 % interval lies
all on one side of the mark, and *cannot be told* where it does not.  Together they come to "holds" (in every
reading), "holds only if ..." (the readings in which it does), "does not hold" or "cannot be told".  Nothing here
knows which claims there are, and no verdict is written down anywhere.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from swarmctl.core.arrays import Floats

from .statistics import Interval, compare, summarise, wilson

MEANINGFUL_P = 0.05
RESAMPLES = 2000


class Verdict(Enum):
    """What the runs say of a claim."""

    HOLDS = "holds"
    ONLY_IF = "holds only if"
    FAILS = "does not hold"
    OPEN = "cannot be told"


@dataclass(frozen=True, slots=True)
class Case:
    """A claim in one reading: ``reading`` names what was chosen; ``evidence`` are lines with the figures.

    ``ours`` marks the reading that this program flies unless told otherwise.
    """

    reading: Mapping[str, str]
    verdict: Verdict
    evidence: tuple[str, ...]
    ours: bool = True


@dataclass(frozen=True, slots=True)
class Judgement:
    """All readings of a claim together: the verdict, and the condition it is tied to (empty: none)."""

    verdict: Verdict
    condition: str
    cases: tuple[Case, ...]

    @property
    def text(self) -> str:
        """The verdict in words."""
        return f"{self.verdict.value} {self.condition}".rstrip()

    @property
    def main(self) -> Case:
        """The case whose figures are shown first: this program's own reading."""
        return next((case for case in self.cases if case.ours), self.cases[0])


def judge(cases: Iterable[Case]) -> Judgement:
    """What the cases come to together."""
    told = tuple(cases)
    verdicts = [case.verdict for case in told]
    if all(verdict is Verdict.HOLDS for verdict in verdicts):
        return Judgement(Verdict.HOLDS, "", told)
    if Verdict.HOLDS in verdicts:
        return Judgement(Verdict.ONLY_IF, condition(told), told)
    return Judgement(Verdict.FAILS if Verdict.FAILS in verdicts else Verdict.OPEN, "", told)


def condition(cases: Sequence[Case]) -> str:
    """In words, which of the readings hold: ``terms unit and φ 0.02 or 0.05``."""
    return _condition(cases, list(cases[0].reading)) or ""


def _condition(cases: Sequence[Case], names: Sequence[str]) -> str | None:
    """The same over the remaining ``names`` of readings: None where no case holds, empty where all do."""
    if not names:
        return "" if cases[0].verdict is Verdict.HOLDS else None
    by_value: dict[str, list[Case]] = {}
    for case in cases:
        by_value.setdefault(case.reading[names[0]], []).append(case)
    under: dict[str | None, list[str]] = {}
    for value, part in by_value.items():
        under.setdefault(_condition(part, names[1:]), []).append(value)
    if len(under) == 1:
        return next(iter(under))
    parts = [
        f"{names[0]} {either(values)}" + (f" and {rest}" if rest else "")
        for rest, values in under.items()
        if rest is not None
    ]
    return "; or ".join(parts)


def either(words: Sequence[str]) -> str:
    """``a``, ``a or b``, ``a, b or c``."""
    return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def every(verdicts: Iterable[Verdict]) -> Verdict:
    """Whether all of several things hold: one that does not is enough to fail."""
    told = list(verdicts)
    if Verdict.FAILS in told:
        return Verdict.FAILS
    return Verdict.OPEN if Verdict.OPEN in told else Verdict.HOLDS


def beyond(interval: Interval | None, mark: float) -> Verdict:
    """Whether an interval lies above the mark."""
    if interval is None or interval[0] <= mark <= interval[1]:
        return Verdict.OPEN
    return Verdict.HOLDS if interval[0] > mark else Verdict.FAILS


def mirrored(interval: Interval | None) -> Interval | None:
    """The interval of the negative: what lies below a mark lies, mirrored, above the mark's negative."""
    return None if interval is None else (-interval[1], -interval[0])


def within(interval: Interval | None, low: float, high: float) -> Verdict:
    """Whether what an interval holds lies between two marks."""
    if interval is None:
        return Verdict.OPEN
    if low <= interval[0] and interval[1] <= high:
        return Verdict.HOLDS
    return Verdict.FAILS if interval[1] < low or interval[0] > high else Verdict.OPEN


def earlier(a: ArrayLike, b: ArrayLike) -> Verdict:
    """Whether a is before b: in more than half of the pairs by Wilson's interval, and by the signed-rank test."""
    pair = compare(a, b)
    return beyond(pair.wins_ci95, 0.5) if pair.p < MEANINGFUL_P else Verdict.OPEN


def share_interval(count: int, of: int) -> Interval:
    """The interval of a share of runs."""
    return wilson(count / of, of)


def capped(times: Floats, duration_s: float) -> Floats:
    """Times in which never counts as the search's end: defined for every run."""
    return np.minimum(times, duration_s)


def spread_ratio(a: Floats, b: Floats) -> tuple[float, Interval] | None:
    """The standard deviation of a over that of b, and its bootstrap interval; a and b (n,) are paired and finite.

    Pairs are drawn again with the same draws every time, so that the same runs always get the same interval.  None
    where b hardly differs.
    """
    if len(a) < 3 or b.std() == 0:
        return None
    draws = np.random.default_rng(1).integers(0, len(a), (RESAMPLES, len(a)))
    spread = b[draws].std(axis=1)
    if not spread.all():
        return None
    low, high = np.quantile(a[draws].std(axis=1) / spread, (0.025, 0.975))
    return float(a.std() / b.std()), (float(low), float(high))


def told_time(times: Floats) -> str:
    """Mean and spread of those that got there, the mean's interval, and how many never did."""
    summary = summarise(times)
    never = f"{summary.missing} of {len(times)} never"
    if summary.mean is None:
        return never
    spread = "" if summary.std is None else f" ± {summary.std:.0f}"
    return f"{summary.mean:.0f}{spread} s{bracket(summary.ci95, 0)} ({never})"


def told_mean(values: Floats, digits: int = 1, scale: float = 1.0, unit: str = "") -> str:
    """A mean and its interval."""
    summary = summarise(scale * np.asarray(values, float))
    if summary.mean is None:
        return "none"
    return f"{_number(summary.mean, digits)}{unit}{bracket(summary.ci95, digits)}"


def bracket(interval: Interval | None, digits: int, scale: float = 1.0) -> str:
    """An interval behind its figure."""
    if interval is None:
        return ""
    return f" [{_number(scale * interval[0], digits)}, {_number(scale * interval[1], digits)}]"


def _number(value: float, digits: int) -> str:
    """Rounded, and no minus before a zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"
