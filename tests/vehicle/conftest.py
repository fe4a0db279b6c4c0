"""A rig that joins a scripted vehicle to a session in virtual time, and a link that spoils what crosses it."""

import random
from collections.abc import Callable, Iterator

import pytest

from swarmctl.vehicle.events import Event, EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .fake_ardupilot import FakeArduPilot
from .fake_px4 import FakePx4

TICK_S = 0.05


class Rig:
    """A session and its vehicle in virtual time; ``up`` and ``down`` may spoil what crosses the link."""

    def __init__(
        self, vehicle: type[FakePx4] = FakePx4, preflight: Preflight | None = None, adopts: bool = False,
        **settings: float,
    ) -> None:  # fmt: skip
        self.now = 0.0
        self.session = Session(
            1, settings=SessionSettings(**settings), now=0.0, preflight=preflight, adopts=adopts
        )
        self.vehicle = vehicle(1)
        self.up: Callable[[list[bytes]], list[bytes]] = lambda frames: frames
        self.down: Callable[[list[bytes]], list[bytes]] = lambda frames: frames
        self.each_tick: Callable[[], None] = lambda: None
        self.events: list[Event] = []

    def tick(self) -> None:
        self.now += TICK_S
        self.vehicle.advance(self.now, TICK_S)
        frames, self.vehicle.out = self.vehicle.out, []
        for data in self.down(frames):
            self.session.receive(data, self.now)
        self.session.poll(self.now)
        self.each_tick()
        for data in self.up(self.session.outgoing()):
            self.vehicle.receive(data)
        self.events += self.session.events()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.tick()

    def until(self, condition: Callable[[], bool], limit_s: float = 120.0) -> None:
        end = self.now + limit_s
        while not condition():
            assert self.now < end, f"still {self.session.phase} after {limit_s} s: {self.session.reason}"
            self.tick()

    def until_phase(self, phase: Phase, limit_s: float = 120.0) -> None:
        self.until(lambda: self.session.phase is phase, limit_s)

    def reach(self, phase: Phase) -> None:
        """Bring the session to ``phase`` as a flight would."""
        if phase is Phase.CONNECTING:
            return
        if phase in BEFORE_READY or phase is Phase.FOUND:
            self.until_phase(phase)
            return
        if phase in ON_THE_WAY_OUT:
            self.reach(Phase.ENGAGED)
            ON_THE_WAY_OUT[phase](self.session)
            return
        self.until_phase(Phase.READY)
        for order, then in ORDERS:
            if self.session.phase is phase:
                return
            order(self.session)
            if phase is then[0]:
                return
            self.until_phase(then[1])
        assert self.session.phase is phase

    def texts(self, kind: EventKind) -> list[str]:
        return [event.text for event in self.events if event.kind is kind]


BEFORE_READY = (Phase.IDENTIFYING, Phase.CONFIGURING, Phase.POSITIONING, Phase.CHECKING)
ON_THE_WAY_OUT: dict[Phase, Callable[[Session], None]] = {
    Phase.STOPPING: lambda session: session.hold(),
    Phase.RELEASING: lambda session: session.release(),
}
ORDERS: tuple[tuple[Callable[[Session], None], tuple[Phase, Phase]], ...] = (
    (lambda session: session.take_off(20.0), (Phase.TAKING_OFF, Phase.HOLDING)),
    (lambda session: session.engage(), (Phase.ENGAGING, Phase.ENGAGED)),
    (lambda session: session.land(), (Phase.LANDING, Phase.LANDED)),
)


class Noise:
    """A lossy, repeating, overtaking link; always the same for one seed."""

    def __init__(self, seed: int, loss: float = 0.0, repeat: float = 0.0, overtake: float = 0.0) -> None:
        self._random = random.Random(seed)
        self._loss, self._repeat, self._overtake = loss, repeat, overtake
        self._held: list[bytes] = []

    def __call__(self, frames: list[bytes]) -> list[bytes]:
        return list(self._spoil(frames))

    def _spoil(self, frames: list[bytes]) -> Iterator[bytes]:
        held, self._held = self._held, []
        for frame in frames:
            if self._random.random() < self._loss:
                continue
            if self._random.random() < self._overtake:
                self._held.append(frame)
                continue
            yield frame
            if self._random.random() < self._repeat:
                yield frame
        yield from held


@pytest.fixture
def make_rig() -> type[Rig]:
    return Rig


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.fixture
def ardupilot_rig() -> Rig:
    return Rig(FakeArduPilot)


@pytest.fixture
def make_noise() -> type[Noise]:
    return Noise
