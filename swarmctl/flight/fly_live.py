"""One live flight from mission and addresses to run folder."""

import asyncio
import signal
from collections.abc import Awaitable, Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from swarmctl.core import calls
from swarmctl.core.arrays import Floats
from swarmctl.core.world import World
from swarmctl.mission.dump import dump
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario
from swarmctl.record.folder import RunFolder
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.session import Session

from . import clock
from .control import ControlError, ControlServer
from .fly import Orders, Report, about_flight, obey_and_report, session_settings
from .journal import Journal
from .live import FlightClock, LiveLink, LiveLoop
from .results import Outcome
from .swarm import RefusedError, Swarm
from .track import Track

T = TypeVar("T")
LIVE_FLUSH_S = 1.0
STUB_LATENCY_S = 0.1
"""From a position's measurement to the setpoint's effect, on stubs of this machine."""


@dataclass(frozen=True)
class LiveOptions:
    """How to reach the vehicles, and what they are."""

    addresses: Sequence[Address]
    speed: float = 1.0
    connect_timeout_s: float = 20.0
    own_stubs: bool = False  #: our own stub vehicles: they fly as the mission says
    confirm: Callable[[Sequence[Session]], Awaitable[bool]] | None = None  #: asked before anything is armed


async def fly_live(
    mission: Mission, seed: int, folder: RunFolder, options: LiveOptions, orders: Orders, report: Report
) -> Outcome:
    """Fly ``mission`` live and record it.  Raises RefusedError (nothing armed), FlightError, RunFolderError."""
    link = LiveLink(FlightClock(options.speed))
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, orders.interrupt)
    try:
        await link.connect(
            options.addresses, len(mission.fleet), session_settings(mission), options.connect_timeout_s
        )
        await link.prepare()
        if options.confirm is not None and not await _meanwhile(link, options.confirm(link.sessions)):
            raise RefusedError("not confirmed: nothing was armed")
        return await _fly_prepared(mission, seed, folder, options, orders, report, link)
    finally:
        link.close()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)


async def _meanwhile(link: LiveLink, work: Awaitable[T]) -> T:
    """Await ``work``, and keep the links alive until it is done."""
    task = asyncio.ensure_future(work)
    while not task.done():
        link.poll()
        await asyncio.sleep(0.02)
    return task.result()


def stands(mission: Mission, sessions: Sequence[Session]) -> Floats:
    """Where the vehicles stand, (V, 2) local metres."""
    origin = mission.origin
    places = [
        calls.to_local(
            s.telemetry.lat_e7 * 1e-7, s.telemetry.lon_e7 * 1e-7, origin.lat, origin.lon, origin.alt_m
        )
        for s in sessions
    ]
    return np.array(places)


async def _fly_prepared(
    mission: Mission,
    seed: int,
    folder: RunFolder,
    options: LiveOptions,
    orders: Orders,
    report: Report,
    link: LiveLink,
) -> Outcome:
    """Build the world about where the vehicles stand, and fly."""
    scenario, world = await _meanwhile(link, asyncio.to_thread(_build, mission, seed, link.sessions))
    describe_vehicles(world.fleet, link.sessions, options.own_stubs)
    text = f"# Flown with --seed {seed}.\n" + dump(mission)
    folder.write_text(folder.mission, text)
    journal = Journal(folder, world, text, about_flight(mission, world, seed), flush_s=LIVE_FLUSH_S)
    swarm = Swarm(mission, world, link.sessions, journal)
    track = Track(len(link.sessions))
    control = ControlServer(folder.path, lambda words: obey(words, swarm, link.clock.now()))
    flight = LiveLoop(link, swarm, lambda: world.poses, journal, track, 1.0 / mission.setpoints.rate_hz)
    with closing(journal), closing(control):
        link.record(journal)
        await control.start()
        began = clock.wall_s()
        await flight.run(obey_and_report(swarm, world, orders, report))
    wall = clock.wall_s() - began
    return Outcome(
        mission,
        world,
        scenario.regions,
        swarm,
        link.sessions,
        track,
        seed,
        wall,
        orders.level > 0,
        options.speed,
    )


def _build(mission: Mission, seed: int, sessions: Sequence[Session]) -> tuple[Scenario, World]:
    as_found = stands(mission, sessions) if mission.launch == "as_found" else None
    scenario = Scenario(mission, ideal=False, stands=as_found)
    return scenario, scenario.world(seed)


def obey(words: list[str], swarm: Swarm, now: float) -> str:
    """Carry out one order of ``swarmctl control``.  Raises ControlError for what is none."""
    orders: dict[str, Callable[[], None]] = {
        "hold": lambda: swarm.hold(now),
        "resume": lambda: swarm.resume(now),
        "return": lambda: swarm.return_all("ordered by the operator", now),
        "land": lambda: swarm.land_all(now),
    }
    if len(words) != 1 or words[0] not in orders:
        raise ControlError(f"{' '.join(words)!r} is no order ({', '.join(orders)})")
    orders[words[0]]()
    return f"{words[0]} at {now:.1f} s; now {'holding' if swarm.held else swarm.part.value}"


def describe_vehicles(
    fleet: np.ndarray[tuple[int], np.dtype[np.void]], sessions: Sequence[Session], own: bool
) -> None:
    """Give the guard what it needs to know of each vehicle: how it brakes, and how late it acts."""
    for row, session in zip(fleet, sessions, strict=True):
        if own or session.adapter is None:
            row["latency"] = STUB_LATENCY_S
            continue
        limits = session.adapter.limits
        row["braking"] = min(float(row["braking"]), limits.braking_mps2)
        row["latency"] = limits.latency_s
