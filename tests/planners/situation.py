"""A situation in a few lines: vehicles here, targets there; one period decides, the test looks where they turn.

The vehicles fly as in the reference scenario (25 m/s, 200 m sensor, 600 m radio, 1 s), without the random
vector of the rules unless a test asks for it, in a wide field whose fence is out of reach.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from swarmctl.core import planners

from ..core.worlds import Box, Place, direction, fences, fleet_of, rules_of, world_of

FIELD: Box = (-20_000.0, 20_000.0, -20_000.0, 20_000.0)
RULES = ("metric", "seed", "radio_delay", "period")


class Situation:
    """Vehicles at ``places`` on ``headings`` (degrees from east to north), about to plan their first period.

    Keywords are the planner's parameters, VEHICLE's fields, or some of RULES'.
    """

    def __init__(
        self, algorithm: str, places: Sequence[Place], headings: Sequence[float] = (),
        targets: Sequence[Place] = (), *, area: Box = FIELD, keep_outs: Sequence[Box] = (), margin: float = 0.0,
        ideal: bool = True, random: float = 0.0, **values: Any,
    ) -> None:  # fmt: skip
        known = {p.name for p in planners.module(algorithm).PARAMETERS}
        settings = {k: v for k, v in values.items() if k in known}
        rules = {k: v for k, v in values.items() if k in RULES}
        vehicle = {k: v for k, v in values.items() if k not in known and k not in RULES}
        if "random" in known:
            settings["random"] = random
        self.world = world_of(
            algorithm, fleet_of(places, headings, **vehicle), rules_of(ideal=ideal, **rules),
            fences(area, keep_outs, margin), targets, settings,
        )  # fmt: skip
        self.world.prepare()
        self.tick = 0

    def plan(self, periods: int = 1) -> "Situation":
        """Let every vehicle sense, tell and plan; nobody moves."""
        for _ in range(periods):
            self.world.observe(self.tick)
            self.world.share(self.tick)
            self.world.deliver(self.tick)
            self.world.decide(self.tick)
            self.tick += 1
        return self

    def fly(self, periods: int = 1) -> "Situation":
        """Plan and fly on, period by period."""
        period = float(self.world.rules[0]["period"])
        for _ in range(periods):
            self.plan()
            for axis in ("east", "north"):
                self.world.poses[f"v_{axis}"] = self.world.wishes[f"v_{axis}"]
                self.world.poses[axis] += period * self.world.wishes[f"v_{axis}"]
        return self

    def put(self, i: int, place: Place, heading: float | None = None) -> "Situation":
        """Move vehicle ``i`` by hand."""
        self.world.poses["east"][i], self.world.poses["north"][i] = place
        if heading is not None:
            memory = self.world.memory
            memory["heading_east"][i], memory["heading_north"][i] = direction(heading)
        return self

    def forget(self) -> "Situation":
        """Let everybody forget what they know, so that all targets are new again."""
        self.world.has[:], self.world.told[:], self.world.knowledge["known"] = 0, 0, 0
        return self

    def heading(self, i: int = 0) -> float:
        """Where vehicle ``i`` wants to fly, degrees from east to north in (-180, 180]."""
        wish = self.world.wishes[i]
        return math.degrees(math.atan2(wish["v_north"], wish["v_east"]))

    def speed(self, i: int = 0) -> float:
        """How fast it wants to fly, m/s."""
        wish = self.world.wishes[i]
        return math.hypot(wish["v_east"], wish["v_north"])

    def place(self, i: int = 0) -> Place:
        """Where vehicle ``i`` is."""
        pose = self.world.poses[i]
        return float(pose["east"]), float(pose["north"])

    def known(self, i: int = 0) -> list[int]:
        """The serial numbers of the targets vehicle ``i`` knows, in the order it learned of them."""
        row = self.world.contacts[i][: self.world.knowledge[i]["known"]]
        return [int(serial) for serial in row["id"]]

    def remembers(self, field: str, i: int = 0) -> float:
        """A number in the planner's memory of vehicle ``i``."""
        return float(self.world.memory[field][i])


def along(*terms: tuple[float, float]) -> float:
    """The direction, in degrees, of a sum of terms (weight, direction in degrees)."""
    x = sum(w * direction(angle)[0] for w, angle in terms)
    y = sum(w * direction(angle)[1] for w, angle in terms)
    return math.degrees(math.atan2(y, x))


def bearing(start: Place, end: Place) -> float:
    """The direction from one place to another, degrees from east to north."""
    return math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))


def near(degrees: float, tolerance: float = 1e-6) -> object:
    """For comparing angles."""
    return pytest.approx(degrees, abs=tolerance)


def crowd(place: Place, count: int, spread: float = 1.0) -> list[Place]:
    """``count`` targets close round a place."""
    turns = 2.0 * np.pi * np.arange(count) / count
    return [(place[0] + spread * math.cos(a), place[1] + spread * math.sin(a)) for a in turns]
