"""The guard's invariant, in a closed loop with motion, whatever is wished."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from .flying import BAD, Flight, scattered, wild
from .worlds import Box, Place, region

AREA: Box = (0.0, 300.0, 0.0, 250.0)
KEEP_OUTS: list[Box] = [(120.0, 160.0, 90.0, 150.0)]
WIDE: Box = (-5000.0, 5000.0, -5000.0, 5000.0)
FAST, SLOW = (25.0, 4.0), (8.0, 2.0)
SEEDS = st.integers(0, 1 << 32)


@given(
    seed=SEEDS, motion=st.sampled_from([FAST, SLOW]), lag=st.sampled_from([0.0, 0.3, 1.0]),
    latency=st.sampled_from([0.0, 0.05, 0.1, 0.25, 0.5]), count=st.integers(1, 6),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_nobody_leaves_the_fence_or_comes_too_near_whatever_is_wished(
    seed: int, motion: tuple[float, float], lag: float, latency: float, count: int
) -> None:
    rng = np.random.default_rng(seed)
    speed, acceleration = motion
    places = scattered(rng, count, region(AREA, KEEP_OUTS, 11.0), apart=16.0)
    flight = Flight(
        places, AREA, KEEP_OUTS, speed=speed, acceleration=acceleration, braking=acceleration, lag=lag,
        latency=latency,
    )  # fmt: skip
    flight.fly(250, wild(rng))


@given(SEEDS)
@settings(max_examples=15, deadline=None)
def test_unlike_vehicles_keep_apart_too(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flight = Flight(scattered(rng, 6, region(AREA, KEEP_OUTS, 11.0), apart=16.0), AREA, KEEP_OUTS)
    fleet = flight.world.fleet
    fleet["speed"] = rng.uniform(3.0, 25.0, len(fleet))
    fleet["acceleration"] = fleet["braking"] = rng.uniform(1.0, 6.0, len(fleet))
    fleet["lag"] = rng.uniform(0.0, 1.0, len(fleet))
    flight.fly(250, wild(rng))


@pytest.mark.parametrize("motion", [FAST, SLOW])
@pytest.mark.parametrize("lag", [0.0, 0.5])
def test_full_speed_against_the_fence_stops_short_of_it(motion: tuple[float, float], lag: float) -> None:
    speed, acceleration = motion
    flight = Flight(
        [(300.0, 500.0)], (0.0, 600.0, 0.0, 1000.0), speed=speed, acceleration=acceleration,
        braking=acceleration, lag=lag,
    )  # fmt: skip
    reached = [flight.fly(1, lambda _: [(speed, 0.0)]).places[0][0] for _ in range(round(3500 / speed))]
    assert 550.0 < max(reached) <= 590.05  # turned along the fence, but not far before it


@pytest.mark.parametrize("wish", [(25.0, 0.0), (-3.0, 4.0), (0.0, 0.0), (1e-3, 0.0), (17.0, -18.0)])
def test_a_free_vehicle_is_told_exactly_what_it_wished(wish: Place) -> None:
    flight = Flight([(0.0, 0.0), (100.0, 0.0)], WIDE)
    for _ in range(5):
        flight.step([wish, wish])
        assert flight.outcomes == ["kept", "kept"]
        assert [flight.told(0), flight.told(1)] == [wish, wish]


def test_a_wish_beyond_the_speed_is_cut_to_it() -> None:
    flight = Flight([(0.0, 0.0)], WIDE)
    flight.step([(300.0, -400.0)])
    assert flight.told() == pytest.approx((15.0, -20.0))


@pytest.mark.parametrize("bad", [b for b in BAD if not math.isfinite(b)])
def test_nonsense_means_stand_still(bad: float) -> None:
    flight = Flight([(0.0, 0.0)], WIDE)
    flight.fly(10, lambda _: [(10.0, 0.0)])
    for wish in ((bad, 1.0), (1.0, bad), (bad, bad)):
        flight.step([wish])
        assert flight.told() == (0.0, 0.0)


@pytest.mark.parametrize("huge", [1e300, 1e200, 1e160])
def test_huge_wishes_never_reach_the_vehicle(huge: float) -> None:
    flight = Flight([(0.0, 0.0)], WIDE)
    for wish in ((huge, huge), (-huge, 0.0)):
        flight.step([wish])
        assert math.hypot(*flight.told()) <= 25.0 + 1e-9


def toward(goals: Sequence[Place], speed: float, flight: Flight) -> list[Place]:
    """Everybody wishes to fly to its goal, and to stop there."""
    wishes = []
    for place, goal in zip(flight.places, goals, strict=True):
        dx, dy = goal[0] - place[0], goal[1] - place[1]
        size = max(math.hypot(dx, dy), 1e-9)
        pace = min(speed, 0.5 * size)
        wishes.append((pace * dx / size, pace * dy / size))
    return wishes


@pytest.mark.parametrize("motion", [FAST, SLOW])
@pytest.mark.parametrize("offset", [0.0, 0.01, 5.0, -14.0])
@pytest.mark.parametrize("angle", [0.0, 37.0, 90.0])
def test_two_that_meet_head_on_get_past_each_other(
    motion: tuple[float, float], offset: float, angle: float
) -> None:
    speed, acceleration = motion
    along, across = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    ends = [
        (200.0 * along, 200.0 * across),
        (-200.0 * along - offset * across, -200.0 * across + offset * along),
    ]
    flight = Flight(ends, WIDE, speed=speed, acceleration=acceleration, braking=acceleration)
    goals = [ends[1], ends[0]]
    flight.fly(1200, lambda f: toward(goals, speed, f))
    assert max(math.dist(p, g) for p, g in zip(flight.places, goals, strict=True)) < 2.0


def test_four_that_cross_in_one_place_all_get_through() -> None:
    ends = [(150.0, 0.0), (0.0, 150.0), (-150.0, 3.0), (3.0, -150.0)]
    goals = [ends[2], ends[3], ends[0], ends[1]]
    flight = Flight(ends, WIDE, speed=12.0)
    flight.fly(1500, lambda f: toward(goals, 12.0, f))
    assert max(math.dist(p, g) for p, g in zip(flight.places, goals, strict=True)) < 2.0


@pytest.mark.parametrize(("gap", "crossed"), [(6.0, True), (10.0, True), (5.0, False), (0.0, False)])
def test_only_vehicles_near_in_height_are_kept_apart(gap: float, crossed: bool) -> None:
    flight = Flight([(0.0, 0.0), (60.0, 0.0)], WIDE)
    flight.world.poses["up"] = flight.world.fleet["altitude"] = [50.0, 50.0 + gap]
    for _ in range(200):
        flight.step([(5.0, 0.0), (0.0, 0.0)])
        if not crossed:
            assert flight.nearest() >= 15.0
    assert (flight.places[0][1] == 0.0) == crossed


def test_vehicles_on_the_ground_are_nobodys_obstacle() -> None:
    flight = Flight([(0.0, 0.0), (60.0, 0.0)], WIDE)
    flight.world.errands["stage"][1] = 0
    for _ in range(100):
        flight.step([(10.0, 0.0), (0.0, 0.0)])
        assert flight.outcomes[0] == "kept"


@pytest.mark.parametrize("wish", [(25.0, 0.0), (0.0, 25.0), (0.0, 0.0), (math.nan, 0.0)])
@pytest.mark.parametrize("start", [(295.0, 125.0), (310.0, 125.0), (140.0, 120.0), (-20.0, -20.0)])
def test_from_outside_it_comes_back_by_the_shortest_way(start: Place, wish: Place) -> None:
    flight = Flight([start], AREA, KEEP_OUTS)
    away = flight.kept.distance(shapely.Point(start))
    flight.step([wish])
    assert flight.outcomes == ["recovering"]
    ticks = 0
    while not flight.kept.contains(shapely.Point(flight.places[0])):
        flight.step([wish])
        ticks += 1
        assert flight.kept.distance(shapely.Point(flight.places[0])) <= away + 1e-6
    assert ticks * 0.1 < away / 3.0 + 3.0
    flight.fly(100, lambda _: [wish])


def test_coming_back_it_waits_for_one_that_stands_in_the_way() -> None:
    flight = Flight([(312.0, 125.0), (289.0, 125.0)], AREA)
    for _ in range(100):
        flight.step([(0.0, 0.0), (0.0, 0.0)])
        assert flight.nearest() >= 15.0
    assert flight.places[0][0] > 300.0
    for _ in range(150):
        flight.step([(0.0, 0.0), (-5.0, 0.0)])
    assert flight.places[0][0] <= 290.0


def test_two_that_come_back_from_outside_keep_apart() -> None:
    flight = Flight([(330.0, 125.0), (330.0, 145.0), (240.0, 135.0)], AREA)
    for _ in range(300):
        flight.step([(25.0, 0.0), (25.0, 0.0), (0.0, 0.0)])
        assert flight.nearest() >= 15.0
    assert shapely.intersects_xy(flight.kept.buffer(0.05), flight.places).all()


@given(SEEDS)
@settings(max_examples=15, deadline=None)
def test_two_that_start_too_near_never_come_nearer_and_can_part(seed: int) -> None:
    rng = np.random.default_rng(seed)
    flight = Flight([(0.0, 0.0), (9.0, 0.0)], WIDE)
    wishes, nearest = wild(rng), 9.0
    for _ in range(60):
        flight.step(wishes(flight))
        assert flight.nearest() >= min(nearest, 15.0) - 0.02
        nearest = max(nearest, flight.nearest())
    for _ in range(100):
        flight.step([(-5.0, 0.0), (5.0, 0.0)])
    assert flight.nearest() > 15.0


def test_a_column_with_room_to_brake_is_not_slowed() -> None:
    flight = Flight([(0.0, 0.0), (40.0, 0.0), (80.0, 0.0)], WIDE, speed=10.0)
    for _ in range(100):
        flight.step([(10.0, 0.0)] * 3)
        assert flight.outcomes == ["kept"] * 3


@pytest.mark.parametrize(("start", "goal"), [((60.0, 10.0), (-30.0, 0.0)), ((60.0, 0.0), (-26.0, -5.0))])
def test_round_one_that_stands_it_keeps_clear_though_its_setpoints_act_late(
    start: Place, goal: Place
) -> None:
    flight = Flight([(0.0, 0.0), start], WIDE, separation=25.0, speed=12.0, latency=0.5)
    flight.fly(300, lambda f: toward([(0.0, 0.0), goal], 12.0, f))
    assert math.dist(flight.places[1], goal) < 2.0
