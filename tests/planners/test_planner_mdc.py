"""MDC, and DPSO-U which shares its rule: each mechanism in a situation where it decides."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from swarmctl.core import planners

from ..core.worlds import Box
from .situation import Situation, along, bearing, crowd, near

# Seen from (0, 0) there are four targets; from (0, 100) only the northern one.
HERE, ASIDE = (0.0, 0.0), (0.0, 100.0)
FOUR = [*crowd((190.0, 0.0), 3), (0.0, 190.0)]
ALGORITHMS = ("mdc", "dpso-u")


def after_best(algorithm: str = "mdc", **values: Any) -> Situation:
    """A vehicle that saw four targets at HERE and stands ASIDE, heading east."""
    return Situation(algorithm, [HERE], [0.0], FOUR, **values).plan().put(0, ASIDE, 0.0)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_inertia_keeps_the_heading_while_nothing_was_seen(algorithm: str) -> None:
    s = Situation(algorithm, [HERE], [33.0], [(1000.0, 1000.0)], random=0.5).fly(5)
    assert s.heading() == near(33.0)
    assert s.speed() == pytest.approx(25.0)
    assert s.place() == pytest.approx((125 * math.cos(math.radians(33)), 125 * math.sin(math.radians(33))))


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_personal_best_pulls_back_to_where_most_was_seen(algorithm: str) -> None:
    s = after_best(algorithm).plan()
    assert s.heading() == near(along((0.4, 0.0), (0.3, -90.0)))


def test_a_better_place_becomes_the_personal_best() -> None:
    targets = [*FOUR, *crowd((60.0, 280.0), 4)]
    s = Situation("mdc", [HERE], [0.0], targets).plan().put(0, ASIDE, 0.0).plan()  # five: better than four
    s.put(0, (0.0, 200.0), 0.0).plan()  # five again: no better
    assert s.heading() == near(along((0.4, 0.0), (0.3, -90.0)))
    assert s.remembers("best_north") == 100.0


def pair(
    theirs: tuple[float, float], their_best: tuple[float, float], count: int, ours: int = 1
) -> Situation:
    """Vehicle 0 at (0, 0) sees ``ours`` targets; vehicle 1 saw ``count`` at ``their_best``, now is at ``theirs``."""
    x, y = their_best
    targets = [*crowd((-100.0, 0.0), ours), *crowd((x + 150.0, y), count - 1), (x, y - 150.0)]
    s = Situation("mdc", [HERE, their_best], [0.0, 0.0], targets).plan()
    return s.put(0, HERE, 0.0).put(1, theirs, 0.0)


def test_global_best_is_the_neighbours_best_place_and_not_the_neighbour() -> None:
    s = pair(theirs=(300.0, 250.0), their_best=(300.0, 400.0), count=5).plan()
    assert s.world.knowledge["in_range"][1] == 1
    toward = bearing(HERE, (300.0, 400.0))
    assert s.heading(0) == near(along((0.4, 0.0), (0.3, toward)))  # standing on the own best: no pull to it


def test_the_own_best_is_the_global_best_when_it_is_better() -> None:
    s = pair(theirs=(300.0, 250.0), their_best=(300.0, 400.0), count=5, ours=8)
    s.put(0, (0.0, 90.0), 0.0)
    s.plan()
    assert s.heading(0) == near(along((0.4, 0.0), (0.6, -90.0)))


def test_a_neighbour_that_is_not_on_targets_does_not_pull() -> None:
    s = pair(theirs=(-300.0, 250.0), their_best=(300.0, 400.0), count=5).plan()
    assert s.world.knowledge["in_range"][1] == 0
    assert s.heading(0) == near(0.0)


def test_a_neighbour_beyond_the_radio_does_not_pull() -> None:
    s = pair(theirs=(480.0, 400.0), their_best=(300.0, 400.0), count=5).plan()
    assert s.world.knowledge["in_range"][1] > 0
    assert s.heading(0) == near(0.0)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_jump_out_after_15_s_without_a_better_place(algorithm: str) -> None:
    s = after_best(algorithm).plan(14).put(0, ASIDE, 0.0)
    assert s.remembers("leaving") == 0
    s.plan()
    assert s.remembers("leaving") == 1
    assert s.heading() == near(0.0)


def test_jump_out_flies_straight_on_until_nothing_is_in_range() -> None:
    line = [(25.0 * k, 20.0) for k in range(40)]  # a chain of targets: hardly ever a better place
    s = Situation("mdc", [HERE], [0.0], line).fly(15)
    while s.remembers("leaving") == 0:
        s.fly()
    heading = s.heading()
    while s.world.knowledge["in_range"][0] > 0:
        s.fly()
        assert s.heading() == near(heading)
    assert s.remembers("leaving") == 0
    assert s.fly(20).heading() == near(heading)


def test_after_a_jump_out_another_visit_can_begin() -> None:
    s = after_best().plan(15).put(0, (3000.0, 0.0), 0.0).plan()
    s.put(0, HERE, 0.0).plan().put(0, ASIDE, 0.0).plan()
    assert s.heading() == near(along((0.4, 0.0), (0.3, -90.0)))


def test_dwell_ends_a_visit_that_still_finds_better_places() -> None:
    growing = [(40.0 * k, 150.0) for k in range(12)]
    s = Situation("mdc", [(-100.0, 0.0)], [0.0], growing, dwell_s=3.0)
    for k in range(3):
        assert s.remembers("leaving") == 0
        s.put(0, (-100.0 + 40.0 * k, 0.0), 0.0).plan()
        assert s.remembers("best") == k + 1
    assert s.remembers("leaving") == 1


def visited_twice(keep_outs: Sequence[Box] = ()) -> Situation:
    """A vehicle that saw four targets at (0, 0), later one at (0, 3000), and is far from both, heading east."""
    s = Situation("mdc", [HERE], [0.0], [*FOUR, (0.0, 3100.0)], keep_outs=keep_outs)
    s.plan(17).put(0, (3000.0, 0.0)).plan()
    s.put(0, (0.0, 3000.0)).plan(17).put(0, (1000.0, 1000.0), 0.0).plan()
    return s


def test_return_visit_200_s_after_leaving_to_the_best_place_of_all() -> None:
    s = visited_twice()
    left = s.tick - 1
    s.plan(199)
    assert s.heading() == near(0.0)
    s.plan()
    assert s.tick - 1 - left == 200
    assert s.heading() == near(bearing((1000.0, 1000.0), HERE))
    s.put(0, (1000.0, 0.0)).plan()
    assert s.heading() == near(180.0)  # it keeps flying there, wherever it is


def test_a_return_visit_that_finds_nothing_any_more_ends_there() -> None:
    s = visited_twice().plan(200)
    s.world.fleet["sensor_range"] = 0.0
    s.put(0, (-20.0, 0.0), 45.0).plan()
    assert s.heading() == near(45.0)
    assert s.put(0, (1000.0, 1000.0), 45.0).plan(199).heading() == near(45.0)


def test_a_return_visit_is_dropped_when_the_fence_blocks_it() -> None:
    s = visited_twice([(950.0, 1050.0, 950.0, 990.0)]).plan(200)
    blocked = bearing((1000.0, 1000.0), HERE)
    assert s.remembers("returning") == 0
    assert s.heading() != near(blocked, 1.0)
    s.put(0, (1000.0, 1200.0), 90.0).plan(199)
    assert s.heading() == near(90.0)  # not tried again before another 200 s
    assert s.plan().heading() == near(bearing((1000.0, 1200.0), HERE))


def test_without_anything_found_there_is_no_return() -> None:
    assert Situation("mdc", [HERE], [77.0]).plan(450).heading() == near(77.0)


@pytest.mark.parametrize("away", [40.0, 100.0])
def test_unit_terms_pull_alike_from_any_distance_metric_ones_in_proportion(away: float) -> None:
    unit = Situation("mdc", [HERE], [0.0], FOUR, metric=0).plan().put(0, (0.0, away), 0.0).plan()
    metric = Situation("mdc", [HERE], [0.0], FOUR, metric=1).plan().put(0, (0.0, away), 0.0).plan()
    # At 40 m all four are still in range, which is no better than the four seen at (0, 0).
    assert unit.heading() == near(along((0.4, 0.0), (0.3, -90.0)))
    assert metric.heading() == near(along((0.4 * 25.0, 0.0), (0.3 * away, -90.0)))


@pytest.mark.parametrize("metric", [0, 1])
def test_the_random_vector_has_the_size_phi(metric: int) -> None:
    spots = [(1000.0 * k, 0.0) for k in range(18)]
    s = Situation("mdc", spots, [0.0] * len(spots), [(x, 50.0) for x, _ in spots], random=0.02, metric=metric)
    turns = []
    for _ in range(14):
        for i, spot in enumerate(spots):
            s.put(i, spot, 0.0)
        s.plan()
        turns += [math.radians(s.heading(i)) for i in range(len(spots))]
    assert np.mean(turns) == pytest.approx(0.0, abs=0.012)
    assert np.std(turns) == pytest.approx(0.02 / 0.4, rel=0.2)  # v' = 0.4 v + 0.02 randn, seen across


def test_dpso_u_has_no_randomness() -> None:
    default = planners.catalogue()["dpso-u"]["random"]
    assert default == 0.0

    def flown(algorithm: str, seed: int, random: float) -> tuple[float, float]:
        s = Situation(algorithm, [HERE], [0.0], FOUR, seed=seed, random=random).plan()
        return s.put(0, ASIDE, 0.0).fly(12).place()

    assert flown("dpso-u", 1, float(default)) == flown("dpso-u", 2, float(default))
    assert flown("dpso-u", 1, float(default)) != pytest.approx((300.0, 100.0), abs=10.0)  # not straight on
    assert flown("mdc", 1, 0.05) != flown("mdc", 2, 0.05)
