"""Who hears whom: range, loss, delay and bandwidth."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from swarmctl.core import calls, randoms
from swarmctl.core.world import World

from .worlds import Place, fences, fleet_of, rules_of, world_of

WIDE = fences((-1e5, 1e5, -1e5, 1e5))


def world(spots: list[Place], targets: list[Place] | None = None, delay: int = 0, **values: Any) -> World:
    """Vehicles that fly under ``fco``, which tells what it knows."""
    return world_of("fco", fleet_of(spots, **values), rules_of(radio_delay=delay), WIDE, targets or [])


def hears(w: World, tick: int = 0) -> list[list[int]]:
    """Whom each vehicle hears of the beacons sent at a tick."""
    w.deliver(tick)
    slot = tick % w.depth
    return [w.heard[slot, i, : w.heard_count[slot, i]].tolist() for i in range(len(w.fleet))]


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-900, 900), st.floats(-900, 900), st.floats(0, 1500)), min_size=1, max_size=8
    )
)
def test_two_hear_each_other_within_the_shorter_of_their_ranges(
    vehicles: list[tuple[float, float, float]],
) -> None:
    w = world([(x, y) for x, y, _ in vehicles])
    w.fleet["radio_range"] = [reach for _, _, reach in vehicles]
    expected = [
        [
            j for j, (bx, by, their_reach) in enumerate(vehicles)
            if j != i and min(reach, their_reach) > 0.0
            and (bx - ax) * (bx - ax) + (by - ay) * (by - ay) <= min(reach, their_reach) ** 2
        ]
        for i, (ax, ay, reach) in enumerate(vehicles)
    ]  # fmt: skip
    assert hears(w) == expected


def test_a_vehicle_exactly_at_the_range_is_heard() -> None:
    assert hears(world([(0.0, 0.0), (360.0, 480.0)])) == [[1], [0]]
    assert hears(world([(0.0, 0.0), (360.0, 480.1)])) == [[], []]


@pytest.mark.parametrize("count", [3, 60])
def test_a_radio_of_range_0_is_off_even_on_the_same_spot(count: int) -> None:
    """By pairs and by cells."""
    w = world([(5.0, 5.0)] * count)
    w.fleet["radio_range"][0] = 0.0
    heard = hears(w)
    assert heard[0] == []
    assert heard[1:] == [[j for j in range(1, count) if j != i] for i in range(1, count)]


def test_loss_is_each_receivers_own_and_new_every_tick() -> None:
    w = world([(0.0, 0.0)] * 4)
    w.fleet["radio_loss"] = [0.0, 0.3, 0.3, 1.0]
    got = np.zeros((1500, 4, 4), bool)
    for tick in range(1500):
        for i, senders in enumerate(hears(w, tick)):
            got[tick, i, senders] = True
    assert got[:, 0, 1:].all()
    assert not got[:, 3].any()
    lossy = np.concatenate([got[:, 1, [0, 2, 3]], got[:, 2, [0, 1, 3]]], axis=1)
    assert stats.binomtest(int(lossy.sum()), lossy.size, 0.7).pvalue > 1e-4
    assert np.abs(np.corrcoef(lossy.T) - np.eye(6)).max() < 0.1
    assert (lossy[1:] & lossy[:-1]).mean() == pytest.approx(0.49, abs=0.03)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_beacon_is_heard_after_its_delay(delay: int) -> None:
    w = world([(0.0, 0.0), (500.0, 0.0)], [(600.0, 0.0)], delay)
    learned = None
    for tick in range(8):
        for stage in (w.observe, w.share, w.deliver, w.decide):
            stage(tick)
        if learned is None and w.knowledge["known"][0]:
            learned = tick
    assert learned == delay


@pytest.mark.parametrize("delay", [0, 2])
def test_who_was_in_range_when_a_beacon_was_sent_hears_it_as_it_was(delay: int) -> None:
    """It arrives though the sender has left; what the sender learned meanwhile is not in it."""
    w = world([(0.0, 0.0), (500.0, 0.0)], [(600.0, 0.0), (5000.0, 0.0)], delay)
    for tick in range(delay + 1):
        w.poses["east"][1] = 500.0 if tick == 0 else 5000.0
        for stage in (w.observe, w.share, w.deliver, w.decide):
            stage(tick)
    assert w.contacts[0]["id"][: w.knowledge["known"][0]].tolist() == [0]
    assert w.knowledge["known"][1] == (1 if delay == 0 else 2)
    beacon = w.beacons[w.arriving(delay), 1]
    assert beacon["east"] == 500.0


def test_nothing_is_heard_before_anything_arrives() -> None:
    w = world([(0.0, 0.0), (1.0, 0.0)], [(0.0, 1.0)], 4)
    w.fleet["sensor_range"][0] = 0.5
    for tick in range(4):
        for stage in (w.observe, w.share, w.deliver, w.decide):
            stage(tick)
    assert w.knowledge["known"].tolist() == [0, 1]


def test_a_narrow_radio_carries_everything_in_time() -> None:
    crowd = [(600.0 + math.cos(a), math.sin(a)) for a in range(50)]
    w = world([(0.0, 0.0), (500.0, 0.0)], crowd, beacon_contacts=3, radio_loss=0.2)
    w.fleet["sensor_range"][0] = 1.0
    counts = []
    for tick in range(150):
        for stage in (w.observe, w.share, w.deliver, w.decide):
            stage(tick)
        counts.append(int(w.knowledge["known"][0]))
    assert max(np.diff(counts)) <= 3
    assert counts[10] <= 33
    assert counts[-1] == 50


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 1 << 32), st.sampled_from([49, 80, 300]), st.floats(500.0, 50_000.0))
def test_a_large_swarm_is_heard_as_going_through_all_pairs_says(draw: int, count: int, side: float) -> None:
    rng = np.random.default_rng(draw)
    spots = rng.uniform(0.0, side, (count, 2))
    w = world([(float(x), float(y)) for x, y in spots], radio_loss=0.3)
    w.fleet["radio_range"] = rng.uniform(0.0, 900.0, count)
    gaps = spots[:, None] - spots[None]
    squared = gaps[..., 0] * gaps[..., 0] + gaps[..., 1] * gaps[..., 1]
    reach = np.minimum.outer(w.fleet["radio_range"], w.fleet["radio_range"])
    seed = int(w.rules[0]["seed"])
    expected = [
        [
            j for j in range(count)
            if j != i and squared[i, j] <= reach[i, j] * reach[i, j]
            and calls.uniform(seed, i, 5, randoms.LOSS + j) >= 0.3
        ]
        for i in range(count)
    ]  # fmt: skip
    assert hears(w, 5) == expected
