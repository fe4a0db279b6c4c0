"""The local frame against pymap3d, its inverse, rounding on the wire, compiled against interpreted bits."""

import math

import numpy as np
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.core import geodesy

ORIGINS = [
    (47.3977, 8.5456, 488.0),
    (-33.8568, 151.2153, 20.0),
    (0.0, 0.0, 0.0),
    (78.2232, 15.6267, 28.0),
    (-85.0, -60.0, 2800.0),
    (52.0, 179.999, 5.0),
    (-16.5, -179.99, 5.0),
]
PLACES = [
    (0.0, 0.0),
    (10_000.0, 0.0),
    (0.0, -10_000.0),
    (-7_071.0, 7_071.0),
    (5_000.0, 5_000.0),
    (-1.5, 0.25),
]

origins = st.tuples(st.floats(-85, 85), st.floats(-180, 180), st.floats(-400, 6000))
metres = st.floats(-100_000, 100_000)


@pytest.mark.parametrize("origin", ORIGINS)
@pytest.mark.parametrize("place", PLACES)
def test_agrees_with_pymap3d(origin: tuple[float, float, float], place: tuple[float, float]) -> None:
    lat, lon = geodesy.to_geodetic(*place, *origin)
    east, north, _ = pymap3d.geodetic2enu(lat, lon, origin[2], *origin)
    assert math.dist((east, north), place) < 1e-3
    assert math.dist(geodesy.to_local(lat, lon, *origin), (east, north)) < 1e-3


@given(origins, metres, metres)
@settings(max_examples=300, deadline=None)
def test_inverse_returns_to_the_same_place(
    origin: tuple[float, float, float], east: float, north: float
) -> None:
    lat, lon = geodesy.to_geodetic(east, north, *origin)
    assert math.dist(geodesy.to_local(lat, lon, *origin), (east, north)) < 1e-6
    assert -180.0 <= lon < 180.0


def test_longitude_wraps_at_the_antimeridian() -> None:
    _, lon = geodesy.to_geodetic(1000.0, 0.0, 10.0, 179.995, 0.0)
    assert -180.0 < lon < -179.99
    assert geodesy.to_local(10.0, -179.995, 10.0, 179.995, 0.0)[0] == pytest.approx(1096.39, abs=0.01)


@given(origins, metres, metres)
@settings(max_examples=100, deadline=None)
def test_compiled_and_interpreted_bits_are_equal(
    origin: tuple[float, float, float], east: float, north: float
) -> None:
    compiled = geodesy.to_geodetic(east, north, *origin)
    assert compiled == geodesy.to_geodetic.py_func(east, north, *origin)
    assert geodesy.to_local(*compiled, *origin) == geodesy.to_local.py_func(*compiled, *origin)


def test_wire_is_rounded_and_comes_back_within_its_grid() -> None:
    rng = np.random.default_rng(1)
    east, north = rng.uniform(-5000, 5000, (2, 200))
    lat_e7, lon_e7 = np.zeros((2, 200), np.int64)
    geodesy.positions_to_wire(east, north, lat_e7, lon_e7, *ORIGINS[0])
    exact = np.array([geodesy.to_geodetic(east[k], north[k], *ORIGINS[0]) for k in range(200)])
    expected = np.rint(exact * 1e7)
    assert np.array_equal(np.column_stack((lat_e7, lon_e7)), expected)
    back_east, back_north = np.zeros((2, 200))
    geodesy.wire_to_positions(lat_e7, lon_e7, back_east, back_north, *ORIGINS[0])
    assert np.abs(back_east - east).max() < 0.0057
    assert np.abs(back_north - north).max() < 0.0057


def test_batch_kernels_give_the_same_bits_interpreted() -> None:
    rng = np.random.default_rng(2)
    east, north = rng.uniform(-5000, 5000, (2, 50))
    wire = np.zeros((2, 2, 50), np.int64)
    places = np.zeros((2, 2, 50))
    for k, (out, back) in enumerate(
        [
            (geodesy.positions_to_wire, geodesy.wire_to_positions),
            (geodesy.positions_to_wire.py_func, geodesy.wire_to_positions.py_func),
        ]
    ):
        out(east, north, *wire[k], *ORIGINS[1])
        back(*wire[k], *places[k], *ORIGINS[1])
    assert np.array_equal(wire[0], wire[1])
    assert np.array_equal(places[0], places[1])


def test_wire_rounds_halves_to_even() -> None:
    assert [round(x) for x in (0.5, 1.5, 2.5, -0.5, -1.5)] == [0, 2, 2, 0, -2]
    lat_e7, lon_e7 = np.zeros((2, 1), np.int64)
    geodesy.positions_to_wire(np.zeros(1), np.zeros(1), lat_e7, lon_e7, 0.5e-7, 2.5e-7, 0.0)
    assert (lat_e7[0], lon_e7[0]) == (0, 2)
