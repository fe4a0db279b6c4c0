"""What the operator can order of a flight under way, by Ctrl-C or by `swarmctl control`."""

from collections.abc import Callable
from dataclasses import dataclass

from swarmctl.vehicle.session import OrderError

from .control import ControlError
from .swarm import Swarm

OF_ONE = ("release", "retake")
OF_ALL = ("hold", "resume", "return", "land")


@dataclass
class Orders:
    """How often the operator pressed Ctrl-C: 1 all return, 2 all land.  ``told`` is called with each new level."""

    level: int = 0
    obeyed: int = 0
    told: Callable[[int], None] = lambda level: None

    def interrupt(self) -> None:
        """One more Ctrl-C."""
        self.level += 1
        self.told(self.level)


def obey(words: list[str], swarm: Swarm, now: float) -> str:
    """Carry out one order of `swarmctl control`, and say what is now.  Raises ControlError."""
    if len(words) == 2 and words[0] in OF_ONE:
        _obey_one(words[0], words[1], swarm, now)
        return f"{words[0]} vehicle {words[1]} at {now:.1f} s"
    if len(words) != 1 or words[0] not in OF_ALL:
        known = ", ".join((*OF_ALL, *(f"{word} ID" for word in OF_ONE)))
        raise ControlError(f"{' '.join(words)!r} is no order ({known})")
    orders: dict[str, Callable[[], None]] = {
        "hold": lambda: swarm.hold(now),
        "resume": lambda: swarm.resume(now),
        "return": lambda: swarm.return_all("ordered by the operator", now),
        "land": lambda: swarm.land_all(now),
    }
    orders[words[0]]()
    return f"{words[0]} at {now:.1f} s; now {'holding' if swarm.held else swarm.part.value}"


def _obey_one(word: str, system: str, swarm: Swarm, now: float) -> None:
    row = swarm.roster.row(int(system)) if system.isascii() and system.isdigit() else None
    if row is None:
        raise ControlError(f"there is no vehicle {system} in this flight")
    try:
        (swarm.release if word == "release" else swarm.retake)(row, now)
    except OrderError as error:
        raise ControlError(str(error)) from None
