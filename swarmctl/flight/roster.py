"""Who belongs to the swarm: who dropped out of it and how, who is in the air, and what happened to each.

A vehicle that dropped out sees and tells nothing more, and no order for the swarm reaches it.
"""

from collections.abc import Sequence

from swarmctl.core import stages
from swarmctl.core.world import World
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import FLYING, SET_UP, Phase
from swarmctl.vehicle.procedures import ON_GROUND
from swarmctl.vehicle.session import OrderError, Session

EARS = ("sensor_range", "alarms_per_second", "radio_range")
"""What a vehicle that dropped out has no more."""
AIRBORNE = frozenset((*range(stages.TAKE_OFF, stages.LANDED), *range(stages.ADRIFT, len(stages.NAMES))))
"""As `stages.airborne` says, which would first be compiled, in the air, with nobody steering meanwhile."""
LOW_M = 0.5
NOT_OURS = (Phase.RELEASED, Phase.FAILED, Phase.LOST)
LANDINGS_ASKED = 3
"""A vehicle that failed in the air is told to land so often; then nothing more can be done from here."""


class Roster:
    """The vehicles of ``world``, session i being its row i."""

    def __init__(self, world: World, sessions: Sequence[Session]) -> None:
        count = len(sessions)
        self.dropped: list[str | None] = [None] * count  #: refused, crashed, released or lost, once it was
        self.by_order: set[int] = set()  #: rows of those that were released by order, or not taken back
        self.troubled = [False] * count  #: landed where it should not have, though not dropped
        self.messages: list[list[str]] = [[] for _ in sessions]  #: what happened to each vehicle, for people
        self._world, self._sessions = world, sessions
        self._flown = [False] * count
        self._landings = [0] * count
        self._ears = {name: world.fleet[name].copy() for name in EARS}

    @property
    def active(self) -> list[Session]:
        """The sessions of those that did not drop out."""
        return [s for s, gone in zip(self._sessions, self.dropped, strict=True) if gone is None]

    @property
    def empty(self) -> bool:
        """Whether all dropped out."""
        return None not in self.dropped

    @property
    def anybody_flies_for_us(self) -> bool:
        """Whether a vehicle is in the air that obeys us."""
        return any(session.phase in FLYING for session in self._sessions)

    def row(self, system: int) -> int | None:
        """The row of the vehicle with this system id; None if there is none."""
        return next((i for i, s in enumerate(self._sessions) if s.system == system), None)

    def note(self, i: int, time: float, text: str) -> None:
        """Keep what happened to a vehicle."""
        self.messages[i].append(f"{time:.1f} s: {text}")

    def look(self) -> None:
        """Note who has left the ground."""
        for i, session in enumerate(self._sessions):
            self._flown[i] |= session.telemetry.height_m > LOW_M

    def flies(self, i: int) -> bool:
        """Whether the vehicle is in the air, as far as is known."""
        return int(self._world.errands["stage"][i]) in AIRBORNE

    def aloft(self, i: int) -> bool:
        """The same, of one that dropped out."""
        return self.flies(i) and self._sessions[i].telemetry.height_m > LOW_M

    def refuse(self, i: int) -> None:
        """It may not be armed: the others fly without it."""
        self._drop(i, "refused")

    def miss(self, i: int) -> None:
        """It is not heard: the others fly without it."""
        self._drop(i, "lost")

    def drop(self, i: int, kind: EventKind) -> None:
        """Note how a vehicle was lost to the swarm.  One that failed in the air, and was ours, is told to land."""
        session = self._sessions[i]
        outcome = {EventKind.RELEASED: "released", EventKind.LOST: "lost"}.get(kind)
        self._drop(i, outcome or self._how_it_failed(i))
        ours = session.failed_while not in SET_UP and session.telemetry.armed
        if kind is EventKind.FAILED and ours and self._landings[i] < LANDINGS_ASKED:
            self._landings[i] += 1
            session.land()

    def _how_it_failed(self, i: int) -> str:
        """The outcome of a session that gave up."""
        session = self._sessions[i]
        if not self._flown[i]:
            return "refused"
        stands = not session.telemetry.armed or session.telemetry.landed_state == ON_GROUND
        if stands and session.failed_while is Phase.LANDING:
            self.troubled[i] = True  # it is down, though not as it was told
            return "landed"
        return "crashed" if stands else "lost"

    def _drop(self, i: int, outcome: str) -> None:
        self.dropped[i] = self.dropped[i] or outcome
        self.deafen(i)

    def deafen(self, i: int) -> None:
        """From now on it sees and tells nothing."""
        for name in EARS:
            self._world.fleet[name][i] = 0.0

    def take_back(self, i: int) -> None:
        """It belongs to the swarm again."""
        self.dropped[i] = None
        self.by_order.discard(i)
        for name in EARS:
            self._world.fleet[name][i] = self._ears[name][i]

    def land(self) -> None:
        """Land everybody who can be told to."""
        for session in self._sessions:
            try:
                session.land()
            except OrderError:
                continue  # on the ground, or no longer ours

    def unattended(self) -> list[int]:
        """Rows of those that flew, are armed as far as is known, and that nobody here flies."""
        return [
            i
            for i, session in enumerate(self._sessions)
            if session.phase in NOT_OURS and session.telemetry.armed and self._flown[i]
        ]
