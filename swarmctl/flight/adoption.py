"""Finding the vehicles of a flight whose controller died, and who of them can be taken back.

They are in the air, as their firmware's failsafe wants, or were brought down by it.  Every session sets its vehicle
up as it finds it: nothing is changed on board, the fence is only compared with the mission's.  Left alone are those
that a pilot flies, that had left the swarm before, that are outside the fence or out of touch; whoever wants one of
these back orders `retake`.  A vehicle whose battery is low is taken back as well: it is brought home under the guard.
"""

from collections.abc import Mapping, Sequence

import shapely

from swarmctl.mission.geometry import regions
from swarmctl.mission.model import Mission
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.procedures import flies_on_or_has_landed
from swarmctl.vehicle.session import Session

from .errors import RefusedError
from .inspection import MOST_ROUND_TRIP_S, Inspection, place_en

FIND_S = 90.0
"""A session gives up by itself when a step takes too long; this bounds all steps together."""
HEAR_S = 20.0
"""One that is silent for so long is not waited for while the others fly on without a controller."""
ANSWER_S = 10.0
"""One that has not answered a ping by then does not hear."""
SETTLED = (Phase.LANDED, Phase.RELEASED, Phase.FAILED)


def preflight(mission: Mission) -> Preflight:
    """What every session looks at."""
    return Preflight(read_parameters=True, fence=Inspection(mission, ()).fence(), upload=False)


class Adoption:
    """Finds ``sessions``' vehicles, session i being vehicle i of ``mission``.

    ``left``: why a vehicle, by its row, was not ours any more when the controller died.
    """

    def __init__(
        self, mission: Mission, sessions: Sequence[Session], now: float, left: Mapping[int, str]
    ) -> None:
        self.done = False
        self._mission, self._sessions, self._left = mission, sessions, left
        self._began = now
        r = regions(mission)
        self._legal = shapely.difference(
            shapely.Polygon(r.border), shapely.union_all([shapely.Polygon(k) for k in r.keep_outs])
        )

    @property
    def found(self) -> list[Session]:
        """Those that can be taken back."""
        return [session for session in self._sessions if session.phase is Phase.FOUND]

    def tick(self, now: float) -> None:
        """Go on, once the sessions have taken in what arrived by ``now``."""
        if not self.done and all(self._settled(session, now - self._began) for session in self._sessions):
            self.done = True
            self.judge()

    def judge(self) -> None:
        """Leave alone whoever cannot be taken back, as things are now."""
        for i, session in enumerate(self._sessions):
            if session.phase is Phase.FOUND and (reason := self._reason(i)):
                session.decline(reason)

    def require(self) -> None:
        """Raise RefusedError if there is nobody to take back."""
        if not self.found:
            raise RefusedError("nobody is in the air to be taken back\n" + "\n".join(self.told()))

    def told(self) -> list[str]:
        """What was found of each vehicle, a line each."""
        return [self._line(session) for session in self._sessions]

    @staticmethod
    def _settled(session: Session, waited_s: float) -> bool:
        """Whether a vehicle is found, gone, or lands by itself just now."""
        if session.phase is Phase.FOUND:
            return session.round_trip_s is not None or waited_s > ANSWER_S
        if session.phase in SETTLED or waited_s > FIND_S:
            return True
        if session.phase in (Phase.CONNECTING, Phase.LOST):
            return waited_s > HEAR_S
        t = session.telemetry
        return session.phase is Phase.POSITIONING and t.landed_state != 0 and not flies_on_or_has_landed(t)

    def _reason(self, i: int) -> str:
        """Why vehicle i is left alone, or nothing."""
        session = self._sessions[i]
        assert session.adapter is not None
        modes, mode = session.adapter.modes, session.telemetry.mode
        if i in self._left:
            return self._left[i]
        if mode not in modes.unattended:
            return f"a pilot flies it in {modes.name(mode)}"
        if not shapely.intersects_xy(self._legal, *place_en(self._mission, session)):
            return "it is outside the fence"
        trip = session.round_trip_s
        if trip is None:
            return "it answers no TIMESYNC: nobody can tell whether it hears"
        return f"its link's round trip takes {trip:.1f} s" if trip > MOST_ROUND_TRIP_S else ""

    def _line(self, session: Session) -> str:
        """One vehicle for people."""
        name = f"vehicle {session.system}"
        if session.phase is Phase.FOUND:
            return f"{name}: {self._whereabouts(session)}"
        if session.phase is Phase.LANDED:
            return f"{name}: has landed"
        if session.phase in (Phase.RELEASED, Phase.FAILED):
            return f"{name}: left alone: {session.reason.removeprefix(f'{name}: ')}"
        if session.phase is Phase.POSITIONING:
            return f"{name}: lands just now"
        return f"{name}: is not heard" if session.phase is Phase.CONNECTING else f"{name}: is silent"

    def _whereabouts(self, session: Session) -> str:
        assert session.adapter is not None
        t = session.telemetry
        east, north = place_en(self._mission, session)
        battery = "?" if t.battery_percent is None else t.battery_percent
        return (
            f"{session.adapter.name} {t.version or ''} in {session.adapter.modes.name(t.mode)}, "
            f"{t.height_m:.0f} m up at {east:.0f} m E, {north:.0f} m N, battery {battery} %"
        )
