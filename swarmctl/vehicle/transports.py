"""Bytes in and out: UDP, TCP and serial behind one small interface, on asyncio.

A wire hands whatever arrives to ``arrived(wire, data, peer)``; ``peer`` is what ``send`` needs to answer, the
sender's address on UDP.  A datagram is handed on as it came, a stream as it is read.

A connection that breaks, or a line that is unplugged, is opened again every second until it is there; what is
sent meanwhile is lost, as on any link.
"""

import asyncio
import contextlib
import errno
import fcntl
import os
import termios
import tty
import zlib
from collections.abc import Callable
from typing import Any, Protocol

from .addresses import Address

Peer = tuple[str, int] | None
READ_BYTES = 65536
REOPEN_S = 1.0
MOST_WAITING_S, MOST_WAITING_BYTES = 0.5, 4096
"""A serial line (s) or connection (bytes) so far behind loses what is sent next: old setpoints are worse than none."""
BITS_PER_BYTE = 10
_PLUGGED = "is it plugged in? ls /dev/serial/by-id"
_BUSY = "another program has it open: a ground station, ModemManager or another swarmctl"
ADVICE = {
    errno.EACCES: "may you use it? sudo usermod -aG dialout $USER, then log in again",
    errno.ENOENT: _PLUGGED,
    errno.ENXIO: _PLUGGED,
    errno.EBUSY: _BUSY,
    errno.EWOULDBLOCK: _BUSY,
}
OWN_PORTS = range(10000, 20000)
"""From one of these ``udpout`` speaks, unless it is taken."""


class TransportError(Exception):
    """A port, host or device cannot be opened; the message names it and what to do."""


class Wire(Protocol):
    """One open port, connection or line."""

    address: Address

    def send(self, data: bytes, peer: Peer) -> None:
        """Send one frame, to ``peer`` where the wire has several."""

    def close(self) -> None:
        """Close it."""


Arrived = Callable[[Wire, bytes, Peer], None]


async def open_wire(address: Address, arrived: Arrived) -> Wire:
    """Open an address.  Raises TransportError if the system refuses."""
    openers = {"udpin": _open_udp, "udpout": _open_udp, "tcp": _open_tcp, "serial": _open_serial}
    try:
        return await openers[address.kind](address, arrived)
    except OSError as error:
        said = error.strerror or str(error)
        advice = ADVICE.get(error.errno or 0) if address.kind == "serial" else None
        advice = advice or "is it in use, or the address wrong?"
        raise TransportError(f"{address}: cannot open: {said} ({advice})") from None


class _UdpWire(asyncio.DatagramProtocol):
    """A UDP port; ``udpout`` has one peer from the start."""

    def __init__(self, address: Address, arrived: Arrived) -> None:
        self.address = address
        self._arrived = arrived
        self._transport: Any = None
        self._peer: Peer = (address.host, address.port) if address.kind == "udpout" else None

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, peer: tuple[str, int]) -> None:
        self._arrived(self, data, peer)

    def error_received(self, error: Exception) -> None:
        """The other side is not there (yet): heartbeats will tell."""

    def send(self, data: bytes, peer: Peer) -> None:
        to = peer or self._peer
        if to is not None:
            self._transport.sendto(data, to)

    def close(self) -> None:
        self._transport.close()


async def _open_udp(address: Address, arrived: Arrived) -> Wire:
    if address.kind == "udpin":
        return await _bind_udp(address, arrived, address.host, address.port)
    try:
        return await _bind_udp(address, arrived, "0.0.0.0", _own_port(address))
    except OSError:
        return await _bind_udp(address, arrived, "0.0.0.0", 0)


async def _bind_udp(address: Address, arrived: Arrived, host: str, port: int) -> Wire:
    loop = asyncio.get_running_loop()
    _, wire = await loop.create_datagram_endpoint(lambda: _UdpWire(address, arrived), (host, port))
    return wire


def _own_port(address: Address) -> int:
    """The port that we speak first from, the same at every start: PX4 answers only whom it heard first."""
    return OWN_PORTS[zlib.crc32(f"{address.host}:{address.port}".encode()) % len(OWN_PORTS)]


class _TcpWire(asyncio.Protocol):
    """A TCP connection as client; one that breaks is made again."""

    def __init__(self, address: Address, arrived: Arrived) -> None:
        self.address = address
        self._arrived = arrived
        self._transport: Any = None
        self._again: asyncio.Task[None] | None = None
        self._closed = False

    async def connect(self) -> None:
        """Connect.  Raises OSError."""
        loop = asyncio.get_running_loop()
        await loop.create_connection(lambda: self, self.address.host, self.address.port)

    def connection_made(self, transport: Any) -> None:
        self._transport = transport
        if self._closed:
            transport.close()

    def data_received(self, data: bytes) -> None:
        self._arrived(self, data, None)

    def connection_lost(self, error: Exception | None) -> None:
        if not self._closed:
            self._again = asyncio.get_running_loop().create_task(self._reconnect())

    async def _reconnect(self) -> None:
        while True:
            await asyncio.sleep(REOPEN_S)
            with contextlib.suppress(OSError):
                return await self.connect()

    def send(self, data: bytes, peer: Peer) -> None:
        transport = self._transport
        if not transport.is_closing() and transport.get_write_buffer_size() < MOST_WAITING_BYTES:
            transport.write(data)

    def close(self) -> None:
        self._closed = True
        self._transport.close()
        if self._again is not None:
            self._again.cancel()


async def _open_tcp(address: Address, arrived: Arrived) -> Wire:
    wire = _TcpWire(address, arrived)
    await wire.connect()
    return wire


class _SerialWire:
    """A serial line, or a pseudo-terminal, read when the loop says that bytes are there.

    A line that is unplugged is readable for ever and gives an error or nothing: it is closed then, and opened
    again when its device is back.
    """

    def __init__(self, address: Address, arrived: Arrived) -> None:
        self.address = address
        self._arrived = arrived
        self._loop = asyncio.get_running_loop()
        self._unsent = bytearray()
        self._most_waiting = int(MOST_WAITING_S * address.port / BITS_PER_BYTE)
        self._again: asyncio.TimerHandle | None = None
        self._file: int | None = None
        self._open()

    def _open(self) -> None:
        """Open the device for us alone.  Raises OSError."""
        file = os.open(self.address.host, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _make_raw(file, self.address.port)
        except OSError:
            os.close(file)
            raise
        except (termios.error, AttributeError) as error:
            os.close(file)
            raise OSError(f"not a serial line of {self.address.port} baud ({error})") from None
        self._file = file
        self._loop.add_reader(file, self._read)

    def _read(self) -> None:
        assert self._file is not None
        try:
            data = os.read(self._file, READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._arrived(self, data, None)
        else:
            self._lost()

    def send(self, data: bytes, peer: Peer) -> None:
        if self._file is not None and len(self._unsent) + len(data) <= max(self._most_waiting, len(data)):
            self._unsent += data
            self._write()

    def _write(self) -> None:
        if self._file is None:
            return
        try:
            del self._unsent[: os.write(self._file, self._unsent)]
        except BlockingIOError:
            pass
        except OSError:
            self._lost()
            return
        if self._unsent:
            self._loop.add_writer(self._file, self._write)
        else:
            self._loop.remove_writer(self._file)

    def _lost(self) -> None:
        """It was unplugged: let go of it, and try again in a while."""
        self._let_go()
        self._again = self._loop.call_later(REOPEN_S, self._reopen)

    def _reopen(self) -> None:
        try:
            self._open()
        except OSError:
            self._again = self._loop.call_later(REOPEN_S, self._reopen)

    def _let_go(self) -> None:
        self._unsent.clear()
        if self._file is not None:
            self._loop.remove_reader(self._file)
            self._loop.remove_writer(self._file)
            os.close(self._file)
            self._file = None

    def close(self) -> None:
        if self._again is not None:
            self._again.cancel()
        self._let_go()


def _make_raw(file: int, baud: int) -> None:
    """Eight bits, no echo, no translation, at ``baud``."""
    tty.setraw(file)
    attributes = termios.tcgetattr(file)
    speed = getattr(termios, f"B{baud}")
    attributes[4] = attributes[5] = speed
    termios.tcsetattr(file, termios.TCSANOW, attributes)


async def _open_serial(address: Address, arrived: Arrived) -> Wire:
    return _SerialWire(address, arrived)
