"""Bounce, the simplest baseline: straight on, and turn at random where the fence is met."""

from ..arrays import Floats, Integers, Records
from ..jit import kernel
from ..state import COMMON_MEMORY, record
from . import common
from .parameters import Parameter

TITLE = "baseline: straight on, a random turn at the fence"
LISTS = False
PARAMETERS = (
    Parameter("inertia", 0.4, "w in the fence response", "Algorithm 1, line 27", 0.0, 100.0, (0.0, 3.0)),
)
MEMORY = record(*COMMON_MEMORY)


@kernel
def start(memory: Records, i: int, fleet: Records, rules: Records, edges: Floats) -> None:
    """Nothing to prepare."""


@kernel
def step(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats, rules: Records,
    settings: Records, tick: int,
) -> None:  # fmt: skip
    """One period of vehicle ``i``: turn the heading in its memory (see loop.decide for the arguments)."""
    common.respond_to_fence(memory, i, poses, fleet, edges, rules, tick, settings[0].inertia)


@kernel
def tell(memory: Records, i: int, beacons: Records, slot: int) -> None:
    """Nothing beside what every beacon carries."""
