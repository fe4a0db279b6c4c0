"""What the command line does for live flights: stub processes, the confirmation, the asyncio run."""

import asyncio
import contextlib
import random
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import click

from .dashboard import Progress, findings_table
from .flight import clock
from .flight.adoption import Adoption
from .flight.fly import autopilots, endurance_s
from .flight.fly_live import LiveOptions, fly_live, probe
from .flight.orders import Orders
from .flight.preparation import Preparation
from .flight.results import Outcome
from .flight.resumption import Resumption
from .mavlink.signing import Signing
from .mission.model import Mission
from .mission.scenario import Scenario
from .record.folder import RunFolder
from .vehicle.addresses import Address, AddressError, parse
from .vehicle.backend import Backend, Mavlink
from .vehicle.keys import SigningKeyError, exposure, read_key, signing_with

FIRST_PORT, LAST_PORT = 20000, 28000
OWN_PORT_OFFSET = 1000
STUB_CONNECT_S = 30.0


def fly_with_stubs(
    mission: Mission, seed: int, folder: RunFolder, speed: float, orders: Orders, progress: Progress,
    backend: Callable[[], Backend] = Mavlink,
) -> Outcome:  # fmt: skip
    """Fly in wall time, times ``speed``, with stub vehicles in a process of their own, over UDP."""
    with stub_process(mission, seed, speed) as port:
        options = LiveOptions(
            [[Address("udpin", "127.0.0.1", port + i)] for i in range(len(mission.fleet))],
            speed=speed, connect_timeout_s=STUB_CONNECT_S, own_stubs=True, watching=progress.preparing,
            backend=backend,
        )  # fmt: skip
        return asyncio.run(fly_live(mission, seed, folder, options, orders, progress.flying))


@dataclass(frozen=True)
class Reach:
    """How vehicles that are there already are reached, as the command line says it."""

    urls: Sequence[str] = ()
    timeout_s: float = 20.0
    backend: str = "mavlink"
    signing_key: Path | None = None

    def signing(self, progress: Progress) -> Signing | None:
        """What signs and judges frames, if a key was given.  Raises SigningKeyError."""
        if self.signing_key is None:
            return None
        key = read_key(self.signing_key)
        if trouble := exposure(self.signing_key):
            progress.say(trouble)
        return signing_with(key, clock.utc_s)


def backend(reach: Reach) -> Callable[[], Backend]:
    """Who speaks to the vehicles.  Raises UsageError where MAVSDK is wanted and cannot do it."""
    if reach.backend == "mavlink":
        return Mavlink
    if reach.signing_key is not None:
        raise click.UsageError("MAVSDK cannot sign what it sends: --signing-key needs --backend mavlink")
    try:
        from .vehicle.mavsdk_session import MavsdkBackend
    except ImportError as error:
        raise click.UsageError(
            f"--backend mavsdk needs MAVSDK 4.1 (pip install 'mavsdk>=4.1,<5'): {error}"
        ) from None
    return MavsdkBackend


def fly_connected(
    mission: Mission, seed: int, folder: RunFolder, reach: Reach, orders: Orders, progress: Progress, *,
    speed: float, sure: bool, adapt: bool,
) -> Outcome:  # fmt: skip
    """Fly vehicles that are there already.  Raises AddressError for a bad URL, SigningKeyError for a bad key."""
    options = LiveOptions(
        addresses(mission, reach.urls), speed=speed, connect_timeout_s=reach.timeout_s,
        confirm=confirming(progress, sure), watching=progress.preparing, adapt=adapt,
        signing=reach.signing(progress), telling=progress.say, backend=backend(reach),
    )  # fmt: skip
    return asyncio.run(fly_live(mission, seed, folder, options, orders, progress.flying))


def fly_on(
    before: Resumption, folder: RunFolder, reach: Reach, orders: Orders, progress: Progress, *,
    speed: float | None, sure: bool,
) -> Outcome:  # fmt: skip
    """Fly on where another controller died: find its vehicles, take them back.  Raises AddressError for a bad URL."""
    mission = before.mission
    at_urls = addresses(mission, reach.urls) if reach.urls else [[address] for address in before.addresses]
    asks = not (sure or before.own_stubs)
    options = LiveOptions(
        at_urls, speed=speed or before.speed, connect_timeout_s=reach.timeout_s, own_stubs=before.own_stubs,
        confirm=confirming(progress, not asks), watching=progress.preparing, resumes=before,
        signing=reach.signing(progress), telling=progress.say,
    )  # fmt: skip
    return asyncio.run(fly_live(mission, before.seed, folder, options, orders, progress.flying))


def check_connected(mission: Mission, reach: Reach, orders: Orders, progress: Progress) -> bool:
    """Probe the vehicles and print what was found; whether all may be armed.  Raises AddressError, SigningKeyError."""
    options = LiveOptions(
        addresses(mission, reach.urls), connect_timeout_s=reach.timeout_s, watching=progress.preparing,
        signing=reach.signing(progress), telling=progress.say, backend=backend(reach),
    )  # fmt: skip
    preparation, ways = asyncio.run(probe(mission, options, orders))
    rows = list(zip(preparation.systems, ways, preparation.findings, strict=True))
    click.echo(findings_table(f"{mission.name}: nothing was armed", rows))
    for line in (*preparation.refusals.values(), *preparation.troubles):
        click.echo(line)
    return not preparation.refusals


def addresses(mission: Mission, urls: Sequence[str]) -> list[list[Address]]:
    """Where each vehicle may be heard: at any of ``urls``, or else where the mission says.  Raises AddressError."""
    if urls:
        anywhere = [address for url in urls for address in parse(url)]
        return [anywhere] * len(mission.fleet)
    return [parse(vehicle.connect) if vehicle.connect else [] for vehicle in mission.fleet]


def connects(mission: Mission, reach: Reach) -> bool:
    """Whether real vehicles are meant.

    Raises AddressError for a bad URL, or where only some vehicles have one, SigningKeyError for a bad key, and
    UsageError as `backend` does.
    """
    backend(reach)
    for url in reach.urls:
        parse(url)
    named = [vehicle.connect is not None for vehicle in mission.fleet]
    if not reach.urls and any(named) and not all(named):
        raise AddressError("vehicles.connect: some vehicles have one and some have none (or give --connect)")
    real = bool(reach.urls) or all(named)
    if reach.signing_key is not None:
        read_key(reach.signing_key)
        if not real:
            raise SigningKeyError(
                "--signing-key is for vehicles by --connect: stub vehicles in memory sign nothing"
            )
    return real


def confirming(progress: Progress, sure: bool) -> "Callable[[Preparation | Adoption], asyncio.Future[bool]]":
    """Tells what was found, then asks at the terminal, unless the operator is sure beforehand."""

    def confirm(start: Preparation | Adoption) -> "asyncio.Future[bool]":
        for line in start.told():
            progress.say(line)
        return agreed() if sure else confirm_typed(start, progress)

    return confirm


def agreed() -> "asyncio.Future[bool]":
    """A yes that was given beforehand."""
    answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
    answer.set_result(True)
    return answer


def confirm_typed(start: Preparation | Adoption, progress: Progress) -> "asyncio.Future[bool]":
    """Ask for a typed yes at the terminal."""
    if isinstance(start, Adoption):
        _ask_to_take_back(start, progress)
    else:
        _ask_to_take_off(start, progress)
    return _typed_yes()


def _ask_to_take_back(adoption: Adoption, progress: Progress) -> None:
    names = ", ".join(str(session.system) for session in adoption.found)
    progress.say(f"found in the air: vehicles {names}. Type yes to take them back:")


def _ask_to_take_off(preparation: Preparation, progress: Progress) -> None:
    names = ", ".join(
        f"{system} ({findings[0].value})"
        for row, (system, findings) in enumerate(zip(preparation.systems, preparation.findings, strict=True))
        if row not in preparation.refusals
    )
    progress.say(f"ready to arm: vehicles {names}. Type yes to take off:")


def _typed_yes() -> "asyncio.Future[bool]":
    """Whether the next line typed is yes."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[bool] = loop.create_future()

    def read() -> None:
        typed = sys.stdin.readline().strip().lower()
        with contextlib.suppress(RuntimeError):  # the loop is closed: it was interrupted
            loop.call_soon_threadsafe(answer.set_result, typed == "yes")

    # A thread that nobody waits for: an interrupted program must not hang until a line is typed.
    threading.Thread(target=read, daemon=True).start()
    return answer


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
