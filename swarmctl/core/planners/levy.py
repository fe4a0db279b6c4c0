"""Lévy walk, a baseline: straight flights of power-law length, each in a new random direction.

Foraging animals are said to search so (Viswanathan et al. 1999); lengths follow p(l) ~ l^-μ above a shortest one.
"""

import math

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..randoms import CHOICE, uniform
from ..state import COMMON_MEMORY, record
from . import common
from .parameters import Parameter

TITLE = "baseline: a Lévy walk"
LISTS = False
PARAMETERS = (
    Parameter("inertia", 0.4, "w in the fence response", "Algorithm 1, line 27", 0.0, 100.0, (0.0, 1.0)),
    Parameter(
        "mu", 2.0, "μ, exponent of the flight lengths", "Viswanathan et al. 1999", 1.01, 10.0, (1.1, 3.5)
    ),
    Parameter("shortest_m", 200.0, "shortest flight", "ours: one sensor radius", 1.0, search=(10.0, 2000.0)),
    Parameter(
        "longest_m",
        5000.0,
        "longest flight",
        "ours: one side of the reference area",
        1.0,
        search=(2000.0, 10000.0),
    ),
)
MEMORY = record(*COMMON_MEMORY, "left_m")


@kernel
def _draw_length(i: int, rules: Records, settings: Records, tick: int) -> float:
    exponent = 1.0 / (1.0 - max(settings[0].mu, 1.001))
    length = settings[0].shortest_m * uniform(rules[0].seed, i, tick, CHOICE) ** exponent
    return float(min(length, settings[0].longest_m))


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """The first flight runs along the initial heading until its length, drawn at the first step, is flown."""
    memory[i].left_m = -1.0


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    memory[i].left_m -= fleet[i].speed * rules[0].period
    if memory[i].left_m < 0.0:
        memory[i].left_m = _draw_length(i, rules, settings, tick)
        if tick > 0:
            angle = 2.0 * math.pi * uniform(rules[0].seed, i, tick, CHOICE + 1)
            common.turn_to(memory, i, math.cos(angle), math.sin(angle))
    if common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia):
        memory[i].left_m = _draw_length(i, rules, settings, tick)


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """Nothing beside what every beacon carries."""
