"""ArduCopter's return: up to RTL_ALT_M if lower, straight home, loiter for a moment, land.

Before it sets out, and again over home, it stands until it has settled.  The whole takes as long as the real
one did, 45 to 50 s; how that was shared out was not seen.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .ardupilot import ArduPilot

ACCEPTED_M = 1.0
SETTLES_S = 3.5


class Return:
    """The return of one vehicle."""

    def __init__(self, autopilot: "ArduPilot") -> None:
        self._autopilot = autopilot
        self._vehicle = autopilot.vehicle
        self._pilot = autopilot.vehicle.pilot
        self._height = 0.0
        self._stands_since = 0.0
        self._phase = 0

    @property
    def landing(self) -> bool:
        """Whether it has come to its last part."""
        return self._phase == len(PHASES) - 1

    def begin(self) -> None:
        """Start the return."""
        self._phase = 0
        PHASES[0].begin(self)

    def step(self) -> None:
        """Go on to the next phase when one is over; the landing is the mode's own step."""
        if self.landing:
            self._autopilot.step_landing()
        elif PHASES[self._phase].done(self):
            self._phase += 1
            PHASES[self._phase].begin(self)

    def _climb(self) -> None:
        self._pilot.velocity(0.0, 0.0)
        self._height = max(self._autopilot.values["RTL_ALT_M"], self._pilot.place[2])
        self._pilot.height(self._height)

    def _at_height(self) -> bool:
        return self._pilot.place[2] >= self._height - ACCEPTED_M

    def _fly_home(self) -> None:
        self._pilot.go_to(*self._vehicle.home_place)

    def _over_home(self) -> bool:
        return math.dist(self._pilot.place[:2], self._vehicle.home_place) <= ACCEPTED_M

    def _stand(self) -> None:
        self._stands_since = self._vehicle.now

    def _has_settled(self) -> bool:
        return self._vehicle.now - self._stands_since >= SETTLES_S

    def _has_loitered(self) -> bool:
        loiter = self._autopilot.values["RTL_LOIT_TIME"] / 1000.0
        return self._vehicle.now - self._stands_since >= SETTLES_S + loiter

    def _land(self) -> None:
        """The place stays home; the descent is the landing's."""

    def _never(self) -> bool:
        return False


class Phase(NamedTuple):
    """A part of the return: how it begins and when it is over."""

    begin: Callable[[Return], None]
    done: Callable[[Return], bool]


PHASES = (
    Phase(Return._climb, Return._at_height),
    Phase(Return._stand, Return._has_settled),
    Phase(Return._fly_home, Return._over_home),
    Phase(Return._stand, Return._has_loitered),
    Phase(Return._land, Return._never),
)
