"""The fence's plain loops against shapely, over random areas with random keep-outs."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from swarmctl.core import fence

from .worlds import edges_of, region

COORDINATE = st.floats(-50.0, 1050.0).map(lambda metres: round(metres, 6))  # as missions' geometry is
POINT = st.tuples(COORDINATE, COORDINATE)
SIZE = st.floats(5.0, 400.0).map(lambda metres: round(metres, 6))
KEEP_OUT = st.builds(lambda x, y, w, h: (x, x + w, y, y + h), COORDINATE, COORDINATE, SIZE, SIZE)
AREAS = st.lists(KEEP_OUT, max_size=4).map(lambda boxes: region((0.0, 1000.0, 0.0, 1000.0), boxes))
CORNERS = st.lists(POINT, min_size=3, max_size=9)
CLEAR = 1e-6  # m: a case nearer to a tie than this may count as either


def star(points: list[tuple[float, float]]) -> shapely.Geometry:
    """A simple polygon through the points: by their angle from their centre."""
    centre = np.mean(points, axis=0)
    return shapely.Polygon(sorted(points, key=lambda p: math.atan2(p[1] - centre[1], p[0] - centre[0])))


SHAPES = st.one_of(AREAS, CORNERS.map(star)).filter(lambda s: s.is_valid and s.area > 1.0)


def tied(shape: shapely.Geometry, *points: tuple[float, float]) -> bool:
    """Whether a point lies on the border, or the segment between two passes a corner, within rounding."""
    if any(shape.boundary.distance(shapely.Point(p)) < CLEAR for p in points):
        return True
    corners = shapely.MultiPoint(edges_of(shape)[:, :2])
    return len(points) > 1 and shapely.LineString(points).distance(corners) < CLEAR


@given(SHAPES, POINT)
@settings(deadline=None)
def test_inside(shape: shapely.Geometry, point: tuple[float, float]) -> None:
    assume(not tied(shape, point))
    assert fence.inside(edges_of(shape), *point) == shape.contains(shapely.Point(point))


@given(SHAPES, POINT, POINT)
@settings(deadline=None, max_examples=200)
def test_crosses(shape: shapely.Geometry, a: tuple[float, float], b: tuple[float, float]) -> None:
    assume(not tied(shape, a, b))
    assert fence.crosses(edges_of(shape), *a, *b) == shape.boundary.intersects(shapely.LineString([a, b]))


@given(SHAPES, POINT, POINT)
@settings(deadline=None, max_examples=200)
def test_legal_from_within(shape: shapely.Geometry, a: tuple[float, float], b: tuple[float, float]) -> None:
    if not shape.contains(shapely.Point(a)):
        a = shape.representative_point().coords[0]
    assume(not tied(shape, a, b))
    assert fence.legal(edges_of(shape), *a, *b) == shape.covers(shapely.LineString([a, b]))


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ((0.0, 0.0), (300.0, 300.0), True),  # from the corner, where a search in ideal dynamics starts
        ((0.0, 500.0), (25.0, 500.0), True),  # from the border inwards
        ((0.0, 500.0), (-25.0, 500.0), False),  # and outwards
        ((0.0, 0.0), (-10.0, -10.0), False),
        ((0.0, 0.0), (0.0, -10.0), False),
        ((500.0, 500.0), (1500.0, 500.0), False),
    ],
)
def test_legal_from_the_border(a: tuple[float, float], b: tuple[float, float], expected: bool) -> None:
    assert fence.legal(edges_of(region((0.0, 1000.0, 0.0, 1000.0))), *a, *b) is expected


@given(SHAPES, POINT)
@settings(deadline=None)
def test_nearest(shape: shapely.Geometry, point: tuple[float, float]) -> None:
    found = fence.nearest(edges_of(shape), *point)
    border = shape.boundary
    assert border.distance(shapely.Point(found)) < 1e-6
    assert math.dist(found, point) == pytest.approx(border.distance(shapely.Point(point)), abs=1e-6)


@given(POINT, POINT, POINT)
@settings(deadline=None)
def test_point_to_segment(p: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> None:
    expected = shapely.Point(p).distance(shapely.LineString([a, b]))
    assert math.sqrt(fence.point_to_segment(*p, *a, *b)) == pytest.approx(expected, abs=1e-6)


@given(POINT, POINT, POINT, POINT)
@settings(deadline=None, max_examples=300)
def test_segment_to_segment(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
) -> None:
    expected = shapely.LineString([a, b]).distance(shapely.LineString([c, d]))
    assert math.sqrt(fence.segment_to_segment(*a, *b, *c, *d)) == pytest.approx(expected, abs=1e-6)


def test_a_segment_without_length_is_a_point() -> None:
    assert fence.point_to_segment(3.0, 4.0, 0.0, 0.0, 0.0, 0.0) == 25.0
    assert fence.segment_to_segment(3.0, 4.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0) == 25.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_nowhere_is_not_inside(bad: float) -> None:
    edges = edges_of(region((0.0, 1000.0, 0.0, 1000.0)))
    assert not fence.inside(edges, bad, 500.0)
    assert not fence.inside(edges, 500.0, bad)
