"""Where vehicles stand before the flight: the pads that a mission names, a grid in the area's corner, or all over it.

The grid is square, filled row by row from the west and the south.  In a rectangular area it begins
``margin`` + 5 m east and north of the south-west corner, whatever lies there.  In any other polygon it
begins at the place nearest to that corner (east plus north, then south before north) of a fixed raster
where the whole grid lies in the plan region.

Spread vehicles stand evenly over all of the plan region, on a square lattice.
"""

import math

import numpy as np
import shapely
from scipy.spatial import cKDTree

from . import geometry
from .geometry import Floats, Regions
from .model import Mission

FIRST_PAD_M = 5.0
ROOM_M = 1.0
"""Metres round the grid that must be legal too."""
RASTER = 250
"""Places tried along each side of an area that is no rectangle, at most."""


def launch_pads(mission: Mission) -> Floats | None:
    """Pads (vehicles, 2) in local metres; None where they stand as found.

    Raises ValueError if a corner launch, or a spread one, does not fit.
    """
    if mission.launch == "as_found":
        return None
    if mission.launch == "spread":
        return spread_pads(geometry.regions(mission), len(mission.fleet), mission.safety.separation_m)
    if mission.launch == "corner":
        return corner_pads(
            geometry.regions(mission), len(mission.fleet), mission.spacing_m, mission.safety.fence_margin_m
        )
    return np.array(mission.launch)


def corner_pads(regions: Regions, count: int, spacing: float, margin: float) -> Floats:
    """Pads (count, 2) in local metres, ``spacing`` metres apart.  Raises ValueError if they do not fit."""
    pads = _grid(count, spacing)
    anchors = _anchors(regions.border, margin + FIRST_PAD_M, spacing)
    width, height = pads.max(axis=0)
    rooms = shapely.box(
        anchors[:, 0] - ROOM_M,
        anchors[:, 1] - ROOM_M,
        anchors[:, 0] + width + ROOM_M,
        anchors[:, 1] + height + ROOM_M,
    )
    shapely.prepare(regions.legal)
    fits = np.flatnonzero(shapely.covers(regions.legal, rooms))
    if not len(fits):
        raise ValueError(
            f"a grid of {width:.0f} x {height:.0f} m for {count} pads does not fit into the area"
        )
    return np.asarray(anchors[fits[0]] + pads)


def spread_pads(regions: Regions, count: int, separation: float) -> Floats:
    """Pads (count, 2) in local metres, evenly over the plan region, south to north.

    Raises ValueError if they come nearer than ``separation``.
    """
    shapely.prepare(regions.legal)
    west, south, east, north = regions.legal.bounds
    wanted = count * (east - west) * (north - south) / regions.legal.area
    while len(places := _lattice(regions, wanted)) < count:
        wanted *= 1.05
    if len(places) > 1 and cKDTree(places).query(places, k=2)[0][:, 1].min() < separation:
        raise ValueError(f"{count} pads {separation:g} m apart do not fit into the area")
    chosen = np.linspace(0, len(places) - 1, count).round().astype(np.int64)
    return np.asarray(places[chosen])


def _lattice(regions: Regions, wanted: float) -> Floats:
    """The points of a lattice of about ``wanted`` over the plan region's box that lie in the region, (N, 2)."""
    west, south, east, north = regions.legal.bounds
    columns = max(round(math.sqrt(wanted * (east - west) / (north - south))), 1)
    rows = math.ceil(wanted / columns)
    across = west + (east - west) * (np.arange(columns) + 0.5) / columns
    up = south + (north - south) * (np.arange(rows) + 0.5) / rows
    places = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
    return np.asarray(places[shapely.contains_xy(regions.legal, places)])


def _grid(count: int, spacing: float) -> Floats:
    columns = math.ceil(math.sqrt(count))
    index = np.arange(count)
    return np.column_stack((index % columns, index // columns)).astype(np.float64) * spacing


def _anchors(border: Floats, inset: float, spacing: float) -> Floats:
    """Where the first pad may be, (A, 2), the best place first."""
    low, high = border.min(axis=0), border.max(axis=0)
    if math.isclose(shapely.Polygon(border).area, float(np.prod(high - low)), rel_tol=1e-9):
        return np.array([low + inset])
    step = max(float((high - low).max()) / RASTER, spacing / 4.0)
    east = np.arange(low[0] + inset, high[0], step)
    north = np.arange(low[1] + inset, high[1], step)
    places = np.stack(np.meshgrid(east, north), axis=-1).reshape(-1, 2)
    # Stable, so that of two places equally near the southern one comes first.
    return places[np.argsort(places.sum(axis=1) - low.sum(), kind="stable")]
