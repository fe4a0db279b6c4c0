"""The way home: every vehicle to its own pad, round what is forbidden, in few layers, in turn; whole missions."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from swarmctl.core import bind, stages, steering, timetable
from swarmctl.core.world import Fences, World

from .worlds import Box, Place, edges_of, fences, fleet_of, region, rules_of, world_of

AREA: Box = (0.0, 800.0, 0.0, 600.0)
KEEP_OUTS: list[Box] = [(300.0, 400.0, -50.0, 350.0), (500.0, 600.0, 250.0, 650.0)]
PADS = [(30.0 + 20.0 * (k % 3), 30.0 + 20.0 * (k // 3)) for k in range(6)]
INNER = shapely.Polygon([(0, 0), (800, 0), (800, 200), (200, 200), (200, 600), (0, 600)])


def grown(shape: shapely.Geometry, margin: float = 20.0) -> Fences:
    """The three fences of a keep-in of any shape."""
    raw, guard, plan = (edges_of(shape.buffer(-margin * k, join_style="mitre")) for k in (0.0, 0.5, 1.0))
    return Fences(raw, plan, guard)


class Return:
    """Vehicles ordered home from ``places``, hovering at 50 m, in still air."""

    def __init__(
        self, places: Sequence[Place], fence: Fences, pads: Sequence[Place] = PADS, speed: float = 12.0,
        separation: float = 15.0,
    ) -> None:  # fmt: skip
        fleet = fleet_of(pads[: len(places)], speed=speed)
        self.world: World = world_of("bounce", fleet, rules_of(separation=separation), fence)
        self.world.poses["east"], self.world.poses["north"] = np.transpose(places)
        self.world.poses["up"] = 50.0
        self.world.errands["stage"] = stages.SEARCH
        self.account = np.array([np.inf, 0.0, 0.0, 0.0])
        self.tick = 0
        self.times: dict[tuple[int, int], float] = {}  # when each vehicle entered each stage
        self.order()

    def order(self) -> None:
        """Order everybody home."""
        self.world.orders[:] = 1
        self.world.begin_return(0.0)

    def fly(self, most_s: float = 1200.0) -> "Return":
        """Steer and move until all have landed, keeping account."""
        w = self.world
        for _ in range(round(most_s / 0.1)):
            w.steer(self.tick * 0.1)
            move(w.fleet, w.poses, w.errands, w.sent, w.setpoints, w.rules)
            watch(w.poses, w.errands, w.fences.raw, w.paths, self.account)
            for i, stage in enumerate(w.errands["stage"]):
                self.times.setdefault((i, int(stage)), self.tick * 0.1)
            self.tick += 1
            if np.isin(w.errands["stage"], (stages.LANDED, stages.ADRIFT)).all():
                break
        return self

    @property
    def seconds(self) -> float:
        """How long it has been flown."""
        return self.tick * 0.1

    def place(self, i: int) -> Place:
        """Where vehicle ``i`` is."""
        return float(self.world.poses["east"][i]), float(self.world.poses["north"][i])

    def order_only(self, i: int) -> "Return":
        """Let all others search on, standing where they are, as if only vehicle ``i`` had been ordered home."""
        self.world.errands["stage"] = stages.SEARCH
        self.world.orders[i] = 1
        self.world.begin_return(0.0)
        return self

    def check(self) -> None:
        """Everybody stands on its own pad, nobody broke a limit."""
        w = self.world
        assert (w.errands["stage"] == stages.LANDED).all()
        off = np.hypot(w.poses["east"] - w.fleet["pad_east"], w.poses["north"] - w.fleet["pad_north"])
        assert off.max() < 1.0
        assert (w.poses["up"] < 0.05).all()
        assert self.account[1] == 0.0
        assert self.account[0] >= float(w.rules[0]["separation"])


move, watch = bind.compiled(steering.move), bind.compiled(steering.watch)


def routes(world: World) -> list[shapely.LineString]:
    """Everybody's way home as ordered."""
    ways = []
    for pose, errand in zip(world.poses, world.errands, strict=True):
        count = errand["points"]
        corners = zip(errand["route_east"][:count], errand["route_north"][:count], strict=True)
        ways.append(shapely.LineString([(pose["east"], pose["north"]), *corners]))
    return ways


SPREAD = [(740.0, 60.0), (700.0, 550.0), (450.0, 100.0), (450.0, 500.0), (120.0, 500.0), (760.0, 300.0)]


def test_all_land_on_their_own_pads_round_the_keep_outs() -> None:
    Return(SPREAD, fences(AREA, KEEP_OUTS, 20.0)).fly().check()


def test_every_route_leads_round_the_keep_outs_to_the_own_pad() -> None:
    world = Return(SPREAD, fences(AREA, KEEP_OUTS, 20.0)).world
    legal = region(AREA, KEEP_OUTS, 10.0)
    for way, pad in zip(routes(world), PADS, strict=True):
        assert legal.covers(way)
        assert way.coords[-1] == pad


def test_from_round_an_inner_corner() -> None:
    places = [(700.0, 100.0), (740.0, 60.0), (100.0, 550.0), (60.0, 500.0)]
    pads = [(60.0, 500.0), (60.0, 540.0), (740.0, 60.0), (700.0, 100.0)]
    flight = Return(places, grown(INNER), pads)
    assert all(INNER.buffer(-10.0, join_style="mitre").covers(way) for way in routes(flight.world))
    flight.fly().check()


def spread(count: int, seed: int, area: Box = AREA) -> list[Place]:
    """Places at least 16 m apart, drawn from an area."""
    rng = np.random.default_rng(seed)
    west, east, south, north = area
    places: list[Place] = []
    while len(places) < count:
        place = float(rng.uniform(west + 20.0, east - 20.0)), float(rng.uniform(south + 20.0, north - 20.0))
        if all(math.dist(place, other) >= 16.0 for other in places):
            places.append(place)
    return places


def grid(count: int, spacing: float = 20.0) -> list[Place]:
    """A square grid of pads, row by row."""
    columns = math.ceil(math.sqrt(count))
    return [(25.0 + spacing * (k % columns), 25.0 + spacing * (k // columns)) for k in range(count)]


@pytest.mark.parametrize(("count", "seed"), [(6, 1), (6, 2), (30, 3), (60, 4)])
def test_by_plan_nobody_comes_near_another_in_one_layer(count: int, seed: int) -> None:
    world = Return(spread(count, seed), fences(AREA, (), 20.0), grid(count)).world
    ways, layers, released = routes(world), world.errands["layer"], world.errands["release_at"]
    under_way = np.array([[r <= t <= r + w.length / 12.0 for t in range(200)]
                          for w, r in zip(ways, released, strict=True)])  # fmt: skip
    places = np.array([shapely.get_coordinates(w.interpolate(12.0 * (np.arange(200) - r)))
                       for w, r in zip(ways, released, strict=True)])  # fmt: skip
    shared = 0
    for i, j in itertools.combinations(range(count), 2):
        if abs(layers[i] - layers[j]) < 6.0:
            shared += 1
            apart = np.hypot(*(places[i] - places[j]).T)
            assert apart[under_way[i] & under_way[j]].min(initial=math.inf) >= 15.0
    assert shared > 0


def test_layers_are_few_and_begin_at_the_search_height() -> None:
    layers = Return(spread(60, 1), fences(AREA, (), 20.0), grid(60)).world.errands["layer"]
    assert set(layers) == {50.0 + timetable.LAYER_M * k for k in range(timetable.LAYERS)}


def test_nobody_climbs_far_above_the_layers() -> None:
    flight = Return(spread(60, 1), fences(AREA, (), 20.0), grid(60))
    highest = 0.0
    while (flight.world.errands["stage"] != stages.LANDED).any() and flight.seconds < 300.0:
        flight.fly(0.1)
        highest = max(highest, float(flight.world.poses["up"].max()))
    flight.check()
    assert highest < 50.0 + timetable.LAYER_M * (timetable.LAYERS + 1) + 1.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_hundred_are_down_in_three_minutes(seed: int) -> None:
    area = (0.0, 1000.0, 0.0, 1000.0)
    flight = Return(spread(100, seed, area), fences(area, (), 20.0), grid(100))
    flight.fly().check()
    assert flight.seconds < 165.0  # the farthest alone takes 140 s from 50 m


@pytest.mark.parametrize(("count", "separation"), [(30, 25.0), (41, 15.0), (100, 15.0)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_crowd_over_the_pads_blocks_itself(count: int, separation: float, seed: int) -> None:
    """Everybody hovers over another one's pad, with hardly room to pass between two of them."""
    pads = grid(count, separation + 1.0)
    places = [pads[k] for k in np.random.default_rng(seed).permutation(count)]
    flight = Return(places, fences(AREA, (), 20.0), pads, separation=separation)
    flight.fly(400.0).check()


def test_of_two_that_bar_each_others_way_one_climbs() -> None:
    pads = [(60.0, 300.0), (740.0, 300.0)]
    corridor = fences(
        (0.0, 800.0, 270.0, 330.0), (), 20.0
    )  # 40 m between the guard's fences: no room to pass
    flight = Return([(450.0, 300.0), (350.0, 300.0)], corridor, pads, separation=45.0)
    world = flight.world
    world.errands["layer"], world.errands["release_at"] = 50.0, 0.0
    highest = [0.0, 0.0]
    while (world.errands["stage"] != stages.LANDED).any() and flight.seconds < 200.0:
        flight.fly(0.1)
        highest = [max(h, float(up)) for h, up in zip(highest, world.poses["up"], strict=True)]
    assert (world.errands["stage"] == stages.LANDED).all()
    assert flight.account[0] >= 45.0
    assert min(highest) < 51.0 < max(highest)


def adrift_at(flight: Return, i: int, place: Place, up: float) -> None:
    """Vehicle ``i`` is no longer ours and hovers at a place."""
    world = flight.world
    world.errands["stage"][i] = stages.ADRIFT
    world.poses["east"][i], world.poses["north"][i], world.poses["up"][i] = *place, up


@pytest.mark.parametrize("up", [50.0, 30.0, 4.0])
def test_where_somebody_adrift_stands_over_its_pad_it_lands_beside(up: float) -> None:
    flight = Return(SPREAD, fences(AREA, KEEP_OUTS, 20.0))
    adrift_at(flight, 5, PADS[0], up)
    flight.fly(400.0)
    assert flight.world.errands["stage"].tolist() == [stages.LANDED] * 5 + [stages.ADRIFT]
    beside = flight.place(0)
    assert 15.0 < math.dist(beside, PADS[0]) < 60.0
    assert all(math.dist(beside, pad) > 15.0 for pad in PADS[1:])
    assert all(math.dist(flight.place(i), PADS[i]) < 1.0 for i in range(1, 5))
    assert flight.account[0] >= 15.0


def stacked() -> Return:
    """Vehicle 1 waits in the very corner to climb from 50 to 62 m; vehicle 0 hovers over its pad, above it, at 56 m."""
    flight = Return([(20.0, 20.0), (12.0, 12.0)], fences(AREA, (), 20.0), [(20.0, 20.0), (700.0, 500.0)])
    world = flight.world
    world.poses["up"] = 56.0, 50.0
    world.errands["stage"] = stages.OVER_PAD, stages.WAIT
    world.errands["layer"] = 56.0, 62.0
    world.errands["wait_up"] = 50.0
    world.errands["release_at"] = 0.0
    return flight


def test_over_its_pad_it_steps_aside_of_one_that_has_to_climb() -> None:
    flight = stacked().fly(8.0)
    assert flight.world.errands["stage"][1] in (stages.CLIMB, stages.TRANSIT)
    flight.fly(200.0).check()


def test_a_climb_that_stays_blocked_is_given_up() -> None:
    flight = stacked()
    flight.world.errands["stage"][0] = stages.ADRIFT
    flight.fly(15.0)
    assert flight.world.errands["stage"][1] == stages.WAIT
    flight.fly(200.0)
    assert flight.world.errands["stage"][1] == stages.LANDED
    assert math.dist(flight.place(1), (700.0, 500.0)) < 1.0


def test_it_waits_a_while_for_somebody_adrift_to_go() -> None:
    flight = Return([(300.0, 100.0), (700.0, 500.0)], fences(AREA, (), 20.0))
    adrift_at(flight, 1, PADS[0], 30.0)
    flight.fly(40.0)
    assert flight.world.errands["stage"][0] in (stages.OVER_PAD, stages.DESCEND)
    flight.world.poses["east"][1] += 100.0
    flight.fly(60.0)
    assert flight.world.errands["stage"][0] == stages.LANDED
    assert math.dist(flight.place(0), PADS[0]) < 1.0


def test_ways_that_do_not_meet_share_a_layer() -> None:
    pads = [(50.0, 50.0), (50.0, 300.0), (50.0, 550.0)]
    flight = Return([(700.0, 50.0), (700.0, 300.0), (700.0, 550.0)], fences(AREA, (), 20.0), pads)
    assert len(set(flight.world.errands["layer"])) < 3
    flight.fly().check()


def test_they_set_out_in_turn_and_one_alone_at_once() -> None:
    flight = Return(spread(30, 1), fences(AREA, (), 20.0), grid(30))
    released = flight.world.errands["release_at"].copy()
    assert released.min() == 0.0
    assert len(set(released)) > 5
    flight.fly()
    assert all(flight.times[i, stages.TRANSIT] >= released[i] - 1.0 for i in range(30))
    alone = Return([(100.0, 300.0)], fences(AREA, KEEP_OUTS, 20.0)).fly()
    assert alone.times[0, stages.TRANSIT] < 1.0
    distance = math.dist((100.0, 300.0), PADS[0])
    assert alone.times[0, stages.OVER_PAD] < distance / 12.0 + 12.0


def test_stages_come_in_order() -> None:
    flight = Return(SPREAD, fences(AREA, KEEP_OUTS, 20.0)).fly()
    for i in range(6):
        entered = [flight.times[i, stage] for stage in range(stages.TRANSIT, stages.LANDED + 1)]
        assert entered == sorted(entered)


def test_two_in_one_column_part_before_they_change_height() -> None:
    flight = Return([(400.0, 450.0), (416.0, 450.0), (432.0, 450.0)], fences(AREA, (), 20.0))
    flight.fly().check()


def test_one_that_searches_on_keeps_its_height_to_itself() -> None:
    flight = Return(SPREAD[:3], fences(AREA, KEEP_OUTS, 20.0))
    world = flight.world
    flight.order_only(0)
    assert world.errands["layer"][0] == 56.0
    assert world.errands["stage"].tolist() == [stages.WAIT, stages.SEARCH, stages.SEARCH]


def test_who_must_climb_past_another_steps_aside_first() -> None:
    flight = Return([(400.0, 450.0), (405.0, 450.0), (100.0, 500.0)], fences(AREA, (), 20.0))
    world = flight.world
    world.fleet["altitude"] = world.poses["up"] = [50.0, 60.0, 50.0]  # the second searches above the first
    flight.order_only(0).fly(30.0)
    assert world.errands["layer"][0] == 68.0
    assert world.errands["stage"][0] == stages.TRANSIT
    assert flight.account[0] >= 15.0


def test_over_its_pad_it_waits_for_one_that_hovers_below() -> None:
    flight = Return([(300.0, 100.0), PADS[0]], fences(AREA, (), 20.0))
    world = flight.world
    flight.order_only(0).fly(80.0)
    assert world.errands["stage"].tolist() == [stages.OVER_PAD, stages.SEARCH]
    assert flight.account[0] >= 15.0
    world.wishes[1] = (5.0, 0.0)
    flight.fly(60.0)
    assert world.errands["stage"][0] == stages.LANDED
    assert flight.account[0] >= 15.0


@pytest.mark.parametrize("place", [(795.0, 300.0), (820.0, 300.0), (350.0, 345.0)])
def test_from_outside_the_fence_too(place: Place) -> None:
    flight = Return([place], fences(AREA, KEEP_OUTS, 20.0)).fly()
    world = flight.world
    assert (world.errands["stage"] == stages.LANDED).all()
    assert math.dist((world.poses["east"][0], world.poses["north"][0]), PADS[0]) < 1.0


def test_swapped_places_near_the_pads() -> None:
    """Everybody hovers over another one's pad."""
    Return(PADS[::-1], fences(AREA, KEEP_OUTS, 20.0)).fly(2400.0).check()


@pytest.mark.parametrize("algorithm", ["fco", "mdc"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_whole_mission_breaks_no_limit(algorithm: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    targets = [(float(x), float(y)) for x, y in rng.normal((450.0, 400.0), 60.0, (40, 2))]
    fleet = fleet_of(PADS, rng.uniform(0.0, 90.0, 6).tolist(), sensor_range=120.0, radio_range=300.0)
    fence = fences(AREA, KEEP_OUTS, 20.0)
    world = world_of(algorithm, fleet, rules_of(duration=120.0, seed=seed), fence, targets)
    in_range, account, length_s = world.run_multicopter()
    nearest, outside, standing, searching = account
    assert (world.errands["stage"] == stages.LANDED).all()
    off = np.hypot(world.poses["east"] - fleet["pad_east"], world.poses["north"] - fleet["pad_north"])
    assert off.max() < 1.0
    assert outside == 0.0
    assert 15.0 <= nearest < 30.0
    assert searching == 6 * 1200
    assert standing < 0.2 * searching
    assert 120.0 < length_s < 900.0
    assert in_range.shape == (120, 2)
    assert 0 < in_range[:, 1].max() <= 6
    assert (in_range[:, 0] >= in_range[:, 1]).all()
