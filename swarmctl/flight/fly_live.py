"""One live flight from mission and addresses to run folder, and the probing of vehicles without a flight."""

import asyncio
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from swarmctl.core.arrays import Floats, Records
from swarmctl.core.world import World
from swarmctl.mavlink.signing import Signing
from swarmctl.mission.dump import dump
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario
from swarmctl.record.folder import RunFolder
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.backend import Backend, Mavlink
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.switchboard import Switchboard

from . import clock
from .adoption import Adoption, preflight
from .budget import Rates, lowered, plan, stale_s
from .control import ControlServer
from .errors import RefusedError, StoppedError
from .fly import Report, about_flight, obey_and_report, session_settings
from .inspection import CEILING_KEPT_M, place_en
from .journal import Journal
from .live import FlightClock, Known, LiveLink, LiveLoop, Wires
from .orders import Orders, obey
from .preparation import Preparation
from .results import Outcome
from .resumption import Resumption
from .swarm import Swarm
from .taking_back import Resumed
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
    confirm: Callable[[Preparation | Adoption], "asyncio.Future[bool]"] | None = None
    """Asked before anything is armed, or taken back."""
    resumes: Resumption | None = None  #: the flight that is flown on
    watching: Watching = lambda now, sessions: None
    telling: Callable[[str], None] = lambda text: None  #: told the budget of each wire
    signing: Signing | None = None  #: signs what is sent; what is not signed is not believed
    wires: Callable[[Signing | None], Wires] = field(default=Switchboard)
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
            if options.resumes is not None:
                mission, rates, start = await _found(options.resumes, link, options)
            else:
                mission, rates, start = await _ready(mission, link, options)
            return await _fly_prepared(mission, rates, seed, folder, options, orders, report, link, start)


async def probe(mission: Mission, options: LiveOptions, orders: Orders) -> tuple[Preparation, list[str]]:
    """Connect, prepare and inspect the vehicles of ``mission``, and leave them; arms nothing.

    Returns also where each vehicle was heard.  Raises RefusedError where too few are heard, StoppedError.
    """
    with _interruptions(orders), closing(_link(options, orders)) as link:
        _, _, preparation = await _prepared(mission, link, options)
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
            what = "anybody was taken back" if options.resumes else "anything was armed"
            raise StoppedError(f"stopped before {what}")
        options.watching(now, sessions)

    clock, wires = FlightClock(options.speed), options.wires(options.signing)
    return LiveLink(clock, wires, look, options.backend(), options.signing)


async def _prepared(
    mission: Mission, link: LiveLink, options: LiveOptions
) -> tuple[Mission, Rates, Preparation]:
    """Find the vehicles and have them prepared; also the mission and the rates that their wires carry."""
    mission, rates = await _met(mission, link, options, None)
    preparation = Preparation(mission, link.sessions, link.clock.now(), options.adapt)
    await link.prepare(preparation)
    return mission, rates, preparation


async def _ready(
    mission: Mission, link: LiveLink, options: LiveOptions
) -> tuple[Mission, Rates, Preparation | Resumed]:
    """Vehicles that may be armed, by the operator's word.  Raises RefusedError."""
    mission, rates, preparation = await _prepared(mission, link, options)
    preparation.require()
    await _confirm(preparation, link, options)
    return mission, rates, preparation


async def _met(
    mission: Mission, link: LiveLink, options: LiveOptions, known: Known | None
) -> tuple[Mission, Rates]:
    """Find the vehicles and begin their sessions, with the rates that their wires carry."""
    systems = await link.find(options.addresses, options.connect_timeout_s, known)
    heard_on = [link.wires.address(system) for system in systems if system in link.wires.heard]
    budget = plan(mission, heard_on, options.signing is not None, options.speed)
    options.telling(str(budget))
    mission, rates = lowered(mission, budget.rates), budget.rates
    settings = replace(session_settings(mission), rate_hz=rates.positions, status_rate_hz=rates.status)
    link.meet(systems, settings, known)
    return mission, rates


async def _found(
    before: Resumption, link: LiveLink, options: LiveOptions
) -> tuple[Mission, Rates, Preparation | Resumed]:
    """Find the vehicles of a flight whose controller died.  Raises RefusedError where nobody is to be taken back."""
    known = Known(before.systems, preflight(before.mission))
    mission, rates = await _met(before.mission, link, options, known)
    adoption = Adoption(mission, link.sessions, link.clock.now(), before.left)
    await link.prepare(adoption)
    adoption.require()
    await _confirm(adoption, link, options)
    adoption.judge()
    adoption.require()
    return mission, rates, Resumed(adoption, before)


async def _confirm(start: Preparation | Adoption, link: LiveLink, options: LiveOptions) -> None:
    """Have the operator say yes.  Raises RefusedError."""
    if options.confirm is not None and not await link.wait(options.confirm(start)):
        what = "nobody was taken back" if options.resumes else "nothing was armed"
        raise RefusedError(f"not confirmed: {what}")


async def _fly_prepared(
    mission: Mission, rates: Rates, seed: int, folder: RunFolder, options: LiveOptions, orders: Orders,
    report: Report, link: LiveLink, start: Preparation | Resumed,
) -> Outcome:  # fmt: skip
    """Build the world about where the vehicles stand, or stood when they took off, and fly."""
    sessions = link.sessions
    scenario, world = _built(mission, rates, seed, sessions, options)
    journal = _recorder(mission, seed, folder, link, world, options)
    swarm = Swarm(mission, world, sessions, journal, start)
    track = Track(len(sessions))
    control = ControlServer(folder.path, lambda words: obey(words, swarm, link.clock.now()))
    flight = LiveLoop(
        link, swarm, lambda: world.poses, journal, track, 1.0 / mission.setpoints.rate_hz,
        mission.safety.link_loss_s,
    )  # fmt: skip
    with closing(journal), closing(control):
        link.record(journal)
        await control.start()
        began = clock.wall_s()
        every_s = REPORT_S * options.speed
        await flight.run(obey_and_report(swarm, world, orders, report, every_s, may_stop=options.own_stubs))
    wall = clock.wall_s() - began
    resumed = str(options.resumes.run) if options.resumes else ""
    return Outcome(
        mission, world, scenario.regions, swarm, sessions, track, seed, wall, orders.level > 0, options.speed,
        resumed,
    )  # fmt: skip


def _built(
    mission: Mission, rates: Rates, seed: int, sessions: Sequence[Session], options: LiveOptions
) -> tuple[Scenario, World]:
    """The world that is flown in, with what another flight had come to if this one resumes it."""
    as_found = stands(mission, sessions) if mission.launch == "as_found" else None
    scenario = Scenario(mission, ideal=False, stands=options.resumes.pads if options.resumes else as_found)
    world = scenario.world(seed)
    if options.resumes is not None:
        options.resumes.give_back(world)
    describe_vehicles(world.fleet, sessions, options.own_stubs, stale_s(rates))
    world.rules["separation"] += unsure_m(world.fleet, sessions, options.own_stubs, stale_s(rates))
    return scenario, world


def _recorder(
    mission: Mission, seed: int, folder: RunFolder, link: LiveLink, world: World, options: LiveOptions
) -> Journal:
    """The flight's recorder; a flight that is resumed learns where it goes on."""
    text = f"# Flown with --seed {seed}.\n" + dump(mission)
    folder.write_text(folder.mission, text)
    if options.resumes is not None:
        options.resumes.note(folder)
    about = {**about_flight(mission, world, seed), **_about_links(link, options)}
    journal = Journal(folder, world, text, about, flush_s=LIVE_FLUSH_S)
    if options.resumes is not None:
        journal.continues(options.resumes.metadata(), options.resumes.searched.seen_rows())
    return journal


def _about_links(link: LiveLink, options: LiveOptions) -> dict[str, str]:
    """How the vehicles are reached, for whoever has to fly them on."""
    before = options.resumes
    heard = link.wires.heard
    addresses = [
        link.wires.address(session.system)
        if session.system in heard or before is None
        else before.addresses[i]
        for i, session in enumerate(link.sessions)
    ]
    return {
        "systems": " ".join(str(session.system) for session in link.sessions),
        "connect": " ".join(map(str, addresses)),
        "speed": f"{options.speed:g}",
        "own_stubs": "yes" if options.own_stubs else "no",
    }


def stands(mission: Mission, sessions: Sequence[Session]) -> Floats:
    """Where the vehicles stand, (V, 2) local metres.

    One that never said so stays on the ground: any place will do for it.
    """
    told = [place_en(mission, s) for s in sessions if s.telemetry.positioned]
    return np.array([place_en(mission, s) if s.telemetry.positioned else told[0] for s in sessions])


def unsure_m(fleet: Records, sessions: Sequence[Session], own: bool, positions_stale_s: float) -> float:
    """How much more than the separation the guard keeps, because nobody knows better how vehicles stop."""
    adapters = [session.adapter for session in sessions]
    unsure_s = [UNSURE_OF_STUBS_S if own or a is None else a.limits.unsure_s for a in adapters]
    return float(max(fleet["speed"] * (np.array(unsure_s) + positions_stale_s)))


def describe_vehicles(
    fleet: Records, sessions: Sequence[Session], own: bool, positions_stale_s: float
) -> None:
    """Give planner and guard what a vehicle says that it can do: its speed, how it brakes, how late it acts.

    ``positions_stale_s``: a thin wire's positions are older by this on average, and what was sent since is not in them.
    """
    for row, session in zip(fleet, sessions, strict=True):
        if own or session.adapter is None:
            row["latency"] = STUB_LATENCY_S + positions_stale_s
            continue
        limits, told = session.adapter.limits, session.parameters
        row["speed"] = min(float(row["speed"]), told.get("speed_mps", np.inf))
        obeyed = min(float(row["acceleration"]), told.get("acceleration_mps2", np.inf))
        row["acceleration"] = limits.acceleration_mps2 or obeyed
        row["braking"] = min(float(row["acceleration"]), limits.braking_mps2)
        row["lag"] = limits.lag_s
        row["climb"] = min(float(row["climb"]), told.get("climb_mps", np.inf))
        row["descent"] = min(float(row["descent"]), told.get("descent_mps", np.inf))
        ceiling = session.protection.ceiling_m
        if ceiling is not None:
            row["altitude"] = min(float(row["altitude"]), ceiling - CEILING_KEPT_M)
        trip = session.statistics().round_trip
        row["latency"] = limits.latency_s + (trip.median_s if trip else 0.0) + positions_stale_s
