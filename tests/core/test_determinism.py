"""The same seed, the same bytes: run after run, in one thread or two, compiled or interpreted."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from swarmctl.core import planners, scene, state
from swarmctl.core.arrays import Records
from swarmctl.core.world import Fences, Scene, World, make_settings

from .worlds import Box, fences, fleet_of, rules_of, snapshot

AREA: Box = (0.0, 800.0, 0.0, 800.0)
KEEP_OUTS: list[Box] = [(300.0, 400.0, 350.0, 450.0)]
PADS = [(30.0, 30.0), (50.0, 30.0), (30.0, 50.0)]


def build(algorithm: str, seed: int, ideal: bool, view: Callable[[Records], Records] = lambda a: a) -> World:
    """Three vehicles, forty targets, one keep-out, everything random that can be; arrays as ``view`` shows them."""
    places = np.random.default_rng(seed).normal((450.0, 500.0), 90.0, (40, 2))
    grid, starts = np.zeros(1, state.GRID), np.zeros((26, 2), np.int64)
    grid[0] = (100.0, 100.0, 150.0, 5, 5, 1, seed, 90.0, 20.0, 1.0, 2.0, 0.6, 0.8, 50.0, 60.0)
    targets = np.zeros(40, state.TARGET)
    scene.sort_into(view(grid), places, np.zeros(40, np.int64), view(targets), starts)
    fleet = fleet_of(
        PADS, [20.0, 45.0, 70.0], sensor_range=100.0, radio_range=400.0, detection_probability=0.8,
        position_noise=5.0, alarms_per_second=0.01, radio_loss=0.2,
    )  # fmt: skip
    rules = rules_of(
        seed=seed, ideal=ideal, duration=60.0 if ideal else 20.0, targets=40, alarm_slots=8, radio_delay=1
    )
    fence = fences(AREA, KEEP_OUTS, 0.0 if ideal else 20.0)
    world = World(
        algorithm, view(fleet), view(rules), Scene(view(targets), view(grid), starts),
        Fences(fence.raw, fence.plan, fence.guard), view(make_settings(algorithm, {})),
    )  # fmt: skip
    world.poses["east"], world.poses["north"] = fleet["pad_east"], fleet["pad_north"]
    for name, array in list(vars(world).items()):
        if isinstance(array, np.ndarray) and array.dtype.names:
            setattr(world, name, view(array))
    return world


def outcome(world: World) -> str:
    """The run from end to end, as a digest of every byte it leaves."""
    results = [world.run_ideal()] if world.rules[0]["ideal"] else list(world.run_multicopter())
    sha = hashlib.sha256()
    for data in (*snapshot(world).values(), *(np.asarray(r).tobytes() for r in results)):
        sha.update(data)
    return sha.hexdigest()


@pytest.mark.parametrize("ideal", [True, False])
def test_twice_and_in_two_threads_the_bytes_are_the_same(ideal: bool) -> None:
    runs = [(name, seed) for name in ("fco", "mdc") for seed in range(6)]

    def fly(run: tuple[str, int]) -> str:
        return outcome(build(*run, ideal))

    once = [fly(run) for run in runs]
    assert [fly(run) for run in reversed(runs)] == once[::-1]
    for threads in (1, 2):
        with ThreadPoolExecutor(threads) as pool:
            assert list(pool.map(fly, runs)) == once
    assert len(set(once)) == len(runs)  # every seed and every algorithm is another run


INTERPRETED = """
import json, sys
import numpy as np
from tests.core.test_determinism import build, outcome

def as_records(array):
    return array.view(np.recarray)

np.seterr(all="ignore")  # counters wrap round on purpose
print(json.dumps([outcome(build(name, 3, ideal, as_records)) for name, ideal in json.loads(sys.argv[1])]))
"""


def test_interpreted_the_bytes_are_those_of_the_compiled_code() -> None:
    runs = [*((name, True) for name in planners.MODULES), ("fco", False)]
    root = Path(__file__).resolve().parents[2]
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(root)}
    done = subprocess.run(
        [sys.executable, "-c", INTERPRETED, json.dumps(runs)], env=env, cwd=root, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    said = dict(zip(runs, json.loads(done.stdout), strict=True))
    assert said == {(name, ideal): outcome(build(name, 3, ideal)) for name, ideal in runs}
