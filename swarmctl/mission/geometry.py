"""Where vehicles may be: the mission's area and keep-outs as polygons, and the edges that the fence tests.

Shapely unites, grows and shrinks the polygons once, when a mission is read; what leaves is plain arrays.
The legal region is the keep-in less the union of all keep-outs (united, because the compiled test counts
crossings and would take the overlap of two keep-outs for legal).  Corners stay corners (mitre joins), so
that a grown box is a box.
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from swarmctl.core.calls import to_local

from .model import Circle, KeepOut, Mission, Origin, PolygonDegrees

Floats = NDArray[np.float64]
CIRCLE_CORNERS = 32


@dataclass(frozen=True)
class Regions:
    """The legal region three times over, as edges (E, 4): x0, y0, x1, y1 in local metres.

    Each ring is closed and has the legal side on its left.  ``raw`` is as drawn; ``plan``, for the planner,
    has the keep-in shrunk and the keep-outs grown by the fence margin; ``guard`` by half of it.  ``border``
    (N, 2) and ``keep_outs`` (N, 2) each are the rings as drawn, not closed, for pictures; ``legal`` is the
    plan region as a shapely geometry.
    """

    raw: Floats
    plan: Floats
    guard: Floats
    border: Floats
    keep_outs: list[Floats]
    legal: BaseGeometry


def regions(mission: Mission, margin_m: float | None = None) -> Regions:
    """The regions of a mission whose files are inlined; ``margin_m`` replaces its safety.fence_margin_m."""
    margin = mission.safety.fence_margin_m if margin_m is None else margin_m
    border = border_m(mission)
    keep_outs = [keep_out_m(item, mission.origin) for item in mission.keep_out]
    legal = legal_region(border, keep_outs, margin)
    return Regions(
        raw=edges(legal_region(border, keep_outs, 0.0)),
        plan=edges(legal),
        guard=edges(legal_region(border, keep_outs, margin / 2.0)),
        border=border,
        keep_outs=keep_outs,
        legal=legal,
    )


def local_m(points: PolygonDegrees, origin: Origin) -> Floats:
    """Corners (N, 2) in local metres of [latitude, longitude] in degrees."""
    return _tidy([to_local(lat, lon, origin.lat, origin.lon, origin.alt_m) for lat, lon in points])


def border_m(mission: Mission) -> Floats:
    """The keep-in's corners (N, 2) in local metres, as drawn."""
    area = mission.area
    if area.size_m is not None:
        width, height = area.size_m
        return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    if area.polygon is not None:
        return local_m(area.polygon, mission.origin)
    if area.polygon_m is not None:
        return _tidy(area.polygon_m)
    raise ValueError(f"the area's file {area.file} has not been read")


def keep_out_m(item: KeepOut, origin: Origin) -> Floats:
    """A keep-out's corners (N, 2) in local metres; a circle becomes the polygon drawn round it."""
    if item.box_m is not None:
        west, east, south, north = item.box_m
        return _tidy([(west, south), (east, south), (east, north), (west, north)])
    if item.circle_m is not None:
        return circle_m(item.circle_m)
    if item.polygon is not None:
        return local_m(item.polygon, origin)
    assert item.polygon_m is not None, "the model wants one shape"
    return _tidy(item.polygon_m)


def circle_m(circle: Circle, *, within: bool = False) -> Floats:
    """A regular polygon (32, 2) round the circle, or inside it: on the safe side of either."""
    turns = 2.0 * math.pi / CIRCLE_CORNERS * np.arange(CIRCLE_CORNERS)
    radius = circle.radius_m if within else circle.radius_m / math.cos(math.pi / CIRCLE_CORNERS)
    return _tidy(np.array(circle.center_m) + radius * np.column_stack((np.cos(turns), np.sin(turns))))


def legal_region(border: Floats, keep_outs: list[Floats], margin: float) -> BaseGeometry:
    """Keep-in less keep-outs, ``margin`` metres kept from each; empty or in several parts if so drawn."""
    inner = grown(border, -margin)
    return shapely.difference(inner, shapely.union_all([grown(item, margin) for item in keep_outs]))


def grown(corners: Floats, margin: float) -> BaseGeometry:
    """The polygon grown (or, if negative, shrunk) by ``margin`` metres, its corners kept sharp."""
    polygon = shapely.Polygon(corners)
    return polygon.buffer(margin, join_style="mitre") if margin else polygon


def edges(region: BaseGeometry) -> Floats:
    """The borders of a region as edges (E, 4), in an order that depends on the region alone."""
    polygons = [part for part in shapely.get_parts(shapely.normalize(region)) if part.geom_type == "Polygon"]
    parts = [
        np.hstack((points[:-1], points[1:]))
        for polygon in map(orient, polygons)
        for points in (np.array(ring.coords) for ring in (polygon.exterior, *polygon.interiors))
    ]
    # Shapely's arithmetic leaves 1479.9999999999998 where 1480 was meant.
    return _tidy(np.vstack(parts)) if parts else np.zeros((0, 4))


def _tidy(metres: ArrayLike) -> Floats:
    """The numbers to the micrometre; distances far below that upset the geometry library."""
    return np.asarray(metres, dtype=np.float64).round(6)
