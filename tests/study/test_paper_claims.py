"""Judges put to made-up runs: each verdict is reached, and what was never reached is counted and told."""

from typing import Any

import numpy as np
import pytest

from swarmctl.core.arrays import Floats, Records
from swarmctl.study import paper_judges as judges
from swarmctl.study.paper_census import CENSUS
from swarmctl.study.paper_claims import CLAIMS, Claim
from swarmctl.study.paper_judges import SHARE, Pairing
from swarmctl.study.paper_rules import Verdict
from swarmctl.study.paper_runs import OPTIMUM, Evidence, in_region, nominated
from swarmctl.study.paper_variants import (
    EXTREME,
    SPACINGS_M,
    STEPS,
    ace,
    counted,
    extreme,
    fco,
    mdc,
    readings,
    triangle,
    variant,
    wanted,
    weighted,
)
from swarmctl.study.runs import RUN

HOLDS, FAILS, OPEN = Verdict.HOLDS, Verdict.FAILS, Verdict.OPEN
ONE, OTHER = variant("bounce"), variant("sweep")
PAIRING = Pairing({"terms": "unit"}, ONE, OTHER)
NAMES = ("one", "other")
COUNT = 60


def noise(seed: int, spread: float = 1.0) -> Floats:
    return np.random.default_rng(seed).normal(0.0, spread, COUNT)


def runs_of(times: Floats, **fields: Any) -> Records:
    """RUN records whose times to all levels are the same."""
    runs = np.zeros(len(times), RUN)
    runs["time_s"] = times[:, None]
    for name, values in fields.items():
        runs[name] = values
    return runs


def evidence_of(one: Records, other: Records) -> Evidence:
    evidence = Evidence(1, len(one))
    evidence.common = {ONE: one, OTHER: other}
    return evidence


@pytest.mark.parametrize(("lead", "verdict"), [(50.0, HOLDS), (-50.0, FAILS), (0.0, OPEN)])
def test_who_is_earlier(lead: float, verdict: Verdict) -> None:
    one, other = 500 + noise(1, 20), 500 + lead + noise(2, 20)
    (case,) = judges.is_earlier(evidence_of(runs_of(one), runs_of(other)), [PAIRING], NAMES)
    assert case.verdict is verdict
    assert len(case.evidence) == 4
    assert all("of 60 never" in line and "% of pairs" in line for line in case.evidence)


def test_one_level_is_enough_to_fail() -> None:
    one, other = runs_of(500 + noise(1, 20)), runs_of(550 + noise(2, 20))
    one["time_s"][:, 3] = np.inf
    (case,) = judges.is_earlier(evidence_of(one, other), [PAIRING], NAMES)
    assert case.verdict is FAILS
    assert "60 of 60 never" in case.evidence[3]


def test_each_level_may_be_a_reading_of_its_own() -> None:
    one, other = runs_of(500 + noise(1, 20)), runs_of(550 + noise(2, 20))
    one["time_s"][:, 0] += 200
    cases = judges.is_earlier_at(evidence_of(one, other), [PAIRING], NAMES)
    assert [(case.reading["share found"], case.verdict) for case in cases] == [
        ("25 %", FAILS),
        ("50 %", HOLDS),
        ("75 %", HOLDS),
        ("85 %", HOLDS),
    ]
    assert [case.ours for case in cases] == [False, False, False, True]


@pytest.mark.parametrize(("spread", "verdict"), [(100.0, HOLDS), (20.0, FAILS), (50.0, OPEN)])
def test_who_is_steadier(spread: float, verdict: Verdict) -> None:
    one, other = 500 + noise(1, 50), 500 + noise(2, spread)
    (case,) = judges.is_steadier(evidence_of(runs_of(one), runs_of(other)), [PAIRING], NAMES)
    assert case.verdict is verdict


def test_never_as_the_end_makes_less_steady() -> None:
    steady, torn = 500 + noise(1, 50), 500 + noise(2, 20)
    torn[:10] = np.inf
    evidence = evidence_of(runs_of(steady), runs_of(torn))
    assert judges.is_steadier(evidence, [PAIRING], NAMES)[0].verdict is HOLDS
    swapped = Pairing(PAIRING.reading, OTHER, ONE)
    assert judges.is_steadier(evidence, [swapped], NAMES)[0].verdict is FAILS


@pytest.mark.parametrize(("mean", "never", "verdict"), [(700, 0, HOLDS), (1100, 0, FAILS), (700, 40, FAILS)])
def test_below_a_mark_never_counts_as_the_end(mean: float, never: int, verdict: Verdict) -> None:
    times = mean + noise(1, 50)
    times[:never] = np.inf
    evidence = evidence_of(runs_of(times), runs_of(times))
    (case,) = judges.is_below(evidence, [PAIRING], 85, 1000.0)
    assert case.verdict is verdict
    assert f"{never} of 60 never" in case.evidence[0]


@pytest.mark.parametrize(("lead", "verdict"), [(0.1, HOLDS), (-0.1, FAILS), (0.0, OPEN)])
def test_who_has_more(lead: float, verdict: Verdict) -> None:
    one = runs_of(500 + noise(3, 9), final_fraction=0.8 + lead + noise(1, 0.02))
    other = runs_of(500 + noise(4, 9), final_fraction=0.8 + noise(2, 0.02))
    (case,) = judges.is_more(evidence_of(one, other), [PAIRING], NAMES, SHARE, "found")
    assert case.verdict is verdict


@pytest.mark.parametrize(("lead", "alike", "are_27"), [(0.1, HOLDS, HOLDS), (5.0, FAILS, FAILS)])
def test_averages_alike_and_as_printed(lead: float, alike: Verdict, are_27: Verdict) -> None:
    times = np.full(COUNT, 500.0)
    one = runs_of(times, in_range=27 + noise(1, 0.2), in_range_when_any=27 + noise(1, 0.2))
    other = runs_of(times, in_range=27 + lead + noise(2, 0.2), in_range_when_any=27 + lead + noise(2, 0.2))
    evidence = evidence_of(one, other)
    assert [case.verdict for case in judges.are_alike(evidence, [PAIRING], NAMES, 0.5)] == [alike] * 2
    assert [case.verdict for case in judges.both_are(evidence, [PAIRING], NAMES, 27, 0.5)] == [are_27] * 2


def test_a_level_apart_says_which_average_is_meant() -> None:
    one = runs_of(np.full(COUNT, 500.0), in_range=9 + noise(1), in_range_when_any=27 + noise(1, 0.2))
    cases = judges.both_are(evidence_of(one, one), [PAIRING], NAMES, 27, 0.5)
    assert [(case.reading["average"], case.verdict) for case in cases] == [
        ("over all steps", FAILS),
        ("over steps with any", HOLDS),
    ]


def triangles(best: tuple[int, int, int], field: str) -> Evidence:
    """Evidence in which one point of every triangle is the best, by far."""
    evidence = Evidence(1, COUNT)
    for terms, random in readings():
        for k, point in enumerate(triangle()):
            values = (0.9 if point == best else 0.5) + noise(k, 0.01)
            evidence.common[weighted(point, terms, random)] = runs_of(
                np.full(COUNT, 500.0), **{field: values}
            )
    return evidence


@pytest.mark.parametrize(("best", "verdict"), [(OPTIMUM, HOLDS), ((5, 3, 2), FAILS)])
def test_a_claimed_point_meets_its_strongest_rival_on_fresh_seeds(
    best: tuple[int, int, int], verdict: Verdict
) -> None:
    evidence = triangles(best, SHARE)
    for reading in readings():
        points = nominated(evidence, SHARE, reading, lambda point: point == OPTIMUM)
        assert points[0] == OPTIMUM
        assert (points[1] == best) == (verdict is FAILS)
        evidence.optimum[reading] = points
        for point in points:
            evidence.fresh[weighted(point, *reading)] = evidence.common[weighted(point, *reading)]
    cases = judges.wins_contest(evidence, lambda told: told.optimum, SHARE, "found")
    assert {case.verdict for case in cases} == {verdict}
    assert sum(case.ours for case in cases) == 1


def test_the_region_is_that_of_the_paper() -> None:
    region = [point for point in triangle() if in_region(point)]
    assert (4, 3, 3) in region
    assert (0, 4, 6) in region
    assert (1, 2, 7) not in region
    assert (5, 3, 2) not in region


@pytest.mark.parametrize(("slope", "verdict"), [(0.2, HOLDS), (-0.2, FAILS), (0.0, OPEN)])
def test_inertia_is_a_slope_over_the_triangle(slope: float, verdict: Verdict) -> None:
    evidence = Evidence(1, COUNT)
    own = slope + np.tile([0.1, -0.1], COUNT // 2)  # each run's own slope
    for terms, random in readings():
        for point in triangle():
            flown = runs_of(np.full(COUNT, 500.0), final_fraction=0.5 + own * point[0] / STEPS)
            evidence.common[weighted(point, terms, random)] = flown
    cases = judges.rises_with_inertia(evidence)
    assert len(cases) == 10
    assert {case.verdict for case in cases} == {verdict}
    assert f"rises by {100 * slope:.1f} %" in cases[0].evidence[0]


def censuses(**fields: Any) -> Records:
    told = np.zeros(COUNT, CENSUS)
    told["visited"] = 6
    for name, values in fields.items():
        told[name] = values
    return told


def test_all_gather_where_most_runs_end_with_six_at_one_cluster() -> None:
    evidence = Evidence(1, COUNT)
    for name, weights in EXTREME.items():
        for jump_out in (True, False):
            together = name.startswith("w = 0") and not jump_out
            evidence.counted[extreme(weights, jump_out)] = censuses(gathered=6 if together else 5)
    cases = judges.all_gather(evidence, 6)
    held = [case.reading for case in cases if case.verdict is HOLDS]
    assert [(reading["weights"][:5], reading["jump-out"]) for reading in held] == [("w = 0", "off")]
    assert sum(case.ours for case in cases) == 1


@pytest.mark.parametrize(("whole", "verdict"), [(6, HOLDS), (5, FAILS)])
def test_coverage_is_complete_where_a_visit_sees_clusters_whole(whole: int, verdict: Verdict) -> None:
    evidence = Evidence(1, COUNT)
    for spacing in SPACINGS_M:
        evidence.counted[ace(spacing)] = censuses(whole=whole, complete=6, best_share=0.9)
    for other, share in ((mdc(), 0.8), (fco(), 0.95)):
        evidence.counted[other] = censuses(whole=1, complete=6, best_share=share)
    assert {case.verdict for case in judges.covers_whole(evidence)} == {verdict}
    told = {case.reading["compared with"]: case.verdict for case in judges.covers_most(evidence)}
    assert told == {"MDC": HOLDS, "FCO": FAILS}


def test_everything_that_a_claim_asks_for_is_flown() -> None:
    """Every claim can be judged from just the runs that are planned, whatever they come to."""
    evidence = Evidence(1, 40)
    for seed, (flown, count) in enumerate(wanted(40).items()):
        draws = np.random.default_rng(seed)
        evidence.common[flown] = runs_of(
            draws.uniform(100, 1500, count), final_fraction=draws.uniform(0, 1, count)
        )
    for flown, count in counted(40).items():
        evidence.counted[flown] = censuses(gathered=3, whole=4, best_share=0.9)[:count]
    for reading in readings():
        for contest in (evidence.optimum, evidence.region):
            contest[reading] = (OPTIMUM, (4, 3, 3))
        for point in (OPTIMUM, (4, 3, 3)):
            evidence.fresh[weighted(point, *reading)] = evidence.common[weighted(point, *reading)][:2]
    for claim in CLAIMS:
        judgement = claim.judged(evidence)
        assert judgement.cases, claim.key
        assert all(case.evidence for case in judgement.cases), claim.key


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.key)
def test_a_claim_says_what_where_and_by_which_rule(claim: Claim) -> None:
    assert claim.statement.endswith(".")
    assert claim.place
    assert len(claim.rule) > 40
    assert sum(other.key == claim.key for other in CLAIMS) == 1
