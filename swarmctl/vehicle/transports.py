"""Bytes in and out: UDP, TCP and serial behind one small interface, on asyncio.

A wire hands whatever arrives to ``arrived(wire, data, peer)``; ``peer`` is what ``send`` needs to answer, the
sender's address on UDP.  A datagram is handed on as it came, a stream as it is read.
"""

import asyncio
import os
import termios
import tty
import zlib
from collections.abc import Callable
from typing import Any, Protocol

from .addresses import Address

Peer = tuple[str, int] | None
READ_BYTES = 65536
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
        raise TransportError(
            f"{address}: cannot open: {said} (is it in use, or the address wrong?)"
        ) from None


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
    """A TCP connection as client."""

    def __init__(self, address: Address, arrived: Arrived) -> None:
        self.address = address
        self._arrived = arrived
        self._transport: Any = None

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        self._arrived(self, data, None)

    def send(self, data: bytes, peer: Peer) -> None:
        if not self._transport.is_closing():
            self._transport.write(data)

    def close(self) -> None:
        self._transport.close()


async def _open_tcp(address: Address, arrived: Arrived) -> Wire:
    loop = asyncio.get_running_loop()
    _, wire = await loop.create_connection(lambda: _TcpWire(address, arrived), address.host, address.port)
    return wire


class _SerialWire:
    """A serial line, or a pseudo-terminal, read when the loop says that bytes are there."""

    def __init__(self, address: Address, arrived: Arrived) -> None:
        self.address = address
        self._arrived = arrived
        self._loop = asyncio.get_running_loop()
        self._file = os.open(address.host, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            _make_raw(self._file, address.port)
        except (termios.error, AttributeError) as error:
            os.close(self._file)
            raise OSError(f"not a serial line of {address.port} baud ({error})") from None
        self._unsent = bytearray()
        self._loop.add_reader(self._file, self._read)

    def _read(self) -> None:
        try:
            data = os.read(self._file, READ_BYTES)
        except (BlockingIOError, OSError):
            return
        if data:
            self._arrived(self, data, None)

    def send(self, data: bytes, peer: Peer) -> None:
        self._unsent += data
        self._write()

    def _write(self) -> None:
        try:
            del self._unsent[: os.write(self._file, self._unsent)]
        except BlockingIOError:
            pass
        except OSError:
            self._unsent.clear()  # unplugged: the silence will be noticed as a lost link
        if self._unsent:
            self._loop.add_writer(self._file, self._write)
        else:
            self._loop.remove_writer(self._file)

    def close(self) -> None:
        self._loop.remove_reader(self._file)
        self._loop.remove_writer(self._file)
        os.close(self._file)


def _make_raw(file: int, baud: int) -> None:
    """Eight bits, no echo, no translation, at ``baud``."""
    tty.setraw(file)
    attributes = termios.tcgetattr(file)
    speed = getattr(termios, f"B{baud}")
    attributes[4] = attributes[5] = speed
    termios.tcsetattr(file, termios.TCSANOW, attributes)


async def _open_serial(address: Address, arrived: Arrived) -> Wire:
    return _SerialWire(address, arrived)
