"""The beginning of a flight that goes on where another controller died: everybody found in the air is taken back.

Nobody's setpoints flow before that, for PX4 would obey them at once.  All are stopped where they are, then come to
their search height under the guard (core/levelling.py); then the search goes on.  Whoever is found later, because
its link was bad, is taken back later.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from swarmctl.core import stages
from swarmctl.core.world import World
from swarmctl.vehicle.phases import FLYING, Phase
from swarmctl.vehicle.session import Session

from .adoption import Adoption
from .resumption import Resumption
from .roster import Roster

LEVEL_S = 40.0
"""So long the search waits until those that were taken back are at their height; who is not joins it later."""


class Resumed(NamedTuple):
    """Who was found, and the flight that is flown on."""

    adoption: Adoption
    before: Resumption


class TakingBack:
    """Takes the vehicles of ``world`` back, session i flying row i.

    ``note(row, time, kind, text)`` is told of everyone.
    """

    def __init__(
        self, adoption: Adoption, world: World, sessions: Sequence[Session], roster: Roster,
        note: Callable[[int, float, str, str], None],
    ) -> None:  # fmt: skip
        self._adoption, self._sessions, self._roster, self._note = adoption, sessions, roster, note
        self._stages = world.errands["stage"]
        self._level_by = 0.0
        # What was found wrong with others is no reason to break off: it was known when the flight was resumed.
        others = (i for i, session in enumerate(sessions) if session.phase is not Phase.FOUND)
        self._roster.by_order.update(others)

    def begin(self, now: float) -> None:
        """Everybody in the air is in the others' way, whoever flies it; who is silent is missed."""
        self._level_by = now + LEVEL_S
        for i, session in enumerate(self._sessions):
            self._stages[i] = stages.ADRIFT if session.telemetry.armed else stages.GROUND
            if session.phase in (Phase.CONNECTING, Phase.LOST):
                self._roster.miss(i)
                self._note(i, now, "lost", "is not heard")
            elif session.phase is Phase.LANDED:
                self._note(i, now, "landed", "had landed before it was found")

    def tick(self, now: float) -> None:
        """Take back whoever is found, where it is."""
        self._adoption.judge()
        for i, session in enumerate(self._sessions):
            if session.phase is Phase.FOUND:
                self._note(i, now, "adopt", f"taken back: {whereabouts(session)}")
                self._roster.take_back(i)
                self._stages[i] = stages.ADRIFT
                session.adopt()

    def over(self, now: float) -> bool:
        """Whether all that were taken back are at their height, or enough time has passed."""
        level = (
            session.phase not in FLYING or (session.phase is Phase.ENGAGED and self._stages[i] == stages.HOLD)
            for i, session in enumerate(self._sessions)
        )
        return now >= self._level_by or all(level)


def whereabouts(session: Session) -> str:
    """Where a vehicle was last, for those who have to look for it."""
    t = session.telemetry
    mode = session.adapter.modes.name(t.mode) if session.adapter else "unknown mode"
    return f"{session.phase.value}, {mode}, last at {t.lat_e7 * 1e-7:.6f}, {t.lon_e7 * 1e-7:.6f}, {t.height_m:.0f} m up"
