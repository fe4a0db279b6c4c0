"""Lockstep: a whole flight in counted time, every message packed and parsed as on a wire, none ever missing.

One turn moves the vehicles, hands their frames to the sessions, runs the swarm's tick and hands the answers
back.  A vehicle that flies setpoints must have said where it is in this very tick; if it has not, that is an
error of the program, and it raises: nothing is invented.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import Protocol

from swarmctl.core.arrays import Records
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session

from .errors import FlightError
from .journal import Journal
from .parts import Part
from .swarm import Swarm
from .track import Track

LONGEST_EXTRA_S = 3600.0
"""Simulated time beyond the search after which a flight that has not ended is given up."""


class Vehicle(Protocol):
    """One vehicle's end of a link in memory: datagrams in, datagrams out."""

    def receive(self, data: bytes, now: float) -> None:
        """Take in one datagram."""

    def outgoing(self) -> list[bytes]:
        """Datagrams to send since the last call."""


class Vehicles(Protocol):
    """The vehicles of a lockstep flight, and where they truly are."""

    truth: Records  # (V,) POSE

    @property
    def vehicles(self) -> Sequence[Vehicle]:
        """One a system id, in order."""

    def advance(self, now: float) -> None:
        """Move all of them on to ``now`` (s)."""


class Lockstep:
    """Drives one swarm and its vehicles, ``interval_s`` a tick, until the flight is over."""

    def __init__(
        self, swarm: Swarm, sessions: Sequence[Session], vehicles: Vehicles, journal: Journal, track: Track,
        interval_s: float, search_s: float,
    ) -> None:  # fmt: skip
        self._swarm, self._sessions, self._vehicles = swarm, sessions, vehicles
        self._journal, self._track = journal, track
        self._rate = round(1.0 / interval_s, 9)
        highest = max(float(height) for height in swarm.heights_m)
        self._most_ticks = round((search_s + LONGEST_EXTRA_S + 3.0 * highest) * self._rate)
        self.now = 0.0

    def run(self, each_tick: Callable[[float], None]) -> None:
        """Fly to the end; ``each_tick`` is called with the flight time, and may give orders to the swarm.

        Raises FlightError if a message that must come does not, or the flight does not end.
        """
        links = list(zip(self._sessions, self._vehicles.vehicles, strict=True))
        for k in itertools.count():
            now = self.now = k / self._rate
            self._vehicles.advance(now)
            for session, vehicle in links:
                for datagram in vehicle.outgoing():
                    session.receive(datagram, now)
                session.poll(now)
                if session.phase is Phase.ENGAGED and session.telemetry.received_at != now:
                    raise FlightError(f"vehicle {session.system}: no position in the tick at {now:.1f} s")
            self._swarm.tick(k, now)
            frames: list[bytes] = []
            for session, vehicle in links:
                for datagram in session.outgoing():
                    vehicle.receive(datagram, now)
                frames += session.traffic()
            self._journal.frames(now, frames)
            self._track.add(now, self._vehicles.truth)
            self._journal.breathe(now)
            each_tick(now)
            if self._swarm.part is Part.OVER:
                return
            if k >= self._most_ticks:
                raise FlightError(f"the flight has not ended after {now:.0f} s")
