"""What a vehicle's telemetry says, as a pose: the one place where a flight's observations enter the core."""

from . import geodesy
from .arrays import Floats, Records
from .jit import kernel

COLUMNS = ("lat_e7", "lon_e7", "height_m", "v_east", "v_north", "v_up")


@kernel
def read_poses(wire: Floats, poses: Records, lat: float, lon: float, alt: float) -> None:
    """Fill ``poses`` from ``wire`` (V, 6), rows of COLUMNS, in the local frame about an origin (degrees, m)."""
    for i in range(wire.shape[0]):
        east, north = geodesy.to_local(wire[i, 0] * 1e-7, wire[i, 1] * 1e-7, lat, lon, alt)
        poses[i].east = east
        poses[i].north = north
        poses[i].up = wire[i, 2]
        poses[i].v_east = wire[i, 3]
        poses[i].v_north = wire[i, 4]
        poses[i].v_up = wire[i, 5]
