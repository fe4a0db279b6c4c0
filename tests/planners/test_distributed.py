"""What keeps "distributed" honest, for every planner there is: vehicles meet only through the radio.

Whatever is true of a vehicle out of radio range (where it is, what it knows, remembers and was told) does not
change what another one decides.  Within range it may, and for every planner that listens at all it does.
"""

from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swarmctl.core import planners
from swarmctl.core.world import World

from ..core.worlds import Box, restore, snapshot
from .situation import Situation

AREA: Box = (0.0, 3000.0, 0.0, 3000.0)
KEEP_OUT: Box = (1200.0, 1500.0, 1300.0, 1500.0)
RADIO = 600.0
ME, OTHER = 0, 1  # the other is perturbed, I must not notice; the third may be in range of either
DEAF = ("bounce", "levy", "sweep")  # these use no radio at all
OWN = ("wishes", "memory", "knowledge", "contacts", "has")


@cache
def situation(algorithm: str) -> tuple[Situation, dict[str, bytes]]:
    """Three vehicles among targets, about to start; built once a planner."""
    targets = np.random.default_rng(5).uniform(0.0, 3000.0, (120, 2))
    spots = [(float(x), float(y)) for x, y in targets]
    s = Situation(algorithm, [(0.0, 0.0)] * 3, [], spots, area=AREA, keep_outs=[KEEP_OUT], random=0.05)
    return s, snapshot(s.world)


def in_mid_flight(algorithm: str, rng: np.random.Generator) -> Situation:
    """The three after a short flight from random places, so that there is something in every memory."""
    s, start = situation(algorithm)
    restore(s.world, start)
    s.world.rules["seed"] = rng.integers(1 << 31)
    s.tick = 0
    angles = rng.uniform(0.0, 2.0 * np.pi, 3)
    s.world.memory["heading_east"], s.world.memory["heading_north"] = np.cos(angles), np.sin(angles)
    for axis in ("east", "north"):
        s.world.poses[axis] = rng.uniform(100.0, 2900.0, 3)
    return s.fly(int(rng.integers(0, 40)))


def perturb(world: World, rng: np.random.Generator) -> None:
    """Make everything about the other vehicle different: its memory, its knowledge, what it was told."""
    for name in world.memory.dtype.names or ():
        kind = world.memory.dtype[name].base.kind
        world.memory[name][OTHER] = rng.integers(0, 4) if kind == "i" else rng.uniform(-500.0, 3000.0)
    world.memory["heading_east"][OTHER], world.memory["heading_north"][OTHER] = 0.6, -0.8
    knows = rng.permutation(len(world.scene.targets))[: rng.integers(1, 60)]
    world.told[OTHER] = 0
    for slot, serial in enumerate(knows):
        target = world.scene.targets[serial]
        world.contacts[OTHER, slot] = (serial, target["east"], target["north"])
    world.knowledge["known"][OTHER] = len(knows)
    world.index()
    world.poses["v_east"][OTHER], world.poses["v_north"][OTHER] = rng.uniform(-25.0, 25.0, 2)


def put_at_range(world: World, low: float, high: float, rng: np.random.Generator) -> bool:
    """Put the other vehicle somewhere so far from me; False if chance finds no such place in the area."""
    for _ in range(40):
        place = rng.uniform(0.0, 3000.0, 2)
        if low < np.hypot(place[0] - world.poses["east"][ME], place[1] - world.poses["north"][ME]) <= high:
            world.poses["east"][OTHER], world.poses["north"][OTHER] = place
            return True
    return False


def decided(s: Situation) -> dict[str, bytes]:
    """One more period, and what I then know, remember and want."""
    s.plan()
    s.tick -= 1
    return {name: getattr(s.world, name)[ME].tobytes() for name in OWN}


@pytest.mark.parametrize("algorithm", planners.MODULES)
def test_a_vehicle_out_of_range_does_not_matter(algorithm: str) -> None:
    @given(st.integers(0, 1 << 32))
    @settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
    def holds(draw: int) -> None:
        rng = np.random.default_rng(draw)
        s = in_mid_flight(algorithm, rng)
        if not put_at_range(s.world, RADIO, np.inf, rng):
            return
        before = snapshot(s.world)
        expected = decided(s)
        restore(s.world, before)
        perturb(s.world, rng)
        put_at_range(s.world, RADIO, np.inf, rng)
        assert decided(s) == expected

    holds()


@pytest.mark.parametrize("algorithm", [name for name in planners.MODULES if name not in DEAF])
def test_a_vehicle_in_range_does_matter(algorithm: str) -> None:
    changed = 0
    for draw in range(150):
        rng = np.random.default_rng(draw)
        s = in_mid_flight(algorithm, rng)
        put_at_range(s.world, 0.0, RADIO, rng)
        before = snapshot(s.world)
        expected = decided(s)["wishes"]
        restore(s.world, before)
        perturb(s.world, rng)
        changed += decided(s)["wishes"] != expected
    assert changed >= 3


@pytest.mark.parametrize("algorithm", DEAF)
def test_the_deaf_planners_do_not_listen(algorithm: str) -> None:
    for draw in range(50):
        rng = np.random.default_rng(draw)
        s = in_mid_flight(algorithm, rng)
        put_at_range(s.world, 0.0, RADIO, rng)
        before = snapshot(s.world)
        expected = decided(s)
        restore(s.world, before)
        perturb(s.world, rng)
        after = decided(s)
        assert (after["wishes"], after["memory"]) == (expected["wishes"], expected["memory"])
