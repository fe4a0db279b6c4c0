"""A bad network between a vehicle and whoever talks to it, in the vehicle's own time and from a seed.

Each direction is a `Channel`: datagrams go in with the time, and come out when they are due, or twice, or
later than those behind them, or never.
"""

import heapq
from collections.abc import Iterable
from dataclasses import dataclass, replace
from random import Random

REORDERED_BY_S = 0.25
"""The most by which a datagram that is to be overtaken, or a second copy, is held back."""
LARGEST_GARBAGE = 40


@dataclass(frozen=True)
class Impairments:
    """What happens to a datagram: chances (0 to 1), seconds, and directions that are cut."""

    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    garbage: float = 0.0
    """Chance that random bytes come before it."""
    delay_s: float = 0.0
    single_bytes: bool = False
    """It comes a byte at a time, as from a slow serial line."""
    up_cut: bool = False
    """Nothing reaches the vehicle."""
    down_cut: bool = False
    """Nothing leaves it."""


class Channel:
    """One direction."""

    def __init__(self, dice: Random) -> None:
        self.impairments = Impairments()
        self.cut = False
        self._dice = dice
        self._held: list[tuple[float, int, bytes]] = []
        self._count = 0

    def put(self, data: bytes, now: float) -> None:
        """A datagram enters."""
        wants, dice = self.impairments, self._dice
        if self.cut or dice.random() < wants.loss:
            return
        if dice.random() < wants.garbage:
            self._hold(dice.randbytes(dice.randint(1, LARGEST_GARBAGE)), now + wants.delay_s)
        late = REORDERED_BY_S * dice.random() if dice.random() < wants.reordering else 0.0
        self._hold(data, now + wants.delay_s + late)
        if dice.random() < wants.duplication:
            self._hold(data, now + wants.delay_s + REORDERED_BY_S * dice.random())

    def take(self, now: float) -> list[bytes]:
        """What comes out until ``now``."""
        taken: list[bytes] = []
        while self._held and self._held[0][0] <= now:
            data = heapq.heappop(self._held)[2]
            taken += [bytes([byte]) for byte in data] if self.impairments.single_bytes else [data]
        return taken

    def _hold(self, data: bytes, until: float) -> None:
        heapq.heappush(self._held, (until, self._count, data))
        self._count += 1


class Network:
    """Both directions of one vehicle's link; perfect, and passed by, until it is impaired."""

    def __init__(self, seed: str) -> None:
        self.perfect = True
        self.impairments = Impairments()
        self._up = Channel(Random(f"{seed} up"))
        self._down = Channel(Random(f"{seed} down"))

    def impair(self, **changes: float | bool) -> None:
        """Change some fields of `Impairments`, from the next datagram on.

        Raises TypeError for an unknown field.
        """
        self.perfect = False
        self.impairments = replace(self.impairments, **changes)  # type: ignore[arg-type]
        for channel, cut in ((self._up, self.impairments.up_cut), (self._down, self.impairments.down_cut)):
            channel.impairments, channel.cut = self.impairments, cut

    def up(self, data: Iterable[bytes], now: float) -> list[bytes]:
        """Datagrams are sent to the vehicle: those that reach it now."""
        return _through(self._up, data, now)

    def down(self, data: Iterable[bytes], now: float) -> list[bytes]:
        """Datagrams leave the vehicle: those that get out now."""
        return _through(self._down, data, now)


def _through(channel: Channel, data: Iterable[bytes], now: float) -> list[bytes]:
    for each in data:
        channel.put(each, now)
    return channel.take(now)
