"""Single searches flown step by step, with every track kept: the very stages that a flight calls, in ideal dynamics."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarmctl.core.arrays import Floats
from swarmctl.core.world import World
from swarmctl.mission.scenario import Scenario

from .paper_variants import Variant

Watch = Callable[[World, int], None]


@dataclass(frozen=True)
class Search:
    """One search: where everybody was, (ticks + 1, V, 2) metres, and the world as it was left."""

    flown: Variant
    seed: int
    world: World
    places: Floats

    @property
    def targets(self) -> Floats:
        """Where the targets lie, (T, 2) metres."""
        rows = self.world.scene.targets
        return np.column_stack((rows["east"], rows["north"]))

    @property
    def found(self) -> NDArray[np.bool_]:
        """Which of them were found, (T,)."""
        return np.asarray(self.world.found >= 0)


def fly_search(flown: Variant, seed: int, seconds: float, watch: Watch = lambda world, tick: None) -> Search:
    """Fly for so long; ``watch`` sees the world at every tick, after all have decided and before they move."""
    scenario = Scenario(flown.mission(), ideal=True)
    world = scenario.world(seed, flown.algorithm)
    return Search(flown, seed, world, step_on(world, seconds, watch))


def step_on(world: World, seconds: float, watch: Watch = lambda world, tick: None) -> Floats:
    """Fly a new world so long, period by period; where everybody was, (ticks + 1, V, 2) metres."""
    world.prepare()
    period = float(world.rules[0]["period"])
    ticks = round(seconds / period)
    places = np.empty((ticks + 1, len(world.fleet), 2))
    places[0, :, 0], places[0, :, 1] = world.poses["east"], world.poses["north"]
    for tick in range(ticks):
        world.observe(tick)
        world.share(tick)
        world.deliver(tick)
        world.decide(tick)
        watch(world, tick)
        for axis, name in enumerate(("east", "north")):
            world.poses[f"v_{name}"] = world.wishes[f"v_{name}"]
            world.poses[name] += period * world.wishes[f"v_{name}"]
            places[tick + 1, :, axis] = world.poses[name]
    return places


def heard(world: World, tick: int, vehicle: int) -> list[int]:
    """Whom a vehicle hears at this tick."""
    slot = world.arriving(tick)
    return [int(j) for j in world.heard[slot, vehicle, : world.heard_count[slot, vehicle]]]
