"""Belief sweep's kernels do as little anew as they can, and decide what the plain version does, to the last bit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmctl.core.world import World
from swarmctl.mission.load import load
from swarmctl.mission.scenario import Scenario

from ..flight import flown
from .plain_belief import Watched

PAPER = Path(__file__).parents[2] / "missions" / "paper.yaml"
BELIEF = {"planner.algorithm": "belief"}


def headings(world: World) -> Any:
    """The commanded directions, (V, 2)."""
    return np.column_stack((world.memory["heading_east"], world.memory["heading_north"]))


def fly_ideally(seed: int, **settings: object) -> Watched:
    """A whole search in ideal dynamics, compared at every period."""
    mission = load(PAPER, {**BELIEF, **{k.replace("__", "."): v for k, v in settings.items()}})
    world = Scenario(mission, ideal=True).world(seed)
    watched, period = Watched(world), float(world.rules[0]["period"])
    world.prepare()
    for tick in range(round(mission.duration_s / period)):
        world.observe(tick)
        watched.share(tick)
        world.share(tick)
        world.deliver(tick)
        before = headings(world)
        world.decide(tick)
        watched.decided(tick, before)
        for axis in ("east", "north"):
            world.poses[f"v_{axis}"] = world.wishes[f"v_{axis}"]
            world.poses[axis] += period * world.wishes[f"v_{axis}"]
    return watched


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_whole_search_in_ideal_dynamics(seed: int) -> None:
    watched = fly_ideally(seed)
    assert watched.parted == []
    assert watched.compared == 6 * 1600
    assert len(watched.goals) > 200
    assert watched.world.memory["lap"].max() > 0  # all was covered, and searched again


def test_a_search_of_vehicles_that_start_all_over_the_area() -> None:
    watched = fly_ideally(5, vehicles__launch="spread", vehicles__count=7, duration_s=600)
    assert (watched.world.memory["home"] > 0.0).all()
    assert watched.parted == []
    assert watched.compared == 7 * 600


def test_every_kind_of_trouble_at_once() -> None:
    watched = fly_ideally(
        4, vehicles__count=9, radio__loss=0.3, radio__delay_s=2.0, sensor__detection_probability=0.7,
        sensor__false_alarms_per_hour=60, sensor__position_noise_m=10, duration_s=600, planner__period_s=2.0,
    )  # fmt: skip
    assert watched.parted == []
    assert watched.compared == 9 * 300


def test_a_multicopters_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Watched] = []
    share, decide = World.share, World.decide

    def sharing(world: World, tick: int) -> None:
        if not seen:
            seen.append(Watched(world))
        seen[0].share(tick)
        share(world, tick)

    def deciding(world: World, tick: int) -> None:
        before = headings(world)
        decide(world, tick)
        seen[0].decided(tick, before)

    monkeypatch.setattr(World, "share", sharing)
    monkeypatch.setattr(World, "decide", deciding)
    flown.fly(tmp_path, {**BELIEF, "duration_s": 400})
    assert seen[0].parted == []
    assert seen[0].compared == 3 * 400
