"""The stub on UDP: one socket a vehicle, one loop that gives the fleet its time.

As firmware does, a vehicle sends to a fixed port until somebody answers, and from then on to the first who
did: a second client hears nothing, and what its commands bring about is told to the first.
"""

import asyncio
from typing import Any

from .fleet import StubFleet
from .vehicle import StubVehicle

HOST = "127.0.0.1"
PERIOD_S = 0.01
"""Fleet time between two ticks: the interval of the fastest stream."""


class Clock:
    """Fleet time: the event loop's, from zero, ``speed`` times as fast."""

    def __init__(self, speed: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._start = self._loop.time()
        self._speed = speed

    def now(self) -> float:
        """Seconds of fleet time."""
        return (self._loop.time() - self._start) * self._speed

    async def until(self, time: float) -> None:
        """Wait for a moment of fleet time."""
        await asyncio.sleep(max(0.0, (time - self.now()) / self._speed))


class VehicleLink(asyncio.DatagramProtocol):
    """The socket of one vehicle."""

    def __init__(self, vehicle: StubVehicle, partner: tuple[str, int], clock: Clock) -> None:
        self._vehicle = vehicle
        self._partner = partner
        self._locked = False
        self._clock = clock
        self._transport: Any = None

    def connection_made(self, transport: Any) -> None:
        """Keep the transport to send by."""
        self._transport = transport

    def datagram_received(self, data: bytes, address: tuple[str, int]) -> None:
        """Hand the bytes on; the first sender becomes the partner."""
        if not self._locked:
            self._partner, self._locked = address, True
        self._vehicle.receive(data, self._clock.now())
        self.flush()

    def error_received(self, error: Exception) -> None:
        """Nobody listens yet: firmware does not mind."""

    def flush(self) -> None:
        """Send what the vehicle has to say."""
        for frame in self._vehicle.outgoing():
            self._transport.sendto(frame, self._partner)


async def serve(fleet: StubFleet, port: int, own_port: int, speed: float) -> None:
    """Run the fleet until cancelled: vehicle i sends from ``own_port`` + i to ``port`` + i on this machine.

    Raises OSError if a port of its own is taken.
    """
    loop = asyncio.get_running_loop()
    clock = Clock(speed)
    links = []
    for index, vehicle in enumerate(fleet.vehicles):
        link = VehicleLink(vehicle, (HOST, port + index), clock)
        await loop.create_datagram_endpoint(lambda link=link: link, (HOST, own_port + index))  # type: ignore[misc]
        links.append(link)
    tick = 0
    while True:
        fleet.advance(clock.now())
        for link in links:
            link.flush()
        tick = max(tick + 1, int(clock.now() / PERIOD_S))
        await clock.until(tick * PERIOD_S)
