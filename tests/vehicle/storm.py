"""A link with every fault at once, in virtual time, and a captain who gives a session its orders."""

import contextlib
import heapq
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import OrderError, Session

LAST_BREAK_S = 150.0
"""By then a flight that goes well is over."""


@dataclass(frozen=True)
class Weather:
    """What a link does to frames: shares of them, seconds, and the time from which it carries nothing."""

    loss: float = 0.0
    repeat: float = 0.0
    delay_s: float = 0.0
    garbage: float = 0.0
    crumbs: bool = False  # byte by byte
    dead_up_from: float = math.inf
    dead_down_from: float = math.inf


def drawn(seed: int) -> Weather:
    """Any weather: each trouble more or less or not at all, and now and then a direction that falls silent."""
    dice = random.Random(seed)
    return Weather(
        loss=dice.uniform(0.0, 0.4),
        repeat=dice.choice((0.0, dice.uniform(0.0, 0.3))),
        delay_s=dice.choice((0.0, dice.uniform(0.0, 2.0))),
        garbage=dice.choice((0.0, dice.uniform(0.0, 0.3))),
        crumbs=dice.random() < 0.3,
        dead_up_from=dice.uniform(0.0, LAST_BREAK_S) if dice.random() < 0.15 else math.inf,
        dead_down_from=dice.uniform(0.0, LAST_BREAK_S) if dice.random() < 0.15 else math.inf,
    )


class StormyLink:
    """One direction; the same for one seed."""

    def __init__(self, weather: Weather, dead_from: float, seed: int) -> None:
        self._weather, self._dead_from = weather, dead_from
        self._random = random.Random(seed)
        self._flying: list[tuple[float, int, bytes]] = []
        self._count = 0

    def carry(self, frames: list[bytes], now: float) -> list[bytes]:
        """Take in ``frames``; give out what arrives by ``now``."""
        for frame in frames:
            self._launch(frame, now)
        arrived = []
        while self._flying and self._flying[0][0] <= now:
            arrived.append(heapq.heappop(self._flying)[2])
        return [crumb for data in arrived for crumb in self._crumble(data)]

    def _launch(self, frame: bytes, now: float) -> None:
        weather, noise = self._weather, self._random
        if now >= self._dead_from or noise.random() < weather.loss:
            return
        if noise.random() < weather.garbage:
            frame = noise.randbytes(noise.randrange(1, 40)) + frame
        for _ in range(1 + (noise.random() < weather.repeat)):
            self._count += 1
            due = now + noise.random() * weather.delay_s
            heapq.heappush(self._flying, (due, self._count, frame))

    def _crumble(self, data: bytes) -> list[bytes]:
        return [bytes([byte]) for byte in data] if self._weather.crumbs else [data]


class Captain:
    """Take off, search for ``search_s``, land; a vehicle that is lost or has failed is ordered to land."""

    def __init__(self, session: Session, search_s: float) -> None:
        self._session, self._search_s = session, search_s
        self._engaged_at = self._lost_at = math.inf
        self.landings = 0

    def command(self, now: float) -> None:
        session = self._session
        phase = session.phase
        if phase is Phase.READY:
            session.take_off(20.0)
        elif phase is Phase.HOLDING:
            session.engage()
        elif phase is Phase.ENGAGED:
            self._engaged_at = min(self._engaged_at, now)
            session.setpoint(3.0, 1.0, 25.0)
        self._lost_at = min(self._lost_at, now) if phase is Phase.LOST else math.inf
        over = phase is Phase.ENGAGED and now - self._engaged_at >= self._search_s
        if over or phase is Phase.FAILED or now - self._lost_at >= self._search_s:
            self._land()

    def _land(self) -> None:
        if self._session.adapter is None or self.landings == 3:
            return
        with contextlib.suppress(OrderError):
            self._session.land()
            self.landings += 1


def fly(
    session: Session,
    advance: Callable[[float], list[bytes]],
    receive: Callable[[bytes, float], Any],
    weather: Weather,
    *,
    seed: int,
    limit_s: float,
    tick_s: float = 0.1,
    over: Callable[[float], bool] = lambda now: False,
) -> float:
    """Fly through ``weather`` until the vehicle has landed, or it is ``over``, or ``limit_s``; when that was."""
    down = StormyLink(weather, weather.dead_down_from, seed)
    up = StormyLink(weather, weather.dead_up_from, seed + 1)
    captain = Captain(session, 10.0)
    now = 0.0
    for k in range(round(limit_s / tick_s)):
        now = k * tick_s
        for data in down.carry(advance(now), now):
            session.receive(data, now)
        session.poll(now)
        captain.command(now)
        for data in up.carry(session.outgoing(), now):
            receive(data, now)
        if session.phase is Phase.LANDED or over(now):
            break
    return now
