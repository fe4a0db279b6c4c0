"""Belief sweep: each mechanism in a situation where it decides (its choices: test_belief_plainly.py)."""

import math

import numpy as np
import pytest
import shapely

from swarmctl.core.planners import belief
from swarmctl.core.planners import belief_choice as choice
from swarmctl.core.planners import belief_grid as grid
from swarmctl.core.world import make_settings

from ..core.worlds import Box, Place, region
from .situation import Situation, bearing, crowd, near

AREA: Box = (0.0, 3000.0, 0.0, 3000.0)
CORNER = (0.0, 0.0)


def visited(s: Situation, i: int = 0) -> set[tuple[int, int]]:
    """The cells (row, column of the area) that vehicle ``i`` holds for visited."""
    memory = s.world.memory[i]
    words = enumerate(memory["visited"].tolist())
    bits = [(r, c) for r, word in words for c in range(grid.SIDE) if word >> c & 1]
    return {(r + int(memory["first_row"]), c + int(memory["first_column"])) for r, c in bits}


def centre(s: Situation, row: int, column: int) -> Place:
    """Where the centre of a cell of the area is."""
    memory = s.world.memory[0]
    return (
        float(memory["west"] + (column + 0.5) * memory["cell"]),
        float(memory["south"] + (row + 0.5) * memory["cell"]),
    )


def test_the_first_leg_halves_the_sector_until_the_fence() -> None:
    s = Situation("belief", [CORNER] * 3, [10.0, 45.0, 80.0], area=AREA).fly(100)
    assert s.heading(1) == near(45.0)
    assert s.place(1) == pytest.approx((2500 / math.sqrt(2), 2500 / math.sqrt(2)))
    assert set(s.world.memory["mode"]) == {belief.FIRST_LEG}
    s.fly(80)
    assert set(s.world.memory["mode"]) == {belief.SEARCH}


def test_the_first_leg_ends_at_the_first_target() -> None:
    s = Situation("belief", [CORNER], [45.0], [(800.0, 800.0)], area=AREA).fly(38)
    assert s.remembers("mode") == belief.FIRST_LEG
    s.fly(1)
    assert s.remembers("mode") == belief.SEARCH


def test_cells_are_visited_when_their_centre_was_in_range() -> None:
    s = Situation("belief", [(1500.0, 1500.0)], area=AREA).plan()
    east = {centre(s, r, c) for r, c in visited(s)}
    assert len(east) == 4  # 150 m cells, 200 m range
    assert all(math.dist(place, (1500.0, 1500.0)) <= 200.0 for place in east)


def test_what_is_passed_between_two_periods_is_visited_too() -> None:
    slow, fast = (
        Situation("belief", [(500.0, 1500.0)], area=AREA, period=period).put(0, (500.0, 1500.0), 0.0)
        for period in (1.0, 20.0)
    )
    slow.fly(40).plan()
    fast.fly(2).plan()
    assert slow.place() == fast.place() == pytest.approx((1500.0, 1500.0))
    assert visited(fast) == visited(slow)
    assert len(visited(slow)) > 15


def test_it_turns_to_where_targets_were_found() -> None:
    s = Situation("belief", [(1500.0, 1500.0)], [0.0], crowd((1500.0, 1680.0), 5), area=AREA).plan()
    assert abs(s.heading() - 90.0) < 45.0
    s = Situation("belief", [(1500.0, 1500.0)], [0.0], crowd((1500.0, 1320.0), 5), area=AREA).plan()
    assert abs(s.heading() + 90.0) < 45.0


def test_maps_are_exchanged_in_range_and_only_there() -> None:
    for radio, told in ((600.0, True), (300.0, False)):
        s = Situation("belief", [(1000.0, 1500.0), (1500.0, 1500.0)], area=AREA, radio_range=radio).plan(2)
        mine, others = visited(s, 0), visited(s, 1)
        assert (mine == others) == told
        assert (s.world.memory["met"][0, 1] == 1) == told


def test_the_newest_word_of_a_vehicle_counts_and_ends() -> None:
    s = Situation("belief", [(1000.0, 1000.0), (1200.0, 1000.0)], area=AREA).plan(1)
    s.put(1, (2900.0, 2900.0)).plan(5)
    assert s.world.memory["met_at"][0, 1] == 0.0
    assert s.world.memory["met_east"][0, 1] == 1200.0
    s.put(1, (1100.0, 1000.0)).plan(1)
    assert (s.world.memory["met_at"][0, 1], s.world.memory["met_east"][0, 1]) == (6.0, 1100.0)


def test_more_vehicles_than_the_table_has_places() -> None:
    places = [(200.0 + 60.0 * (k % 8), 200.0 + 60.0 * (k // 8)) for k in range(40)]
    s = Situation("belief", places, [9.0 * k for k in range(40)], area=AREA, radio_range=200.0).fly(120)
    memory = s.world.memory
    assert all(i not in memory["met"][i][memory["met_at"][i] >= 0] for i in range(40))
    assert (memory["met"] % choice.MET == np.arange(choice.MET)).all(where=memory["met_at"] >= 0)


@pytest.mark.parametrize("keep_outs", [(), [(800.0, 1000.0, 700.0, 1300.0)]])
def test_a_lone_vehicle_sees_the_whole_area_and_begins_anew(keep_outs: list[Box]) -> None:
    area = (0.0, 2000.0, 0.0, 2000.0)
    spots = [(x, y) for x in range(50, 2000, 100) for y in range(50, 2000, 100)]
    targets = [p for p in spots if region(area, keep_outs).contains(shapely.Point(p))]
    s = Situation("belief", [CORNER], [45.0], area=area, keep_outs=keep_outs)
    track = [s.fly().place() for _ in range(900)]
    assert s.remembers("lap") >= 1
    assert region(area, keep_outs).buffer(1e-6).covers(shapely.LineString(track))
    seen = shapely.LineString(track).buffer(200.0)
    assert np.mean([seen.contains(shapely.Point(p)) for p in targets]) > 0.95


def test_a_court_that_nobody_can_enter_is_given_up() -> None:
    walls: list[Box] = [
        (900.0, 1800.0, 900.0, 1000.0), (900.0, 1800.0, 1700.0, 1800.0),
        (900.0, 1000.0, 900.0, 1800.0), (1700.0, 1800.0, 900.0, 1800.0),
    ]  # fmt: skip
    s = Situation("belief", [CORNER], [45.0], area=AREA, keep_outs=walls, sensor_range=150.0).fly(3000)
    assert s.remembers("lap") >= 1


def test_a_vehicle_joins_the_lap_that_others_are_in() -> None:
    s = Situation("belief", [(1000.0, 1500.0), (1300.0, 1500.0)], area=AREA).plan()
    s.world.memory["lap"][1] = 3
    s.plan(1)
    assert s.remembers("lap", 0) == 3
    assert len(visited(s, 0)) < len(visited(s.plan(1), 0)) + 1


def test_the_window_follows_the_vehicle_over_a_large_area() -> None:
    area = (0.0, 60_000.0, 0.0, 60_000.0)
    s = Situation("belief", [(15_000.0, 15_000.0)], [20.0], area=area)
    s.plan()
    began = (s.remembers("first_row"), s.remembers("first_column"))
    before = visited(s)
    s.put(0, (17_000.0, 15_000.0)).plan()
    assert before <= visited(s)  # nothing that is still in the window is forgotten
    for east in range(17_000, 30_000, 500):
        s.put(0, (float(east), 15_000.0)).plan()
    assert s.remembers("first_column") > began[1]
    assert s.remembers("first_row") == began[0]
    assert all(abs(centre(s, r, c)[1] - 15_000.0) <= 200.0 for r, c in visited(s))


def test_windows_in_different_places_mean_the_same_cells() -> None:
    area = (0.0, 60_000.0, 0.0, 60_000.0)
    s = Situation("belief", [(15_000.0, 15_000.0), (16_100.0, 14_200.0)], area=area, radio_range=2000.0)
    s.plan()
    assert s.world.memory["first_column"][0] != s.world.memory["first_column"][1]
    apart = visited(s, 0) | visited(s, 1)
    s.plan()
    assert visited(s, 0) == visited(s, 1) == apart


def test_then_converge_holds_where_most_is_known() -> None:
    few, many = crowd((500.0, 1500.0), 4, 20.0), crowd((1500.0, 600.0), 30, 60.0)
    area = (0.0, 2000.0, 0.0, 2000.0)
    s = Situation("belief", [CORNER, CORNER], [30.0, 60.0], few + many, area=area)
    s.world.settings["then"] = belief.CONVERGE
    s.fly(500)
    assert set(s.world.memory["mode"]) == {belief.CONVERGING}
    for i in range(2):
        assert math.dist(s.place(i), (1500.0, 600.0)) < 85.0
        assert s.speed(i) < 0.1
        assert s.world.knowledge["in_range"][i] == 30
    assert math.dist(s.place(0), s.place(1)) > 15.0


def test_then_is_a_choice_between_words() -> None:
    assert make_settings("belief", {"then": "converge"})["then"] == [belief.CONVERGE]
    assert make_settings("belief", {})["then"] == [belief.HOLD]
    with pytest.raises(ValueError):
        make_settings("belief", {"then": "hover"})


def test_it_flies_straight_at_its_goal() -> None:
    s = Situation("belief", [(1500.0, 1500.0)], [0.0], crowd((1500.0, 1680.0), 5), area=AREA).plan()
    row, column = int(s.remembers("goal_row")), int(s.remembers("goal_column"))
    assert s.heading() == near(bearing((1500.0, 1500.0), centre(s, row, column)))
