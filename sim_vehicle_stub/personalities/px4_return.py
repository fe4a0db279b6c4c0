"""PX4's return: climb to the return altitude, straight home at that height, land.  It knows of no zones.

Before it sets out, and again over home, it stands for a while.  The whole takes as long as the real one did,
64 s from 40 m away; how that was shared out was not seen.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..vehicle import StubVehicle

ALTITUDE_ACCEPTED_M = 0.8
PLACE_ACCEPTED_M = 1.0
STANDS_S = 8.0


class Return:
    """The return of one vehicle."""

    def __init__(self, vehicle: "StubVehicle", land: Callable[[], None]) -> None:
        self._vehicle = vehicle
        self._pilot = vehicle.pilot
        self._parameters = vehicle.parameters
        self._land = land
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
        """Go on to the next phase when one is over."""
        if PHASES[self._phase].done(self):
            self._phase += 1
            PHASES[self._phase].begin(self)

    def _climb(self) -> None:
        """Climb to the return altitude, or lower when home is near: a cone stands on it."""
        self._pilot.hold()
        cone = math.radians(max(self._parameters["RTL_CONE_ANG"], 1))
        allowed = min(self._home_distance() / math.tan(cone), self._parameters["RTL_RETURN_ALT"])
        self._height = max(allowed, self._pilot.place[2])
        self._pilot.height(self._height)

    def _at_height(self) -> bool:
        return self._pilot.place[2] >= self._height - ALTITUDE_ACCEPTED_M

    def _stand(self) -> None:
        self._stands_since = self._vehicle.now

    def _has_stood(self) -> bool:
        return self._vehicle.now - self._stands_since >= STANDS_S

    def _fly_home(self) -> None:
        self._pilot.go_to(*self._vehicle.home_place)

    def _over_home(self) -> bool:
        return self._home_distance() <= PLACE_ACCEPTED_M

    def _begin_landing(self) -> None:
        self._land()

    def _never(self) -> bool:
        return False

    def _home_distance(self) -> float:
        """Horizontal metres to home."""
        east, north = self._vehicle.home_place
        d_east, d_north = self._pilot.place[0] - east, self._pilot.place[1] - north
        return math.sqrt(d_east * d_east + d_north * d_north)


class Phase(NamedTuple):
    """A part of the return: how it begins and when it is over."""

    begin: Callable[[Return], None]
    done: Callable[[Return], bool]


PHASES = (
    Phase(Return._climb, Return._at_height),
    Phase(Return._stand, Return._has_stood),
    Phase(Return._fly_home, Return._over_home),
    Phase(Return._stand, Return._has_stood),
    Phase(Return._begin_landing, Return._never),
)
