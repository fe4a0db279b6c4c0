"""The baselines: bounce, the Lévy walk, the sweep; and the fence response that all planners share."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import shapely
from scipy import stats

from swarmctl.core import planners

from ..core.worlds import Box, Place, fences, fleet_of, region, rules_of, world_of
from .situation import Situation, bearing, near

AREA: Box = (0.0, 1000.0, 0.0, 1000.0)
KEEP_OUT: Box = (400.0, 600.0, 400.0, 600.0)


def at_fence(algorithm: str = "bounce", count: int = 200, **values: Any) -> Situation:
    """Vehicles that fly against the eastern border, too near to go on for another period."""
    return Situation(algorithm, [(990.0, 500.0)] * count, [20.0] * count, area=AREA, **values).plan()


def test_bounce_flies_straight_on() -> None:
    s = Situation("bounce", [(0.0, 500.0)], [0.0], [(500.0, 500.0)], area=AREA)
    assert s.fly(39).place() == (975.0, 500.0)
    assert s.heading() == near(0.0)


@pytest.mark.parametrize("algorithm", planners.MODULES)
def test_the_fence_response_is_legal_and_differs_from_vehicle_to_vehicle(algorithm: str) -> None:
    s = at_fence(algorithm, 60)
    legal = region(AREA)
    ends = [(990.0 + s.world.wishes[i]["v_east"], 500.0 + s.world.wishes[i]["v_north"]) for i in range(60)]
    assert all(legal.covers(shapely.LineString([(990.0, 500.0), end])) for end in ends)
    assert all(s.speed(i) == pytest.approx(25.0) for i in range(60))
    if algorithm != "sweep":
        assert len({s.heading(i) for i in range(60)}) == 60


def test_the_fence_response_looks_round_a_keep_out_too() -> None:
    s = Situation("bounce", [(380.0, 500.0)] * 100, [0.0] * 100, area=AREA, keep_outs=[KEEP_OUT]).plan()
    east = s.world.wishes["v_east"]
    assert (380.0 + east <= 400.0).all()
    assert np.ptp(s.world.wishes["v_north"]) > 40.0


def test_inertia_carries_the_fence_response_straight_back() -> None:
    for inertia, spread in ((40.0, 2.0), (0.0, 60.0)):
        s = at_fence(inertia=inertia)
        back = [(s.heading(i) - 200.0 + 180.0) % 360.0 - 180.0 for i in range(200)]
        assert np.std(back) == pytest.approx(spread, rel=0.4)


def test_boxed_in_it_stands_and_flies_on_when_free() -> None:
    s = Situation("bounce", [(5.0, 5.0)], [0.0], area=(0.0, 10.0, 0.0, 10.0)).plan()
    assert s.speed() == 0.0
    s.world.fences.plan[:] *= 100.0
    assert s.plan().speed() == pytest.approx(25.0)


def test_a_real_vehicle_looks_as_far_as_it_needs_to_stop() -> None:
    reach = 25.0 + 25.0 * 25.0 / (2.0 * 4.0)  # a period, and v²/2a
    spots = [(1000.0 - reach - 1.0, 500.0), (1000.0 - reach + 1.0, 500.0)]
    s = Situation("bounce", spots, [0.0, 0.0], area=AREA, ideal=False).plan()
    assert s.heading(0) == near(0.0)
    assert s.heading(1) != near(0.0, 0.01)


@pytest.mark.parametrize("algorithm", planners.MODULES)
def test_from_the_fences_margin_it_heads_back_in_by_the_shortest_way(algorithm: str) -> None:
    spots = [(985.0, 500.0), (985.0, 300.0), (500.0, 12.0)]
    s = Situation(algorithm, spots, [0.0, 120.0, 0.0], area=AREA, margin=20.0, ideal=False).plan()
    assert [s.heading(i) for i in range(3)] == [near(180.0), near(180.0), near(90.0)]


def lengths_flown(mu: float, shortest: float) -> list[float]:
    """The length that each of 3000 vehicles draws for its first flight."""
    count = 3000
    s = Situation("levy", [(0.0, 0.0)] * count, mu=mu, shortest_m=shortest, longest_m=1e12).plan()
    return [s.remembers("left_m", i) for i in range(count)]


@pytest.mark.parametrize(("mu", "shortest"), [(2.0, 200.0), (1.5, 50.0), (3.0, 100.0)])
def test_levy_flights_have_power_law_lengths(mu: float, shortest: float) -> None:
    drawn = lengths_flown(mu, shortest)
    law = stats.pareto(mu - 1.0, scale=shortest)  # p(l) ~ l^-mu above the shortest
    assert stats.kstest(drawn, law.cdf).pvalue > 1e-3


def test_levy_flights_are_no_longer_than_the_longest() -> None:
    s = Situation("levy", [(0.0, 0.0)] * 500, shortest_m=200.0, longest_m=1000.0).plan()
    left = s.world.memory["left_m"]
    assert left.max() == 1000.0
    assert left.min() >= 200.0


def test_levy_flies_straight_for_its_length_then_turns_anywhere() -> None:
    turned = []
    for i in range(60):
        s = Situation("levy", [(0.0, 0.0)], [30.0], seed=i, shortest_m=100.0, longest_m=100.0)
        s.fly(4)
        assert s.heading() == near(30.0)
        assert s.place() == pytest.approx((100 * math.cos(math.radians(30)), 50.0))
        turned.append(s.fly(2).heading())
    assert stats.kstest(turned, stats.uniform(-180.0, 360.0).cdf).pvalue > 1e-3


def test_levy_draws_a_new_length_at_the_fence() -> None:
    s = at_fence("levy", 1, shortest_m=300.0, longest_m=300.0)
    s.world.memory["left_m"] = 50.0
    s.put(0, (990.0, 500.0), 20.0).plan()
    assert s.remembers("left_m") == 300.0


def raster(legal: shapely.Geometry, step: float) -> list[Place]:
    """A point every ``step`` metres wherever it is legal."""
    west, south, east, north = legal.bounds
    spots = [(float(x), float(y)) for x in np.arange(west, east, step) for y in np.arange(south, north, step)]
    return [spot for spot in spots if legal.contains(shapely.Point(spot))]


SWEPT: Box = (0.0, 2000.0, 0.0, 1600.0)


@pytest.mark.parametrize(
    "keep_outs",
    [(), [(300.0, 500.0, 600.0, 900.0)], [(0.0, 250.0, 500.0, 900.0), (900.0, 1300.0, 300.0, 1100.0)]],
)
@pytest.mark.parametrize("count", [1, 3])
def test_sweep_sees_every_place_and_enters_no_keep_out(count: int, keep_outs: Sequence[Box]) -> None:
    rules = rules_of(ideal=1, duration=1600.0 / count)
    spots = raster(region(SWEPT, keep_outs), 60.0)
    fleet = fleet_of([(5.0, 5.0)] * count, [45.0] * count, sensor_range=150.0)
    world = world_of("sweep", fleet, rules, fences(SWEPT, keep_outs), spots)
    world.run_ideal()
    assert (world.found >= 0).mean() == 1.0


def test_sweep_flies_parallel_lanes_an_overlapping_swath_apart() -> None:
    s = Situation("sweep", [(5.0, 5.0)], [45.0], area=SWEPT, sensor_range=150.0, overlap=0.3)
    track = np.array([s.fly().place() for _ in range(900)])
    lanes = np.unique(np.round(track[np.abs(track[:, 1] - 800.0) < 200.0, 0]))
    gaps = np.diff(lanes[np.append(True, np.diff(lanes) > 20.0)])
    assert len(gaps) == 9  # ten lanes of 2000 m
    assert gaps == pytest.approx(200.0, abs=3.0)  # the swath of 300 m would allow 210 m


def test_sweep_gives_each_vehicle_its_own_strip() -> None:
    s = Situation("sweep", [(5.0, 5.0), (5.0, 5.0)], [45.0, 45.0], area=SWEPT, sensor_range=150.0)
    s.fly(60)
    tracks = np.array([[s.fly().place(i)[0] for i in (0, 1)] for _ in range(400)])
    assert tracks[:, 0].max() < 1000.0 < tracks[:, 1].min()


def test_sweep_strips_are_as_wide_as_vehicles_are_fast_and_see() -> None:
    s = Situation("sweep", [(5.0, 5.0)] * 3, [45.0] * 3, area=SWEPT)
    s.world.fleet["speed"], s.world.fleet["sensor_range"] = [30.0, 10.0, 20.0], [100.0, 200.0, 250.0]
    s.world.prepare()
    assert [s.remembers("west", i) for i in range(3)] == pytest.approx([0.0, 600.0, 1000.0])
    assert [s.remembers("width", i) for i in range(3)] == pytest.approx([600.0, 400.0, 1000.0])


def test_sweep_passes_a_keep_out_and_rejoins_its_lane() -> None:
    keep_outs = [(950.0, 1010.0, 700.0, 900.0)]
    s = Situation("sweep", [(980.0, 300.0)], [90.0], area=(900.0, 1100.0, 0.0, 1600.0), keep_outs=keep_outs)
    legal = region((900.0, 1100.0, 0.0, 1600.0), keep_outs)
    places = [s.fly().place() for _ in range(110)]
    assert legal.buffer(1e-6).covers(shapely.LineString(places))
    lane = 1000.0
    beyond = [x for x, y in places if 1100.0 < y < 1500.0]
    assert beyond
    assert beyond == pytest.approx([lane] * len(beyond), abs=3.0)


def test_sweep_is_led_neither_by_targets_nor_by_neighbours() -> None:
    def flown(targets: Sequence[Place], radio: float) -> Place:
        spots, headings = [(5.0, 5.0), (5.0, 5.0)], [45.0, 45.0]
        return Situation("sweep", spots, headings, targets, area=SWEPT, radio_range=radio).fly(120).place(0)

    assert flown([], 0.0) == flown([(300.0, 300.0), (310.0, 900.0)], 600.0)
    assert bearing((5.0, 5.0), flown([], 0.0)) != near(45.0, 1.0)
