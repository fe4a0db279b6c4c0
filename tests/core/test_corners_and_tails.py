"""Places where arithmetic gives out: segments exactly through corners, the tails of distributions."""

import numpy as np
import pytest
import shapely
from scipy import special

from swarmctl.core import fence, randoms

from .flying import Flight
from .test_randoms import WORD, seed_that_draws
from .test_route import way
from .worlds import edges_of, fences, region

AREA = (0.0, 1000.0, 0.0, 1000.0)
BOX = [(400.0, 600.0, 400.0, 600.0)]


def test_inverse_normal_is_accurate_to_the_last_digits() -> None:
    for p in np.concatenate([10.0 ** -np.arange(1, 301.0), np.linspace(1e-6, 0.999999, 20_001)]):
        assert randoms.inverse_normal(p) == pytest.approx(special.ndtri(p), rel=1e-14, abs=1e-16)


def test_a_segment_through_a_corner_crosses() -> None:
    edges = edges_of(region(AREA, BOX))
    assert not fence.legal(edges, 300.0, 300.0, 700.0, 700.0)
    assert fence.crosses(edges, 300.0, 300.0, 500.0, 500.0)


def test_a_route_along_a_keep_outs_diagonal_leads_round_it() -> None:
    made = fences(AREA, BOX, 20.0)
    found = way(made.plan, made.guard, (350.0, 350.0), (900.0, 900.0))
    assert region(AREA, BOX).covers(shapely.LineString(found))


def test_a_vehicle_that_flies_at_a_corner_stays_outside() -> None:
    Flight([(300.0, 300.0)], AREA, BOX).fly(300, lambda f: [(10.0, 10.0)])


def test_the_largest_number_is_not_one() -> None:
    seed = next(s for s in map(seed_that_draws, range(WORD - 2048, WORD)) if 0 <= s < WORD // 2)
    assert randoms.uniform(seed, 0, 0, 0) < 1.0
