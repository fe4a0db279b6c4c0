"""A flight in lockstep and a study side by side: the study starts where the flight's search begins, and both must
decide the same from there on, bit for bit.

The study has its own world, its own kernels' calls and its own motion; from the flight it gets one thing, once: where
everybody truly is, and was last seen, when the barrier opens.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from sim_vehicle_stub.configured import configured_fleet
from swarmctl.core import stages
from swarmctl.core.world import World
from swarmctl.flight import fly as flight
from swarmctl.flight.lockstep import Lockstep
from swarmctl.flight.parts import Part
from swarmctl.flight.preparation import Preparation
from swarmctl.flight.swarm import Swarm
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario
from swarmctl.vehicle.session import Session

EVERY_TICK = ("wants", "setpoints")  # and the poses, before
EVERY_PERIOD = ("report_count", "knowledge", "wishes", "memory", "beacons", "heard_count", "errands")
Meddle = Callable[[int, World], None]
"""Called with the planner tick that was just planned and the flight's world, before the two are compared."""


class Unrecorded:
    """Takes the place of a flight's journal, and of its track, and writes nothing."""

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_: None


class _SearchOverError(Exception):
    """Ends a flight when its search is over."""


def leave_alone(tick: int, world: World) -> None:
    """Nobody meddles."""


class Pair:
    """One mission, flown and studied; the mission must say ``observations: wire`` for the two to agree."""

    def __init__(self, mission: Mission, seed: int, meddle: Meddle = leave_alone) -> None:
        scenario = Scenario(mission, ideal=False)
        self.flown, self.studied = scenario.world(seed), scenario.world(seed)
        self.ticks = 0
        self.account = np.array([np.inf, 0.0, 0.0, 0.0])
        self._interval_s = 1.0 / mission.setpoints.rate_hz
        self._meddle = meddle
        self._begun: int | None = None
        self._planned = -1
        self._stubs = self._make_stubs(mission)
        settings = flight.session_settings(mission)
        sessions = [Session(i + 1, settings=settings, now=0.0) for i in range(len(self.flown.fleet))]
        nowhere: Any = Unrecorded()
        self._swarm = Swarm(mission, self.flown, sessions, nowhere, Preparation(mission, sessions, now=0.0))
        self._lockstep = Lockstep(
            self._swarm, sessions, self._stubs, nowhere, nowhere, self._interval_s, mission.duration_s
        )

    def _make_stubs(self, mission: Mission) -> Any:
        origin = (mission.origin.lat, mission.origin.lon, mission.origin.alt_m)
        return configured_fleet(
            self.flown.fleet, origin, flight.endurance_s(mission), self._interval_s,
            autopilots=flight.autopilots(mission), wind_mps=mission.stub.wind_mps,
        )  # fmt: skip

    def fly(self) -> "Pair":
        """To the end of the search.  Raises AssertionError at the first difference, and says where it is."""
        try:
            self._lockstep.run(self._each_tick)
        except _SearchOverError:
            return self
        raise AssertionError("the flight ended before its search")

    def _each_tick(self, now: float) -> None:
        if self._swarm.part is Part.RETURNING:
            raise _SearchOverError
        if self._swarm.part is not Part.SEARCHING:
            return
        k = round(now / self._interval_s)
        if self._begun is None:
            self._begun = k
            self._start_study()
        self._compare(("poses",))
        self.studied.search(self._begun, k, k + 1, self.account)
        planned = self._swarm.planner_tick - 1
        if planned == self._planned:
            self._compare(EVERY_TICK)
        else:
            self._planned = planned
            self._meddle(planned, self.flown)
            self._compare(EVERY_PERIOD + EVERY_TICK)
        self.ticks += 1

    def _start_study(self) -> None:
        """From the flight: where everybody is, and was last seen.  All else is as the scenario has it."""
        self.studied.prepare()
        self.studied.truth[:] = self._stubs.truth
        self.studied.poses[:] = self.flown.poses
        self.studied.errands["stage"] = stages.SEARCH

    def _compare(self, names: tuple[str, ...]) -> None:
        for name in names:
            flown, studied = getattr(self.flown, name), getattr(self.studied, name)
            if flown.tobytes() != studied.tobytes():
                where = f"setpoint tick {self.ticks}, planner tick {self._planned}"
                raise AssertionError(f"{where}: {first_difference(name, flown, studied)}")


def first_difference(name: str, flown: npt.NDArray[Any], studied: npt.NDArray[Any]) -> str:
    """The first place where two arrays of one row a vehicle (at last) differ, in words."""
    for at in np.ndindex(flown.shape):
        for field in flown.dtype.names or ("",):
            a, b = (array[field][at] if field else array[at] for array in (flown, studied))
            if a.tobytes() != b.tobytes():
                return f"vehicle {at[-1] + 1}: {name}.{field} is {a!r} in the flight, {b!r} in the study"
    raise ValueError(f"{name}: nothing differs")
