"""Vehicles taken back at whatever height and however near one another part, and come to their search height."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.core import guard, motion, stages

from .flying import Flight
from .worlds import Box, Place

AREA: Box = (0.0, 400.0, 0.0, 400.0)
ALTITUDE_M = 20.0
MOST_TICKS = 1200


class Taken(Flight):
    """Vehicles that were just taken back at ``heights`` (m) over ``places``, flying at ``speeds`` (m/s)."""

    def __init__(
        self, places: Sequence[Place], heights: Sequence[float], speeds: Sequence[Place] | None = None
    ) -> None:
        super().__init__(places, AREA, speed=8.0, altitude=ALTITUDE_M, latency=0.1)
        self.world.poses["up"] = heights
        self.world.errands["stage"] = stages.TAKEN
        if speeds is not None:
            self.world.poses["v_east"], self.world.poses["v_north"] = np.transpose(speeds)

    def tick_once(self) -> None:
        """One setpoint interval, heights included."""
        self.step([(0.0, 0.0)] * len(self.places))
        for pose, vehicle, setpoint in zip(
            self.world.poses, self.world.fleet, self.world.setpoints, strict=True
        ):
            rate = motion.climb_rate_towards(
                pose["up"], setpoint["up"], vehicle["climb"], vehicle["descent"],
                vehicle["climb_acceleration"],
            )  # fmt: skip
            pose["up"] += 0.1 * rate

    def gaps(self) -> list[tuple[float, float]]:
        """Of each two vehicles, how far apart they are sideways and in height (m)."""
        poses = self.world.poses
        return [
            (math.dist(self.places[i], self.places[j]), abs(float(poses["up"][i] - poses["up"][j])))
            for i in range(len(poses))
            for j in range(i)
        ]

    @property
    def level(self) -> bool:
        """Whether all are at their search height."""
        return bool((self.world.errands["stage"] == stages.HOLD).all())

    def settle(self) -> "Taken":
        """Fly until all hold, and watch that nobody comes near another who was not near to begin with."""
        wanted = float(self.world.rules[0]["separation"])
        before = self.gaps()
        for _ in range(MOST_TICKS):
            self.tick_once()
            now = self.gaps()
            for (was, was_high), (apart, high) in zip(before, now, strict=True):
                if high < guard.HEIGHT_SEPARATION_M:
                    assert apart >= min(wanted, was - 0.01), f"{was} → {apart} m at tick {self.tick}"
                    assert apart >= wanted or was_high < guard.HEIGHT_SEPARATION_M + 0.7
            before = now
            if self.level:
                return self
        raise AssertionError([stages.NAMES[s] for s in self.world.errands["stage"]])


@pytest.mark.parametrize("height", [8.0, 19.7, 20.0, 30.0, 44.0])
def test_a_single_one_goes_to_its_height_and_nowhere_else(height: float) -> None:
    flight = Taken([(200.0, 200.0)], [height]).settle()
    assert flight.places.tolist() == [[200.0, 200.0]]
    assert abs(flight.world.poses["up"][0] - ALTITUDE_M) < 0.7


def test_it_keeps_its_height_while_another_is_below() -> None:
    flight = Taken([(200.0, 200.0), (203.0, 200.0)], [30.0, 20.0])
    heights = []
    while math.dist(*flight.places) < 15.0:
        flight.tick_once()
        heights.append(float(flight.world.poses["up"][0]))
    assert min(heights) > 29.9
    flight.settle()


def test_two_at_one_height_part_before_either_sinks() -> None:
    flight = Taken([(200.0, 200.0), (202.0, 200.0)], [30.0, 27.0])
    while math.dist(*flight.places) < 15.0:
        flight.tick_once()
        assert flight.world.poses["up"].min() > 26.5
    flight.settle()


def test_beside_one_adrift_it_moves_and_the_other_is_not_reckoned_with() -> None:
    flight = Taken([(200.0, 200.0), (204.0, 203.0)], [30.0, 24.0])
    flight.world.errands["stage"][1] = stages.ADRIFT
    for _ in range(MOST_TICKS):
        flight.step([(0.0, 0.0)] * 2)
        if flight.world.errands["stage"][0] == stages.LEVEL:
            break
    assert flight.world.errands["stage"].tolist() == [stages.LEVEL, stages.ADRIFT]
    assert math.dist(*flight.places) >= 15.0


@given(st.integers(0, 1 << 32))
@settings(max_examples=40, deadline=None)
def test_all_part_and_come_to_their_height_wherever_they_were(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 7))
    places = [(float(e), float(n)) for e, n in rng.uniform(150.0, 190.0, (count, 2))]
    Taken(places, rng.uniform(10.0, 45.0, count).tolist()).settle()


@given(st.integers(0, 1 << 32))
@settings(max_examples=20, deadline=None)
def test_taken_back_at_full_speed_all_stop_inside_the_fence_and_come_to_their_height(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 7))
    places = [(float(e), float(n)) for e, n in rng.uniform(40.0, 110.0, (count, 2))]
    angles = rng.uniform(0.0, 2.0 * math.pi, count)
    speeds = [(8.0 * math.cos(a), 8.0 * math.sin(a)) for a in angles]
    flight = Taken(places, rng.uniform(10.0, 45.0, count).tolist(), speeds)
    for _ in range(MOST_TICKS):
        flight.tick_once()
        assert flight.places.min() > 0.0
        if flight.level:
            break
    assert flight.level and flight.nearest() >= 15.0
