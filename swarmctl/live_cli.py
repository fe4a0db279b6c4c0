"""What the command line does for live flights: stub processes, the confirmation, the asyncio run."""

import asyncio
import contextlib
import random
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from .flight.fly import Orders, Report, autopilots, endurance_s
from .flight.fly_live import LiveOptions, fly_live
from .flight.results import Outcome
from .mission.model import Mission
from .mission.scenario import Scenario
from .record.folder import RunFolder
from .vehicle.addresses import Address, parse
from .vehicle.session import Session

FIRST_PORT, LAST_PORT = 20000, 28000
OWN_PORT_OFFSET = 1000


def fly_with_stubs(
    mission: Mission, seed: int, folder: RunFolder, speed: float, orders: Orders, report: Report
) -> Outcome:
    """Fly in wall time, times ``speed``, with stub vehicles in a process of their own, over UDP."""
    with stub_process(mission, seed, speed) as port:
        addresses = [Address("udpin", "127.0.0.1", port + i) for i in range(len(mission.fleet))]
        options = LiveOptions(addresses, speed=speed, connect_timeout_s=30.0, own_stubs=True)
        return asyncio.run(fly_live(mission, seed, folder, options, orders, report))


def fly_connected(
    mission: Mission, seed: int, folder: RunFolder, urls: Sequence[str], speed: float, timeout_s: float,
    sure: bool, orders: Orders, report: Report,
) -> Outcome:  # fmt: skip
    """Fly vehicles that are there already.  Raises AddressError for a bad URL."""
    addresses = [address for url in urls for address in parse(url)]
    options = LiveOptions(
        addresses, speed=speed, connect_timeout_s=timeout_s, confirm=None if sure else confirm_typed
    )
    return asyncio.run(fly_live(mission, seed, folder, options, orders, report))


async def confirm_typed(sessions: Sequence[Session]) -> bool:
    """Ask for a typed yes at the terminal."""
    names = ", ".join(f"{s.system} ({s.adapter.name if s.adapter else '?'})" for s in sessions)
    click.echo(f"ready to arm: vehicles {names}. Type yes to take off: ", err=True, nl=False)
    answer = await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    return str(answer).strip().lower() == "yes"


@contextmanager
def stub_process(mission: Mission, seed: int, speed: float) -> Iterator[int]:
    """Stub vehicles on their pads in a process; gives the first of the ports they send to."""
    from sim_vehicle_stub.served import order

    world = Scenario(mission, ideal=False).world(seed)
    origin = (mission.origin.lat, mission.origin.lon, mission.origin.alt_m)
    endurance = endurance_s(mission)
    port = free_ports(len(mission.fleet))
    command = [sys.executable, "-m", "sim_vehicle_stub.served"]
    # A session of its own: Ctrl-C at the terminal is for the controller alone.
    process = subprocess.Popen(command, stdin=subprocess.PIPE, text=True, start_new_session=True)
    try:
        assert process.stdin is not None
        process.stdin.write(
            order(world.fleet, origin, endurance, autopilots(mission), mission.stub.wind_mps, port, speed)
            + "\n"
        )
        process.stdin.flush()
        yield port
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(5.0)
        process.kill()


def free_ports(count: int) -> int:
    """The first of ``count`` UDP ports in a row that are free here, and so are those 1000 above."""
    for first in random.Random().sample(range(FIRST_PORT, LAST_PORT, 50), 100):
        wanted = [first + k for k in range(count)]
        if all(_is_free(port) for port in (*wanted, *(p + OWN_PORT_OFFSET for p in wanted))):
            return first
    raise OSError("no free UDP ports for the stub vehicles")


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True
