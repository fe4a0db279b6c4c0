"""Live flight: the same swarm on the wall's clock, its vehicles behind UDP, TCP or a serial line.

First every vehicle's session is brought to READY, then the world is built about where they stand, then one
task ticks on absolute deadlines.  All times are flight time: the wall's times the speed of the simulation, so
sessions, swarm and records never know.  If a tick fails, whatever the reason, all vehicles are told to land
and their sessions are run until they have.
"""

import asyncio
from collections.abc import Callable, Sequence

from swarmctl.core.state import POSE
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.link import GROUND_COMPONENT, GROUND_SYSTEM
from swarmctl.vehicle.phases import FLYING, Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.switchboard import Switchboard
from swarmctl.vehicle.transports import TransportError

from .journal import Journal
from .swarm import GONE, Part, RefusedError, Swarm
from .track import Track

SETTLE_S = 1.0
"""After the last vehicle was first heard: more of them would make it unclear which are meant."""
PREPARE_S = 120.0
LANDING_S = 300.0
BEHIND_S = 0.5
"""A loop that is late by more than this gives up catching up."""

assert POSE.names


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
    """Every vehicle of a live flight: its session, and the wires its frames go by."""

    def __init__(self, clock: FlightClock) -> None:
        self.clock = clock
        self.sessions: list[Session] = []
        self.switchboard = Switchboard()
        self._by_system: dict[int, Session] = {}
        self._early: list[tuple[float, list[bytes]]] = []
        self._journal: Journal | None = None

    async def connect(
        self, addresses: Sequence[Address], count: int, settings: SessionSettings, timeout_s: float
    ) -> None:
        """Open the addresses and wait (wall seconds) for ``count`` vehicles.  Raises RefusedError."""
        try:
            await self.switchboard.open(list(addresses))
        except TransportError as error:
            raise RefusedError(str(error)) from None
        caller = Encoder(GROUND_SYSTEM, GROUND_COMPONENT)
        await self._wait_for(count, caller, timeout_s)
        systems = self.switchboard.heard
        if len(systems) < count:
            heard = ", ".join(map(str, systems)) or "none"
            places = ", ".join(map(str, addresses[:6])) + (" ..." if len(addresses) > 6 else "")
            raise RefusedError(
                f"heard {len(systems)} of {count} vehicles (system ids: {heard}) on {places} within {timeout_s:g} s"
            )
        for system in systems[:count]:
            session = Session(system, settings=settings, now=self.clock.now())
            self.sessions.append(session)
            self._by_system[system] = session
        self.switchboard.subscribe(self._take)

    async def _wait_for(self, count: int, caller: Encoder, timeout_s: float) -> None:
        """Call and listen until enough vehicles were heard, and a moment longer."""
        loop = asyncio.get_running_loop()
        end = loop.time() + timeout_s
        enough_at: float | None = None
        while loop.time() < end:
            self.switchboard.call(caller.heartbeat(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4))
            await asyncio.sleep(0.2)
            if len(self.switchboard.heard) >= count:
                enough_at = enough_at or loop.time()
                if loop.time() >= enough_at + SETTLE_S:
                    return

    async def prepare(self) -> None:
        """Bring every session to READY.  Raises RefusedError, naming the vehicles that are not."""
        end = self.clock.now() + PREPARE_S
        while any(s.phase not in (*GONE, Phase.READY) for s in self.sessions) and self.clock.now() < end:
            self.poll()
            await asyncio.sleep(0.05 / self.clock.speed)
        unready = [s for s in self.sessions if s.phase is not Phase.READY]
        if unready:
            reasons = "\n".join(
                f"vehicle {s.system} is {s.phase.value}: {s.reason or 'no answer'}" for s in unready
            )
            raise RefusedError(reasons)

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
        """Send and record what the sessions have queued."""
        for session in self.sessions:
            self._flush(session, now)

    def close(self) -> None:
        """Close every wire."""
        self.switchboard.close()

    def _take(self, system: int, data: bytes) -> None:
        session = self._by_system.get(system)
        if session is not None:
            now = self.clock.now()
            session.receive(data, now)
            self._flush(session, now)

    def _flush(self, session: Session, now: float) -> None:
        for frame in session.outgoing():
            self.switchboard.send(session.system, frame)
        frames = session.traffic()
        if not frames:
            return
        if self._journal is not None:
            self._journal.frames(now, frames)
        else:
            self._early.append((now, frames))


class LiveLoop:
    """Ticks a swarm on absolute deadlines until the flight is over."""

    def __init__(self, link: LiveLink, swarm: Swarm, poses: Callable[[], object], journal: Journal, track: Track,
                 interval_s: float) -> None:  # fmt: skip
        self._link, self._swarm, self._journal, self._track = link, swarm, journal, track
        self._poses = poses
        self._interval_s = interval_s

    async def run(self, each_tick: Callable[[float], None]) -> None:
        """Fly to the end.  If a tick raises, land everybody, then raise that again."""
        try:
            await self._fly(each_tick)
        except Exception:
            await self._land_everybody()
            raise

    async def _fly(self, each_tick: Callable[[float], None]) -> None:
        loop = asyncio.get_running_loop()
        wall_interval = self._interval_s / self._link.clock.speed
        deadline = loop.time()
        k = 0
        while self._swarm.part is not Part.OVER:
            now = self._link.poll()
            self._swarm.tick(k, now)
            self._link.flush(now)
            self._track.add(now, self._poses())  # type: ignore[arg-type]
            self._journal.breathe(now)
            each_tick(now)
            k += 1
            deadline += wall_interval
            if loop.time() > deadline + BEHIND_S:
                deadline = loop.time()
            await asyncio.sleep(max(0.0, deadline - loop.time()))

    async def _land_everybody(self) -> None:
        """The program failed: get the vehicles down with what is left of it."""
        self._swarm.land_all(self._link.clock.now())
        end = self._link.clock.now() + LANDING_S
        while any(s.phase in FLYING for s in self._link.sessions) and self._link.clock.now() < end:
            self._link.poll()
            await asyncio.sleep(0.05)
