"""Where vehicles start and on which heading, and that a seed makes one world."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.core import planners
from swarmctl.core.world import World
from swarmctl.mission import geometry, launch
from swarmctl.mission.load import load
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario

RAY_M = 20_000.0


def rays(starts: np.ndarray, headings: np.ndarray) -> list[shapely.LineString]:
    """From each start a long straight line."""
    ends = starts + RAY_M * np.column_stack((np.cos(headings), np.sin(headings)))
    return [shapely.LineString([a, b]) for a, b in zip(starts, ends, strict=True)]


def crossings(starts: np.ndarray, headings: np.ndarray) -> int:
    """How many pairs of rays cross."""
    return sum(a.intersects(b) for a, b in itertools.combinations(rays(starts, headings), 2))


def headings_of(world: World) -> np.ndarray:
    """The fleet's initial headings in radians from east."""
    return np.asarray(np.arctan2(world.fleet["heading_north"], world.fleet["heading_east"]))


def paper(**settings: object) -> Mission:
    """The reference mission, keys given with _ for the dot between section and key."""
    return load(None, {key.replace("__", "."): value for key, value in settings.items()})


@pytest.mark.parametrize("count", [2, 3, 6, 12])
def test_headings_from_the_corner_do_not_cross(count: int) -> None:
    scenario = Scenario(paper(vehicles__count=count), ideal=False)
    for seed in range(20):
        fleet = scenario.fleet(seed)
        headings = np.arctan2(fleet["heading_north"], fleet["heading_east"])
        assert crossings(scenario.starts, headings) == 0
        assert (headings >= 0.0).all()
        assert (headings <= np.pi / 2.0).all()


def test_handing_out_is_needed() -> None:
    """As drawn, headings do cross: the test above would see it."""
    mission = paper(vehicles__count=12)
    regions = geometry.regions(mission)
    starts = Scenario(mission, ideal=False).starts
    drawn = [
        launch.draw_headings(launch.opening(mission, regions, starts), len(starts), seed) for seed in range(5)
    ]
    assert all(crossings(starts, headings) > 0 for headings in drawn)


@given(
    st.lists(st.tuples(st.integers(-40, 40), st.integers(-40, 40)), min_size=2, max_size=8, unique=True),
    st.data(),
)
@settings(max_examples=60, deadline=None)
def test_any_headings_are_handed_out_without_crossing(
    places: list[tuple[int, int]], data: st.DataObject
) -> None:
    starts = 20.0 * np.array(places, dtype=float)
    quarter = st.floats(0.0, np.pi / 2.0, allow_nan=False)
    drawn = np.array([data.draw(quarter) for _ in places])
    handed = launch.uncross(starts, drawn)
    assert sorted(handed.tolist()) == sorted(drawn.tolist())
    # Rays that only touch, or run into one another's start, are as good as apart: the guard keeps distance.
    lines = rays(starts, handed)
    assert not any(a.crosses(b) for a, b in itertools.combinations(lines, 2))


def test_pads_are_a_square_grid_in_the_south_west_corner() -> None:
    starts = Scenario(paper(), ideal=False).starts
    assert starts.tolist() == [[25, 25], [45, 25], [65, 25], [25, 45], [45, 45], [65, 45]]
    moved = {"safety__fence_margin_m": 35.0, "vehicles__spacing_m": 30.0}
    starts = Scenario(paper(vehicles__count=4, **moved), ideal=False).starts
    assert starts.tolist() == [[40, 40], [70, 40], [40, 70], [70, 70]]


def test_pads_that_the_mission_names_are_the_pads() -> None:
    mission = load("field")
    scenario = Scenario(mission, ideal=False)
    assert scenario.starts.tolist() == [[60, 60], [80, 60], [60, 80], [80, 80]]
    fleet = scenario.fleet(1)
    assert fleet["pad_east"].tolist() == [60, 80, 60, 80]
    assert fleet["pad_north"].tolist() == [60, 60, 80, 80]


def test_vehicles_stand_where_they_were_found() -> None:
    stands = np.array([[200.0 + 20.0 * i, 150.0] for i in range(6)])
    scenario = Scenario(load("sitl"), ideal=False, stands=stands)
    world = scenario.world(3)
    assert world.poses["east"].tolist() == stands[:, 0].tolist()
    assert world.fleet["pad_north"].tolist() == [150.0] * 6
    assert np.ptp(headings_of(world)) > np.pi / 2.0  # in the open, headings are drawn from the whole circle


def test_ideal_vehicles_start_together_on_the_border_and_drawn_headings_are_kept() -> None:
    mission = paper()
    scenario = Scenario(mission, ideal=True)
    assert scenario.starts.tolist() == [[0.0, 0.0]] * 6
    drawn = launch.draw_headings(
        launch.opening(mission, scenario.regions, scenario.starts), len(scenario.starts), 5
    )
    assert headings_of(scenario.world(5)) == pytest.approx(drawn)
    assert scenario.fences.plan is scenario.fences.raw
    assert scenario.fences.plan[:, 0].max() == 5000.0


@pytest.mark.parametrize("ideal", [True, False])
def test_spread_vehicles_start_all_over_the_area_on_any_heading_as_drawn(ideal: bool) -> None:
    scenario = Scenario(paper(vehicles__count=300, vehicles__launch="spread"), ideal=ideal)
    world = scenario.world(5)
    assert world.poses["east"].tolist() == scenario.starts[:, 0].tolist()
    assert np.ptp(scenario.starts, axis=0).min() > 4500.0
    drawn = launch.draw_headings((0.0, 2.0 * np.pi), 300, 5)
    assert np.cos(headings_of(world) - drawn) == pytest.approx(1.0)
    assert np.histogram(drawn, 4, (0.0, 2.0 * np.pi))[0].min() > 50


def test_pads_that_the_mission_names_are_those_of_ideal_vehicles_too() -> None:
    pads = [[100.0, 200.0], [400.0, 300.0]]
    scenario = Scenario(paper(vehicles__count=2, vehicles__launch=pads), ideal=True)
    assert scenario.starts.tolist() == pads


def test_a_multicopters_fences_have_their_margins() -> None:
    fences = Scenario(paper(), ideal=False).fences
    assert (fences.raw[:, 0].max(), fences.plan[:, 0].max(), fences.guard[:, 0].max()) == (5000, 4980, 4990)
    assert (fences.raw[:, 1].min(), fences.plan[:, 1].min(), fences.guard[:, 1].min()) == (0, 20, 10)


@pytest.mark.parametrize("name", list(planners.MODULES))
def test_one_seed_is_one_world(name: str) -> None:
    def everything(world: World) -> list[bytes]:
        arrays = (
            world.fleet,
            world.rules,
            world.settings,
            world.poses,
            world.scene.targets,
            world.fences.plan,
        )
        return [array.tobytes() for array in arrays]

    scenario = Scenario(paper(), ideal=False)
    assert everything(scenario.world(7, name)) == everything(scenario.world(7, name))
    assert everything(scenario.world(7, name)) == everything(Scenario(paper(), ideal=False).world(7, name))
    assert everything(scenario.world(7, name)) != everything(scenario.world(8, name))


def test_another_algorithm_searches_the_same_world() -> None:
    scenario = Scenario(paper(), ideal=False)
    worlds = [scenario.world(4, name) for name in planners.MODULES]
    assert len({world.scene.targets.tobytes() for world in worlds}) == 1
    assert len({world.fleet.tobytes() for world in worlds}) == 1


def test_targets_are_legal_numerous_and_in_their_clusters() -> None:
    scenario = Scenario(paper(), ideal=False)
    legal = scenario.regions
    area = shapely.Polygon(legal.border).difference(
        shapely.union_all([shapely.Polygon(k) for k in legal.keep_outs])
    )
    for seed in range(10):
        targets = scenario.scene(seed).targets
        assert len(targets) == 450
        assert shapely.intersects_xy(area, targets["east"], targets["north"]).all()
        assert set(targets["cluster"].tolist()) == set(range(6))


def test_targets_move_as_the_mission_says_and_start_from_the_layout_that_stands_still() -> None:
    still = Scenario(paper(), ideal=True).scene(3)
    moves = {"targets__motion": "wander", "targets__wander_mps": 0.5}
    wander = Scenario(paper(**moves), ideal=True).scene(3)
    drift = Scenario(paper(targets__cluster_motion="drift", targets__cluster_mps=2.0), ideal=True).scene(3)
    assert still.targets.tobytes() == wander.targets.tobytes() == drift.targets.tobytes()
    assert (still.grid[0]["stray"], still.grid[0]["drift_speed"], len(still.grid)) == (0.0, 0.0, 1)
    assert wander.grid[["seed", "wander", "wander_speed", "drift_speed"]].tolist() == [(3, 45.0, 0.5, 0.0)]
    assert drift.grid[["seed", "wander", "drift_speed"]].tolist() == [(3, 0.0, 2.0)] * 6
    assert 300.0 < drift.grid["ahead"].max() <= 600.0


def test_targets_of_a_file_drift_together() -> None:
    lake = load("lake", {"targets.cluster_motion": "drift"})
    grid = Scenario(lake, ideal=True).scene(1).grid
    assert len(grid) == 1
    assert grid[0]["drift_speed"] == 1.5


def test_targets_of_a_file_are_those_targets_whatever_the_seed() -> None:
    scenario = Scenario(load("lake"), ideal=False)
    one, other = scenario.scene(1).targets, scenario.scene(2).targets
    assert len(one) == 40
    assert one.tobytes() == other.tobytes()


def test_each_vehicle_is_what_its_entry_says(tmp_path: Path) -> None:
    fleet = Scenario(load("mixed"), ideal=False).fleet(1)
    assert fleet["speed"].tolist() == [22, 22, 15, 10]
    assert fleet["altitude"].tolist() == [120, 128, 90, 60]
    assert fleet["sensor_range"].tolist() == [250, 250, 150, 150]
    assert fleet["radio_range"].tolist() == [800, 800, 2000, 800]
    assert fleet["radio_loss"][:2].tolist() == [0.1, 0.1]
    assert fleet["detection_probability"].tolist() == [0.8, 0.8, 1.0, 1.0]


def test_what_the_mission_sets_of_a_planner_reaches_it_and_no_other() -> None:
    scenario = Scenario(paper(planner__parameters={"fco": {"inertia": 0.9}}), ideal=False)
    assert float(scenario.world(1, "fco").settings[0]["inertia"]) == 0.9
    assert float(scenario.world(1, "mdc").settings[0]["inertia"]) == 0.4
