"""What a flight came to: summary.json, the picture, and the exit code, from what truly happened."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from swarmctl.core.arrays import Floats
from swarmctl.core.world import World
from swarmctl.mission.geometry import Regions
from swarmctl.mission.model import Mission
from swarmctl.record import summary
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.statistics import Spread, Statistics

from .swarm import Swarm
from .track import Track

DONE, BROKEN, REFUSED, ABORTED = 0, 1, 3, 4
STANDING_MPS = 0.5


@dataclass(frozen=True)
class Outcome:
    """A finished flight: its figures as summary.json has them, and what the figures were made of."""

    mission: Mission
    world: World
    regions: Regions
    swarm: Swarm
    sessions: Sequence[Session]
    track: Track
    seed: int
    wall_s: float
    aborted: bool
    speed: float | None = None  #: times real time; None in lockstep
    resumed: str = ""  #: the folder of the flight that this one continues

    @property
    def found_s(self) -> Floats:
        """When each target was found, (T,) seconds of search; infinity for never."""
        period = self.mission.planner.period_s
        return np.where(self.world.found < 0, np.inf, self.world.found * period)

    @property
    def searched_s(self) -> float:
        """How long the search went on, in this flight and in those that it continues."""
        return self.swarm.planner_tick * self.mission.planner.period_s

    @property
    def search_window_s(self) -> tuple[float, float]:
        """Flight times at which the search of this flight began and ended; without one, both infinite."""
        began = self.swarm.search_began
        if began is None:
            return np.inf, np.inf
        before_s = self.swarm.ticks_before * self.mission.planner.period_s
        return began, began + self.searched_s - before_s

    def exit_code(self) -> int:
        """INTERFACE's exit code."""
        if self.aborted:
            return ABORTED
        never = self.swarm.search_began is None
        if never and ("refused" in self.swarm.roster.dropped or not self.track.airborne.any()):
            return REFUSED
        figures = self.summary("")
        close = figures["min_separation_m"]
        unsafe = figures["geofence_violations"] > 0 or (
            close is not None and close < self.mission.safety.separation_m
        )
        failed = any(self.swarm.roster.troubled) or any(
            v["outcome"] != "landed" for v in figures["per_vehicle"]
        )
        return BROKEN if never or unsafe or failed or self.swarm.broken_off else DONE

    def complaints(self) -> list[str]:
        """What went wrong, a line each."""
        lines = [
            f"vehicle {session.system}: {self._outcome(i, session)}"
            for i, session in enumerate(self.sessions)
            if self._outcome(i, session) != "landed"
        ]
        lines += [
            f"vehicle {session.system}: landed away from its pad"
            for session, troubled in zip(self.sessions, self.swarm.roster.troubled, strict=True)
            if troubled
        ]
        nearest, wanted = self.min_separation_m(), self.mission.safety.separation_m
        if nearest is not None and nearest < wanted:
            lines.append(
                f"UNSAFE: two vehicles came within {nearest:.2f} m of each other; separation_m is {wanted:g}"
            )
        if self.geofence_violations():
            lines.append("UNSAFE: a vehicle was outside the keep-in or inside a keep-out")
        return lines

    def summary(self, run: str) -> dict[str, Any]:
        """The content of summary.json for the run folder ``run``."""
        found, track, mission = self.found_s, self.track, self.mission
        simulated = _seconds_in_air(track)
        targets, detected = len(found), int(np.isfinite(found).sum())
        statistics = [session.statistics() for session in self.sessions]
        samples = self.swarm.decisions
        return {
            "algorithm": self.world.algorithm,
            "vehicles": len(self.sessions),
            "seed": self.seed,
            "duration_s": mission.duration_s,
            "searched_s": self.searched_s,
            "speed": "max" if self.speed is None else self.speed,
            "wall_s": round(self.wall_s, 3),
            "real_time_factor": round(simulated / self.wall_s, 1) if self.wall_s > 0 else None,
            "targets": targets,
            "detected": detected,
            "detected_fraction": round(detected / targets, 6) if targets else 0.0,
            "time_to_s": summary.time_to(found),
            "mean_targets_in_range": round(self.swarm.in_range_total / samples, 4) if samples else 0.0,
            "standing_fraction": self.standing_fraction(),
            "min_separation_m": self.min_separation_m(),
            "geofence_violations": self.geofence_violations(),
            "setpoints_sent": sum(s.setpoints_sent for s in statistics),
            "messages_received": sum(s.messages_received for s in statistics),
            "decisions": self.swarm.decisions,
            "setpoint_interval_ms": self._intervals_ms(),
            "per_vehicle": self._per_vehicle(),
            **({"resumed": self.resumed} if self.resumed else {}),
            "run": run,
        }

    def min_separation_m(self) -> float | None:
        """The nearest two airborne vehicles at about one height came."""
        track = self.track
        nearest = summary.min_separation(
            track.field("east"), track.field("north"), track.field("up"), track.airborne
        )
        return None if nearest is None else round(nearest, 3)

    def standing_fraction(self) -> float:
        """The share of the search's vehicle-ticks in which a vehicle truly stood still."""
        began, ended = self.search_window_s
        times = self.track.times_s
        during = (times >= began) & (times < ended)
        aloft = self.track.airborne[during]
        speed = np.hypot(self.track.field("v_east")[during], self.track.field("v_north")[during])
        return round(float(np.mean(speed[aloft] < STANDING_MPS)), 6) if aloft.any() else 0.0

    def geofence_violations(self) -> int:
        """Vehicles × ticks with the true position outside the border or inside a keep-out."""
        r = self.regions
        keep_outs = shapely.union_all([shapely.Polygon(k) for k in r.keep_outs])
        legal = shapely.difference(shapely.Polygon(r.border), keep_outs)
        shapely.prepare(legal)
        return summary.geofence_violations(
            self.track.field("east"), self.track.field("north"), self.track.airborne,
            lambda east, north: shapely.intersects_xy(legal, east, north),
        )  # fmt: skip

    def _intervals_ms(self) -> dict[str, float | None]:
        """The spread of all vehicles' setpoint intervals, in flight time."""
        intervals = np.concatenate([np.asarray(s.setpoint_intervals_s) for s in self.sessions])
        if not len(intervals):
            return {"p50": None, "p99": None}
        p50, p99 = np.percentile(intervals, (50, 99))
        return {"p50": round(float(p50) * 1e3, 3), "p99": round(float(p99) * 1e3, 3)}

    def _per_vehicle(self) -> list[dict[str, Any]]:
        flown = summary.distance_flown(
            self.track.field("east"), self.track.field("north"), self.track.airborne
        )
        return [
            {
                "id": session.system,
                "autopilot": session.adapter.name if session.adapter else "unknown",
                "outcome": self._outcome(i, session),
                "detected": int(self.swarm.seen[i].sum()),
                "distance_m": round(float(flown[i]), 1),
                "events": self.swarm.roster.messages[i],
                "link": _link(session.statistics()),
            }
            for i, session in enumerate(self.sessions)
        ]

    def _outcome(self, i: int, session: Session) -> str:
        """landed, released, lost, crashed or refused; one that never had to fly stands, and so has landed."""
        dropped = self.swarm.roster.dropped[i]
        if dropped is not None:
            return dropped
        flew = bool(self.track.airborne[:, i].any())
        return "landed" if session.phase is Phase.LANDED or not flew else "lost"


def _link(figures: Statistics) -> dict[str, Any]:
    """One vehicle's link: counts, and spreads in milliseconds of flight time."""
    heard = figures.messages_received + figures.messages_lost
    return {
        "messages_received": figures.messages_received,
        "messages_lost": figures.messages_lost,
        "loss": round(figures.messages_lost / heard, 6) if heard else 0.0,
        "messages_late": figures.messages_late,
        "messages_bad": figures.messages_bad,
        "setpoints_sent": figures.setpoints_sent,
        "setpoint_interval_ms": _milliseconds(figures.setpoint_interval),
        "round_trip_ms": _milliseconds(figures.round_trip),
        "command_round_trip_ms": _milliseconds(figures.command_round_trip),
    }


def _milliseconds(spread: Spread | None) -> dict[str, float] | None:
    """A spread of durations; None where there was nothing to spread."""
    if spread is None:
        return None
    seconds = {"min": spread.minimum_s, "p50": spread.median_s, "p99": spread.p99_s, "max": spread.maximum_s}
    return {name: round(1e3 * value, 3) for name, value in seconds.items()}


def _seconds_in_air(track: Track) -> float:
    """From the first take-off to the last landing."""
    up = np.flatnonzero(track.airborne.any(axis=1))
    return float(track.times_s[up[-1]] - track.times_s[up[0]]) if len(up) else 0.0
