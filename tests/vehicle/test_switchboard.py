"""The switchboard over real sockets of this machine: who is behind which wire, and answers to the right place."""

import asyncio
import os
import pty
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.switchboard import Switchboard
from swarmctl.vehicle.transports import TransportError


def beat(system: int, kind: int = mav.MAV_TYPE_QUADROTOR, component: int = 1) -> bytes:
    return Encoder(system, component).heartbeat(kind, mav.MAV_AUTOPILOT_PX4, 0, 0, 4)


class Sender(asyncio.DatagramProtocol):
    """A vehicle's end of a UDP link."""

    def __init__(self) -> None:
        self.got: list[bytes] = []

    def datagram_received(self, data: bytes, addr: object) -> None:
        self.got.append(data)


async def until(met: Callable[[], bool]) -> None:
    """Let the loop run until something is so; fails after two seconds."""
    async with asyncio.timeout(2.0):
        while not met():
            await asyncio.sleep(0)


def run(scene: Callable[[], Awaitable[None]]) -> None:
    asyncio.run(scene())  # type: ignore[arg-type]


async def udp_board() -> tuple[Switchboard, int]:
    """A switchboard that waits on a free UDP port."""
    board = Switchboard()
    probe = asyncio.get_running_loop().create_datagram_endpoint(asyncio.DatagramProtocol, ("127.0.0.1", 0))
    transport, _ = await probe
    port = transport.get_extra_info("sockname")[1]
    transport.close()
    await asyncio.sleep(0)
    await board.open([Address("udpin", "127.0.0.1", port)])
    return board, port


def test_many_vehicles_on_one_port_are_told_apart_and_answered_where_they_send_from() -> None:
    async def scene() -> None:
        board, port = await udp_board()
        taken: list[tuple[int, bytes]] = []
        board.subscribe(lambda system, data: taken.append((system, data)))
        loop = asyncio.get_running_loop()
        ends = [
            await loop.create_datagram_endpoint(Sender, remote_addr=("127.0.0.1", port)) for _ in range(2)
        ]
        for system, (transport, _) in zip((3, 9), ends, strict=True):
            transport.sendto(beat(system))
        await until(lambda: board.heard == [3, 9])
        assert sorted(system for system, _ in taken) == [3, 9]
        board.send(9, b"to nine")
        board.send(3, b"to three")
        await until(lambda: all(sender.got for _, sender in ends))
        assert [sender.got for _, sender in ends] == [[b"to three"], [b"to nine"]]
        for transport, _ in ends:
            transport.close()
        board.close()

    run(scene)


def test_ground_stations_gimbals_and_garbage_are_no_vehicles() -> None:
    async def scene() -> None:
        board, port = await udp_board()
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(Sender, remote_addr=("127.0.0.1", port))
        for data in (beat(255, mav.MAV_TYPE_GCS), beat(4, component=154), b"\xfd", b"hello there", beat(5)):
            transport.sendto(data)
        await until(lambda: 5 in board.heard)
        assert board.heard == [5]
        transport.close()
        board.close()

    run(scene)


def test_a_serial_line_is_cut_into_frames() -> None:
    async def scene() -> None:
        vehicle_end, our_end = pty.openpty()
        board = Switchboard()
        await board.open([Address("serial", os.ttyname(our_end), 57600)])
        taken: list[tuple[int, bytes]] = []
        board.subscribe(lambda system, data: taken.append((system, data)))
        frame = beat(7)
        os.write(vehicle_end, b"noise" + frame[:5])
        os.write(vehicle_end, frame[5:])
        await until(lambda: bool(taken))
        assert taken == [(7, frame)]
        assert board.heard == [7]
        board.send(7, b"\xfd answer")
        assert os.read(vehicle_end, 100) == b"\xfd answer"
        board.close()
        os.close(vehicle_end)
        os.close(our_end)

    run(scene)


def test_a_port_in_use_is_named() -> None:
    async def scene() -> None:
        board, port = await udp_board()
        with pytest.raises(TransportError, match=f"udpin://127.0.0.1:{port}: cannot open"):
            await Switchboard().open([Address("udpin", "127.0.0.1", port)])
        board.close()

    run(scene)


def test_no_such_device_is_named() -> None:
    async def scene() -> None:
        with pytest.raises(TransportError, match="serial:///dev/no-such:57600: cannot open: No such file"):
            await Switchboard().open([Address("serial", "/dev/no-such", 57600)])

    run(scene)


def test_who_speaks_first_does_so_from_the_same_port_at_every_start() -> None:
    """PX4 answers only whom it heard first, also when another controller has taken that one's place."""

    async def scene() -> None:
        loop = asyncio.get_running_loop()
        vehicle = _Locked()
        transport, _ = await loop.create_datagram_endpoint(lambda: vehicle, ("127.0.0.1", 0))
        place = Address("udpout", "127.0.0.1", transport.get_extra_info("sockname")[1])
        first = await _greets(place)
        await until(lambda: first.heard == [7])
        first.close()
        await asyncio.sleep(0)
        again = await _greets(place)
        await until(lambda: again.heard == [7])
        assert len(vehicle.heard_from) == 1
        other = await _greets(place)  # the port is taken: another will do
        await until(lambda: len(vehicle.heard_from) == 2)
        for open_one in (again, other, transport):
            open_one.close()

    run(scene)


async def _greets(place: Address) -> Switchboard:
    """A controller that speaks first."""
    switchboard = Switchboard()
    await switchboard.open([place])
    switchboard.call(beat(255, mav.MAV_TYPE_GCS, 190))
    return switchboard


class _Locked(asyncio.DatagramProtocol):
    """A vehicle that answers only whom it heard first."""

    def __init__(self) -> None:
        self.heard_from: list[tuple[str, int]] = []

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        if addr not in self.heard_from:
            self.heard_from.append(addr)
        self._transport.sendto(beat(7), self.heard_from[0])
