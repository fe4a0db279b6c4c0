"""A geofence as firmware holds it: polygons and circles to stay in or out of, in the fleet's frame (m)."""

import math
from typing import TYPE_CHECKING, NamedTuple

from swarmctl.core.calls import to_local
from swarmctl.mavlink.dialect import mav

if TYPE_CHECKING:
    from .plans import Item

# NAV_FENCE commands, and whether to stay inside.
POLYGONS: dict[int, bool] = {
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLES: dict[int, bool] = {
    mav.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True,
    mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False,
}
Place = tuple[float, float]
ROUNDING_M = 1e-6
"""By so much less is a place clear of a border than its distance says."""


class Polygon(NamedTuple):
    """Corners (east, north)."""

    corners: tuple[Place, ...]

    def holds(self, east: float, north: float) -> bool:
        """Whether a place is inside: a ray from it to the east crosses the border an odd number of times."""
        inside = False
        before_east, before_north = self.corners[-1]
        for at_east, at_north in self.corners:
            if (at_north > north) != (before_north > north):
                share = (north - at_north) / (before_north - at_north)
                inside ^= east < at_east + share * (before_east - at_east)
            before_east, before_north = at_east, at_north
        return inside

    def nearest(self, east: float, north: float) -> Place:
        """The place on the border nearest to this one."""
        places = [
            _nearest_on_edge(self.corners[k - 1], self.corners[k], east, north)
            for k in range(len(self.corners))
        ]
        return min(places, key=lambda place: math.dist(place, (east, north)))


class Circle(NamedTuple):
    """Centre and radius."""

    east: float
    north: float
    radius: float

    def holds(self, east: float, north: float) -> bool:
        """Whether a place is inside."""
        return math.dist((east, north), (self.east, self.north)) < self.radius

    def nearest(self, east: float, north: float) -> Place:
        """The place on the border nearest to this one."""
        distance = math.dist((east, north), (self.east, self.north))
        if distance == 0.0:
            return self.east + self.radius, self.north
        share = self.radius / distance
        return self.east + share * (east - self.east), self.north + share * (north - self.north)


def _nearest_on_edge(start: Place, end: Place, east: float, north: float) -> Place:
    along_east, along_north = end[0] - start[0], end[1] - start[1]
    square = along_east * along_east + along_north * along_north
    share = 0.0
    if square > 0.0:
        share = ((east - start[0]) * along_east + (north - start[1]) * along_north) / square
        share = min(max(share, 0.0), 1.0)
    return start[0] + share * along_east, start[1] + share * along_north


class Zone(NamedTuple):
    """A shape, to stay ``inside`` of or out of."""

    shape: Polygon | Circle
    inside: bool


class Fence:
    """Zones: a vehicle has to be in one of those to stay inside of, and in none of the others."""

    def __init__(self, zones: list[Zone]) -> None:
        self._zones = zones
        self._keep_in = [zone.shape for zone in zones if zone.inside]
        self._keep_out = [zone.shape for zone in zones if not zone.inside]
        self._asked: tuple[Place, float, bool] = ((0.0, 0.0), 0.0, False)

    def broken_at(self, east: float, north: float) -> bool:
        """Whether nobody may be here.  Nearer to where it was asked last than any border was, nothing has changed."""
        place = (east, north)
        asked_at, clear_m, broken = self._asked
        if math.dist(asked_at, place) < clear_m:
            return broken
        broken = self._breaks(east, north)
        clear_m = math.dist(place, self.nearest(east, north)) - ROUNDING_M if self._zones else math.inf
        self._asked = (place, clear_m, broken)
        return broken

    def _breaks(self, east: float, north: float) -> bool:
        if any(shape.holds(east, north) for shape in self._keep_out):
            return True
        return bool(self._keep_in) and not any(shape.holds(east, north) for shape in self._keep_in)

    def nearest(self, east: float, north: float) -> Place:
        """The nearest place on any zone's border; raises ValueError if there is no zone."""
        places = [zone.shape.nearest(east, north) for zone in self._zones]
        return min(places, key=lambda place: math.dist(place, (east, north)))


def fence_of(items: "list[Item]", origin: tuple[float, float, float]) -> Fence:
    """The fence that checked mission items describe, in the frame about ``origin`` (degrees, degrees, m)."""
    zones = []
    at = 0
    while at < len(items):
        item = items[at]
        size = int(item.p1) if item.command in POLYGONS else 1
        places = [to_local(i.x * 1e-7, i.y * 1e-7, *origin) for i in items[at : at + size]]
        if item.command in POLYGONS:
            zones.append(Zone(Polygon(tuple(places)), POLYGONS[item.command]))
        elif item.command in CIRCLES:
            zones.append(Zone(Circle(*places[0], item.p1), CIRCLES[item.command]))
        at += size
    return Fence(zones)
