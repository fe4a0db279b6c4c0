"""What messages carry of a vehicle: the one place where a flight's observations enter the core, and both directions.

A vehicle tells its pose with ``tell``, in the integers of GLOBAL_POSITION_INT, and a flight reads it with
``read_poses``; a setpoint goes out through ``climb_down`` and comes in as float32 and through ``height_of``.  The
stub and the sessions call these very functions across the link.  A study with ``observations: wire`` calls them
with no link between, and so sees and obeys exactly what a flight in lockstep does.
"""

import numpy as np

from . import geodesy
from .arrays import Floats, Records
from .jit import kernel

COLUMNS = ("lat_e7", "lon_e7", "height_m", "v_east", "v_north", "v_up", "age_s")
LONGEST_AGE_S = 1.0
"""A position older than this is carried on no further: the velocity says nothing of where it is now."""
MM, CM = 1000.0, 100.0  # in a metre


@kernel
def tell(
    east: float, north: float, up: float, v_east: float, v_north: float, v_up: float,
    lat_0: float, lon_0: float, alt_0: float, altitude_error: float,
) -> tuple[int, int, int, int, int, int, int]:  # fmt: skip
    """A pose about an origin (degrees, m) as GLOBAL_POSITION_INT carries it, from ``lat`` to ``vz``.

    Places in 1e-7 degrees, heights above sea level (read too high by ``altitude_error`` metres) and above home in mm,
    speeds north, east, down in cm/s.
    """
    lat, lon = geodesy.to_geodetic(east, north, lat_0, lon_0, alt_0)
    return (
        round(lat * 1e7), round(lon * 1e7), round((up + alt_0 + altitude_error) * MM), round(up * MM),
        round(v_north * CM), round(v_east * CM), round(-v_up * CM),
    )  # fmt: skip


def in_si(height_mm: int, vx_cms: int, vy_cms: int, vz_cms: int) -> tuple[float, float, float, float]:
    """Height, and velocity east, north, up, in m and m/s, of GLOBAL_POSITION_INT's last four."""
    return height_mm / MM, vy_cms / CM, vx_cms / CM, -vz_cms / CM


def down_of(height: float, origin_alt: float, home_alt: float) -> float:
    """The z (m) of a setpoint for ``height`` above home, counted down from the local origin, as PX4 wants it."""
    return origin_alt - home_alt - height


def height_of(down: float, origin_alt: float, zero_alt: float) -> float:
    """The height above ``zero_alt`` (m above sea level) that a setpoint's z means: the inverse."""
    return origin_alt - down - zero_alt


_in_si, _down_of, _height_of = kernel(in_si), kernel(down_of), kernel(height_of)  # for kernels


@kernel
def _read(
    poses: Records, i: int, lat_e7: float, lon_e7: float, height: float, v_east: float, v_north: float,
    v_up: float, age: float, lat_0: float, lon_0: float, alt_0: float,
) -> None:  # fmt: skip
    """Fill ``poses[i]`` from what one message told ``age`` seconds ago."""
    east, north = geodesy.to_local(lat_e7 * 1e-7, lon_e7 * 1e-7, lat_0, lon_0, alt_0)
    age = min(age, LONGEST_AGE_S)
    poses[i].east = east + age * v_east
    poses[i].north = north + age * v_north
    poses[i].up = height + age * v_up
    poses[i].v_east, poses[i].v_north, poses[i].v_up = v_east, v_north, v_up


@kernel
def read_poses(wire: Floats, poses: Records, lat: float, lon: float, alt: float) -> None:
    """Fill ``poses`` from ``wire`` (V, 7), rows of COLUMNS, in the local frame about an origin (degrees, m).

    A position is carried on along its velocity by its age, which is 0 in lockstep.
    """
    for i in range(wire.shape[0]):
        _read(
            poses, i, wire[i, 0], wire[i, 1], wire[i, 2], wire[i, 3], wire[i, 4], wire[i, 5], wire[i, 6],
            lat, lon, alt,
        )  # fmt: skip


@kernel
def observe(truth: Records, poses: Records, rules: Records) -> None:
    """Fill ``poses`` with what messages would tell of ``truth``; where they are not to be told apart, both are one."""
    if rules[0].wire == 0:
        return
    lat_0, lon_0, alt_0 = rules[0].origin_lat, rules[0].origin_lon, rules[0].origin_alt
    for i in range(truth.shape[0]):
        lat, lon, _, up, north, east, down = tell(
            truth[i].east, truth[i].north, truth[i].up, truth[i].v_east, truth[i].v_north, truth[i].v_up,
            lat_0, lon_0, alt_0, 0.0,
        )  # fmt: skip
        height, v_east, v_north, v_up = _in_si(up, north, east, down)
        _read(poses, i, lat, lon, height, v_east, v_north, v_up, 0.0, lat_0, lon_0, alt_0)


@kernel
def told_speed(speed: float, rules: Records) -> float:
    """A setpoint's velocity (m/s) as it arrives."""
    return float(np.float32(speed)) if rules[0].wire != 0 else speed


@kernel
def told_height(height: float, rules: Records) -> float:
    """A setpoint's height (m) as a PX4 whose origin and home are at the mission's origin takes it."""
    if rules[0].wire == 0:
        return height
    alt = rules[0].origin_alt
    return float(_height_of(float(np.float32(_down_of(height, alt, alt))), alt, alt))
