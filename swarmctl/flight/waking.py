"""A controller that stood still: its computer was busy or asleep, or the process was stopped.

What the vehicles said meanwhile waits to be read, oldest first, and nothing in it is of now: a vehicle that seems to
fly our setpoints may have been brought home by its failsafe for seconds, and a PX4 that its failsafe flies takes the
first setpoint for leave to turn round.  So after a standstill nobody is told anything until what is known of everybody
is of now again: a position that is no older than positions ever are, and, of a vehicle that may have begun its
failsafe, a heartbeat after that.  The silence itself was ours, and is nobody's fault.
"""

from collections.abc import Sequence

from swarmctl.vehicle.phases import FLYING
from swarmctl.vehicle.session import Session

STOOD_STILL_S = 1.0
"""A longer time (of flight) between two ticks is a standstill."""
SETPOINT_LOSS_S = 1.0
"""After so long without setpoints a firmware acts that does not say after how long."""
FRESH_S = 0.3
"""A position that is older than the last one before the standstill was, by more than this, had waited."""


class Waking:
    """Waits until what is known of the vehicles is of now, but not longer than until a silent one is lost."""

    def __init__(self, sessions: Sequence[Session], now: float, stood_s: float, link_loss_s: float) -> None:
        self._sessions = sessions
        self._began, self._ends = now, now + link_loss_s
        self._doubted = [stood_s >= (s.protection.setpoint_loss_s or SETPOINT_LOSS_S) for s in sessions]
        self._age_s = [session.telemetry.age_s for session in sessions]
        self._fresh_at: list[float | None] = [None] * len(sessions)
        for session in sessions:
            session.excuse_silence(now)

    def over(self, now: float) -> bool:
        """Whether the flight may go on."""
        known = [self._is_known(i, session, now) for i, session in enumerate(self._sessions)]
        return all(known) or now >= self._ends

    def _is_known(self, i: int, session: Session, now: float) -> bool:
        t, fresh_at = session.telemetry, self._fresh_at[i]
        if session.phase not in FLYING:
            return True
        if fresh_at is None:
            fresh = t.received_at >= self._began and t.age_s <= self._age_s[i] + FRESH_S
            self._fresh_at[i] = now if fresh else None
            return fresh and not self._doubted[i]
        return not self._doubted[i] or session.beat_at > fresh_at
