"""The way home: the shortest legal one, against a brute-force search with shapely's eyes."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from swarmctl.core import fence, route, state
from swarmctl.core.arrays import Floats

from .worlds import Box, Place, edges_of, fences, region

AREA: Box = (0.0, 1000.0, 0.0, 1000.0)
MARGIN = 20.0
PLACE = st.tuples(st.floats(30.0, 970.0), st.floats(30.0, 970.0))
KEEP_OUT = st.builds(
    lambda x, y, w, h: (x, x + w, y, y + h),
    st.floats(50.0, 800.0), st.floats(50.0, 800.0), st.floats(10.0, 500.0), st.floats(10.0, 500.0),
)  # fmt: skip


def way(plan: Floats, guard: Floats, start: Place, end: Place) -> list[Place]:
    """The route from ``start`` to ``end``, both included."""
    errands = np.zeros(2, state.ERRAND)
    route.find(plan, guard, *start, *end, errands, 1)
    assert (errands["points"][0], errands["next"][1]) == (0, 0)
    count = errands["points"][1]
    return [start, *zip(errands["route_east"][1][:count], errands["route_north"][1][:count], strict=True)]


def length(points: list[Place]) -> float:
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))


def brute_force(nodes: list[Place], legal: shapely.Geometry) -> float:
    """The length of the shortest way from the last but one node to the last, along legs that ``legal`` covers."""
    count = len(nodes)
    legs = np.full((count, count), np.inf)
    room = legal.buffer(1e-6)
    shapely.prepare(room)
    for a, b in itertools.combinations(range(count), 2):
        if room.covers(shapely.LineString([nodes[a], nodes[b]])):
            legs[a, b] = legs[b, a] = math.dist(nodes[a], nodes[b])
    away = legs[-2].copy()
    for _ in range(count):
        away = np.minimum(away, (away[:, None] + legs).min(axis=0))
    return float(away[-1])


@given(st.lists(KEEP_OUT, max_size=3), PLACE, PLACE)
@settings(deadline=None, max_examples=60)
def test_is_the_shortest_legal_way(keep_outs: list[Box], start: Place, end: Place) -> None:
    fence_ = fences(AREA, keep_outs, MARGIN)
    plan, guard = region(AREA, keep_outs, MARGIN), region(AREA, keep_outs, MARGIN / 2.0)
    assume(guard.geom_type == "Polygon" and plan.geom_type == "Polygon")
    assume(all(guard.buffer(-1e-3).contains(shapely.Point(p)) for p in (start, end)))
    corners = [(float(x), float(y)) for x, y in fence_.plan[:, :2]]
    expected = brute_force([*corners, start, end], guard)
    assume(math.isfinite(expected))  # the guard's region may have pockets that no corner of the plan's sees
    found = way(fence_.plan, fence_.guard, start, end)
    assert found[-1] == end
    assert guard.buffer(1e-6).covers(shapely.LineString([*found, end]))
    assert length(found) == pytest.approx(expected)


def test_goes_straight_where_nothing_is_in_the_way() -> None:
    made = fences(AREA, [(400.0, 600.0, 400.0, 600.0)], MARGIN)
    assert way(made.plan, made.guard, (100.0, 100.0), (900.0, 200.0)) == [(100.0, 100.0), (900.0, 200.0)]


def test_rounds_a_keep_out_at_its_grown_corners() -> None:
    made = fences(AREA, [(400.0, 600.0, 300.0, 900.0)], MARGIN)
    found = way(made.plan, made.guard, (200.0, 500.0), (800.0, 500.0))
    assert found[1:-1] == [(380.0, 280.0), (620.0, 280.0)]


def test_follows_an_area_round_its_inner_corner() -> None:
    shape = shapely.Polygon([(0, 0), (1000, 0), (1000, 300), (300, 300), (300, 1000), (0, 1000)])
    plan, guard = (edges_of(shape.buffer(-m, join_style="mitre")) for m in (20.0, 10.0))
    found = way(plan, guard, (900.0, 200.0), (200.0, 900.0))
    assert found == [(900.0, 200.0), (pytest.approx(280.0), pytest.approx(280.0)), (200.0, 900.0)]


def test_without_a_way_it_is_the_straight_line() -> None:
    made = fences(AREA, [(400.0, 600.0, -50.0, 1050.0)], MARGIN)  # the area is cut in two
    assert way(made.plan, made.guard, (200.0, 500.0), (800.0, 500.0)) == [(200.0, 500.0), (800.0, 500.0)]


def test_a_way_with_more_corners_than_fit_still_ends_at_its_goal() -> None:
    walls = [
        (60.0 + 30.0 * k, 62.0 + 30.0 * k, *((-10.0, 940.0) if k % 2 else (60.0, 1010.0))) for k in range(30)
    ]
    made = fences((0.0, 1000.0, 0.0, 1000.0), walls, 4.0)
    found = way(made.plan, made.guard, (20.0, 500.0), (990.0, 500.0))
    assert len(found) == state.ROUTE_POINTS + 1
    assert found[-1] == (990.0, 500.0)
    assert not fence.crosses(made.guard, *found[0], *found[1])
