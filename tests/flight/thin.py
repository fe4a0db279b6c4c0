"""Vehicles on one thin line, in virtual time: a half-duplex radio that carries so many bytes a second and no more.

Whoever has something to send takes turns, the controller too; what one has waiting beyond half a second of the
line is lost, as a radio's buffer is short.
"""

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Sequence

from sim_vehicle_stub.fleet import StubFleet
from swarmctl.vehicle.addresses import Address

from .virtual import StubWires

MOST_WAITING_S = 0.5


class ThinWires(StubWires):
    """All vehicles on one serial line.  ``sent``: bytes offered to it, by direction and second; ``dropped``: frames."""

    def __init__(self, fleet: StubFleet, addresses: Sequence[Address]) -> None:
        super().__init__(fleet, addresses)
        self.sent: Counter[tuple[str, int]] = Counter()
        self.dropped: Counter[int] = Counter()
        self._bytes_per_s = addresses[0].port / 10
        self._waiting: dict[int, deque[tuple[bytes, Callable[[], None]]]] = {
            sender: deque() for sender in (0, *(vehicle.system for vehicle in fleet.vehicles))
        }
        self._turn = 0
        self._busy = False

    def send(self, system: int, frame: bytes) -> None:
        """To a vehicle."""
        self._offer(0, frame, lambda: super(ThinWires, self).send(system, frame))

    def leaves(self, system: int, data: bytes) -> None:
        """A vehicle has sent something."""
        self._offer(system, data, lambda: super(ThinWires, self).leaves(system, data))

    def rate(self, way: str, first_s: int, last_s: int) -> float:
        """Bytes a second offered in one direction, on average."""
        return sum(self.sent[way, second] for second in range(first_s, last_s)) / (last_s - first_s)

    def _offer(self, sender: int, data: bytes, arrive: Callable[[], None]) -> None:
        second, waiting = int(asyncio.get_running_loop().time()), self._waiting[sender]
        self.sent["from" if sender else "to", second] += len(data)
        if sum(len(one) for one, _ in waiting) > MOST_WAITING_S * self._bytes_per_s:
            self.dropped[second] += 1
            return
        waiting.append((data, arrive))
        if not self._busy:
            self._serve()

    def _serve(self) -> None:
        """Carry the next frame of whoever's turn it is."""
        senders = list(self._waiting)
        for _ in senders:
            self._turn = (self._turn + 1) % len(senders)
            waiting = self._waiting[senders[self._turn]]
            if waiting:
                data, arrive = waiting.popleft()
                self._busy = True
                asyncio.get_running_loop().call_later(len(data) / self._bytes_per_s, self._carried, arrive)
                return
        self._busy = False

    def _carried(self, arrive: Callable[[], None]) -> None:
        self._busy = False
        arrive()
        if not self._busy:
            self._serve()
