"""Regions, pads, and the mission written down again."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import shapely
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from swarmctl.mission import geometry, pads
from swarmctl.mission.dump import dump
from swarmctl.mission.errors import MissionError
from swarmctl.mission.geometry import Floats, regions
from swarmctl.mission.load import load, packaged
from swarmctl.mission.model import Area, Circle, KeepOut, Mission, Safety

Read = Callable[..., Mission]


def inside(edges: Floats, east: float, north: float) -> bool:
    """Parity of crossings, as the fence's kernel counts them."""
    x0, y0, x1, y1 = edges.T
    across = (y0 > north) != (y1 > north)
    with np.errstate(divide="ignore", invalid="ignore"):
        return bool(np.count_nonzero(across & (east < x0 + (north - y0) * (x1 - x0) / (y1 - y0))) % 2)


def corners(edges: Floats) -> set[tuple[float, float]]:
    return {(float(e), float(n)) for e, n in edges[:, :2]}


def test_a_box_shrinks_and_grows_to_a_box(small_catalogue: None) -> None:
    found = regions(load("paper"))
    assert corners(found.raw) >= {(0, 0), (5000, 0), (5000, 5000), (0, 5000), (1500, 3200), (1700, 4000)}
    assert corners(found.plan) == {
        *((20, 20), (4980, 20), (4980, 4980), (20, 4980)),
        *((1480, 3180), (1720, 3180), (1720, 4020), (1480, 4020)),
        *((3480, 1480), (4220, 1480), (4220, 1720), (3480, 1720)),
    }
    assert corners(found.guard) >= {(10, 10), (4990, 4990), (1490, 3190), (4210, 1710)}
    assert found.raw.shape == found.plan.shape == (12, 4)
    assert found.border.tolist() == [[0, 0], [5000, 0], [5000, 5000], [0, 5000]]
    assert len(found.keep_outs) == 2


def test_rings_are_closed_with_the_legal_side_on_the_left(small_catalogue: None) -> None:
    found = regions(load("field"))
    for edges in (found.raw, found.plan, found.guard):
        assert sorted(edges[:, :2].tolist()) == sorted(edges[:, 2:].tolist())
        middle = (edges[:, :2] + edges[:, 2:]) / 2
        along = edges[:, 2:] - edges[:, :2]
        left = np.column_stack((-along[:, 1], along[:, 0])) / np.hypot(*along.T)[:, None]
        assert all(inside(edges, *place) for place in middle + 0.01 * left)
        assert not any(inside(edges, *place) for place in middle - 0.01 * left)


def test_overlapping_keep_outs_are_united() -> None:
    mission = Mission(
        keep_out=(
            KeepOut(box_m=(1000.0, 2000.0, 1000.0, 2000.0)),
            KeepOut(box_m=(1500.0, 2500.0, 1500.0, 2500.0)),
        )
    )
    assert not inside(regions(mission).raw, 1750, 1750)
    assert inside(regions(mission).raw, 2250, 1250)


def test_a_keep_out_across_the_border_only_takes_what_is_inside() -> None:
    mission = Mission(keep_out=(KeepOut(box_m=(-500.0, 500.0, 2000.0, 3000.0)),))
    raw = regions(mission).raw
    assert not inside(raw, 250, 2500)
    assert not inside(raw, -250, 2500)
    assert inside(raw, 600, 2500)


def test_a_circle_is_covered_by_its_polygon() -> None:
    circle = Circle(center_m=(900.0, 1200.0), radius_m=120.0)
    ring = shapely.Polygon(geometry.circle_m(circle))
    assert len(geometry.circle_m(circle)) == 32
    assert shapely.Point(900, 1200).distance(ring.exterior) == pytest.approx(120)
    assert ring.area < 1.01 * math.pi * 120**2


def test_a_margin_of_zero_changes_nothing() -> None:
    found = regions(Mission(safety=Safety(fence_margin_m=0.0)))
    assert np.array_equal(found.raw, found.plan)
    assert np.array_equal(regions(Mission(), margin_m=0.0).plan, found.raw)


shapes = st.tuples(st.floats(0, 4000), st.floats(10, 900), st.floats(0, 4000), st.floats(10, 900))


@given(st.lists(shapes, max_size=5), st.floats(1, 60), st.floats(0, 5000), st.floats(0, 5000))
@settings(max_examples=150, deadline=None)
def test_inside_the_plan_region_the_margin_is_kept(
    boxes: list[tuple[float, float, float, float]], margin: float, east: float, north: float
) -> None:
    keep_out = tuple(KeepOut(box_m=(e, e + w, n, n + h)) for e, w, n, h in boxes)
    found = regions(Mission(keep_out=keep_out, safety=Safety(fence_margin_m=margin)))
    if inside(found.plan, east, north):
        assert inside(found.guard, east, north)
        assert inside(found.raw, east, north)
        assert min(east, north, 5000 - east, 5000 - north) >= margin - 1e-5
        place = shapely.Point(east, north)
        assert all(shapely.Polygon(zone).distance(place) >= margin - 1e-5 for zone in found.keep_outs)


# Pads.


def test_pads_stand_row_by_row_in_the_corner(small_catalogue: None) -> None:
    places = pads.corner_pads(regions(load("paper")), 7, 20.0, 20.0)
    rows = [[25, 25], [45, 25], [65, 25], [25, 45], [45, 45], [65, 45], [25, 65]]
    assert places.tolist() == rows


def test_pads_find_the_south_western_most_place_of_a_polygon() -> None:
    triangle = Area(polygon_m=((0.0, 1000.0), (1000.0, 0.0), (1000.0, 1000.0)))
    found = regions(Mission(area=triangle))
    places = pads.corner_pads(found, 4, 20.0, 20.0)
    assert shapely.covers(found.legal, shapely.points(places)).all()
    assert places[0].sum() < 1000 + 20 * math.sqrt(2) + 20
    assert np.array_equal(places - places[0], [[0, 0], [20, 0], [0, 20], [20, 20]])
    slanted = Area(polygon_m=((0.0, 300.0), (1000.0, 0.0), (1000.0, 1000.0), (0.0, 1000.0)))
    assert pads.corner_pads(regions(Mission(area=slanted)), 1, 20.0, 20.0)[0].sum() < 400
    around = Mission(area=triangle, keep_out=(KeepOut(box_m=(0.0, 900.0, 0.0, 1000.0)),))
    assert pads.corner_pads(regions(around), 4, 20.0, 20.0)[:, 0].min() > 920


def test_pads_that_do_not_fit_are_refused() -> None:
    found = regions(Mission(area=Area(polygon_m=((0.0, 100.0), (100.0, 0.0), (100.0, 100.0)))))
    with pytest.raises(ValueError, match="60 x 60 m for 16 pads does not fit"):
        pads.corner_pads(found, 16, 20.0, 20.0)


def test_named_pads_are_the_pads(read: Read) -> None:
    places = pads.launch_pads(read("vehicles: {count: 2, launch: [[100, 100], [150, 100]]}"))
    assert places is not None
    assert places.tolist() == [[100, 100], [150, 100]]


# Written down again.


@pytest.mark.parametrize("name", ["paper", "sitl", "field", "lake", "mixed"])
def test_what_is_dumped_loads_back_equal(read: Read, name: str) -> None:
    assert name in packaged()
    mission = load(name)
    text = dump(mission)
    assert read(text) == mission
    assert read(text).fleet == mission.fleet
    assert "file" not in text
    assert list(yaml.safe_load(text)) == list(Mission.model_fields)


FULL = """
area: {polygon: [[47.3977, 8.5456], [47.3977, 8.6], [47.43, 8.6]]}
keep_out:
  - {circle_m: {center_m: [900, 120.125], radius_m: 1e-2}}
  - {polygon: [[47.41, 8.59], [47.41, 8.591], [47.411, 8.59]]}
radio: {bandwidth_bps: 9600}
vehicles:
  - {launch: [200, 60], radio: {bandwidth_bps: null}, connect: 'udpin://0.0.0.0:14540-14545'}
  - {launch: [300, 60], sensor: {range_m: 90}, connect: 'serial:///dev/ttyACM0:57600', endurance_s: 600}
targets: {positions_m: [[500, 100], [600, 100.1]]}
planner: {algorithm: belief, period_s: 0.3, parameters: {belief: {then: hold}, fco: {inertia: 1}}}
dynamics: multicopter
"""


def test_every_form_is_dumped_and_loads_back_equal(read: Read) -> None:
    mission = read(FULL)
    again = read(dump(mission))
    assert again == mission
    assert [vehicle.radio.bandwidth_bps for vehicle in again.fleet] == [None, 9600]
    assert again.targets.count == 2


@given(st.text(min_size=1, max_size=30).filter(str.isprintable), st.floats(1e-6, 86400))
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_name_and_number_survives(read: Read, name: str, duration: float) -> None:
    mission = Mission(name=name, duration_s=duration)
    assert read(dump(mission)) == mission


@pytest.mark.parametrize("count", [1, 2, 6, 7, 100, 1000])
@pytest.mark.parametrize("mission", ["paper", "lake"])
def test_spread_vehicles_stand_evenly_all_over_the_legal_area(mission: str, count: int) -> None:
    loaded = load(mission, {"vehicles.count": count, "vehicles.launch": "spread"})
    regions = geometry.regions(loaded)
    places = pads.spread_pads(regions, count, 1.0)
    assert places.shape == (count, 2)
    assert shapely.contains_xy(regions.legal, places).all()
    share = math.sqrt(regions.legal.area / count)
    if count > 6:
        nearest = cKDTree(places).query(places, k=2)[0][:, 1]
        assert nearest.min() > 0.5 * share
        # Nobody in the area is far from a vehicle.
        spots = np.random.default_rng(1).uniform(*np.array(regions.legal.bounds).reshape(2, 2), (2000, 2))
        legal = spots[shapely.contains_xy(regions.legal, spots)]
        assert cKDTree(places).query(legal)[0].max() < 2.5 * share


def test_more_vehicles_than_can_stand_apart_are_refused() -> None:
    with pytest.raises(MissionError, match=r"spread: 100 pads 15 m apart do not fit into the area"):
        load(
            None,
            {"vehicles.count": 100, "vehicles.launch": "spread", "area.size_m": [150, 150], "keep_out": []},
        )
