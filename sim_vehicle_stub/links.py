"""The stub on real links: one a vehicle, and one loop that gives the fleet its time.

Over UDP a vehicle sends to a fixed port until somebody answers, and from then on to the first who did: a
second client hears nothing, and what its commands bring about is told to the first.  Over TCP it waits for
its first client before it boots, and has one at a time.  A pseudo-terminal stands for a serial port.
"""

import asyncio
import contextlib
import os
import tty
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from .fleet import StubFleet
from .vehicle import StubVehicle

HOST = "127.0.0.1"
PERIOD_S = 0.01
"""Fleet time between two ticks: the interval of the fastest stream."""
SHORTEST_PERIOD_S = 0.002
"""Wall time between two ticks, however fast the fleet's time runs."""
MOST_PORTS = 65535
MOST_WAITING_BYTES = 65536
"""A client that reads no faster than this loses frames, as on a serial line."""


class Clock:
    """Fleet time: the event loop's, from zero, ``speed`` times as fast."""

    def __init__(self, speed: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._start = self._loop.time()
        self._speed = speed
        self.period_s = max(PERIOD_S, SHORTEST_PERIOD_S * speed)

    def now(self) -> float:
        """Seconds of fleet time."""
        return (self._loop.time() - self._start) * self._speed

    async def until(self, time: float) -> None:
        """Wait for a moment of fleet time."""
        await asyncio.sleep(max(0.0, (time - self.now()) / self._speed))


class Link(Protocol):
    """One vehicle's way out."""

    def flush(self) -> None:
        """Send what the vehicle has to say."""


Opener = Callable[[StubFleet, Clock], Any]
"""Opens a link for each vehicle: a coroutine that returns them, and raises OSError for a port that is taken."""


class UdpLink(asyncio.DatagramProtocol):
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


class TcpLink:
    """The listening socket of one vehicle."""

    def __init__(self, vehicle: StubVehicle, clock: Clock) -> None:
        self._vehicle = vehicle
        self._clock = clock
        self._client: Any = None
        self._booted = False

    async def listen(self, port: int) -> None:
        """Wait for clients from now on; raises OSError for a port that is taken."""
        await asyncio.get_running_loop().create_server(lambda: TcpClient(self), HOST, port)

    def connected(self, transport: Any) -> bool:
        """A client has come; False if there is one already."""
        if self._client is not None:
            return False
        self._client = transport
        if not self._booted:
            self._booted = True
            self._vehicle.start(self._clock.now())
        return True

    def disconnected(self, transport: Any) -> None:
        """A client has gone."""
        if self._client is transport:
            self._client = None

    def received(self, data: bytes) -> None:
        """Hand the bytes on."""
        self._vehicle.receive(data, self._clock.now())
        self.flush()

    def flush(self) -> None:
        """Send what the vehicle has to say, if anybody is there."""
        frames = self._vehicle.outgoing()
        if self._client is not None and self._client.get_write_buffer_size() < MOST_WAITING_BYTES:
            self._client.write(b"".join(frames))


class TcpClient(asyncio.Protocol):
    """One connection to a vehicle."""

    def __init__(self, link: TcpLink) -> None:
        self._link = link
        self._transport: Any = None

    def connection_made(self, transport: Any) -> None:
        """Take the place of the vehicle's client, or go."""
        self._transport = transport
        if not self._link.connected(transport):
            transport.abort()

    def data_received(self, data: bytes) -> None:
        """Hand the bytes on."""
        self._link.received(data)

    def connection_lost(self, error: Exception | None) -> None:
        """Leave the place to another."""
        self._link.disconnected(self._transport)


class PtyLink:
    """The pseudo-terminal of one vehicle; ``path`` is what a client opens."""

    def __init__(self, vehicle: StubVehicle, clock: Clock) -> None:
        self._vehicle = vehicle
        self._clock = clock
        self._own, self._others = os.openpty()  # the other end stays open, so that clients may come and go
        tty.setraw(self._others)
        os.set_blocking(self._own, False)
        self.path = os.ttyname(self._others)
        asyncio.get_running_loop().add_reader(self._own, self._readable)

    def _readable(self) -> None:
        with contextlib.suppress(OSError):
            self._vehicle.receive(os.read(self._own, 4096), self._clock.now())
        self.flush()

    def flush(self) -> None:
        """Send what the vehicle has to say; what nobody reads is lost."""
        for frame in self._vehicle.outgoing():
            with contextlib.suppress(BlockingIOError):
                os.write(self._own, frame)


def udp(port: int, own_port: int, shared: bool, ports: int = MOST_PORTS) -> Opener:
    """Vehicle i sends from ``own_port`` + i to ``port`` + i on this machine, or all to ``port``.

    ``own_port`` 0: from any port that is free.  ``ports``: how many there are to send to; vehicles beyond share
    the last.
    """
    last = 0 if shared else ports - 1

    async def open_links(fleet: StubFleet, clock: Clock) -> list[UdpLink]:
        links = []
        for index, vehicle in enumerate(fleet.vehicles):
            link = UdpLink(vehicle, (HOST, port + min(index, last)), clock)
            await asyncio.get_running_loop().create_datagram_endpoint(
                lambda link=link: link,  # type: ignore[misc]
                (HOST, own_port + index if own_port else 0),
            )
            links.append(link)
        return links

    return open_links


def tcp(port: int, spacing: int) -> Opener:
    """Vehicle i listens on ``port`` + ``spacing`` · i of this machine."""

    async def open_links(fleet: StubFleet, clock: Clock) -> list[TcpLink]:
        links = [TcpLink(vehicle, clock) for vehicle in fleet.vehicles]
        for index, link in enumerate(links):
            await link.listen(port + spacing * index)
        return links

    return open_links


def pty(announce: Callable[[int, str], None]) -> Opener:
    """Each vehicle on a pseudo-terminal; ``announce`` is told its system id and path."""

    async def open_links(fleet: StubFleet, clock: Clock) -> list[PtyLink]:
        links = [PtyLink(vehicle, clock) for vehicle in fleet.vehicles]
        for vehicle, link in zip(fleet.vehicles, links, strict=True):
            announce(vehicle.system, link.path)
        return links

    return open_links


async def serve(fleet: StubFleet, opener: Opener, speed: float) -> None:
    """Run the fleet until cancelled.  Raises OSError if a port of its own is taken."""
    clock = Clock(speed)
    links: Sequence[Link] = await opener(fleet, clock)
    tick = 0
    while True:
        fleet.advance(clock.now())
        for link in links:
            link.flush()
        tick = max(tick + 1, int(clock.now() / clock.period_s))
        await clock.until(tick * clock.period_s)
