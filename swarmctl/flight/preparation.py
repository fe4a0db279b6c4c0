"""From the first heartbeat to "may be armed": every vehicle ready, inspected, its own fence set and read back.

Where vehicles are to be adapted to the mission, what is wrong with the parameters of their fences is set right then.

The fence is set only once a vehicle has passed the inspection: one that stands elsewhere must not be given the
fence of another place.  Whoever flies the swarm ticks this, in lockstep or live; it knows no clock.
"""

from collections.abc import Sequence
from enum import Enum, auto

from swarmctl.mission.model import Mission
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session

from .errors import RefusedError
from .inspection import Finding, Inspection

PREPARE_S = 600.0
"""A session gives up by itself when a step takes too long; this bounds all steps together."""
CONNECT_S = 20.0
"""A vehicle that was not heard by then is not there."""
LOST_S = 60.0
"""One that has been silent for so long does not come back."""


class _Part(Enum):
    READYING = auto()
    FENCING = auto()
    ADAPTING = auto()
    DONE = auto()


class Preparation:
    """Prepares ``sessions`` for ``mission``; session i is its vehicle i.

    ``adapt``: vehicles that can do less are flown as they can, and their fences' parameters are set.
    """

    def __init__(
        self, mission: Mission, sessions: Sequence[Session], now: float, adapt: bool = False
    ) -> None:
        self.refusals: dict[int, str] = {}  #: why a vehicle may not be armed, by its row
        self.changes: list[str] = []  #: parameters that were set, a line each
        self._mission, self._sessions, self._adapt = mission, sessions, adapt
        self._inspection = Inspection(mission, sessions, adapt)
        self.deadline = now + PREPARE_S
        self._part = _Part.READYING
        self._began = now
        self._silent_since: dict[int, float] = {}

    @property
    def done(self) -> bool:
        """Whether there is nothing more to wait for."""
        return self._part is _Part.DONE

    @property
    def systems(self) -> list[int]:
        """The vehicles' system ids, row by row."""
        return [session.system for session in self._sessions]

    @property
    def findings(self) -> list[list[Finding]]:
        """What there is to say of each vehicle."""
        return [self._inspection.vehicle(i) for i in range(len(self._sessions))]

    @property
    def troubles(self) -> list[str]:
        """What the operator should know and that refuses nobody, a line each."""
        return [
            f"vehicle {session.system}: {finding.trouble}"
            for session, findings in zip(self._sessions, self.findings, strict=True)
            for finding in findings
            if finding.trouble and not finding.refuses
        ]

    def told(self) -> list[str]:
        """What the operator should see before anything is armed, a line each."""
        return [*self.refusals.values(), *self.changes, *self.troubles]

    def tick(self, now: float) -> None:
        """Go on, once the sessions have taken in what arrived by ``now``."""
        if self.done or not self._settled(now):
            return
        for i, session in enumerate(self._sessions):
            if i not in self.refusals and (reason := self._refusal(i, now)):
                self.refusals[i] = f"vehicle {session.system}{reason}"
        if self._part is _Part.READYING:
            self._set_fences()
        elif self._part is _Part.FENCING and self._adapt:
            self._set_parameters()
        else:
            self._part = _Part.DONE

    def _set_fences(self) -> None:
        """Read the parameters, and put the mission's fence on board."""
        self._part = _Part.FENCING
        preflight = Preflight(read_parameters=True, fence=self._inspection.fence())
        for i, session in enumerate(self._sessions):
            if i not in self.refusals:
                session.check(preflight)

    def _set_parameters(self) -> None:
        """Set right what the vehicles' own fences lack."""
        self._part = _Part.ADAPTING
        for i, session in enumerate(self._sessions):
            remedies = session.protection.remedies
            if i in self.refusals or not remedies:
                continue
            for remedy in remedies:
                before = session.parameter(remedy.parameter)
                was = "unknown" if before is None else f"{before:g}"
                self.changes.append(
                    f"vehicle {session.system}: {remedy.parameter} set to {remedy.value:g} (it was {was})"
                )
            session.check(Preflight(True, self._inspection.fence(), remedies))

    def require(self) -> None:
        """Raise RefusedError if the mission does not want to fly without those that were refused."""
        safety = self._mission.safety
        left = len(self._sessions) - len(self.refusals)
        if self.refusals and (safety.if_one_fails == "abort" or left < safety.minimum_vehicles):
            raise RefusedError("\n".join(self.refusals.values()))

    def _settled(self, now: float) -> bool:
        """Whether every vehicle is ready, gave up, or has had its time."""
        settled = [i in self.refusals or self._is_settled(i, now) for i in range(len(self._sessions))]
        return all(settled)

    def _is_settled(self, i: int, now: float) -> bool:
        phase = self._sessions[i].phase
        if phase is Phase.LOST:
            return now - self._silent_since.setdefault(i, now) > LOST_S
        self._silent_since.pop(i, None)
        patience = CONNECT_S if phase is Phase.CONNECTING else PREPARE_S
        return phase in (Phase.READY, Phase.FAILED) or now - self._began > patience

    def _refusal(self, i: int, now: float) -> str:
        """Why vehicle i may not be armed, or nothing."""
        session = self._sessions[i]
        if session.phase is Phase.FAILED:
            return f" gave up: {session.reason.removeprefix(f'vehicle {session.system}: ')}"
        if session.phase is not Phase.READY:
            return f" is still {session.phase.value} at {now:.0f} s"
        troubles = [finding.trouble for finding in self._inspection.vehicle(i) if finding.refuses]
        return f": {'; '.join(troubles)}" if troubles else ""
