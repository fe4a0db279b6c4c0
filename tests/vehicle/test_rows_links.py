"""How real vehicles are reached, played by stubs on real sockets of this machine and met by the switchboard."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

import pytest

from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.links import Opener, serve, tcp, udp
from swarmctl.live_cli import OWN_PORT_OFFSET, free_ports
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.addresses import Address, parse
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.switchboard import Switchboard
from swarmctl.vehicle.transports import TransportError

from .stub_flight import ORIGIN

HOST = "127.0.0.1"
POLL_S = 0.002
LIMIT_S = 20.0


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(scene())


@contextlib.asynccontextmanager
async def served(autopilot: str, count: int, opener: Opener, speed: float) -> AsyncIterator[StubFleet]:
    """Stubs that run by themselves until the end of the scene."""
    pads = [(20.0 * k, 0.0) for k in range(count)]
    fleet = StubFleet(count, origin=ORIGIN, pads_m=pads, autopilot=autopilot)
    task = asyncio.ensure_future(serve(fleet, opener, speed))
    try:
        yield fleet
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


class Controller:
    """A switchboard, and a session for each vehicle that was heard on it."""

    def __init__(self, speed: float) -> None:
        self.board = Switchboard()
        self.board.subscribe(self._arrived)
        self.sessions: dict[int, Session] = {}
        self.frames = 0
        self._settings = SessionSettings(time_scale=speed)
        self._now = asyncio.get_running_loop().time

    def _arrived(self, system: int, data: bytes) -> None:
        self.frames += 1
        if system not in self.sessions:
            self.sessions[system] = Session(system, settings=self._settings, now=self._now())
        self.sessions[system].receive(data, self._now())

    async def open(self, addresses: list[Address]) -> None:
        """Open the addresses; a server that is not there yet is tried again."""
        async with asyncio.timeout(LIMIT_S):
            while True:
                with contextlib.suppress(TransportError):
                    return await self.board.open(addresses)
                await asyncio.sleep(POLL_S)

    async def until(self, met: Callable[[], bool]) -> None:
        """Run the sessions until something is so."""
        async with asyncio.timeout(LIMIT_S):
            while not met():
                for system, session in self.sessions.items():
                    session.poll(self._now())
                    for frame in session.outgoing():
                        self.board.send(system, frame)
                await asyncio.sleep(POLL_S)

    async def until_all(self, count: int, *phases: Phase) -> None:
        """Run them until there are so many, all of them in one of these phases."""
        await self.until(
            lambda: len(self.sessions) == count and all(s.phase in phases for s in self.sessions.values())
        )


@pytest.mark.row("px4-links")
def test_vehicles_on_one_port_are_told_apart_and_each_is_answered() -> None:
    async def scene() -> None:
        port = free_ports(3)
        async with served("px4", 3, udp(port, port + OWN_PORT_OFFSET, True), 10.0) as fleet:
            controller = Controller(10.0)
            await controller.open([Address("udpin", HOST, port)])
            await controller.until_all(3, Phase.READY)
            assert controller.board.heard == [1, 2, 3]
            controller.sessions[2].take_off(4.0)
            await controller.until(lambda: controller.sessions[2].phase is Phase.HOLDING)
            assert [vehicle.armed for vehicle in fleet.vehicles] == [False, True, False]
            controller.board.close()

    run(scene)


@pytest.mark.row("px4-links")
def test_vehicles_beyond_the_tenth_share_a_port_with_it() -> None:
    async def scene() -> None:
        port = free_ports(12)
        async with served("px4", 12, udp(port, port + OWN_PORT_OFFSET, False, 10), 1.0):
            controller = Controller(1.0)
            await controller.open(parse(f"udpin://{HOST}:{port}-{port + 9}"))
            await controller.until_all(12, Phase.CONFIGURING, Phase.POSITIONING, Phase.READY)
            ways = {system: controller.board.way(system) for system in (9, 10, 12)}
            assert ways == {
                system: f"udpin://{HOST}:{port + min(system, 10) - 1} from {HOST}:{port + 999 + system}"
                for system in ways
            }
            controller.board.close()

    run(scene)


@pytest.mark.row("px4-partner-lock")
def test_a_restarted_controller_has_its_vehicle_back_at_its_own_port_alone() -> None:
    async def scene() -> None:
        port = free_ports(1)
        async with served("px4", 1, udp(port, port + OWN_PORT_OFFSET, False), 5.0):
            first = Controller(5.0)
            await first.open([Address("udpin", HOST, port)])
            await first.until_all(1, Phase.READY)
            first.board.close()

            other = Controller(5.0)
            await other.open([Address("udpout", HOST, port + OWN_PORT_OFFSET)])
            beat = Encoder(255, 190).heartbeat(mav.MAV_TYPE_GCS, 8, 0, 0, 4)
            again = Controller(5.0)
            await again.open([Address("udpin", HOST, port)])

            def heard_enough() -> bool:
                other.board.call(beat)
                return again.frames > 50

            await again.until(heard_enough)
            assert other.frames == 0
            await again.until_all(1, Phase.READY)
            again.board.close()
            other.board.close()

    run(scene)


@pytest.mark.row("ardupilot-links")
def test_vehicles_that_send_from_any_port_are_answered_there() -> None:
    async def scene() -> None:
        port = free_ports(1)
        async with served("ardupilot", 2, udp(port, 0, True), 50.0):
            controller = Controller(50.0)
            await controller.open([Address("udpin", HOST, port)])
            await controller.until_all(2, Phase.READY)
            assert controller.board.way(1) != controller.board.way(2)
            controller.board.close()

    run(scene)


@pytest.mark.row("ardupilot-links")
def test_vehicles_that_wait_for_tcp_clients_boot_when_they_are_called() -> None:
    async def scene() -> None:
        port = free_ports(11)
        async with served("ardupilot", 2, tcp(port, 10), 50.0) as fleet:
            controller = Controller(50.0)
            await controller.open([Address("tcp", HOST, port), Address("tcp", HOST, port + 10)])
            await controller.until_all(2, Phase.READY)
            assert all(vehicle.since_boot > 41.0 for vehicle in fleet.vehicles)
            controller.board.close()

    run(scene)
