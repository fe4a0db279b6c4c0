"""Live flight: the same swarm on the wall's clock, its vehicles behind UDP, TCP or a serial line.

First every vehicle's session is prepared, then the world is built about where they stand, then one task ticks
on absolute deadlines.  All times are flight time: the wall's times the speed of the simulation, so sessions,
swarm and records never know.  Nobody is left flying unattended: if a tick fails, whatever the reason, all
vehicles are told to land and their sessions are run until they have; if only the recording fails, all return
without it.
"""

import asyncio
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from swarmctl.core.arrays import Records
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import Signing
from swarmctl.record.errors import RecordError
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.backend import Backend, Begins
from swarmctl.vehicle.link import GROUND_COMPONENT, GROUND_SYSTEM
from swarmctl.vehicle.phases import FLYING
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.transports import TransportError

from .adoption import Adoption
from .errors import RefusedError, StoppedError
from .journal import Journal
from .parts import Part
from .preparation import Preparation
from .swarm import Swarm
from .track import Track
from .waking import STOOD_STILL_S, Waking

CALLING_LINK = 0
"""The link id that calls are signed with; each vehicle's own stream has its system id."""
SETTLE_S = 1.0
"""After the last vehicle was first heard: more of them would make it unclear which are meant."""
CALL_S = 0.2
POLL_S = 0.02
LANDING_S = 300.0
BEHIND_S = 0.5
"""A loop that is late by more than this gives up catching up."""


class Wires(Protocol):
    """What a live link needs of the switchboard."""

    @property
    def heard(self) -> list[int]:
        """System ids of the vehicles whose heartbeat came, ascending."""

    async def open(self, addresses: list[Address]) -> None:
        """Open all addresses.  Raises TransportError."""

    def subscribe(self, deliver: Callable[[int, bytes], None]) -> None:
        """Have the vehicles' bytes handed on from now on."""

    def address(self, system: int) -> Address:
        """The address that a vehicle was heard on."""

    def complaint(self) -> str:
        """What was dropped for its signature so far, for people."""

    def way(self, system: int) -> str:
        """The same and where it sends from, for people."""

    def send(self, system: int, frame: bytes) -> None:
        """Send a frame to a vehicle."""

    def call(self, frame: bytes) -> None:
        """Send a frame on every wire."""

    def close(self) -> None:
        """Close every wire."""


class Known(NamedTuple):
    """Vehicles that another controller flew: their system ids, row by row, and what each session looks at."""

    systems: Sequence[int]
    preflight: Preflight


class FlightClock:
    """Flight time: the event loop's, from zero, ``speed`` times as fast."""

    def __init__(self, speed: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._start = self._loop.time()
        self.speed = speed

    def now(self) -> float:
        """Seconds of flight time."""
        return (self._loop.time() - self._start) * self.speed


class LiveLink:
    """Every vehicle of a live flight: its session, and the wires its frames go by.

    ``look`` is called while waiting, with the sessions so far; what it raises ends the waiting.  ``signing``: what
    is sent is signed, and only what is signed is believed.
    """

    def __init__(
        self, clock: FlightClock, wires: Wires, look: Callable[[float, Sequence[Session]], None],
        backend: Backend, signing: Signing | None = None,
    ) -> None:  # fmt: skip
        self.clock = clock
        self.sessions: list[Session] = []
        self.wires = wires
        self._look = look
        self._backend, self._signing = backend, signing
        self._by_system: dict[int, Session] = {}
        self._early: list[tuple[float, list[bytes]]] = []
        self._journal: Journal | None = None

    async def find(
        self, addresses: Sequence[Sequence[Address]], timeout_s: float, known: Known | None = None
    ) -> list[int]:
        """Open ``addresses``, those of each vehicle, and wait (wall seconds) for all; their system ids.

        Raises RefusedError.  Of ``known`` ones some may be missing; nobody else is taken for them.
        """
        places = list(dict.fromkeys(address for own in addresses for address in own))
        try:
            await self.wires.open(places)
        except TransportError as error:
            raise RefusedError(str(error)) from None
        await self._wait_for(addresses, timeout_s, known)
        systems = self._assign(addresses, known)
        found = [system for system in systems if system is not None]
        if len(found) < len(systems) and (known is None or not found):
            heard = ", ".join(map(str, self.wires.heard)) or "none"
            named = ", ".join(map(str, places[:6])) + (" ..." if len(places) > 6 else "")
            raise RefusedError(
                f"heard {len(found)} of {len(systems)} vehicles (system ids: {heard}) on {named} "
                f"within {timeout_s:g} s{self.wires.complaint()}"
            )
        return list(known.systems) if known else found

    def meet(self, systems: Sequence[int], settings: SessionSettings, known: Known | None = None) -> None:
        """Begin a session with each of these vehicles."""
        for system in systems:
            self._add(system, settings, known)
        self.wires.subscribe(self._take)

    def _add(self, system: int, settings: SessionSettings, known: Known | None) -> None:
        """The session of one vehicle, which may wake us from any thread."""
        loop = asyncio.get_running_loop()

        def wake() -> None:
            loop.call_soon_threadsafe(self._woken, system)

        begins = Begins(known and known.preflight, self._signing, known is not None)
        session = self._backend.session(system, settings, self.clock.now(), wake, begins)
        self.sessions.append(session)
        self._by_system[system] = session

    def _assign(self, addresses: Sequence[Sequence[Address]], known: Known | None) -> list[int | None]:
        """For each vehicle the lowest system id heard at its addresses and not given away yet, or its own."""
        free = list(self.wires.heard)
        systems: list[int | None] = []
        for row, own in enumerate(addresses):
            wanted = free if known is None else [s for s in free if s == known.systems[row]]
            system = next((s for s in wanted if self.wires.address(s) in own), None)
            systems.append(system)
            if system is not None:
                free.remove(system)
        return systems

    async def _wait_for(
        self, addresses: Sequence[Sequence[Address]], timeout_s: float, known: Known | None
    ) -> None:
        """Call and listen until enough vehicles were heard, and, unless they are known, a moment longer."""
        loop = asyncio.get_running_loop()
        caller = Encoder(GROUND_SYSTEM, GROUND_COMPONENT)
        end = loop.time() + timeout_s
        enough_at: float | None = None
        while loop.time() < end:
            beat = caller.heartbeat(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            self.wires.call(self._signing.sign(beat, CALLING_LINK) if self._signing else beat)
            await asyncio.sleep(CALL_S)
            self._look(self.clock.now(), ())
            if None not in self._assign(addresses, known):
                enough_at = enough_at or loop.time()
                if known or loop.time() >= enough_at + SETTLE_S:
                    return

    async def prepare(self, preparation: Preparation | Adoption) -> None:
        """Have every session ready, inspected and fenced; or found."""
        while not preparation.done:
            now = self.poll()
            preparation.tick(now)
            self.flush(now)
            self._look(now, self.sessions)
            await asyncio.sleep(POLL_S / self.clock.speed)

    async def wait(self, task: "asyncio.Future[bool]") -> bool:
        """Keep the links alive until ``task`` is done; its result."""
        while not task.done():
            self._look(self.poll(), self.sessions)
            await asyncio.sleep(POLL_S)
        return task.result()

    def record(self, journal: Journal) -> None:
        """From now on frames go to ``journal``; those from before go first."""
        self._journal = journal
        for now, frames in self._early:
            journal.frames(now, frames)
        self._early.clear()

    def poll(self) -> float:
        """Let time pass for every session, and send what it has to say; returns the flight time."""
        now = self.clock.now()
        for session in self.sessions:
            session.poll(now)
        self.flush(now)
        return now

    def flush(self, now: float) -> None:
        """Send what the sessions have queued, then record it."""
        for session in self.sessions:
            self._send(session)
        for session in self.sessions:
            self._record(session, now)

    def discard(self) -> None:
        """Send nothing of what the sessions have queued."""
        for session in self.sessions:
            session.outgoing()

    def close(self) -> None:
        """Close every wire, and what is behind the sessions."""
        self.wires.close()
        self._backend.close()

    def _woken(self, system: int) -> None:
        """A session has something to send, or to do."""
        session = self._by_system[system]
        session.poll(self.clock.now())
        self._send(session)

    def _take(self, system: int, data: bytes) -> None:
        session = self._by_system.get(system)
        if session is not None:
            session.receive(data, self.clock.now())
            self._send(session)

    def _send(self, session: Session) -> None:
        for frame in session.outgoing():
            self.wires.send(session.system, frame)

    def _record(self, session: Session, now: float) -> None:
        frames = session.traffic()
        if not frames:
            return
        if self._journal is not None:
            self._journal.frames(now, frames)
        else:
            self._early.append((now, frames))


class LiveLoop:
    """Ticks a swarm on absolute deadlines until the flight is over."""

    def __init__(
        self, link: LiveLink, swarm: Swarm, poses: Callable[[], Records], journal: Journal, track: Track,
        interval_s: float, link_loss_s: float,
    ) -> None:  # fmt: skip
        self._link_loss_s = link_loss_s
        self._ticked_at = link.clock.now()
        self._link, self._swarm, self._journal, self._track = link, swarm, journal, track
        self._poses = poses
        self._interval_s = interval_s
        self._record_error: RecordError | None = None

    async def run(self, each_tick: Callable[[float], None]) -> None:
        """Fly to the end.  If a tick raises, land everybody, then raise that again."""
        try:
            await self._fly(each_tick)
        except StoppedError:
            raise
        except BaseException:
            self._journal.stop()
            await asyncio.shield(self._land_everybody())
            raise
        if self._record_error is not None:
            raise self._record_error

    async def _fly(self, each_tick: Callable[[float], None]) -> None:
        loop = asyncio.get_running_loop()
        wall_interval = self._interval_s / self._link.clock.speed
        deadline = loop.time()
        k = 0
        self._ticked_at = self._link.clock.now()
        while self._swarm.part is not Part.OVER:
            await self._catch_up()
            try:
                self._tick(k, each_tick)
            except RecordError as error:
                self._go_home_unrecorded(error)
            k += 1
            deadline += wall_interval
            if loop.time() > deadline + BEHIND_S:
                deadline = loop.time()
            await asyncio.sleep(max(0.0, deadline - loop.time()))

    async def _catch_up(self) -> None:
        """Go on at once, or, after a standstill, when what is known of the vehicles is of now again."""
        now = self._link.clock.now()
        stood_s = now - self._ticked_at
        self._ticked_at = now
        if stood_s < STOOD_STILL_S:
            return
        self._swarm.stood_still(now, stood_s)
        waking = Waking(self._link.sessions, now, stood_s, self._link_loss_s)
        while not waking.over(self._link.poll()):
            await asyncio.sleep(POLL_S / self._link.clock.speed)
        self._ticked_at = self._link.clock.now()

    def _tick(self, k: int, each_tick: Callable[[float], None]) -> None:
        now = self._link.poll()
        self._swarm.tick(k, now)
        if self._link.clock.now() - now >= STOOD_STILL_S:  # in the midst of it: these setpoints are of before
            self._link.discard()
        self._link.flush(now)
        self._track.add(now, self._poses())
        self._journal.breathe(now)
        each_tick(now)

    def _go_home_unrecorded(self, error: RecordError) -> None:
        """The disk is full, or gone: no reason to come down just anywhere."""
        self._record_error = error
        self._journal.stop()
        self._swarm.return_all(f"the recording failed: {error}", self._link.clock.now())

    async def _land_everybody(self) -> None:
        """The program failed: get the vehicles down with what is left of it."""
        self._swarm.roster.land()
        end = self._link.clock.now() + LANDING_S
        while any(s.phase in FLYING for s in self._link.sessions) and self._link.clock.now() < end:
            self._link.poll()
            await asyncio.sleep(POLL_S)
