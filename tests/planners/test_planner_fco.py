"""FCO: each mechanism in a situation where it decides."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from ..core.worlds import Box
from .situation import Situation, along, bearing, near

HERE = (0.0, 0.0)
FURTHER, NEARER = (100.0, 150.0), (80.0, -100.0)  # 180 m and 128 m from HERE
OUT_OF_SIGHT = (5000.0, 5000.0)


def test_inertia_keeps_the_heading_while_nothing_was_seen() -> None:
    s = Situation("fco", [HERE], [33.0], random=0.5).fly(300)
    assert s.heading() == near(33.0)
    assert s.speed() == pytest.approx(25.0)


def test_aims_at_the_furthest_new_target() -> None:
    s = Situation("fco", [HERE], [0.0], [NEARER, FURTHER]).plan()
    assert s.heading() == near(along((0.4, 0.0), (0.4, bearing(HERE, FURTHER))))


def test_a_known_target_does_not_pull_though_it_is_the_furthest() -> None:
    s = Situation("fco", [(0.0, 40.0)], [0.0], [NEARER, FURTHER]).plan()
    assert s.known() == [0, 1]
    s = Situation("fco", [(0.0, 120.0)], [0.0], [NEARER, FURTHER]).plan()
    assert len(s.known()) == 1  # the other is out of sight
    s.put(0, HERE, 0.0).plan()
    assert s.heading() == near(along((0.4, 0.0), (0.4, bearing(HERE, NEARER))))


def test_nothing_new_flies_straight_on_over_known_targets() -> None:
    s = Situation("fco", [HERE], [0.0], [NEARER, FURTHER]).plan().put(0, HERE, -60.0).plan()
    assert s.world.knowledge["in_range"][0] == 2
    assert s.heading() == near(-60.0)


def test_what_a_neighbour_tells_counts_as_new_and_the_neighbour_pushes() -> None:
    target, neighbour = (500.0, 300.0), (500.0, 150.0)
    s = Situation("fco", [HERE, neighbour], [0.0, 0.0], [target]).plan()
    pull, push = bearing(HERE, target), bearing(neighbour, HERE)
    assert s.heading(0) == near(along((0.4, 0.0), (0.4, pull), (0.2, push)))
    assert s.known(0) == s.known(1) == [0]


def test_exclusion_when_the_neighbour_is_on_targets() -> None:
    neighbour = (500.0, 150.0)
    s = Situation("fco", [HERE, neighbour], [0.0, 0.0], [(500.0, 300.0)]).plan()
    s.put(0, HERE, 0.0).put(1, neighbour, 0.0).plan()  # nothing new any more
    assert s.heading(0) == near(along((0.4, 0.0), (0.2, bearing(neighbour, HERE))))
    assert s.heading(1) == near(along((0.4, 0.0), (0.2, bearing(HERE, neighbour))))


def test_no_exclusion_when_neither_is_on_targets() -> None:
    s = Situation("fco", [HERE, (300.0, 100.0)], [0.0, 10.0], [OUT_OF_SIGHT]).plan()
    assert (s.heading(0), s.heading(1)) == (near(0.0), near(10.0))


def test_no_exclusion_beyond_the_radio() -> None:
    s = Situation("fco", [HERE, (500.0, 400.0)], [0.0, 0.0], [(500.0, 450.0)]).plan()
    assert s.heading(0) == near(0.0)
    assert s.known(0) == []


def test_several_neighbours_push_together() -> None:
    spots = [HERE, (300.0, 100.0), (250.0, -200.0)]
    s = Situation("fco", spots, [0.0] * 3, [(-100.0, 0.0)]).plan()
    for i, spot in enumerate(spots):
        s.put(i, spot, 0.0)
    s.plan()
    away = [(0.2, bearing(other, HERE)) for other in spots[1:]]
    assert s.heading(0) == near(along((0.4, 0.0), *away))


@pytest.mark.parametrize("near_by", [0.3, 1.0])
def test_unit_terms_pull_alike_from_any_distance_metric_ones_in_proportion(near_by: float) -> None:
    target, neighbour = (100.0 * near_by, 150.0 * near_by), (-200.0 * near_by, 300.0 * near_by)
    pull, push = bearing(HERE, target), bearing(neighbour, HERE)
    unit, metric = (
        Situation("fco", [HERE, neighbour], [0.0, 0.0], [target], metric=m).plan().heading() for m in (0, 1)
    )
    assert unit == near(along((0.4, 0.0), (0.4, pull), (0.2, push)))
    to_target, to_neighbour = math.hypot(*target), math.hypot(*neighbour)
    assert metric == near(along((0.4 * 25.0, 0.0), (0.4 * to_target, pull), (0.2 * to_neighbour, push)))


AWAY = (3000.0, 1000.0)


def left(count: int = 1, keep_outs: Sequence[Box] = (), **values: Any) -> Situation:
    """Vehicles that saw NEARER and FURTHER at tick 0 and now fly on AWAY, eastwards, out of radio range."""
    s = Situation(
        "fco",
        [HERE] * count,
        [0.0] * count,
        [NEARER, FURTHER],
        keep_outs=keep_outs,
        radio_range=0.0,
        **values,
    ).plan()
    for i in range(count):
        s.put(i, AWAY, 0.0)
    return s


def test_revisit_200_s_after_the_last_new_target() -> None:
    s = left().plan(199)
    assert s.heading() == near(0.0)
    s.plan()
    assert s.heading() == near(bearing(AWAY, FURTHER), math.degrees(200.0 / math.dist(AWAY, FURTHER)))
    goal = s.remembers("goal_east"), s.remembers("goal_north")
    assert math.dist(goal, FURTHER) <= 200.0
    assert s.heading() == near(bearing(AWAY, goal))
    s.put(0, (0.0, 2000.0)).plan()
    assert s.heading() == near(bearing((0.0, 2000.0), goal))  # the same point all the way


def test_revisits_aim_evenly_within_200_m_of_the_last_aim() -> None:
    s = left(400).plan(200)
    off = np.column_stack((s.world.memory["goal_east"], s.world.memory["goal_north"])) - FURTHER
    distance = np.hypot(*off.T)
    assert distance.max() <= 200.0
    assert np.mean(distance**2) == pytest.approx(200.0**2 / 2.0, rel=0.1)  # even in the disc
    assert np.abs(off.mean(axis=0)).max() < 20.0


def test_a_revisit_ends_at_its_point_and_the_next_waits_200_s() -> None:
    s = left().plan(200)
    s.put(0, (s.remembers("goal_east") + 10.0, s.remembers("goal_north")), 45.0).plan()
    assert s.heading() == near(45.0)
    assert s.put(0, AWAY, 45.0).plan(199).heading() == near(45.0)
    assert s.plan().heading() != near(45.0, 10.0)


def test_a_revisit_is_given_up_for_a_new_target() -> None:
    s = left().plan(200)
    assert s.remembers("revisiting") == 1
    s.forget()  # so that there is something new
    s.put(0, HERE, 0.0).plan()
    assert s.remembers("revisiting") == 0
    assert s.heading() == near(along((0.4, 0.0), (0.4, bearing(HERE, FURTHER))))


def test_a_revisit_is_dropped_when_the_fence_blocks_it() -> None:
    s = left(keep_outs=[(AWAY[0] - 20.0, AWAY[0] - 10.0, AWAY[1] - 100.0, AWAY[1] + 100.0)]).plan(200)
    assert s.remembers("revisiting") == 0
    assert math.cos(math.radians(s.heading() - bearing(AWAY, FURTHER))) < 0.5  # and turned away
    s.put(0, (4000.0, 0.0), 90.0).plan(199)
    assert s.heading() == near(90.0)
    s.plan()
    assert s.remembers("revisiting") == 1


def test_without_anything_found_there_is_no_revisit() -> None:
    assert Situation("fco", [HERE], [77.0]).plan(450).heading() == near(77.0)


def test_what_was_told_is_revisited_too() -> None:
    target, neighbour = (500.0, 300.0), (500.0, 150.0)
    s = Situation("fco", [HERE, neighbour], [0.0, 0.0], [target]).plan()
    s.put(0, (-4000.0, 0.0), 180.0).put(1, (4000.0, 0.0), 0.0).plan(200)
    assert math.dist((s.remembers("goal_east"), s.remembers("goal_north")), target) <= 200.0
