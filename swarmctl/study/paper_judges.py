"""The judges: each puts one kind of claim to every reading of it and returns the cases.

A judge's docstring is its rule, which the page prints beside each claim that it judges.  Times in which a run never
got there count as later than all others in comparisons, and as the search's end in means of differences.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from swarmctl.core.arrays import Floats

from .paper_rules import (
    Case,
    Verdict,
    beyond,
    bracket,
    capped,
    earlier,
    every,
    mirrored,
    share_interval,
    spread_ratio,
    told_mean,
    told_time,
    within,
)
from .paper_runs import Contest, Evidence
from .paper_variants import (
    EXTREME,
    LEVELS_PRINTED,
    SPACINGS_M,
    STEPS,
    Variant,
    Weights,
    ace,
    duration_s,
    extreme,
    fco,
    mdc,
    readings,
    weighted,
)
from .statistics import compare, summarise

OURS = {"terms": "unit", "φ": "0.05"}
WHOLE_SHARE = 0.95
"""Of the clusters visited, found whole: what "all" is judged by."""

MEASURES = {"over all steps": "in_range", "over steps with any": "in_range_when_any"}
"""How "targets within detection range" may have been averaged: the field of RUN."""

SHARE = "final_fraction"
Names = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Pairing:
    """Two variants in one reading; ``a`` is the one that the claim favours."""

    reading: Mapping[str, str]
    a: Variant
    b: Variant

    @property
    def ours(self) -> bool:
        """Whether this is the reading that the program flies by itself."""
        return all(OURS.get(name, value) == value for name, value in self.reading.items())


def read_as(terms: str, random: float) -> dict[str, str]:
    """A reading of the velocity rules, named."""
    return {"terms": terms, "φ": f"{random:g}"}


def is_earlier(evidence: Evidence, pairings: Sequence[Pairing], names: Names) -> list[Case]:
    """At every level the first is before the second: in more than half of the pairs, by the interval of that share
    and by Wilcoxon's signed-rank test (p < 0.05)."""
    cases = []
    for pairing in pairings:
        verdicts, lines = [], []
        for percent in LEVELS_PRINTED:
            a, b = _times(evidence, pairing, percent)
            verdicts.append(earlier(a, b))
            lines.append(f"{percent} %: {verdicts[-1].value}. {_faced(a, b, names)}")
        cases.append(Case(pairing.reading, every(verdicts), tuple(lines), pairing.ours))
    return cases


def is_earlier_at(evidence: Evidence, pairings: Sequence[Pairing], names: Names) -> list[Case]:
    """The first is before the second in more than half of the pairs, by the interval of that share and by Wilcoxon's
    signed-rank test (p < 0.05); each share found is a reading of its own."""
    cases = []
    for pairing in pairings:
        for percent in LEVELS_PRINTED:
            a, b = _times(evidence, pairing, percent)
            reading = {**pairing.reading, "share found": f"{percent} %"}
            cases.append(Case(reading, earlier(a, b), (_faced(a, b, names),), pairing.ours and percent == 85))
    return cases


def _times(evidence: Evidence, pairing: Pairing, percent: int) -> tuple[Floats, Floats]:
    return _paired(evidence.times(pairing.a, percent), evidence.times(pairing.b, percent))


def _paired(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """As many of both as the fewer have: all begin at the same seed."""
    count = min(len(a), len(b))
    return a[:count], b[:count]


def _faced(a: Floats, b: Floats, names: Names) -> str:
    pair = compare(a, b)
    gap = told_mean(capped(a, duration_s()) - capped(b, duration_s()), 0, unit=" s")
    return (
        f"{names[0]} {told_time(a)}, {names[1]} {told_time(b)}; {names[0]} first in {100 * pair.wins:.1f} % of pairs"
        f"{bracket(pair.wins_ci95, 1, 100)}, p = {pair.p:.2g}; mean difference {gap}"
    )


def is_steadier(evidence: Evidence, pairings: Sequence[Pairing], names: Names) -> list[Case]:
    """At every level the ratio of the standard deviations lies below 1, by its bootstrap interval.  Never counts as
    the search's end, which narrows most the spread of whoever has more of it."""
    cases = []
    for pairing in pairings:
        verdicts, lines = [], []
        for percent in LEVELS_PRINTED:
            a, b = _times(evidence, pairing, percent)
            ratio = spread_ratio(capped(a, duration_s()), capped(b, duration_s()))
            verdicts.append(beyond(mirrored(ratio[1]), -1.0) if ratio else Verdict.OPEN)
            said = f"{ratio[0]:.2f}{bracket(ratio[1], 2)}" if ratio else "not defined"
            lines.append(
                f"{percent} %: {verdicts[-1].value}. {names[0]} {told_time(a)}, {names[1]} {told_time(b)}; ratio {said}"
            )
        cases.append(Case(pairing.reading, every(verdicts), tuple(lines), pairing.ours))
    return cases


def is_below(evidence: Evidence, pairings: Sequence[Pairing], percent: int, bar_s: float) -> list[Case]:
    """The mean time has its interval below the mark, never counting as the search's end."""
    cases = []
    for pairing in pairings:
        times = evidence.times(pairing.a, percent)
        whole = capped(times, duration_s())
        verdict = beyond(mirrored(summarise(whole).ci95), -bar_s)
        line = f"{percent} %: {told_time(times)}; with never as {duration_s():.0f} s {told_mean(whole, 0, unit=' s')}"
        cases.append(Case(pairing.reading, verdict, (line,), pairing.ours))
    return cases


def is_more(
    evidence: Evidence, pairings: Sequence[Pairing], names: Names, field: str, what: str
) -> list[Case]:
    """The first's figure less the second's, seed by seed, has the interval of its mean above 0."""
    cases = []
    for pairing in pairings:
        a, b = _paired(evidence.figure(pairing.a, field), evidence.figure(pairing.b, field))
        told = [told_mean(values, 2, *_unit(field)) for values in (a, b, a - b)]
        times = _times(evidence, pairing, 85)
        lines = (
            f"{what}: {names[0]} {told[0]}, {names[1]} {told[1]}; difference {told[2]}, {len(a)} pairs",
            f"85 %: {_faced(*times, names)}",
        )
        cases.append(Case(pairing.reading, beyond(summarise(a - b).ci95, 0.0), lines, pairing.ours))
    return cases


def _unit(field: str) -> tuple[float, str]:
    """Scale and unit that a field of RUN is told in."""
    return (100.0, " %") if field == SHARE else (1.0, "")


def are_alike(evidence: Evidence, pairings: Sequence[Pairing], names: Names, half: float) -> list[Case]:
    """The difference of the two averages has its interval within half of the last digit printed, either way."""
    cases = []
    for measure, field in MEASURES.items():
        for pairing in pairings:
            a, b = _paired(evidence.figure(pairing.a, field), evidence.figure(pairing.b, field))
            line = f"{names[0]} {told_mean(a, 2)}, {names[1]} {told_mean(b, 2)}; difference {told_mean(a - b, 2)}"
            verdict = within(summarise(a - b).ci95, -half, half)
            cases.append(Case({"average": measure, **pairing.reading}, verdict, (line,), pairing.ours))
    return cases


def both_are(
    evidence: Evidence, pairings: Sequence[Pairing], names: Names, value: float, half: float
) -> list[Case]:
    """Both averages have their interval within half of the last digit printed of the printed value."""
    cases = []
    for measure, field in MEASURES.items():
        for pairing in pairings:
            a, b = (evidence.figure(one, field) for one in (pairing.a, pairing.b))
            verdict = every(within(summarise(one).ci95, value - half, value + half) for one in (a, b))
            line = f"{names[0]} {told_mean(a, 2)}, {names[1]} {told_mean(b, 2)}"
            cases.append(Case({"average": measure, **pairing.reading}, verdict, (line,), pairing.ours))
    return cases


def wins_contest(
    evidence: Evidence, contest: Callable[[Evidence], Contest], field: str, what: str
) -> list[Case]:
    """On seeds that nothing else saw, the best of the claimed points beats the best of all others: the difference
    has its interval above 0.  Which points those are was told by the triangle's own seeds."""
    cases = []
    for (terms, random), points in contest(evidence).items():
        a, b = (evidence.fresh[weighted(point, terms, random)][field] for point in points)
        told = [told_mean(values, 2, *_unit(field)) for values in (a, b, a - b)]
        line = (
            f"{what}: claimed {named(points[0])} {told[0]}, best other {named(points[1])} {told[1]}; "
            f"difference {told[2]}, {len(a)} fresh pairs"
        )
        reading = read_as(terms, random)
        cases.append(Case(reading, beyond(summarise(a - b).ci95, 0.0), (line,), reading == OURS))
    return cases


def named(point: Weights) -> str:
    """A point of the triangle: (w, c_p, c_g)."""
    return f"({', '.join(f'{value / STEPS:g}' for value in point)})"


def rises_with_inertia(evidence: Evidence) -> list[Case]:
    """Over the whole triangle, the slope of the share found against w, seed by seed, has its interval above 0."""
    cases = []
    for terms, random in readings():
        shares = evidence.over_triangle(SHARE, terms, random)
        inertia = np.array([point[0] / STEPS for point in shares])
        runs = np.array(list(shares.values()))
        slopes = np.polynomial.polynomial.polyfit(inertia, runs, 1)[1]
        means = [f"{100 * runs[inertia == w].mean():.0f}" for w in np.unique(inertia)]
        lines = (
            f"from w = 0 to w = 1 the line rises by {told_mean(slopes, 1, 100, ' %')} of the targets, "
            f"{len(slopes)} runs a point",
            f"% found at w = 0, 0.1 … 1: {', '.join(means)}",
        )
        reading = read_as(terms, random)
        cases.append(Case(reading, beyond(summarise(slopes).ci95, 0.0), lines, reading == OURS))
    return cases


def all_gather(evidence: Evidence, vehicles: int) -> list[Case]:
    """In most runs (interval above a half) all vehicles have targets of one cluster in range when the search ends."""
    cases = []
    for name, weights in EXTREME.items():
        for jump_out, wait in ((True, "on"), (False, "off")):
            numbers = evidence.counted[extreme(weights, jump_out)]["gathered"]
            together = int((numbers == vehicles).sum())
            interval = share_interval(together, len(numbers))
            line = (
                f"all {vehicles} at one cluster in {together} of {len(numbers)} runs "
                f"({100 * together / len(numbers):.1f} %{bracket(interval, 1, 100)}); "
                f"the fullest cluster has {told_mean(numbers, 1)} of them"
            )
            ours = jump_out and weights[0] == 1.0
            cases.append(Case({"weights": name, "jump-out": wait}, beyond(interval, 0.5), (line,), ours))
    return cases


def covers_whole(evidence: Evidence) -> list[Case]:
    """Of the clusters visited, more than 95 % were seen to the last target by a single visit of one vehicle (the
    interval of the mean over runs)."""
    cases = []
    for spacing in SPACINGS_M:
        told = evidence.counted[ace(spacing)]
        seen = told[told["visited"] > 0]
        whole, complete = (seen[name] / seen["visited"] for name in ("whole", "complete"))
        lines = (
            f"one visit saw {told_mean(whole, 1, 100, ' %')} of the clusters whole, and on average "
            f"{told_mean(seen['best_share'], 1, 100, ' %')} of a cluster's targets; {len(told)} runs",
            f"all vehicles together had found {told_mean(complete, 1, 100, ' %')} of them whole in the end",
        )
        verdict = beyond(summarise(whole).ci95, WHOLE_SHARE)
        cases.append(Case({"lanes": f"{spacing:g} m apart"}, verdict, lines, spacing == 300.0))
    return cases


def covers_most(evidence: Evidence) -> list[Case]:
    """The best single visit of a cluster sees a larger share of its targets with ACE than with the other, on the
    same layouts: the difference has its interval above 0."""
    cases = []
    for spacing in SPACINGS_M:
        for name, rival in (("MDC", mdc()), ("FCO", fco())):
            a, b = (evidence.counted[one]["best_share"] for one in (ace(spacing), rival))
            told = [told_mean(values, 1, 100, " %") for values in (a, b, a - b)]
            line = f"share seen: ACE {told[0]}, {name} {told[1]}; difference {told[2]}, {len(a)} pairs"
            reading = {"lanes": f"{spacing:g} m apart", "compared with": name}
            cases.append(Case(reading, beyond(summarise(a - b).ci95, 0.0), (line,), spacing == 300.0))
    return cases
