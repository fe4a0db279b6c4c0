"""Nobody searches before all are up; and what the operator orders is obeyed by all."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarmctl.core import stages
from swarmctl.core.world import World
from swarmctl.flight.orders import Orders
from swarmctl.flight.parts import Part
from swarmctl.flight.swarm import Swarm
from swarmctl.record import mcap_read
from swarmctl.record.replay import replay

from .flown import ALTITUDE_M, Flown, Watch, fly
from .hobbled import goes_silent


def ticks(flown: Flown, field: str) -> NDArray[Any]:
    """One field of the recorded setpoint ticks, (K, V)."""
    log = mcap_read.read(flown.folder.mcap)
    return np.array([message.rows[field] for message in log.rows("/ticks")])


def assert_barrier(flown: Flown, altitudes_m: list[float]) -> None:
    """In the tick in which the first one searches, all search, and all are at their height."""
    stage, up = ticks(flown, "stage"), ticks(flown, "up")
    first = int(np.flatnonzero((stage == stages.SEARCH).any(axis=1))[0])
    assert (stage[first] == stages.SEARCH).all()
    assert (stage[first - 1] == stages.HOLD).all()
    assert (stage[:first] <= stages.HOLD).all()
    assert up[first] == pytest.approx(altitudes_m, abs=0.6)
    log = mcap_read.read(flown.folder.mcap)
    began = [event for event in log.events() if event.content["kind"] == "search"]
    decided = [message.time_s for message in log.rows("/decisions")]
    times = [message.time_s for message in log.rows("/ticks")]
    assert [event.time_s for event in began] == [pytest.approx(decided[0])]
    assert decided[0] == pytest.approx(times[first], abs=0.1001)


def test_nobody_searches_before_all_are_up(tmp_path: Path) -> None:
    flown = fly(tmp_path)
    assert_barrier(flown, [ALTITUDE_M] * 3)


def test_all_wait_for_the_one_that_climbs_highest(tmp_path: Path) -> None:
    flown = fly(tmp_path, {"vehicles.layer_m": 10.0})
    assert_barrier(flown, [12.0, 22.0, 32.0])
    held = (ticks(flown, "stage") == stages.HOLD).sum(axis=0)
    assert held[0] > held[1] > held[2]


def test_all_wait_on_the_ground_for_the_one_that_comes_late(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=goes_silent(0.0, back_at_s=20.0))
    assert flown.outcome.exit_code() == 0
    assert_barrier(flown, [ALTITUDE_M] * 3)
    track = flown.outcome.track
    assert track.times_s[track.airborne.any(axis=1)][0] > 20.0


UNDER_WAY_S = 5.0
"""After so long a search, vehicles have left the columns over their pads."""


def orders_at(*when: tuple[Part, int]) -> Callable[[Orders], Watch]:
    """Press Ctrl-C so many times when a part of the flight is first seen."""

    def watch(orders: Orders) -> Watch:
        left = dict(when)

        def look(now: float, swarm: Swarm, world: World) -> None:
            if swarm.search_began is not None and now < swarm.search_began + UNDER_WAY_S:
                return
            for _ in range(left.pop(swarm.part, 0)):
                orders.interrupt()

        return look

    return watch


def off_pad_m(flown: Flown) -> NDArray[np.float64]:
    """How far from its pad each vehicle ended, (V,)."""
    track, fleet = flown.outcome.track, flown.outcome.world.fleet
    east, north = track.field("east")[-1], track.field("north")[-1]
    return np.asarray(np.hypot(east - fleet["pad_east"], north - fleet["pad_north"]))


def assert_readable(flown: Flown) -> None:
    """The folder of a flight that was cut short is as good as any other."""
    result = replay(mcap_read.read(flown.folder.mcap))
    assert result.same
    assert not result.truncated
    assert result.decisions == flown.summary["decisions"]
    assert flown.folder.tracks.stat().st_size > 10_000


def test_one_order_brings_everybody_home(tmp_path: Path) -> None:
    flown = fly(tmp_path, watch=orders_at((Part.SEARCHING, 1)))
    assert flown.outcome.exit_code() == 4
    assert [v["outcome"] for v in flown.summary["per_vehicle"]] == ["landed"] * 3
    assert 0 < flown.summary["decisions"] < 210
    assert off_pad_m(flown).max() < 1.0
    assert flown.summary["min_separation_m"] >= 15.0
    assert_readable(flown)


def test_two_orders_land_everybody_where_it_is(tmp_path: Path) -> None:
    home = fly(tmp_path / "once", watch=orders_at((Part.SEARCHING, 1)))
    flown = fly(tmp_path / "twice", watch=orders_at((Part.SEARCHING, 2)))
    assert flown.outcome.exit_code() == 4
    assert [v["outcome"] for v in flown.summary["per_vehicle"]] == ["landed"] * 3
    assert flown.outcome.track.times_s[-1] < home.outcome.track.times_s[-1]
    assert off_pad_m(flown).min() > 5.0
    assert_readable(flown)


def test_an_order_on_the_way_home_lands_everybody(tmp_path: Path) -> None:
    flown = fly(tmp_path, {"duration_s": 30.0}, watch=orders_at((Part.RETURNING, 2)))
    assert flown.outcome.exit_code() == 4
    assert [v["outcome"] for v in flown.summary["per_vehicle"]] == ["landed"] * 3
    assert_readable(flown)


def test_an_order_during_take_off_lands_everybody_at_once(tmp_path: Path) -> None:
    flown = fly(tmp_path, watch=orders_at((Part.TAKING_OFF, 1)))
    assert flown.outcome.exit_code() == 4
    assert (flown.summary["decisions"], flown.summary["searched_s"]) == (0, 0.0)
    assert [v["outcome"] for v in flown.summary["per_vehicle"]] == ["landed"] * 3
    assert off_pad_m(flown).max() < 1.0
    assert not flown.outcome.track.airborne[-1].any()
    assert_readable(flown)


def test_an_order_before_take_off_ends_the_flight_on_the_ground(tmp_path: Path) -> None:
    flown = fly(tmp_path, watch=orders_at((Part.PREPARING, 1)))
    assert flown.outcome.exit_code() == 4
    assert not flown.outcome.track.airborne.any()
    armed = [v["distance_m"] for v in flown.summary["per_vehicle"]]
    assert armed == [0.0, 0.0, 0.0]
    assert_readable(flown)
