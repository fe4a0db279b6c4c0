"""One live flight from mission and addresses to run folder, and the probing of vehicles without a flight."""

import asyncio
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field

import numpy as np

from swarmctl.core.arrays import Floats, Records
from swarmctl.mission.dump import dump
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario
from swarmctl.record.folder import RunFolder
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.backend import Backend, Mavlink
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.switchboard import Switchboard

from . import clock
from .control import ControlServer
from .errors import RefusedError, StoppedError
from .fly import Report, about_flight, obey_and_report, session_settings
from .inspection import CEILING_KEPT_M, place_en
from .journal import Journal
from .live import FlightClock, LiveLink, LiveLoop, Wires
from .orders import Orders, obey
from .preparation import Preparation
from .results import Outcome
from .swarm import Swarm
from .track import Track

LIVE_FLUSH_S = 1.0
REPORT_S = 0.5
"""Wall time between two reports."""
STUB_LATENCY_S = 0.1
"""From a position's measurement to the setpoint's effect, on stubs of this machine."""
UNSURE_OF_STUBS_S = 0.05
"""So well is the time known after which a stub of ours acts: what it flies in it, the guard keeps besides."""
INTERRUPTIONS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""A closed terminal (SIGHUP) must not leave vehicles in the air any more than Ctrl-C."""

Watching = Callable[[float, Sequence[Session]], None]
"""Called while vehicles are connected and prepared, with the time and the sessions so far."""


@dataclass(frozen=True)
class LiveOptions:
    """How to reach the vehicles, and what they are."""

    addresses: Sequence[Sequence[Address]]  #: of each vehicle
    speed: float = 1.0
    connect_timeout_s: float = 20.0
    own_stubs: bool = False  #: our own stub vehicles: they fly as the mission says
    adapt: bool = False  #: lower what the mission asks to what the vehicles can do, and set their parameters
    confirm: Callable[[Preparation], "asyncio.Future[bool]"] | None = None  #: asked before anything is armed
    watching: Watching = lambda now, sessions: None
    wires: Callable[[], Wires] = field(default=Switchboard)
    backend: Callable[[], Backend] = field(default=Mavlink)


async def fly_live(
    mission: Mission, seed: int, folder: RunFolder, options: LiveOptions, orders: Orders, report: Report
) -> Outcome:
    """Fly ``mission`` live and record it.

    Raises RefusedError and StoppedError (nothing armed), FlightError, RecordError.
    """
    with _interruptions(orders):
        link = _link(options, orders)
        with closing(link):
            preparation = await _prepared(mission, link, options)
            preparation.require()
            if options.confirm is not None and not await link.wait(options.confirm(preparation)):
                raise RefusedError("not confirmed: nothing was armed")
            return await _fly_prepared(mission, seed, folder, options, orders, report, link, preparation)


async def probe(mission: Mission, options: LiveOptions, orders: Orders) -> tuple[Preparation, list[str]]:
    """Connect, prepare and inspect the vehicles of ``mission``, and leave them; arms nothing.

    Returns also where each vehicle was heard.  Raises RefusedError where too few are heard, StoppedError.
    """
    with _interruptions(orders), closing(_link(options, orders)) as link:
        preparation = await _prepared(mission, link, options)
        return preparation, [link.wires.way(session.system) for session in link.sessions]


@contextmanager
def _interruptions(orders: Orders) -> Iterator[None]:
    """Take signals in the event loop, so that they never break into a tick."""
    loop = asyncio.get_running_loop()
    for number in INTERRUPTIONS:
        loop.add_signal_handler(number, orders.interrupt)
    try:
        yield
    finally:
        for number in INTERRUPTIONS:
            loop.remove_signal_handler(number)


def _link(options: LiveOptions, orders: Orders) -> LiveLink:
    """The link, which is given up when the operator interrupts before anything is armed."""

    def look(now: float, sessions: Sequence[Session]) -> None:
        if orders.level:
            raise StoppedError("stopped before anything was armed")
        options.watching(now, sessions)

    return LiveLink(FlightClock(options.speed), options.wires(), look, options.backend())


async def _prepared(mission: Mission, link: LiveLink, options: LiveOptions) -> Preparation:
    await link.connect(options.addresses, session_settings(mission), options.connect_timeout_s)
    preparation = Preparation(mission, link.sessions, link.clock.now(), options.adapt)
    await link.prepare(preparation)
    return preparation


async def _fly_prepared(
    mission: Mission, seed: int, folder: RunFolder, options: LiveOptions, orders: Orders, report: Report,
    link: LiveLink, preparation: Preparation,
) -> Outcome:  # fmt: skip
    """Build the world about where the vehicles stand, and fly."""
    sessions = link.sessions
    as_found = stands(mission, sessions) if mission.launch == "as_found" else None
    scenario = Scenario(mission, ideal=False, stands=as_found)
    world = scenario.world(seed)
    describe_vehicles(world.fleet, sessions, options.own_stubs)
    world.rules["separation"] += unsure_m(world.fleet, sessions, options.own_stubs)
    text = f"# Flown with --seed {seed}.\n" + dump(mission)
    folder.write_text(folder.mission, text)
    journal = Journal(folder, world, text, about_flight(mission, world, seed), flush_s=LIVE_FLUSH_S)
    swarm = Swarm(mission, world, sessions, journal, preparation)
    track = Track(len(sessions))
    control = ControlServer(folder.path, lambda words: obey(words, swarm, link.clock.now()))
    flight = LiveLoop(link, swarm, lambda: world.poses, journal, track, 1.0 / mission.setpoints.rate_hz)
    with closing(journal), closing(control):
        link.record(journal)
        await control.start()
        began = clock.wall_s()
        every_s = REPORT_S * options.speed
        await flight.run(obey_and_report(swarm, world, orders, report, every_s, may_stop=options.own_stubs))
    wall = clock.wall_s() - began
    return Outcome(
        mission, world, scenario.regions, swarm, sessions, track, seed, wall, orders.level > 0, options.speed
    )


def stands(mission: Mission, sessions: Sequence[Session]) -> Floats:
    """Where the vehicles stand, (V, 2) local metres.

    One that never said so stays on the ground: any place will do for it.
    """
    told = [place_en(mission, s) for s in sessions if s.telemetry.positioned]
    return np.array([place_en(mission, s) if s.telemetry.positioned else told[0] for s in sessions])


def unsure_m(fleet: Records, sessions: Sequence[Session], own: bool) -> float:
    """How much more than the separation the guard keeps, because nobody knows better how vehicles stop."""
    adapters = [session.adapter for session in sessions]
    unsure_s = [UNSURE_OF_STUBS_S if own or a is None else a.limits.unsure_s for a in adapters]
    return float(max(fleet["speed"] * np.array(unsure_s)))


def describe_vehicles(fleet: Records, sessions: Sequence[Session], own: bool) -> None:
    """Give planner and guard what a vehicle says that it can do: its speed, how it brakes, how late it acts."""
    for row, session in zip(fleet, sessions, strict=True):
        if own or session.adapter is None:
            row["latency"] = STUB_LATENCY_S
            continue
        limits, told = session.adapter.limits, session.parameters
        row["speed"] = min(float(row["speed"]), told.get("speed_mps", np.inf))
        row["acceleration"] = min(float(row["acceleration"]), told.get("acceleration_mps2", np.inf))
        row["braking"] = min(float(row["acceleration"]), limits.braking_mps2)
        row["lag"] = limits.lag_s
        row["climb"] = min(float(row["climb"]), told.get("climb_mps", np.inf))
        row["descent"] = min(float(row["descent"]), told.get("descent_mps", np.inf))
        ceiling = session.protection.ceiling_m
        if ceiling is not None:
            row["altitude"] = min(float(row["altitude"]), ceiling - CEILING_KEPT_M)
        trip = session.statistics().round_trip
        row["latency"] = limits.latency_s + (trip.median_s if trip else 0.0)
