"""The firmwares that the stub can play, by name."""

from .ardupilot import ArduPilot, ArduPilot46
from .base import Personality
from .px4 import Px4

PERSONALITIES: dict[str, type[Personality]] = {
    "px4": Px4,
    "ardupilot": ArduPilot,
    "ardupilot-4.6": ArduPilot46,
}


def personality_named(name: str) -> type[Personality]:
    """The class of a firmware; raises ValueError that lists what there is."""
    if name not in PERSONALITIES:
        raise ValueError(f"no autopilot {name!r}: the stub plays {', '.join(PERSONALITIES)}")
    return PERSONALITIES[name]
