"""All arrays of one run, and the stages as methods on them: what a flight, a study and a replay share."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

from . import bind, calls, planners, state
from .arrays import Floats, Integers, Records
from .guard import MOST_UNDER_WAY
from .know import LEAST_CONTACTS, MOST_CONTACTS, MOST_PEERS
from .radio import MOST_HEARD
from .roam import WAYS


@dataclass(frozen=True)
class Scene:
    """What there is to find: targets sorted by grid cell, the grid, and where each cell's targets start (see
    scene.sort_into)."""

    targets: Records
    grid: Records
    starts: Integers


@dataclass(frozen=True)
class Fences:
    """Edges (E, 4) of the area as drawn, as planners see it, and as the guard keeps it."""

    raw: Floats
    plan: Floats
    guard: Floats


@dataclass(frozen=True)
class Motion:
    """How targets move (core/roam.py): how far (m) each wanders to either side, and its cluster drifts along its way,
    at most, and at which speeds (m/s).  A distance of 0 is none.  Ways end at the edges ``raw`` (E, 4)."""

    seed: int = 0
    wander_m: float = 0.0
    wander_mps: float = 1.0
    drift_m: float = 0.0
    drift_mps: float = 1.0
    raw: Floats = field(default_factory=lambda: np.zeros((0, 4)))


STILL = Motion()


def make_scene(places: Floats, clusters: Integers, motion: Motion = STILL, reach_m: float = 200.0) -> Scene:
    """Sort targets at ``places`` (T, 2) into a grid for sensors of up to ``reach_m``, not much finer than there
    are targets."""
    places = np.ascontiguousarray(places, np.float64)
    west, south, east, north = calls.bounds(places)
    cell = max(reach_m, max(east - west, north - south) / max(255.0, 2.0 * math.sqrt(len(places))))
    columns, rows = int((east - west) // cell) + 1, int((north - south) // cell) + 1
    grid = _moving(places, clusters, motion)
    block = math.ceil((reach_m + grid[0]["stray"]) / cell - 1e-9)
    for name, value in zip(("east", "north", "cell", "columns", "rows", "block"),
                           (west, south, cell, columns, rows, block), strict=True):  # fmt: skip
        grid[name] = value
    targets = np.zeros(len(places), state.TARGET)
    starts = np.zeros((columns * rows + 1, 2), np.int64)
    calls.sort_into(grid, places, clusters, targets, starts)
    return Scene(targets, grid, starts)


def _moving(places: Floats, clusters: Integers, motion: Motion) -> Records:
    """What GRID says of how the targets move; a single row where no cluster does."""
    drifting = motion.drift_m > 0.0 and len(places) > 0
    grid = np.zeros(int(clusters.max()) + 1 if drifting else 1, state.GRID)
    grid["seed"], grid["wander"], grid["wander_speed"] = motion.seed, motion.wander_m, motion.wander_mps
    if drifting:
        grid["drift_speed"] = motion.drift_mps
        room = np.zeros((len(grid), WAYS, 2))
        calls.lay_ways(motion.seed, motion.raw, motion.drift_m, places, clusters, room, grid)
    grid["stray"] = calls.stray(grid)
    return grid


def make_settings(algorithm: str, parameters: Mapping[str, float | str]) -> Records:
    """One record with every parameter of ``algorithm``; those not given have their defaults."""
    known = planners.module(algorithm).PARAMETERS
    settings = np.zeros(1, state.record(*(p.name for p in known)))
    for parameter in known:
        settings[0][parameter.name] = parameter.number(parameters.get(parameter.name, parameter.default))
    return settings


def power_of_two(least: int) -> int:
    """The least power of two that is not below ``least``."""
    return 1 << max(least - 1, 0).bit_length()


GIVEN = ("fleet", "rules", "settings")  # a world's arrays that say what is flown; the others are its state


class World:
    """One run's arrays, one row a vehicle, at their start.

    ``fleet`` (V,) VEHICLE and ``rules`` (1,) RULES say what flies; the rest is empty knowledge, zero poses.
    """

    def __init__(
        self, algorithm: str, fleet: Records, rules: Records, scene: Scene, fences: Fences, settings: Records
    ) -> None:
        count, targets = len(fleet), len(scene.targets)
        depth = int(rules[0]["radio_delay"]) + 1
        neighbours = min(max(count - 1, 1), MOST_HEARD)
        self.algorithm = algorithm
        self.kernels: SimpleNamespace = bind.bind(algorithm)
        self.fleet, self.rules, self.settings = fleet, rules, settings
        self.scene, self.fences = scene, fences
        remembered = power_of_two(min(self.serials, max(MOST_CONTACTS // count, LEAST_CONTACTS)))
        self.poses = np.zeros(count, state.POSE)  #: as they are seen
        #: as they are: of a study; where it sees exactly, the very same array
        self.truth = np.zeros(count, state.POSE) if rules[0]["wire"] else self.poses
        self.memory: Records = np.zeros(count, self.kernels.memory_dtype)
        self.knowledge = np.zeros(count, state.KNOWLEDGE)
        self.contacts = np.zeros((count, remembered), state.CONTACT)
        self.has: Integers = np.zeros((count, 2 * remembered), np.int64)
        self.told: Integers = np.zeros((count, power_of_two(min(count, MOST_PEERS))), np.int64)
        self.reports = np.zeros((count, min(targets, max(remembered, LEAST_CONTACTS)) + 1), state.CONTACT)
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
        self.nearest_m = math.nan  #: how near two vehicles came in a run of ideal dynamics
        # Targets in range, a row a period: their sum over the vehicles, and how many vehicles had any.
        self.in_range: Integers = np.zeros((round(rules[0]["duration"] / rules[0]["period"]), 2), np.int64)
        mine = (a for n, a in vars(self).items() if isinstance(a, np.ndarray) and n not in GIVEN)
        self._bytes = [array.reshape(-1).view(np.uint8) for array in mine]

    def restart(self, fleet: Records, rules: Records, scene: Scene) -> None:
        """Put everything back to its start for another run of the same size: the same bytes as a new world's.

        Memory that has been used before needs not be mapped anew, which would take as long as the run.
        """
        self.fleet, self.rules, self.scene = fleet, rules, scene
        for data in self._bytes:
            data.fill(0)
        self.found.fill(-1)
        self.nearest_m = math.nan

    @property
    def serials(self) -> int:
        """How many serial numbers there are: of targets, and those set aside for false alarms."""
        return len(self.scene.targets) + len(self.fleet) * int(self.rules[0]["alarm_slots"])

    def contacts_of(self, i: int) -> Records:
        """What vehicle ``i`` remembers (K,) CONTACT: in order, as long as it has forgotten nothing."""
        known: Records = self.contacts[i, : self.knowledge[i]["known"]]
        return known

    def index(self) -> None:
        """Make everybody's set of contacts anew, after the lists were replaced."""
        for i in range(len(self.fleet)):
            calls.index(self.knowledge, i, self.contacts, self.has)

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
        """Search in ideal dynamics to the end; returns ``in_range`` (periods, 2)."""
        self.nearest_m = self.kernels.run_ideal(
            self.memory, self.fleet, self.poses, self.knowledge, self.contacts, self.has, self.told,
            self.scene.targets, self.scene.grid, self.scene.starts, self.alarms, self.reports, self.report_count,
            self.found, self.beacons, self.heard, self.heard_count, self.fences.plan, self.rules,
            self.settings, self.wishes, self.in_range,
        )  # fmt: skip
        return self.in_range

    def run_multicopter(self, most_s: float = 7200.0) -> tuple[Integers, Floats, float]:
        """Fly the whole mission in a multicopter's dynamics, take-off to landing.

        Returns ``in_range`` (periods, 2); the account of steering.watch; and the flight's length in s.
        """
        rules = self.rules[0]
        account = np.array([np.inf, 0.0, 0.0, 0.0])
        most = round((most_s + rules["duration"]) / rules["interval"])
        ticks = self.kernels.run_multicopter(*self._flown, account, most)
        return self.in_range, account, ticks * float(rules["interval"])

    def search(self, begun: int, first: int, end: int, account: Floats) -> int:
        """Fly setpoint ticks ``first`` to ``end`` - 1 in a multicopter's dynamics, of a search begun at tick ``begun``.

        Everybody is in the air already, where ``truth`` and ``poses`` say.  Returns the tick at which all had landed,
        or ``end``.
        """
        ticks: int = self.kernels.search(*self._flown, account, begun, first, end)
        return ticks

    @property
    def _flown(self) -> tuple[Records | Floats | Integers, ...]:
        """The arrays of a flight in a multicopter's dynamics, in the kernels' order."""
        return (
            self.memory, self.fleet, self.truth, self.poses, self.knowledge, self.contacts, self.has, self.told,
            self.scene.targets, self.scene.grid, self.scene.starts, self.alarms, self.reports, self.report_count,
            self.found, self.beacons, self.heard, self.heard_count, self.fences.plan, self.fences.guard,
            self.fences.raw, self.rules, self.settings, self.wishes, self.errands, self.paths, self.wants,
            self.sent, self.setpoints, self.orders, self.in_range,
        )  # fmt: skip
