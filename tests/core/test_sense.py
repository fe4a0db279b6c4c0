"""The emulated sensor, against brute force and its own statistics."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from swarmctl.core import roam
from swarmctl.core.world import Motion, World, make_scene

from .worlds import Place, fences, fleet_of, rules_of, world_of

WIDE = fences((-1e5, 1e5, -1e5, 1e5))
PLACES = st.tuples(st.floats(-400, 400), st.floats(-400, 400))


def sensing(
    spots: list[Place], targets: list[Place], wander: float = 0.0, drift: float = 0.0, alarm_slots: int = 0,
    **values: Any,
) -> World:  # fmt: skip
    """Vehicles at ``spots`` over still or moving targets; those that drift are three clusters."""
    rules = rules_of(alarm_slots=alarm_slots)
    world = world_of("bounce", fleet_of(spots, **values), rules, WIDE, targets)
    if wander or drift:
        places = np.array(targets, float).reshape(-1, 2)
        motion = Motion(5, wander, 2.0, drift, 3.0, WIDE.raw)
        world.scene = make_scene(places, np.arange(len(places)) % 3, motion, reach_m=15.0)
    return world


def reported(world: World, i: int, tick: int) -> np.ndarray:
    """Vehicle ``i``'s reports at a tick."""
    world.observe(tick)
    return np.array(world.reports[i][: world.report_count[i]])


@settings(max_examples=200, deadline=None)
@given(
    st.lists(PLACES, max_size=60), PLACES, st.floats(1.0, 300.0), st.sampled_from([0.0, 30.0, 200.0]),
    st.sampled_from([0.0, 100.0, 700.0]), st.integers(0, 5000),
)  # fmt: skip
def test_reports_are_those_of_brute_force(
    targets: list[Place], place: Place, reach: float, wander: float, drift: float, tick: int
) -> None:
    world = sensing([place], targets, wander, drift, sensor_range=reach)
    rows, grid = world.scene.targets, world.scene.grid
    where = [roam.place_at(grid, rows, t, float(tick)) for t in range(len(rows))]
    seen = [
        t for t, (x, y) in enumerate(where)
        if (x - place[0]) * (x - place[0]) + (y - place[1]) * (y - place[1]) <= reach * reach
    ]  # fmt: skip
    reports = reported(world, 0, tick)
    assert sorted(reports["id"].tolist()) == seen
    assert [(r["east"], r["north"]) for r in reports] == [where[r["id"]] for r in reports]
    assert [t for t in range(len(rows)) if world.found[t] == tick] == seen


def test_targets_that_wander_in_from_other_cells_are_seen() -> None:
    world = sensing([(0.0, 0.0)], [(110.0, 0.0), (-90.0, -100.0), (0.0, 130.0)], 100.0, sensor_range=50.0)
    assert seen_as_by_brute_force(world, 6000) > 20


def test_a_cluster_that_drifts_in_from_far_is_seen() -> None:
    ways = sensing([(0.0, 0.0)], [(0.0, 0.0)] * 3, drift=700.0).scene.grid
    spots = [(-650.0 * way["way_east"], -650.0 * way["way_north"]) for way in ways]
    world = sensing([(0.0, 0.0)], spots, drift=700.0, sensor_range=50.0)
    assert seen_as_by_brute_force(world, 300) > 9


def seen_as_by_brute_force(world: World, ticks: int) -> int:
    """How often vehicle 0, with a sensor of 50 m at the origin, sees a target; each time just those that it must."""
    rows, grid = world.scene.targets, world.scene.grid
    seen = 0
    for tick in range(0, ticks, 10):
        where = [roam.place_at(grid, rows, t, float(tick)) for t in range(len(rows))]
        expected = [t for t, (x, y) in enumerate(where) if x * x + y * y <= 2500.0]
        assert sorted(reported(world, 0, tick)["id"].tolist()) == expected
        seen += len(expected)
    return seen


def test_a_target_exactly_at_the_sensors_radius_is_seen() -> None:
    world = sensing([(0.0, 0.0)], [(200.0, 0.0), (0.0, -200.0), (200.1, 0.0)])
    assert len(reported(world, 0, 0)) == 2


def test_found_keeps_the_first_tick() -> None:
    world = sensing([(0.0, 0.0)], [(0.0, 10.0), (5000.0, 0.0)])
    for tick in (3, 4):
        world.observe(tick)
    assert world.found.tolist() == [3, -1]


def test_detection_probability() -> None:
    crowd = [(float(x), float(y)) for x in range(20) for y in range(20)]
    world = sensing([(0.0, 0.0), (0.0, 0.0)], crowd, detection_probability=0.3)
    seen = np.zeros((100, 2, 400), bool)
    for tick in range(100):
        world.observe(tick)
        for i in (0, 1):
            seen[tick, i, world.reports["id"][i][: world.report_count[i]]] = True
    assert stats.binomtest(int(seen.sum()), seen.size, 0.3).pvalue > 1e-4
    both = (seen[:, 0] & seen[:, 1]).mean()  # vehicles miss independently of each other
    assert both == pytest.approx(0.09, abs=0.01)
    again = (seen[:-1] & seen[1:]).mean()  # and from tick to tick
    assert again == pytest.approx(0.09, abs=0.01)
    assert np.ptp(seen.mean(axis=(0, 1))) < 0.3  # no target is always missed


def test_position_noise_is_normal_with_its_spread() -> None:
    crowd = [(float(x), float(y)) for x in range(20) for y in range(20)]
    world = sensing([(10.0, 10.0)], crowd, position_noise=7.0)
    errors = []
    for tick in range(10):
        reports = reported(world, 0, tick)
        rows = world.scene.targets[reports["id"]]
        errors.append(np.column_stack((reports["east"] - rows["east"], reports["north"] - rows["north"])))
    error = np.vstack(errors) / 7.0
    assert len(error) == 4000
    assert stats.kstest(error.ravel(), "norm").pvalue > 1e-4
    assert np.corrcoef(error[:, 0], error[:, 1])[0, 1] == pytest.approx(0.0, abs=0.06)


def test_noise_moves_reports_but_not_what_is_in_range() -> None:
    world = sensing([(0.0, 0.0)], [(199.0, 0.0), (201.0, 0.0)], position_noise=50.0)
    assert [reported(world, 0, tick)["id"].tolist() for tick in range(30)] == [[0]] * 30


def test_false_alarms_come_at_their_rate_evenly_within_the_radius() -> None:
    world = sensing(
        [(100.0, 50.0), (0.0, 0.0)], [], alarm_slots=1000, alarms_per_second=0.1, sensor_range=150.0
    )
    alarms = [reported(world, 0, tick) for tick in range(5000)]
    assert max(len(a) for a in alarms) == 1
    raised = np.concatenate(alarms)
    assert stats.binomtest(len(raised), 5000, 0.1).pvalue > 1e-4
    dx, dy = raised["east"] - 100.0, raised["north"] - 50.0
    share = np.hypot(dx, dy) / 150.0
    assert stats.kstest(share**2, "uniform").pvalue > 1e-4
    assert stats.kstest(np.arctan2(dy, dx) / math.pi, stats.uniform(-1, 2).cdf).pvalue > 1e-4


def test_every_false_alarm_has_a_number_of_its_own_after_the_targets() -> None:
    world = sensing([(0.0, 0.0), (0.0, 0.0)], [(0.0, 10.0)] * 3, alarm_slots=200, alarms_per_second=0.3)
    serials: list[list[int]] = [[], []]
    for tick in range(400):
        world.observe(tick)
        for i in (0, 1):
            row = world.reports["id"][i][: world.report_count[i]]
            serials[i] += [int(s) for s in row if s >= 3]
    assert serials[0] == list(range(3, 3 + len(serials[0])))
    assert serials[1] == list(range(203, 203 + len(serials[1])))
    assert len(serials[0]) > 80


def test_an_alarm_is_not_found() -> None:
    world = sensing([(0.0, 0.0)], [(900.0, 0.0)], alarm_slots=50, alarms_per_second=1.0)
    reported(world, 0, 0)
    assert world.report_count[0] == 1
    assert world.found.tolist() == [-1]
