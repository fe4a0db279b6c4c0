"""What no session tells: a battery that is only just enough, a link that is too slow for setpoints, a way home that
takes too long, and who is still in the air when all of ours are down.

The swarm asks once a tick; what follows for the others is for the swarm to say.
"""

import contextlib
import math
from collections.abc import Callable, Sequence

import shapely

from swarmctl.core import stages
from swarmctl.core.world import World
from swarmctl.mission.geometry import regions
from swarmctl.mission.model import Mission
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import OrderError, Session

from .roster import Roster

LOST_LANDING_S = 120.0
"""After all others are down: a vehicle that is still silent by then is told to land where it is."""
WATCH_S = 300.0
"""After all of ours are down: one that is still silent, or beyond help, is waited for no longer."""
RELEASED_S = 1800.0
"""One that somebody else flies is watched until it is down, and may be retaken, but no longer than a battery lasts."""
SLOW_ROUND_TRIP_S, SLOWER_BY_S, SLOW_S = 2.0, 0.5, 10.0
"""A link that is slower than this, and by so much slower than the guard counts on, for so long."""
EMERGENCY_PERCENT = 5
"""A battery so low may not last for the way home."""
RETURN_S, RETURN_VEHICLE_S, DETOURS = 600.0, 10.0, 4.0
"""The way home may take so long, so much more a vehicle, and so many times the area's diagonal."""
SEARCHING = (stages.SEARCH, stages.HOLD)

Note = Callable[[int, float, str, str], None]
"""Called with (row, time, kind, text) of what was noticed."""


class Supervision:
    """Watches over the vehicles of one flight."""

    def __init__(
        self, mission: Mission, world: World, sessions: Sequence[Session], roster: Roster, note: Note
    ) -> None:
        self._kept_percent = mission.safety.battery_return_percent
        self._world, self._sessions, self._roster, self._note = world, sessions, roster, note
        self._battery_low = [False] * len(sessions)
        self._quick_at = [0.0] * len(sessions)
        self._told_to_land: set[int] = set()
        self._watched_since: float | None = None
        self._returns_since: float | None = None
        self._area = regions(mission, margin_m=0.0).legal
        edges = world.fences.raw
        diagonal = math.hypot(*(edges[:, :2].max(axis=0) - edges[:, :2].min(axis=0)))
        slowest = float(world.fleet["speed"].min())
        self._return_s = RETURN_S + RETURN_VEHICLE_S * len(sessions) + DETOURS * diagonal / slowest

    def heed_batteries(self, now: float) -> None:
        """Order home whoever searches, or waits to, on a battery that is down to what is kept for the return."""
        for i, session in enumerate(self._sessions):
            percent = session.telemetry.battery_percent
            if self._battery_low[i] or percent is None or percent > self._kept_percent:
                continue
            if self._world.errands["stage"][i] in SEARCHING:
                self._battery_low[i] = True
                self._world.orders[i] = 1
                self._note(i, now, "battery", f"battery at {percent} %: returns")

    def require_inside(self, i: int) -> None:
        """A vehicle may be taken only from a place that the mission allows.  Raises OrderError.

        From elsewhere no way back is known to be clear, and what its own fence has ordered is not to be undone.
        """
        pose = self._world.poses[i]
        away_m = self._area.distance(shapely.Point(float(pose["east"]), float(pose["north"])))
        if away_m > 0.0:
            raise OrderError(
                f"vehicle {self._sessions[i].system}: cannot be retaken, it is {away_m:.1f} m outside the mission's "
                "fence; bring it inside first, or have it land"
            )

    def exhausted(self) -> list[int]:
        """Rows of those whose battery may give out at any moment, and that fly our setpoints."""
        rows = []
        for i, session in enumerate(self._sessions):
            percent = session.telemetry.battery_percent
            if session.phase is Phase.ENGAGED and percent is not None and percent <= EMERGENCY_PERCENT:
                rows.append(i)
        return rows

    def out_of_touch(self, now: float) -> list[int]:
        """Rows of those whose link has become slower than the guard counts on; each is told once."""
        rows = []
        for i, session in enumerate(self._sessions):
            if session.phase is not Phase.ENGAGED or not self._is_slow(i, session.round_trip_s or 0.0):
                self._quick_at[i] = now
            elif now - self._quick_at[i] >= SLOW_S:
                self._quick_at[i] = now
                rows.append(i)
        return rows

    def _is_slow(self, i: int, round_trip_s: float) -> bool:
        """Whether this is slow for a link, and slower than the guard counts on for this vehicle."""
        if round_trip_s <= SLOW_ROUND_TRIP_S:
            return False
        return round_trip_s > float(self._world.fleet[i]["latency"]) + SLOWER_BY_S

    def overdue(self, now: float) -> list[int]:
        """While all return: rows of those that should be home by now and still fly our setpoints."""
        if self._returns_since is None:
            self._returns_since = now
        if now - self._returns_since < self._return_s:
            return []
        return [i for i, session in enumerate(self._sessions) if session.phase is Phase.ENGAGED]

    def watch(self, now: float) -> bool:
        """None of ours is in the air: whether another's is, and is worth waiting for."""
        left = self._roster.unattended()
        if self._watched_since is None:
            self._watched_since = now
        watched = now - self._watched_since
        released = any(self._sessions[i].phase is Phase.RELEASED for i in left)
        if not left or watched >= (RELEASED_S if released else WATCH_S):
            return False
        for i in left:
            if watched >= LOST_LANDING_S and self._sessions[i].phase is Phase.LOST:
                self._land_unheard(i, now)
        return True

    def _land_unheard(self, i: int, now: float) -> None:
        """It has been silent for longer than its own way home takes: perhaps it hears though it is not heard."""
        if i in self._told_to_land:
            return
        self._told_to_land.add(i)
        with contextlib.suppress(OrderError):
            self._sessions[i].land()
            self._note(i, now, "land", "silent while all others are down: told to land")
