"""Sectors: equal shares of any area, from any launch place, in the order of the headings."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from swarmctl.core.planners import sectors
from swarmctl.core.world import Fences, World

from ..core.worlds import Place, edges_of, fleet_of, rules_of, world_of

SQUARE = shapely.box(0.0, 0.0, 3000.0, 2000.0)
HOLED = SQUARE - shapely.box(300.0, 200.0, 900.0, 1100.0) - shapely.box(1500.0, 1200.0, 1800.0, 1900.0)
BENT = shapely.Polygon(
    [(0, 0), (2500, 200), (2600, 2400), (1700, 2300), (1500, 900), (200, 1200)]
) - shapely.box(600.0, 300.0, 900.0, 700.0)
FAR = 1e4


def launched(area: shapely.Geometry, place: Place, headings: Sequence[float], **values: object) -> World:
    """Vehicles at one place that have agreed on their sectors."""
    edges = edges_of(area)
    fleet = fleet_of([place] * len(headings), headings, **values)
    world = world_of("belief", fleet, rules_of(ideal=1), Fences(edges, edges, edges))
    world.prepare()
    return world


def angle(world: World, i: int, side: str) -> float:
    """The angle of one of the vectors in vehicle ``i``'s memory, radians."""
    return math.atan2(world.memory[f"{side}_north"][i], world.memory[f"{side}_east"][i])


def wedge(place: Place, begin: float, end: float) -> shapely.Geometry:
    """All that lies between two angles, counted from the first on."""
    width = (end - begin) % (2.0 * math.pi)
    width = width if width > 1e-9 else 2.0 * math.pi
    turns = begin + width * np.linspace(0.0, 1.0, 400)
    rim = np.column_stack((place[0] + FAR * np.cos(turns), place[1] + FAR * np.sin(turns)))
    return shapely.Polygon(np.vstack(([place], rim))).buffer(0)


def share(area: shapely.Geometry, place: Place, begin: float, end: float) -> float:
    """The share of an area between two angles."""
    return float(shapely.area(shapely.intersection(area, wedge(place, begin, end))) / shapely.area(area))


@pytest.mark.parametrize("area", [SQUARE, HOLED, BENT], ids=["square", "holed", "bent"])
@pytest.mark.parametrize(
    "place", [(0.0, 0.0), (1300.0, 800.0), (1000.0, 80.0)], ids=["corner", "inside", "border"]
)
@pytest.mark.parametrize("count", [1, 2, 5])
def test_sectors_are_of_equal_area_and_halved_by_the_first_leg(
    area: shapely.Geometry, place: Place, count: int
) -> None:
    world = launched(area, place, list(np.linspace(5.0, 300.0, count)))
    for i in range(count):
        begin, end = angle(world, i, "left"), angle(world, i, "right")
        assert share(area, place, begin, end) == pytest.approx(1.0 / count, abs=1e-4)
        assert share(area, place, begin, angle(world, i, "heading")) == pytest.approx(0.5 / count, abs=1e-4)


def test_every_place_is_in_one_sector() -> None:
    world = launched(HOLED, (1300.0, 800.0), [10.0, 100.0, 200.0, 350.0])
    spots = np.random.default_rng(1).uniform((0.0, 0.0), (3000.0, 2000.0), (500, 2))
    owners = [sum(sectors.own(world.memory, i, float(x), float(y)) for i in range(4)) for x, y in spots]
    assert owners == [1] * 500


def test_sectors_follow_one_another_as_the_headings_do() -> None:
    headings = [70.0, 5.0, 40.0, 85.0]
    world = launched(SQUARE, (0.0, 0.0), headings)
    assert (
        np.argsort([angle(world, i, "heading") for i in range(4)]).tolist() == np.argsort(headings).tolist()
    )


def test_a_vehicle_that_sees_and_flies_more_gets_more() -> None:
    world = launched(SQUARE, (0.0, 0.0), [10.0, 80.0], speed=[10.0, 20.0], sensor_range=[100.0, 150.0])
    shares = [share(SQUARE, (0.0, 0.0), angle(world, i, "left"), angle(world, i, "right")) for i in range(2)]
    assert shares == pytest.approx([0.25, 0.75], abs=1e-4)
