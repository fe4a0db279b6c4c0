"""ACE: each mechanism in a situation where it decides."""

import math
from typing import Any

import numpy as np
import pytest

from swarmctl.core.planners import ace

from .situation import Situation, crowd, near

HERE = (0.0, 0.0)
FAR = (0.0, 5000.0)


def mowing(heading: float = 90.0, **values: Any) -> Situation:
    """A vehicle at HERE that just began to mow: it sees two targets close by."""
    return Situation("ace", [HERE], [heading], crowd(HERE, 2), **values).plan()


def turned(before: float, after: float) -> float:
    """By how many degrees a heading turned left."""
    return (after - before + 180.0) % 360.0 - 180.0


def test_inertia_keeps_the_heading_while_nothing_was_seen() -> None:
    s = Situation("ace", [HERE], [33.0]).fly(50)
    assert s.heading() == near(33.0)
    assert s.speed() == pytest.approx(25.0)


def test_the_first_lane_is_perpendicular_to_the_heading_on_either_side() -> None:
    sides = {
        round(turned(33.0, Situation("ace", [HERE], [33.0], crowd(HERE, 2), seed=n).plan().heading()), 6)
        for n in range(12)
    }
    assert sides == {-90.0, 90.0}


def test_alpha_ends_a_lane_4_s_after_its_last_hit_and_shifts_along_the_old_heading() -> None:
    s = mowing()
    lane = s.heading()
    s.put(0, FAR).plan(3)
    assert s.heading() == near(lane)
    s.plan()
    assert s.heading() == near(90.0)


def test_a_hit_keeps_the_lane_going() -> None:
    s = mowing()
    lane = s.heading()
    s.put(0, FAR).plan(3).put(0, HERE).plan().put(0, FAR).plan(3)
    assert s.heading() == near(lane)
    assert s.plan().heading() == near(90.0)


@pytest.mark.parametrize(("spacing", "speed"), [(300.0, 25.0), (100.0, 10.0)])
def test_the_next_lane_runs_the_other_way_one_spacing_on(spacing: float, speed: float) -> None:
    s = mowing(spacing_m=spacing, speed=speed)
    lane = s.heading()
    s.put(0, FAR).plan(3).fly()
    while s.heading() == near(90.0):
        before = s.place()
        s.fly()
    assert turned(lane, s.heading()) == near(-180.0)
    assert before[1] - FAR[1] == pytest.approx(spacing)


def test_lanes_are_no_further_apart_than_each_vehicle_sees() -> None:
    there = (2000.0, 0.0)
    targets = [*crowd(HERE, 2), *crowd(there, 2)]
    s = Situation("ace", [HERE, there], [90.0, 90.0], targets, spacing_m=300.0)
    s.world.fleet["sensor_range"] = [100.0, 200.0]
    s.plan().put(0, FAR).put(1, (2000.0, 5000.0)).plan(4)
    assert [s.remembers("shift_left", i) for i in (0, 1)] == [200.0, 300.0]


def test_lanes_shift_the_same_way_every_time() -> None:
    s = mowing()
    s.put(0, FAR).plan(4)
    for _ in range(3):
        s.plan(12)  # the shift: 300 m at 25 m/s
        s.put(0, HERE).plan()  # a hit on the new lane
        assert s.heading() in (near(0.0), near(180.0))
        s.put(0, FAR).plan(4)
        assert s.heading() == near(90.0)


def test_beta_ends_the_cluster_after_10_s_on_a_lane_without_any_hit() -> None:
    s = mowing().put(0, FAR).plan(4)
    s.plan(12)
    lane = s.heading()
    assert s.remembers("mode") == ace.LANE
    s.plan(9)
    assert s.remembers("mode") == ace.LANE
    s.plan()
    assert s.remembers("mode") == ace.LEAVING
    assert s.plan(300).heading() == near(lane)  # inertia, no return


def test_leaving_lasts_until_nothing_is_in_range() -> None:
    s = mowing().put(0, FAR).plan(16 + 10)
    assert s.remembers("mode") == ace.LEAVING
    heading = s.heading()
    s.forget()  # even news must not start another mowing before it is out
    s.put(0, HERE).plan()
    assert s.world.knowledge["seen"][0] == 2
    assert (s.remembers("mode"), s.heading()) == (ace.LEAVING, near(heading))
    s.put(0, FAR).plan()
    assert s.remembers("mode") == ace.SEARCHING
    s.forget()
    s.put(0, HERE).plan()
    assert s.remembers("mode") == ace.LANE


def test_known_targets_alone_do_not_start_a_mowing() -> None:
    s = mowing().put(0, FAR).plan(16 + 11)
    s.put(0, HERE, 45.0).plan()
    assert s.world.knowledge["in_range"][0] == 2
    assert s.heading() == near(45.0)


def test_a_lane_with_hits_that_meets_the_fence_ends_there() -> None:
    area = (-1000.0, 1000.0, -1000.0, 1000.0)
    s = Situation("ace", [HERE], [90.0], crowd(HERE, 2), area=area).plan()
    lane = s.heading()
    side = 1.0 if lane == near(0.0) else -1.0
    s.put(0, (side * 990.0, 0.0)).plan()
    assert s.heading() == near(90.0)
    assert s.remembers("mode") == ace.SHIFT
    assert turned(lane, s.plan(12).heading()) == near(-180.0)


def test_a_lane_without_hits_that_meets_the_fence_ends_the_cluster() -> None:
    area = (-1000.0, 1000.0, -1000.0, 1000.0)
    s = Situation("ace", [HERE], [90.0], crowd(HERE, 2), area=area).plan()
    side = 1.0 if s.heading() == near(0.0) else -1.0
    s.put(0, (0.0, 900.0)).plan(16).put(0, (-side * 990.0, 0.0)).plan()
    assert s.remembers("mode") == ace.LEAVING


def test_a_shift_that_meets_the_fence_ends_the_cluster() -> None:
    area = (-1000.0, 1000.0, -1000.0, 1000.0)
    s = Situation("ace", [HERE], [90.0], crowd(HERE, 2), area=area).plan()
    s.put(0, (0.0, 900.0)).plan(4).put(0, (0.0, 990.0)).plan()
    assert s.remembers("mode") == ace.LEAVING
    assert 990.0 + 25.0 * math.sin(math.radians(s.heading())) < 1000.0


def meeting(found: tuple[int, int], heading: float = 90.0, **values: Any) -> Situation:
    """Two vehicles that mow one cluster, having found so many each, come into each other's range."""
    targets = [*crowd((0.0, 0.0), found[0], 20.0), *crowd((900.0, 0.0), found[1], 20.0)]
    s = Situation("ace", [(0.0, 0.0), (900.0, 0.0)], [heading] * 2, targets, random=1.0, **values).plan()
    s.put(0, (0.0, 0.0)).put(1, (450.0, 0.0))
    return s


@pytest.mark.parametrize(("found", "leaver"), [((3, 5), 0), ((5, 3), 1), ((4, 4), 1)])
def test_of_two_on_one_cluster_the_one_that_found_fewer_leaves(found: tuple[int, int], leaver: int) -> None:
    s = meeting(found).plan()
    lanes = [near(0.0), near(180.0)]
    assert s.remembers("mode", leaver) == ace.LEAVING
    assert s.heading(leaver) not in lanes  # a random turn
    assert s.remembers("mode", 1 - leaver) == ace.LANE
    assert s.heading(1 - leaver) in lanes


def test_both_know_what_either_found_when_they_part() -> None:
    s = meeting((3, 5)).plan()
    assert sorted(s.known(0)) == sorted(s.known(1)) == list(range(8))


def test_what_was_only_told_does_not_count_as_found() -> None:
    s = meeting((3, 5)).plan()
    assert (s.remembers("found_here", 0), s.remembers("found_here", 1)) == (3, 5)


def test_out_of_radio_range_nobody_leaves() -> None:
    s = meeting((3, 5)).put(1, (900.0, 0.0)).plan()
    assert [s.remembers("mode", i) for i in (0, 1)] == [ace.LANE, ace.LANE]


def test_a_neighbour_that_does_not_mow_sends_nobody_away() -> None:
    s = meeting((3, 5))
    s.put(1, (450.0, 5000.0)).plan(16 + 10)  # the richer one leaves its cluster
    assert s.remembers("mode", 1) == ace.LEAVING
    s = meeting((3, 5))
    s.world.memory["mode"][1] = ace.LEAVING
    s.plan()
    assert s.remembers("mode", 0) == ace.LANE


def test_the_turn_on_leaving_is_random_with_the_size_phi() -> None:
    turns = []
    for seed in range(150):
        s = meeting((3, 5), seed=seed)
        lane = s.heading(0)
        s.plan()
        turns.append(math.radians(turned(lane, s.heading(0))))
    # v = v̂ + randn on both axes: the mean direction stays, and turns of more than 90° happen.
    assert np.mean(np.cos(turns)) == pytest.approx(0.54, abs=0.12)
    assert np.mean(np.sin(turns)) == pytest.approx(0.0, abs=0.12)
    assert np.min(np.cos(turns)) < 0.0
