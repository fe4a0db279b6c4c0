"""What a vehicle's telemetry says, as a pose: the one place where a flight's observations enter the core."""

from . import geodesy
from .arrays import Floats, Records
from .jit import kernel

COLUMNS = ("lat_e7", "lon_e7", "height_m", "v_east", "v_north", "v_up", "age_s")
LONGEST_AGE_S = 1.0
"""A position older than this is carried on no further: the velocity says nothing of where it is now."""


@kernel
def read_poses(wire: Floats, poses: Records, lat: float, lon: float, alt: float) -> None:
    """Fill ``poses`` from ``wire`` (V, 7), rows of COLUMNS, in the local frame about an origin (degrees, m).

    A position is carried on along its velocity by its age, which is 0 in lockstep.
    """
    for i in range(wire.shape[0]):
        east, north = geodesy.to_local(wire[i, 0] * 1e-7, wire[i, 1] * 1e-7, lat, lon, alt)
        age = min(wire[i, 6], LONGEST_AGE_S)
        poses[i].east = east + age * wire[i, 3]
        poses[i].north = north + age * wire[i, 4]
        poses[i].up = wire[i, 2] + age * wire[i, 5]
        poses[i].v_east = wire[i, 3]
        poses[i].v_north = wire[i, 4]
        poses[i].v_up = wire[i, 5]
