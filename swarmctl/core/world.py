"""All arrays of one run, and the stages as methods on them: what a flight, a study and a replay share."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from . import bind, calls, planners, state
from .arrays import Flags, Floats, Integers, Records
from .guard import MOST_UNDER_WAY


@dataclass(frozen=True)
class Scene:
    """What there is to find: targets sorted by grid cell, the grid, and where each cell's targets start."""

    targets: Records
    grid: Records
    starts: Integers


@dataclass(frozen=True)
class Fences:
    """Edges (E, 4) of the area as drawn, as planners see it, and as the guard keeps it."""

    raw: Floats
    plan: Floats
    guard: Floats


def make_scene(places: Floats, clusters: Integers, wander_m: float = 0.0, wander_mps: float = 0.0,
               cell_m: float = 200.0) -> Scene:  # fmt: skip
    """Sort targets at ``places`` (T, 2) into a grid of about ``cell_m`` cells (at most 256 × 256)."""
    low = places.min(axis=0) if len(places) else np.zeros(2)
    extent = places.max(axis=0) - low if len(places) else np.zeros(2)
    cell = max(cell_m, float(extent.max()) / 255.0)
    grid = np.zeros(1, state.GRID)
    columns, rows = (int(extent[k] // cell) + 1 for k in range(2))
    grid[0] = (low[0], low[1], cell, columns, rows, wander_m, wander_mps)
    targets = np.zeros(len(places), state.TARGET)
    starts = np.zeros(columns * rows + 1, np.int64)
    calls.sort_into(grid, np.ascontiguousarray(places), clusters, targets, starts)
    return Scene(targets, grid, starts)


def make_settings(algorithm: str, parameters: Mapping[str, float | str]) -> Records:
    """One record with every parameter of ``algorithm``; those not given have their defaults."""
    known = planners.module(algorithm).PARAMETERS
    settings = np.zeros(1, state.record(*(p.name for p in known)))
    for parameter in known:
        settings[0][parameter.name] = parameter.number(parameters.get(parameter.name, parameter.default))
    return settings


class World:
    """One run's arrays, one row a vehicle, at their start.

    ``fleet`` (V,) VEHICLE and ``rules`` (1,) RULES say what flies; the rest is empty knowledge, zero poses.
    """

    def __init__(
        self, algorithm: str, fleet: Records, rules: Records, scene: Scene, fences: Fences, settings: Records
    ) -> None:
        count, targets = len(fleet), len(scene.targets)
        slots = targets + count * int(rules[0]["alarm_slots"])
        depth = int(rules[0]["radio_delay"]) + 1
        neighbours = max(count - 1, 1)
        self.algorithm = algorithm
        self.kernels: SimpleNamespace = bind.bind(algorithm)
        self.fleet, self.rules, self.settings = fleet, rules, settings
        self.scene, self.fences = scene, fences
        self.poses = np.zeros(count, state.POSE)
        self.memory: Records = np.zeros(count, self.kernels.memory_dtype)
        self.knowledge = np.zeros(count, state.KNOWLEDGE)
        self.contacts = np.zeros((count, slots), state.CONTACT)
        self.has: Flags = np.zeros((count, slots), np.uint8)
        self.told: Integers = np.zeros((count, count), np.int64)
        self.reports = np.zeros((count, targets + 1), state.CONTACT)
        self.report_count: Integers = np.zeros(count, np.int64)
        self.alarms: Integers = np.zeros(count, np.int64)
        self.found: Integers = np.full(targets, -1, np.int64)
        self.beacons = np.zeros((depth, count), self.kernels.beacon_dtype)
        self.heard: Integers = np.zeros((depth, count, neighbours), np.int64)
        self.heard_count: Integers = np.zeros((depth, count), np.int64)
        self.wishes = np.zeros(count, state.WISH)
        self.errands = np.zeros(count, state.ERRAND)
        self.paths = np.zeros(count + 1, state.PATH)
        self.wants = np.zeros(count, state.WANT)
        self.setpoints = np.zeros(count, state.SETPOINT)
        self.sent: Floats = np.zeros((count, MOST_UNDER_WAY + 1, 2))
        self.orders: Integers = np.zeros(count, np.int64)
        self.nearest_m = float("nan")  #: the nearest two vehicles came in a run of ideal dynamics

    @property
    def depth(self) -> int:
        """Slots in the ring of beacons under way."""
        return int(self.beacons.shape[0])

    def prepare(self) -> None:
        """Launch the planners: initial headings, and what each prepares."""
        self.kernels.prepare(self.memory, self.fleet, self.rules, self.fences.plan)

    def observe(self, tick: int) -> None:
        """Sense: the emulated sensors' reports at planner tick ``tick``."""
        self.kernels.observe(
            self.fleet, self.poses, self.scene.targets, self.scene.grid, self.scene.starts, self.alarms,
            self.rules, tick, self.reports, self.report_count, self.found,
        )  # fmt: skip

    def share(self, tick: int) -> None:
        """Know: learn what was sensed, make this tick's beacons."""
        self.kernels.share(
            self.memory, self.fleet, self.poses, self.knowledge, self.contacts, self.has, self.reports,
            self.report_count, self.beacons, tick % self.depth,
        )  # fmt: skip

    def deliver(self, tick: int) -> None:
        """Radio: who will hear this tick's beacons."""
        self.kernels.deliver(
            self.fleet, self.poses, self.rules, tick, tick % self.depth, self.heard, self.heard_count
        )

    def decide(self, tick: int) -> None:
        """Know what arrives now, and plan: ``wishes`` for the coming period."""
        self.kernels.decide(
            self.memory, self.fleet, self.poses, self.knowledge, self.contacts, self.has, self.told,
            self.beacons, self.heard, self.heard_count, self.arriving(tick), self.fences.plan, self.rules,
            self.settings, tick, self.wishes,
        )  # fmt: skip

    def arriving(self, tick: int) -> int:
        """The ring's slot of the beacons that arrive at ``tick``."""
        return (tick + self.depth - int(self.rules[0]["radio_delay"])) % self.depth

    def begin_return(self, now: float) -> None:
        """Send home every vehicle with a one in ``orders``, and clear them."""
        calls.order_home(
            self.fleet, self.poses, self.errands, self.orders, now, self.rules, self.fences.plan,
            self.fences.guard,
        )  # fmt: skip
        self.orders[:] = 0

    def steer(self, now: float) -> None:
        """Homing and guard: this setpoint tick's ``setpoints``."""
        calls.steer(
            self.fleet, self.poses, self.errands, self.wishes, now, self.rules, self.fences.plan,
            self.fences.guard, self.paths, self.wants, self.sent, self.setpoints,
        )  # fmt: skip

    def run_ideal(self) -> Integers:
        """Search in ideal dynamics to the end; returns targets in range (ticks, V)."""
        in_range = np.zeros(
            (round(self.rules[0]["duration"] / self.rules[0]["period"]), len(self.fleet)), np.int64
        )
        self.kernels.run_ideal(
            self.memory, self.fleet, self.poses, self.knowledge, self.contacts, self.has, self.told,
            self.scene.targets, self.scene.grid, self.scene.starts, self.alarms, self.reports, self.report_count,
            self.found, self.beacons, self.heard, self.heard_count, self.fences.plan, self.rules,
            self.settings, self.wishes, in_range,
        )  # fmt: skip
        return in_range

    def run_multicopter(self, most_s: float = 7200.0) -> tuple[Integers, Floats, float]:
        """Fly the whole mission in a multicopter's dynamics, take-off to landing.

        Returns targets in range (ticks, V); the account of steering.watch; and the flight's length in s.
        """
        rules = self.rules[0]
        in_range = np.zeros((round(rules["duration"] / rules["period"]), len(self.fleet)), np.int64)
        account = np.array([np.inf, 0.0, 0.0, 0.0])
        most = round((most_s + rules["duration"]) / rules["interval"])
        ticks = self.kernels.run_multicopter(
            self.memory, self.fleet, self.poses, self.knowledge, self.contacts, self.has, self.told,
            self.scene.targets, self.scene.grid, self.scene.starts, self.alarms, self.reports, self.report_count,
            self.found, self.beacons, self.heard, self.heard_count, self.fences.plan, self.fences.guard,
            self.fences.raw, self.rules, self.settings, self.wishes, self.errands, self.paths, self.wants,
            self.sent, self.setpoints, self.orders, in_range, account, most,
        )  # fmt: skip
        return in_range, account, ticks * float(rules["interval"])
