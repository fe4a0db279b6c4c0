"""What multicopter dynamics under guard cost beside ideal ones, and how often the guard has to look.

    python benchmarks/multicopter.py [--repeats 20] [--algos mdc,fco,...]

A vehicle-step is one vehicle for one planner period of the search: ten guarded setpoint ticks, or one step of
x += v dt.  ``mission`` spreads take-off and return over the search's steps as well.  Times are a thread's own, the best
over several seeds, so that a busy machine shows little.  The last columns are shares of vehicle-ticks of the search:
free of everything, near another vehicle's circle, near the fence (core/anchor.py).
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from swarmctl.core import stages
from swarmctl.core.planners import MODULES
from swarmctl.core.world import World
from swarmctl.mission.load import load
from swarmctl.mission.scenario import Scenario

SEEDS = range(1, 6)
LOOK_EVERY = 10


def cost_ns(scenario: Scenario, algorithm: str, repeats: int, fly: Callable[[World], object]) -> float:
    """The least thread time of a run a vehicle-step, in ns."""
    mission = scenario.mission
    steps = len(mission.fleet) * round(mission.duration_s / mission.planner.period_s)
    times = []
    for k in range(repeats + 1):  # the first may compile
        world = scenario.world(SEEDS[k % len(SEEDS)], algorithm)
        began = time.thread_time()
        fly(world)
        times.append(time.thread_time() - began)
    return min(times) / steps * 1e9


def ticks_of(world: World) -> int:
    """Setpoint ticks of the search."""
    return round(float(world.rules[0]["duration"] / world.rules[0]["interval"]))


def in_the_air(world: World) -> np.ndarray:
    """Begin the search at the pads, up already; an empty account."""
    world.prepare()
    for poses in (world.truth, world.poses):
        poses["up"] = world.fleet["altitude"]
    world.errands["stage"] = stages.SEARCH
    return np.array([np.inf, 0.0, 0.0, 0.0])


def search(world: World) -> None:
    """The search alone."""
    account = in_the_air(world)
    world.search(0, 0, ticks_of(world), account)


def shares(world: World) -> tuple[float, float, float]:
    """Shares of vehicle-ticks: free, near somebody, near the fence."""
    account = in_the_air(world)
    seen = []
    for k in range(0, ticks_of(world), LOOK_EVERY):
        world.search(0, k, k + LOOK_EVERY, account)
        paths = world.paths[:-1]
        near, fence = paths["near"] > 0, paths["hold"] > paths["clear"]
        seen.append((~near & ~fence, near, fence))
    free, near, fence = np.mean(seen, axis=(0, 2))
    return float(free), float(near), float(fence)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--algos", default=",".join(MODULES))
    asked = parser.parse_args()
    mission = load()
    ideal, exact = (Scenario(mission, ideal=dynamics) for dynamics in (True, False))
    wire = Scenario(load(None, {"observations": "wire"}), ideal=False)
    print(
        f"{'ns a step':10}{'ideal':>8}{'search':>8}{'ratio':>8}{'mission':>9}{'wire':>8}"
        f"{'free':>9}{'near':>7}{'fence':>7}"
    )
    for name in asked.algos.split(","):
        plain = cost_ns(ideal, name, asked.repeats, World.run_ideal)
        guarded = cost_ns(exact, name, asked.repeats, search)
        whole = cost_ns(exact, name, asked.repeats, World.run_multicopter)
        seeing = cost_ns(wire, name, asked.repeats, search)
        free, near, fence = shares(exact.world(SEEDS[0], name))
        print(
            f"{name:10}{plain:8.0f}{guarded:8.0f}{guarded / plain:7.1f}x{whole:9.0f}{seeing:8.0f}"
            f"{100 * free:8.0f}%{100 * near:6.0f}%{100 * fence:6.0f}%",
            flush=True,
        )


if __name__ == "__main__":
    main()
