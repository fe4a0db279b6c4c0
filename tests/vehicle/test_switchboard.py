"""The switchboard over real sockets of this machine: who is behind which wire, and answers to the right place."""

import asyncio
import errno
import os
import pty
import select
from collections import Counter
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import Signing
from swarmctl.vehicle import transports
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.switchboard import Switchboard
from swarmctl.vehicle.transports import TransportError

from .signed import OTHER_KEY, beat, ticking

GROUND_STATION = Encoder(255, 1).heartbeat(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4)


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


async def udp_board(signing: Signing | None = None) -> tuple[Switchboard, int]:
    """A switchboard that waits on a free UDP port."""
    board = Switchboard(signing)
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
        for data in (GROUND_STATION, beat(4, 154), b"\xfd", b"hello there", beat(5)):
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


async def refusal(address: Address) -> str:
    """What is said of an address that cannot be opened."""
    with pytest.raises(TransportError) as caught:
        await Switchboard().open([address])
    return str(caught.value)


def test_no_such_device_is_named() -> None:
    async def scene() -> None:
        said = await refusal(Address("serial", "/dev/no-such", 57600))
        assert said.startswith("serial:///dev/no-such:57600: cannot open: No such file")
        assert "is it plugged in? ls /dev/serial/by-id" in said

    run(scene)


def test_a_line_that_another_program_has_open_is_named() -> None:
    async def scene() -> None:
        vehicle_end, our_end = pty.openpty()
        board = Switchboard()
        address = Address("serial", os.ttyname(our_end), 57600)
        await board.open([address])
        assert "another program has it open" in await refusal(address)
        board.close()
        again = Switchboard()
        await again.open([address])
        again.close()
        os.close(vehicle_end)
        os.close(our_end)

    run(scene)


@pytest.mark.parametrize(
    ("error", "advice"), [(errno.EACCES, "usermod -aG dialout"), (errno.EBUSY, "another program has it open")]
)
def test_a_device_that_the_system_refuses_comes_with_advice(
    monkeypatch: pytest.MonkeyPatch, error: int, advice: str
) -> None:
    def refuse(*words: object) -> int:
        raise OSError(error, os.strerror(error))

    async def scene() -> None:
        monkeypatch.setattr(transports.os, "open", refuse)
        assert advice in await refusal(Address("serial", "/dev/ttyUSB0", 57600))

    run(scene)


def test_a_file_is_no_serial_line(tmp_path: Path) -> None:
    async def scene() -> None:
        (tmp_path / "file").touch()
        assert "not a serial line of 57600 baud" in await refusal(
            Address("serial", str(tmp_path / "file"), 57600)
        )

    run(scene)


class Plug:
    """A device whose name is a link to a pseudo-terminal; ``own`` is the vehicle's end."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.plug()

    def plug(self) -> None:
        """Plug it in."""
        self.own, self._theirs = pty.openpty()
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(self._theirs))

    def unplug(self) -> None:
        """Pull it out."""
        os.close(self._theirs)
        os.close(self.own)
        self.path.unlink()


def test_a_line_that_is_unplugged_is_let_go_of_and_taken_up_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene() -> None:
        monkeypatch.setattr(transports, "REOPEN_S", 0.02)
        reads = Counter[bool]()
        read = os.read
        monkeypatch.setattr(transports.os, "read", lambda *words: reads.update([True]) or read(*words))
        plug = Plug(tmp_path / "ttyUSB0")
        board = Switchboard()
        await board.open([Address("serial", str(plug.path), 57600)])
        os.write(plug.own, beat(7))
        await until(lambda: board.heard == [7])
        before = reads[True]
        plug.unplug()
        for _ in range(20):  # a line that has hung up is readable for ever
            await asyncio.sleep(0.01)
            board.send(7, b"into the void")
        assert reads[True] - before <= 2
        plug.plug()
        await until(lambda: board.send(7, b"again") or select.select([plug.own], [], [], 0)[0] != [])
        assert read(plug.own, 100).startswith(b"again")
        os.write(plug.own, beat(8))
        await until(lambda: board.heard == [7, 8])
        board.close()
        plug.unplug()

    run(scene)


def test_a_line_that_takes_nothing_holds_back_half_a_second_and_no_more() -> None:
    async def scene() -> None:
        vehicle_end, our_end = pty.openpty()
        board = Switchboard()
        await board.open([Address("serial", os.ttyname(our_end), 9600)])
        os.write(vehicle_end, beat(7))
        await until(lambda: board.heard == [7])
        for k in range(100_000):
            board.send(7, b"%06d" % k)
        got = b""
        async with asyncio.timeout(2.0):
            while not got.endswith(b"at last"):
                if select.select([vehicle_end], [], [], 0)[0]:
                    got += os.read(vehicle_end, 65536)
                else:
                    board.send(7, b"at last")
                await asyncio.sleep(0)
        held = got.index(b"at last")
        assert held < 300_000, "what the system has room for, and half a second"
        assert got[:held] == b"".join(b"%06d" % k for k in range(held // 6)), (
            "whole frames, the first that fitted"
        )
        board.close()
        os.close(vehicle_end)
        os.close(our_end)

    run(scene)


def test_a_connection_that_breaks_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene() -> None:
        monkeypatch.setattr(transports, "REOPEN_S", 0.02)
        clients: list[asyncio.StreamWriter] = []
        server = await asyncio.start_server(lambda reader, writer: clients.append(writer), "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        board = Switchboard()
        await board.open([Address("tcp", "127.0.0.1", port)])
        for system in (7, 8):
            await until(lambda: bool(clients))
            client = clients.pop()
            client.write(beat(system))
            await until(lambda system=system: system in board.heard)
            client.close()
        await until(lambda: bool(clients))
        board.close()
        server.close()

    run(scene)


# Signed


def test_an_unsigned_frame_neither_makes_a_vehicle_nor_moves_one() -> None:
    async def scene() -> None:
        board, port = await udp_board(ticking())
        taken: list[bytes] = []
        board.subscribe(lambda system, data: taken.append(data))
        loop = asyncio.get_running_loop()
        ends = [
            await loop.create_datagram_endpoint(Sender, remote_addr=("127.0.0.1", port)) for _ in range(2)
        ]
        (vehicle, vehicle_end), (stranger, stranger_end) = ends
        signer = ticking()
        signed = signer.sign(beat(3), 0)
        vehicle.sendto(signed)
        await until(lambda: board.heard == [3])
        for data in (beat(3), beat(4), ticking(key=OTHER_KEY).sign(beat(3), 0), signed):
            stranger.sendto(data)
        await until(lambda: len(taken) == 5)
        board.send(3, b"to three")
        await until(lambda: bool(vehicle_end.got))
        assert (board.heard, stranger_end.got) == ([3], [])
        assert board.complaint() == (
            "; frames dropped for their signature: system 3: 1 replayed, system 3: 1 unsigned, "
            "system 3: 1 wrongly signed, system 4: 1 unsigned"
        )
        vehicle.close()
        stranger.close()
        board.close()

    run(scene)


def test_a_vehicle_whose_clock_is_behind_is_called_where_it_sends_from() -> None:
    async def scene() -> None:
        board, port = await udp_board(ticking())
        loop = asyncio.get_running_loop()
        transport, end = await loop.create_datagram_endpoint(Sender, remote_addr=("127.0.0.1", port))
        transport.sendto(ticking(date_s=1.5e9).sign(beat(3), 0))
        await until(lambda: board.call(b"now is the time") or bool(end.got))
        assert (end.got[0], board.heard) == (b"now is the time", [])
        transport.close()
        board.close()

    run(scene)


def test_a_radio_on_the_line_is_no_vehicle() -> None:
    async def scene() -> None:
        vehicle_end, our_end = pty.openpty()
        board = Switchboard(ticking())
        await board.open([Address("serial", os.ttyname(our_end), 57600)])
        status = mav.MAVLink_radio_status_message(190, 180, 100, 40, 40, 0, 0)
        signer = ticking()
        os.write(vehicle_end, Encoder(51, 68).encode(status) + signer.sign(beat(7), 0))
        await until(lambda: board.heard == [7])
        assert board.complaint() == ""
        board.close()
        os.close(vehicle_end)
        os.close(our_end)

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
    switchboard.call(GROUND_STATION)
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
