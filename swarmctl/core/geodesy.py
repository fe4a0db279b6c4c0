"""The one place where latitudes and longitudes become metres, and back.

Everything inside works in a local frame, east and north in metres, about the mission's geodetic origin on
WGS84.  A place's local coordinates are the horizontal part of its east-north-up vector, the place taken at
the origin's ellipsoidal altitude.  (An autopilot's own projection differs: PX4's is spherical and 2 m off at
1 km.)  Degrees and metres.  For origins up to 85 degrees north and south and places up to 100 km away.
"""

import math

from .arrays import Floats, Integers
from .jit import kernel

SEMI_MAJOR_M = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
RADIANS = math.pi / 180.0
WIRE_DEGREES = 1e-7
"""Degrees in one unit of the latitudes and longitudes that MAVLink carries as integers."""
NEWTON_STEPS = 4
"""Enough for less than 1e-6 m from 100 km away at 85 degrees; a fixed number, so that the cost is fixed."""


@kernel
def _normal_radius(sin_lat: float) -> float:
    """Radius of curvature (m) across the meridian."""
    return SEMI_MAJOR_M / math.sqrt(1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat)


@kernel
def to_local(
    lat_deg: float, lon_deg: float, origin_lat: float, origin_lon: float, origin_alt: float
) -> tuple[float, float]:
    """East and north (m) of a place (degrees) in the frame about the origin (degrees, degrees, metres)."""
    lat, lat_0 = lat_deg * RADIANS, origin_lat * RADIANS
    turn = (lon_deg - origin_lon) * RADIANS
    sin_lat, sin_0, cos_0 = math.sin(lat), math.sin(lat_0), math.cos(lat_0)
    radius, radius_0 = _normal_radius(sin_lat), _normal_radius(sin_0)
    across = (radius + origin_alt) * math.cos(lat)
    across_0 = (radius_0 + origin_alt) * cos_0
    up = (radius * (1.0 - ECCENTRICITY_SQUARED) + origin_alt) * sin_lat
    up_0 = (radius_0 * (1.0 - ECCENTRICITY_SQUARED) + origin_alt) * sin_0
    east = across * math.sin(turn)
    north = cos_0 * (up - up_0) - sin_0 * (across * math.cos(turn) - across_0)
    return east, north


@kernel
def to_geodetic(
    east: float, north: float, origin_lat: float, origin_lon: float, origin_alt: float
) -> tuple[float, float]:
    """Latitude and longitude (degrees, longitude in [-180, 180)) of a local place: the inverse of `to_local`.

    Newton's method on the two horizontal coordinates.  The derivatives are the place's own north and east
    directions seen from the origin's frame, times its radii of curvature.
    """
    sin_0, cos_0 = math.sin(origin_lat * RADIANS), math.cos(origin_lat * RADIANS)
    lat, lon = origin_lat, origin_lon
    for _ in range(NEWTON_STEPS):
        at_east, at_north = to_local(lat, lon, origin_lat, origin_lon, origin_alt)
        sin_lat, cos_lat = math.sin(lat * RADIANS), math.cos(lat * RADIANS)
        sin_turn, cos_turn = math.sin((lon - origin_lon) * RADIANS), math.cos((lon - origin_lon) * RADIANS)
        radius = _normal_radius(sin_lat)
        meridian = radius * (1.0 - ECCENTRICITY_SQUARED) / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat)
        north_east, north_north = -sin_lat * sin_turn, sin_lat * sin_0 * cos_turn + cos_lat * cos_0
        east_east, east_north = cos_turn, sin_0 * sin_turn
        d_east, d_north = east - at_east, north - at_north
        determinant = east_east * north_north - east_north * north_east
        go_east = (d_east * north_north - d_north * north_east) / determinant
        go_north = (d_north * east_east - d_east * east_north) / determinant
        lat += go_north / ((meridian + origin_alt) * RADIANS)
        lon += go_east / ((radius + origin_alt) * cos_lat * RADIANS)
    return lat, (lon + 180.0) % 360.0 - 180.0


@kernel
def positions_to_wire(
    east: Floats, north: Floats, lat_e7: Integers, lon_e7: Integers,
    origin_lat: float, origin_lon: float, origin_alt: float,
) -> None:  # fmt: skip
    """Fill ``lat_e7`` and ``lon_e7`` (N,) with local places (N,) in 1e-7 degrees, as MAVLink carries them."""
    for k in range(east.shape[0]):
        lat, lon = to_geodetic(east[k], north[k], origin_lat, origin_lon, origin_alt)
        lat_e7[k] = round(lat * 1e7)
        lon_e7[k] = round(lon * 1e7)


@kernel
def wire_to_positions(
    lat_e7: Integers, lon_e7: Integers, east: Floats, north: Floats,
    origin_lat: float, origin_lon: float, origin_alt: float,
) -> None:  # fmt: skip
    """Fill ``east`` and ``north`` (N,) in metres from places (N,) in 1e-7 degrees."""
    for k in range(lat_e7.shape[0]):
        east[k], north[k] = to_local(
            lat_e7[k] * WIRE_DEGREES, lon_e7[k] * WIRE_DEGREES, origin_lat, origin_lon, origin_alt
        )
