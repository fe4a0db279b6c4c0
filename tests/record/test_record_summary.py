"""The summary's figures, on situations worked out by hand and against plain loops."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.record.summary import (
    Flags,
    Floats,
    distance_flown,
    geofence_violations,
    min_separation,
    time_to,
)

NEVER = math.inf


def test_a_level_is_reached_when_that_share_of_all_targets_is_found() -> None:
    found = np.array([40.0, 10.0, NEVER, 30.0, 20.0, 50.0, NEVER, 60.0, 70.0, 80.0])
    assert time_to(found) == {"25": 30.0, "50": 50.0, "75": 80.0, "85": None}
    assert time_to(found, [10, 80, 100]) == {"10": 10.0, "80": 80.0, "100": None}


def test_no_targets_and_nothing_found_reach_no_level() -> None:
    assert set(time_to(np.array([])).values()) == {None}
    assert set(time_to(np.full(4, NEVER)).values()) == {None}
    assert time_to(np.array([5.0])) == {"25": 5.0, "50": 5.0, "75": 5.0, "85": 5.0}


@given(st.lists(st.floats(0, 1e4) | st.just(NEVER), min_size=1, max_size=40), st.integers(1, 100))
def test_a_level_s_time_is_the_first_at_which_the_share_is_reached(times: list[float], level: int) -> None:
    (time_s,) = time_to(np.array(times), [level]).values()
    reached = [
        moment
        for moment in times
        if moment < NEVER and 100 * sum(time <= moment for time in times) >= level * len(times)
    ]
    assert time_s == (min(reached) if reached else None)


def columns(*vehicles: list[float]) -> Floats:
    """One list a vehicle, as (ticks, vehicles)."""
    return np.array(vehicles).T


def test_separation_counts_only_airborne_vehicles_at_about_one_height() -> None:
    east = columns([0.0, 0.0, 0.0, 0.0], [3.0, 30.0, 2.0, 9.0])
    north = columns([0.0, 0.0, 0.0, 0.0], [4.0, 40.0, 0.0, 0.0])
    up = columns([100.0, 100.0, 100.0, 100.0], [100.0, 100.0, 105.0, 104.9])
    airborne = np.array([[False, True], [True, True], [True, True], [True, True]])
    assert min_separation(east, north, up, airborne) == 9.0
    assert min_separation(east[:3], north[:3], up[:3], airborne[:3]) == 50.0
    assert min_separation(east[2:3], north[2:3], up[2:3], airborne[2:3]) is None


def test_vehicles_on_the_ground_may_have_no_position() -> None:
    nowhere = columns([0.0, 0.0], [math.nan, 7.0])
    airborne = np.array([[True, False], [True, True]])
    assert min_separation(nowhere, nowhere * 0, nowhere * 0, airborne) == 7.0
    assert distance_flown(nowhere, nowhere * 0, airborne).tolist() == [0.0, 0.0]


def test_one_vehicle_or_none_has_no_separation() -> None:
    for vehicles in (0, 1):
        nothing = np.zeros((3, vehicles))
        assert min_separation(nothing, nothing, nothing, nothing == 0) is None


@given(st.integers(1, 6), st.integers(2, 5), st.integers(0, 1000))
def test_separation_is_that_of_a_plain_loop(ticks: int, vehicles: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    east, north, up = random.uniform(0, 12, (3, ticks, vehicles))
    airborne: Flags = random.random((ticks, vehicles)) < 0.7
    distances = [
        math.dist((east[tick, a], north[tick, a]), (east[tick, b], north[tick, b]))
        for tick in range(ticks)
        for a in range(vehicles)
        for b in range(a)
        if airborne[tick, a] and airborne[tick, b] and abs(up[tick, a] - up[tick, b]) < 5
    ]
    assert min_separation(east, north, up, airborne) == pytest.approx(min(distances) if distances else None)


def test_fence_violations_are_counted_per_vehicle_and_tick_while_airborne() -> None:
    east = columns([1.0, 11.0, 12.0], [5.0, -1.0, 5.0])
    north = columns([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    airborne = np.array([[True, True], [True, True], [False, True]])
    seen: list[tuple[int, ...]] = []

    def inside(east_m: Floats, north_m: Floats) -> Flags:
        seen.append(east_m.shape)
        flags: Flags = (east_m >= 0) & (east_m <= 10) & (north_m == 0)
        return flags

    assert geofence_violations(east, north, airborne, inside) == 2
    assert seen == [(5,)]


def test_distance_is_the_track_over_ground_while_airborne() -> None:
    east = columns([0.0, 3.0, 3.0, 100.0], [0.0, 0.0, 0.0, 0.0])
    north = columns([0.0, 4.0, 10.0, 10.0], [0.0, 1.0, 0.0, 1.0])
    airborne = np.array([[True, False], [True, True], [True, True], [False, True]])
    assert distance_flown(east, north, airborne).tolist() == [11.0, 2.0]
