"""Statistics of runs that may never get there, against values worked out by hand and against SciPy."""

import json
import math
from itertools import product
from statistics import stdev

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats

from swarmctl.study.statistics import FEW, compare, numbers, summarise, wilson

NEVER = math.inf
times = st.one_of(st.integers(0, 60).map(float), st.just(NEVER))


def test_a_summary_worked_out_by_hand() -> None:
    # Mean 4, deviations -2 0 2: variance 8/2, std 2; t(0.975, 2) = 4.30265; 4.30265 * 2 / sqrt 3 = 4.96827.
    got = summarise([2.0, 4.0, 6.0])
    assert (got.mean, got.std, got.median, got.missing) == (4.0, 2.0, 4.0, 0)
    assert got.ci95 == pytest.approx((-0.968275, 8.968275), abs=1e-5)


def test_the_mean_is_of_those_that_got_there_and_the_median_of_all() -> None:
    got = summarise([10.0, NEVER, 20.0, 30.0, NEVER])
    assert (got.mean, got.median, got.missing) == (20.0, 30.0, 2)


@pytest.mark.parametrize("values", [[5.0, NEVER], [5.0, NEVER, NEVER], [1.0, 2.0, NEVER, NEVER]])
def test_the_median_is_none_where_half_never_got_there(values: list[float]) -> None:
    assert summarise(values).median is None


def test_one_alone_has_no_spread_and_none_at_all_has_nothing() -> None:
    one, none, empty = summarise([7.0, NEVER]), summarise([NEVER, NEVER]), summarise([])
    assert (one.mean, one.std, one.ci95, one.missing) == (7.0, None, None, 1)
    assert (none.mean, none.std, none.median, none.ci95, none.missing) == (None, None, None, None, 2)
    assert (empty.mean, empty.median, empty.missing) == (None, None, 0)


def test_values_that_are_all_alike_have_an_interval_of_no_width() -> None:
    got = summarise([3.0, 3.0, 3.0])
    assert (got.std, got.ci95) == (0.0, (3.0, 3.0))


def test_what_is_not_a_number_is_missing_too() -> None:
    assert summarise([1.0, 3.0, math.nan]) == summarise([1.0, 3.0, NEVER])


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=30))
def test_a_summary_agrees_with_scipy(values: list[float]) -> None:
    got = summarise(values)
    low, high = np.array(stats.t.interval(0.95, len(values) - 1)) * stats.sem(values)
    wanted = (np.mean(values) + low, np.mean(values) + high)
    assert got.ci95 == pytest.approx(wanted, rel=1e-9, abs=1e-6)
    assert got.std == pytest.approx(stdev(values), rel=1e-9, abs=1e-9)


def test_a_comparison_worked_out_by_hand() -> None:
    # Differences -10 -20 -30 +5 never: ranks of the absolute values 2 3 4 1 5, the last (b never) for a as well.
    got = compare([10.0, 20.0, 30.0, 45.0, 70.0], [20.0, 40.0, 60.0, 40.0, NEVER])
    assert (got.earlier, got.tied, got.later, got.wins) == (4, 0, 1, 0.8)
    assert got.median_difference_s == -10.0 - 10.0
    # W+ = 1 of 15; of 32 signings two give at most 1 ({} and {1}), so p = 2 * 2 / 32.
    assert got.p == pytest.approx(4 / 32)


def test_never_is_later_than_ever_by_more_than_any_difference() -> None:
    # Differences never -1 -2 -1000 -3: ranks 5 1 2 4 3.  Ten of 32 signings give at most 5; at most 4, seven would.
    got = compare([NEVER, 1.0, 2.0, 3.0, 4.0], [1999.0, 2.0, 4.0, 1003.0, 7.0])
    assert (got.earlier, got.later) == (4, 1)
    assert got.p == pytest.approx(2 * 10 / 32)


def test_two_that_never_got_there_are_half_a_win_each() -> None:
    got = compare([NEVER, 1.0], [NEVER, 2.0])
    assert (got.tied, got.wins) == (1, 0.75)
    assert got.median_difference_s == -0.5


def test_all_ties_show_nothing() -> None:
    got = compare([NEVER, 4.0, 4.0], [NEVER, 4.0, 4.0])
    assert (got.wins, got.median_difference_s, got.p, got.tied) == (0.5, 0.0, 1.0, 3)


@pytest.mark.parametrize(("a", "b", "wins"), [(1.0, 2.0, 1.0), (NEVER, 2.0, 0.0), (2.0, 2.0, 0.5)])
def test_a_single_pair_shows_nothing_either(a: float, b: float, wins: float) -> None:
    got = compare([a], [b])
    assert (got.wins, got.p) == (wins, 1.0)


def test_an_infinite_median_difference_is_none() -> None:
    assert compare([1.0, 2.0, 3.0], [NEVER, NEVER, 9.0]).median_difference_s is None
    assert compare([1.0, NEVER], [NEVER, 1.0]).median_difference_s is None


@pytest.mark.parametrize(("a", "b"), [([], []), ([1.0], [1.0, 2.0])])
def test_runs_that_do_not_pair_are_refused(a: list[float], b: list[float]) -> None:
    with pytest.raises(ValueError, match="no pairs"):
        compare(a, b)


@settings(deadline=None)
@given(st.lists(st.tuples(times, times), min_size=1, max_size=40))
def test_the_other_way_round_is_the_mirror_image(pairs: list[tuple[float, float]]) -> None:
    a, b = (list(side) for side in zip(*pairs, strict=True))
    here, there = compare(a, b), compare(b, a)
    assert here.wins + there.wins == pytest.approx(1.0)
    assert (here.earlier, here.tied) == (there.later, there.tied)
    assert here.p == pytest.approx(there.p)
    assert here.wins_ci95[0] <= here.wins <= here.wins_ci95[1]
    if here.median_difference_s is not None and there.median_difference_s is not None:
        assert here.median_difference_s == -there.median_difference_s
    json.dumps([here.as_json(), there.as_json(), summarise(a).as_json()], allow_nan=False)


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 400), st.integers(0, 400)), min_size=14, max_size=60))
def test_where_all_get_there_the_p_is_scipy_s(pairs: list[tuple[int, int]]) -> None:
    a, b = (np.array(side, float) for side in zip(*pairs, strict=True))
    told = (a - b)[a != b]
    assume(len(told) > FEW)
    wanted = float(stats.wilcoxon(told).pvalue)
    assert compare(a, b).p == pytest.approx(wanted)


@given(st.lists(st.tuples(times, times), min_size=14, max_size=40))
def test_with_runs_that_never_got_there_the_p_is_scipy_s_of_a_time_beyond_all(
    pairs: list[tuple[float, float]],
) -> None:
    a, b = (np.array(side) for side in zip(*pairs, strict=True))
    neither = np.isinf(a) & np.isinf(b)
    told = np.clip(np.where(neither, 0.0, np.where(neither, 0.0, a) - np.where(neither, 0.0, b)), -1e9, 1e9)
    told = told[told != 0]
    assume(len(told) > FEW)
    assert compare(a, b).p == pytest.approx(float(stats.wilcoxon(told).pvalue))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(-9, 9).filter(bool), min_size=1, max_size=8))
def test_of_few_pairs_the_p_counts_all_signings(differences: list[int]) -> None:
    told = np.array(differences, float)
    ranks = stats.rankdata(np.abs(told))
    sums = np.array([np.dot(ranks, signs) for signs in product((0, 1), repeat=len(told))])
    seen = ranks[told > 0].sum()
    wanted = min(1.0, 2.0 * min(np.mean(sums <= seen), np.mean(sums >= seen)))
    assert compare(told, np.zeros(len(told))).p == pytest.approx(wanted)


@given(st.lists(st.integers(1, 50), min_size=2, max_size=13, unique=True), st.integers(0, 2**13))
def test_of_few_pairs_without_ties_the_p_is_scipy_s(sizes: list[int], signs: int) -> None:
    told = np.array([size if signs >> k & 1 else -size for k, size in enumerate(sizes)], float)
    wanted = float(stats.wilcoxon(told, method="exact").pvalue)
    assert compare(told, np.zeros(len(told))).p == pytest.approx(wanted)


@pytest.mark.parametrize(("won", "count"), [(0, 5), (5, 5), (930, 1000), (1, 3)])
def test_the_interval_of_wins_is_wilson_s(won: int, count: int) -> None:
    wanted = stats.binomtest(won, count).proportion_ci(method="wilson")
    assert wilson(won / count, count) == pytest.approx((wanted.low, wanted.high))


def test_numbers_for_json_have_none_for_never() -> None:
    assert numbers([1.0, NEVER, math.nan]) == [1.0, None, None]
