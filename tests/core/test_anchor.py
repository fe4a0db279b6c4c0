"""Anchors save the guard its tests and change none of its decisions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.core import stages

from .flying import Flight, scattered, wild
from .worlds import Box, region

AREA: Box = (0.0, 900.0, 0.0, 700.0)
KEEP_OUTS: list[Box] = [(300.0, 380.0, 250.0, 350.0)]
SEEDS = st.integers(0, 1 << 32)


def look_at_everything(flight: Flight) -> None:
    """From now on no anchor is ever left, each has neighbours, and the fence is never far: all tests are made."""
    paths = flight.world.paths
    paths["freedom"] = paths["fastest"] = np.inf
    paths["clear"], paths["near"] = -1.0, 1


@given(
    seed=SEEDS, latency=st.sampled_from([0.0, 0.1, 0.5]), lag=st.sampled_from([0.0, 0.5]),
    speed=st.sampled_from([8.0, 25.0]), count=st.integers(1, 8), returns=st.booleans(),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_the_guard_decides_as_it_does_when_it_looks_at_everything(
    seed: int, latency: float, lag: float, speed: float, count: int, returns: bool
) -> None:
    places = scattered(np.random.default_rng(seed), count, region(AREA, KEEP_OUTS, 11.0), apart=16.0)
    quick, thorough = (
        Flight(places, AREA, KEEP_OUTS, speed=speed, latency=latency, lag=lag) for _ in range(2)
    )
    wishes = [wild(np.random.default_rng(seed)) for _ in range(2)]
    for flight, wish in zip((quick, thorough), wishes, strict=True):
        flight.step(wish(flight))
    look_at_everything(thorough)
    for tick in range(200):
        if returns and tick == 100:  # one of them: the others' paths are then looked at
            for flight in (quick, thorough):
                flight.world.orders[0] = 1
                flight.world.begin_return(tick * 0.1)
        for flight, wish in zip((quick, thorough), wishes, strict=True):
            flight.step(wish(flight))
        assert quick.world.setpoints.tobytes() == thorough.world.setpoints.tobytes(), f"tick {tick}"
        assert quick.world.poses.tobytes() == thorough.world.poses.tobytes()


def test_neighbours_are_counted_whoever_moves() -> None:
    rng = np.random.default_rng(7)
    flight = Flight(scattered(rng, 24, region(AREA, KEEP_OUTS, 11.0), apart=16.0), AREA, KEEP_OUTS, speed=8.0)
    wishes = wild(rng)
    seen = set()
    for _ in range(600):
        flight.step(wishes(flight))
        paths = flight.world.paths[:-1]
        places = np.column_stack((paths["anchor_east"], paths["anchor_north"]))
        gaps = np.hypot(*(places[:, None] - places[None]).T) - paths["hold"][:, None] - paths["hold"][None]
        near = (gaps <= 15.5) & ~np.eye(len(paths), dtype=bool)
        assert near.sum(axis=0).tolist() == paths["near"].tolist()
        seen |= set(paths["near"].tolist())
    assert len(seen) > 3


def test_a_vehicle_far_from_everything_is_free_and_one_near_the_fence_is_not() -> None:
    flight = Flight([(450.0, 550.0), (25.0, 60.0)], AREA, speed=8.0)
    flight.step([(5.0, 0.0), (5.0, 0.0)])
    # A vehicle's path is written only where others look at it; the last row, a candidate's, for who is not free.
    flight.world.paths["east_0"] = -1.0
    flight.step([(5.0, 0.0), (5.0, 0.0)])
    assert (flight.world.paths["east_0"] == -1.0).tolist() == [True, True, False]
    assert flight.world.paths["near"][:2].tolist() == [0, 0]
    flight.world.errands["stage"][1] = stages.OVER_PAD
    here = flight.places[0][0]
    flight.step([(5.0, 0.0), (5.0, 0.0)])
    assert flight.world.paths["east_0"][0] == here


@pytest.mark.parametrize("field", ["east", "v_north"])
def test_a_pose_that_is_no_number_leaves_nobody_free(field: str) -> None:
    flight = Flight([(200.0, 500.0), (700.0, 500.0)], AREA, speed=8.0)
    flight.step([(0.0, 0.0)] * 2)
    flight.world.poses[field][0] = np.nan
    flight.world.steer(0.1)
    assert flight.world.paths["near"][:2].tolist() == [1, 1]
