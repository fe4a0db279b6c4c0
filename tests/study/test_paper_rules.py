"""Verdicts: on made-up figures every one of them is reached, and for the right reason."""

import numpy as np
import pytest

from swarmctl.study.paper_rules import (
    Case,
    Verdict,
    beyond,
    capped,
    earlier,
    every,
    judge,
    mirrored,
    share_interval,
    spread_ratio,
    told_mean,
    told_time,
    within,
)

HOLDS, FAILS, OPEN = Verdict.HOLDS, Verdict.FAILS, Verdict.OPEN


def case(verdict: Verdict, ours: bool = False, **reading: str) -> Case:
    return Case(reading, verdict, ("figures",), ours)


@pytest.mark.parametrize(
    ("interval", "verdict"),
    [((1.1, 2.0), HOLDS), ((0.2, 0.9), FAILS), ((0.9, 1.1), OPEN), ((1.0, 2.0), OPEN), (None, OPEN)],
)
def test_an_interval_is_beyond_a_mark_or_not_or_straddles_it(
    interval: tuple[float, float] | None, verdict: Verdict
) -> None:
    assert beyond(interval, 1.0) is verdict
    below = {HOLDS: FAILS, FAILS: HOLDS, OPEN: OPEN}[verdict]
    assert beyond(mirrored(interval), -1.0) is below


@pytest.mark.parametrize(
    ("interval", "verdict"),
    [((-0.4, 0.5), HOLDS), ((0.6, 0.9), FAILS), ((-2.0, -0.7), FAILS), ((0.3, 0.7), OPEN), (None, OPEN)],
)
def test_alike_is_within_both_marks(interval: tuple[float, float] | None, verdict: Verdict) -> None:
    assert within(interval, -0.5, 0.5) is verdict


def test_earlier_takes_never_as_latest() -> None:
    early, late = np.arange(100.0, 140.0), np.arange(200.0, 240.0)
    never = np.full(40, np.inf)
    assert earlier(early, late) is HOLDS
    assert earlier(late, early) is FAILS
    assert earlier(late, never) is HOLDS
    assert earlier(never, never) is OPEN
    assert earlier(early, early[::-1]) is OPEN


def test_earlier_wants_more_than_a_few_pairs() -> None:
    assert earlier([100.0, 110.0, 120.0], [200.0, 210.0, 220.0]) is OPEN


def test_earlier_wants_the_signed_ranks_to_agree() -> None:
    """Two of three pairs are won, by next to nothing; the third is lost by far."""
    one = np.full(60, 500.0)
    gain, loss = np.linspace(1, 2, 40), -np.linspace(400, 500, 20)
    assert earlier(one, one + np.concatenate((gain, loss))) is OPEN
    assert earlier(one, one + np.concatenate((400 * gain, loss / 400))) is HOLDS


def test_every_fails_with_one_and_is_open_with_one_that_is() -> None:
    assert every([HOLDS, HOLDS]) is HOLDS
    assert every([HOLDS, OPEN]) is OPEN
    assert every([HOLDS, OPEN, FAILS]) is FAILS


def test_a_claim_holds_where_it_does_in_every_reading() -> None:
    assert judge([case(HOLDS, terms="unit"), case(HOLDS, terms="metric")]).text == "holds"


def test_a_claim_does_not_hold_where_it_does_in_none() -> None:
    assert judge([case(FAILS, terms="unit"), case(OPEN, terms="metric")]).text == "does not hold"


def test_a_claim_that_no_reading_decides_cannot_be_told() -> None:
    assert judge([case(OPEN, terms="unit"), case(OPEN, terms="metric")]).text == "cannot be told"


@pytest.mark.parametrize(
    ("holding", "words"),
    [
        ({"unit 1"}, "holds only if terms unit and φ 1"),
        ({"unit 1", "unit 2", "unit 3"}, "holds only if terms unit"),
        ({"unit 1", "unit 2"}, "holds only if terms unit and φ 1 or 2"),
        ({"unit 3", "metric 3"}, "holds only if φ 3"),
        (
            {"unit 1", "metric 1", "metric 2"},
            "holds only if terms unit and φ 1; or terms metric and φ 1 or 2",
        ),
        (
            {"unit 1", "unit 2", "unit 3", "metric 2"},
            "holds only if terms unit; or terms metric and φ 2",
        ),
    ],
)
def test_a_condition_names_just_the_readings_that_hold(holding: set[str], words: str) -> None:
    cases = [
        case(HOLDS if f"{terms} {size}" in holding else FAILS, terms=terms, φ=size)
        for terms in ("unit", "metric")
        for size in ("1", "2", "3")
    ]
    assert judge(cases).text == words


def test_our_own_reading_is_shown_first() -> None:
    cases = (case(FAILS, terms="metric"), case(HOLDS, ours=True, terms="unit"))
    assert judge(cases).main is cases[1]
    assert judge(cases[:1]).main is cases[0]


def test_a_ratio_of_spreads_has_an_interval_about_it() -> None:
    draws = np.random.default_rng(7)
    wide, narrow = draws.normal(500, 100, 400), draws.normal(500, 50, 400)
    told = spread_ratio(narrow, wide)
    assert told is not None
    ratio, (low, high) = told
    assert low < ratio < high < 0.65
    assert low > 0.4
    assert spread_ratio(narrow, wide) == told
    assert spread_ratio(narrow, np.full(400, 5.0)) is None
    assert spread_ratio(narrow[:2], wide[:2]) is None


def test_an_interval_of_a_share_is_wilsons() -> None:
    low, high = share_interval(0, 100)
    assert low == 0
    assert high == pytest.approx(0.0370, abs=1e-4)


def test_never_is_counted_in_words_and_as_the_end_in_figures() -> None:
    times = np.array([100.0, 200.0, np.inf])
    assert told_time(times) == "150 ± 71 s [-485, 785] (1 of 3 never)"
    assert told_time(np.full(2, np.inf)) == "2 of 2 never"
    assert capped(times, 1600.0).tolist() == [100.0, 200.0, 1600.0]
    assert told_mean(np.array([0.5, 0.5]), 1, 100, " %") == "50.0 % [50.0, 50.0]"
