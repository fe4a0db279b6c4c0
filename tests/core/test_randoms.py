"""Counter-based random numbers: their distribution, their independence, and that a key is all they depend on."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from swarmctl.core import randoms

KEYS = st.integers(0, (1 << 62) - 1)
WORD = 1 << 64


def test_inverse_normal_joins_its_three_pieces() -> None:
    for p in (0.075, 0.925, math.exp(-25.0)):
        below, above = (randoms.inverse_normal(np.nextafter(p, side)) for side in (0.0, 1.0))
        assert above == pytest.approx(below, rel=1e-13)


@pytest.mark.parametrize("part", range(4))
def test_uniform_along_every_part_of_the_key(part: int) -> None:
    key = [7, 3, 100, randoms.RULE]
    drawn = []
    for k in range(20_000):
        key[part] = k
        drawn.append(randoms.uniform(*key))
    assert stats.kstest(drawn, "uniform").pvalue > 1e-4
    assert np.corrcoef(drawn[:-1], drawn[1:])[0, 1] == pytest.approx(0.0, abs=0.03)
    assert len(set(drawn)) == len(drawn)


def test_normals_are_normal() -> None:
    drawn = [randoms.normal(1, i, tick, 0) for i in range(20) for tick in range(1000)]
    assert stats.kstest(drawn, "norm").pvalue > 1e-4


@pytest.mark.parametrize(("one", "other"), list(itertools.combinations(range(4), 2)))
def test_keys_are_independent(one: int, other: int) -> None:
    """Swapped, shifted or neighbouring parts of a key give numbers that have nothing to do with each other."""
    pairs = []
    for a in range(70):
        for b in range(70):
            key = [5, 5, 5, 5]
            key[one], key[other] = a, b + 70
            swapped = list(key)
            swapped[one], swapped[other] = key[other], key[one]
            pairs.append((randoms.uniform(*key), randoms.uniform(*swapped)))
    x, y = np.transpose(pairs)
    assert abs(np.corrcoef(x, y)[0, 1]) < 0.06
    table, *_ = np.histogram2d(x, y, bins=8, range=[[0, 1], [0, 1]])
    assert stats.chisquare(table.ravel()).pvalue > 1e-4


@given(KEYS, KEYS, KEYS, KEYS)
def test_a_number_lies_in_the_open_interval_and_depends_on_its_key_alone(
    seed: int, vehicle: int, tick: int, stream: int
) -> None:
    first = randoms.uniform(seed, vehicle, tick, stream)
    assert 0.0 < first < 1.0
    randoms.uniform(seed + 1, vehicle, tick, stream)
    assert randoms.uniform(seed, vehicle, tick, stream) == first


def _unmixed(z: int) -> int:
    """The inverse of splitmix64's mixing."""

    def unshift(value: int, by: int) -> int:
        out = value
        for _ in range(64 // by + 1):
            out = value ^ (out >> by)
        return out

    z = unshift(z, 31) * pow(0x94D049BB133111EB, -1, WORD) % WORD
    z = unshift(z, 27) * pow(0xBF58476D1CE4E5B9, -1, WORD) % WORD
    return unshift(z, 30)


def seed_that_draws(bits: int) -> int:
    """The seed with which vehicle 0 draws ``bits`` at tick 0 in stream 0: the generator run backwards."""
    golden = 0x9E3779B97F4A7C15
    value = bits
    for _ in range(3):
        value = (_unmixed(value) - golden) % WORD
    return (_unmixed(value) - golden) * pow(golden, -1, WORD) % WORD - 1


def test_the_smallest_number_is_not_zero() -> None:
    seed = next(s for s in map(seed_that_draws, range(4096)) if 0 <= s < WORD // 2)
    assert randoms.uniform(seed, 0, 0, 0) == 0.5**53
    assert math.isfinite(randoms.normal(seed, 0, 0, 0))


def test_the_generator_is_splitmix64() -> None:
    """Against the published algorithm, written with Python's integers."""

    def mix(z: int) -> int:
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % WORD
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % WORD
        return z ^ (z >> 31)

    golden = 0x9E3779B97F4A7C15
    for key in [(0, 0, 0, 0), (7, 3, 1600, randoms.LAUNCH), (1 << 40, 99, 12, 64)]:
        value = golden
        for part in key:
            value = mix((value + golden * (part + 1)) % WORD)
        assert randoms.uniform(*key) == ((value >> 12) + 0.5) / 2**52


def test_the_purposes_own_disjoint_streams() -> None:
    starts = [
        randoms.RULE, randoms.CHOICE, randoms.FENCE, randoms.LOSS, randoms.DETECT, randoms.NOISE, randoms.ALARM,
        randoms.LAYOUT, randoms.LAUNCH,
    ]  # fmt: skip
    assert starts == sorted(starts)
    rooms = np.diff(starts)
    vehicles, targets, tries = 1000, 1_000_000, 64
    needed = [2, 8, 2 * tries, vehicles, targets, 2 * targets, 3, 32]
    assert all(room >= need for room, need in zip(rooms, needed, strict=True))
