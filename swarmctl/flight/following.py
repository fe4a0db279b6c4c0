"""The stage of every vehicle's errand, as its session shows it.

Stages that firmware flies follow the session; those that the loop flies are the loop's own.  Whoever was adrift and
obeys again is TAKEN: it comes to its search height first (core/levelling.py), then does what the others do.
"""

from collections.abc import Sequence

from swarmctl.core import stages
from swarmctl.core.world import World
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session

from .roster import Roster

STAGE_OF = {
    Phase.TAKING_OFF: stages.TAKE_OFF,
    Phase.HOLDING: stages.HOLD,
    Phase.ENGAGING: stages.HOLD,
    Phase.LANDING: stages.LAND,
    Phase.LANDED: stages.LANDED,
    Phase.STOPPING: stages.HOLD,
    Phase.RELEASING: stages.HOLD,
}


class Following:
    """Follows the sessions of ``world``'s vehicles, session i flying row i."""

    def __init__(self, world: World, sessions: Sequence[Session], roster: Roster) -> None:
        self._world, self._sessions, self._roster = world, sessions, roster

    def follow(self, waits: bool, returning: bool) -> None:
        """Set all stages.  ``waits``: nobody searches yet, or now; ``returning``: everybody goes home."""
        stage = self._world.errands["stage"]
        for i, session in enumerate(self._sessions):
            if session.phase is Phase.ENGAGED:
                self._follow_engaged(i, waits, returning)
            elif session.phase is Phase.ENGAGING and stage[i] == stages.ADRIFT:
                continue  # it is being taken back, and stands only once it is
            elif session.phase in STAGE_OF:
                stage[i] = STAGE_OF[session.phase]
            else:
                stage[i] = stages.ADRIFT if self._roster.aloft(i) else stages.GROUND

    def _follow_engaged(self, i: int, waits: bool, returning: bool) -> None:
        """A vehicle that flies our setpoints: what it does next, if it is not the loop that says so."""
        stage = self._world.errands["stage"]
        if stage[i] == stages.LAND:
            self._sessions[i].land()
        elif stage[i] == stages.ADRIFT:
            if self._roster.dropped[i] == "released":
                self._roster.take_back(i)
            stage[i] = stages.TAKEN
        elif stage[i] == stages.HOLD and returning:
            self._world.orders[i] = 1
        elif stage[i] == stages.HOLD and not waits:
            stage[i] = stages.SEARCH
