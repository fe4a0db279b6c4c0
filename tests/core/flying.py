"""The guard in a closed loop: vehicles that wish whatever a test makes them wish, and fly what the guard allows."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import shapely

from swarmctl.core import guard, motion, stages
from swarmctl.core.arrays import Records
from swarmctl.core.world import World

from .worlds import Box, Place, fences, fleet_of, region, rules_of, world_of

Wishes = Callable[["Flight"], Sequence[Place]]
BAD = (math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-300)


class Flight:
    """Vehicles in the air at ``places``, at rest, under the guard; keywords are VEHICLE's fields.

    ``latency`` delays each setpoint on its way to the vehicle, as the guard is told.
    """

    def __init__(
        self, places: Sequence[Place], area: Box, keep_outs: Sequence[Box] = (), *, margin: float = 20.0,
        separation: float = 15.0, **values: Any,
    ) -> None:  # fmt: skip
        rules = rules_of(separation=separation)
        self.world: World = world_of(
            "bounce", fleet_of(places, **values), rules, fences(area, keep_outs, margin)
        )
        self.raw = region(area, keep_outs)
        self.kept = region(area, keep_outs, margin / 2.0)
        self.world.poses["up"] = self.world.fleet["altitude"]
        self.world.errands["stage"] = stages.SEARCH
        self.latency = values.get("latency", 0.0)
        self.sent: list[Records] = []
        self.tick = 0

    @property
    def places(self) -> np.ndarray:
        """Where the vehicles are, (V, 2)."""
        return np.column_stack((self.world.poses["east"], self.world.poses["north"]))

    @property
    def outcomes(self) -> list[str]:
        """How the guard came to each vehicle's last setpoint."""
        return [guard.OUTCOMES[k] for k in self.world.setpoints["outcome"]]

    def told(self, i: int = 0) -> Place:
        """The velocity that vehicle ``i`` was last told."""
        setpoint = self.world.setpoints[i]
        return float(setpoint["v_east"]), float(setpoint["v_north"])

    def step(self, wishes: Sequence[Place]) -> None:
        """One setpoint interval: guard the wishes, and move."""
        for i, wish in enumerate(wishes):
            self.world.wishes[i] = wish
        self.world.steer(self.tick * 0.1)
        self.sent.append(self.world.setpoints.copy())
        for i in range(len(self.world.fleet)):
            self._move(i)
        self.tick += 1

    def _move(self, i: int) -> None:
        """Fly vehicle ``i`` for an interval under what has reached it by then."""
        interval = float(self.world.rules[0]["interval"])
        late = math.floor(self.latency / interval + 1e-9)
        rest = self.latency - late * interval
        for index, duration in ((self.tick - late - 1, rest), (self.tick - late, interval - rest)):
            if duration > 1e-12:
                self._follow(i, self.sent[index] if index >= 0 else None, duration)

    def _follow(self, i: int, setpoints: Records | None, duration: float) -> None:
        pose, vehicle = self.world.poses[i], self.world.fleet[i]
        east, north = (0.0, 0.0) if setpoints is None else (setpoints["v_east"][i], setpoints["v_north"][i])
        pose["east"], pose["north"], pose["v_east"], pose["v_north"] = motion.horizontal(
            pose["east"], pose["north"], pose["v_east"], pose["v_north"], east, north, vehicle["speed"],
            vehicle["acceleration"], vehicle["lag"], duration,
        )  # fmt: skip

    def fly(self, ticks: int, wishes: Wishes) -> "Flight":
        """Fly on and watch that nobody leaves the fence the guard keeps or comes too near another."""
        for _ in range(ticks):
            self.step(wishes(self))
            self.check()
        return self

    @property
    def bend(self) -> float:
        """How far (m) a turn bends off the straight leg that the guard tests: a T²/8 over its time T, which is the
        latency, what rounding it up to whole intervals adds, and the coming interval."""
        time_s = self.latency + 2.0 * float(self.world.rules[0]["interval"])
        return 0.01 + float(self.world.fleet["acceleration"].max()) * time_s * time_s / 8.0

    def check(self) -> None:
        """Everybody in the guard's fence, but for the bend of a turn, and apart."""
        places = self.places
        room = self.kept.buffer(self.bend, join_style="mitre")
        outside = places[~shapely.intersects_xy(room, places)]
        assert not len(outside), f"outside the fence at tick {self.tick}: {outside}"
        assert self.nearest() >= float(self.world.rules[0]["separation"]), f"too near at tick {self.tick}"
        if self.latency == 0.0:
            self._check_stop_paths()

    def _check_stop_paths(self) -> None:
        """Everybody could brake now and stand inside the fence, clear of where the others would."""
        speed = np.column_stack((self.world.poses["v_east"], self.world.poses["v_north"]))
        size = np.hypot(*speed.T)
        braking, lag = guard.BRAKING_SHARE * self.world.fleet["braking"], self.world.fleet["lag"]
        distance = size * size / (2.0 * braking) + np.minimum(size, braking * lag) * lag
        ends = self.places + speed * (distance / np.maximum(size, 1e-9))[:, None]
        paths = shapely.linestrings(np.stack((self.places, ends), axis=1))
        room = self.kept.buffer(0.05, join_style="mitre")
        inside = shapely.intersects_xy(room, ends) & ~shapely.intersects(room.boundary, paths)
        assert inside.all(), f"stop paths that leave the fence at tick {self.tick}: {paths[~inside]}"
        gaps = shapely.distance(paths[:, None], paths[None]) + np.where(np.eye(len(paths)), np.inf, 0.0)
        wanted = float(self.world.rules[0]["separation"]) + guard.SEPARATION_MARGIN_M
        assert gaps.min() >= wanted - 0.05, f"stop paths {gaps.min():.2f} m apart at tick {self.tick}"

    def nearest(self) -> float:
        """The least distance between two vehicles, m."""
        gaps = self.places[:, None] - self.places[None]
        away = np.hypot(gaps[..., 0], gaps[..., 1]) + np.where(np.eye(len(gaps)), np.inf, 0.0)
        return float(away.min())


def wild(rng: np.random.Generator) -> Wishes:
    """Wishes of every kind: straight on for a while, at one another, at the fence, nonsense."""
    kept: list[Place] = []

    def wish(flight: Flight) -> list[Place]:
        count = len(flight.places)
        if not kept:
            kept.extend([(0.0, 0.0)] * count)
        for i in range(count):
            if rng.random() < 0.1:
                kept[i] = _new_wish(flight, i, rng)
        return list(kept)

    return wish


def _new_wish(flight: Flight, i: int, rng: np.random.Generator) -> Place:
    kind = rng.integers(6)
    speed = float(flight.world.fleet[i]["speed"])
    if kind == 0:
        return tuple(rng.choice(BAD, 2))
    if kind == 1:
        return (0.0, 0.0)
    if kind in (2, 3):  # at somebody, or anybody's place
        toward = flight.places[rng.integers(len(flight.places))] - flight.places[i]
        size = max(math.hypot(*toward), 1e-9)
        return float(toward[0] / size * speed), float(toward[1] / size * speed)
    angle = rng.uniform(0.0, 2.0 * math.pi)
    size = speed * rng.uniform(0.2, 2.0)
    return size * math.cos(angle), size * math.sin(angle)


def scattered(rng: np.random.Generator, count: int, legal: shapely.Geometry, apart: float) -> list[Place]:
    """Up to ``count`` places in a region, no two nearer than ``apart``."""
    west, south, east, north = legal.bounds
    places: list[Place] = []
    for _ in range(200):
        place = (float(rng.uniform(west, east)), float(rng.uniform(south, north)))
        free = legal.contains(shapely.Point(place)) and all(math.dist(place, p) > apart for p in places)
        if free and len(places) < count:
            places.append(place)
    return places
