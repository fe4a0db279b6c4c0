"""Belief sweep, plainly: what the planner is to decide, written from its description with no thought of speed.

Whole maps as arrays of booleans, worked out anew at every decision; everybody met in a dictionary; every open cell
tried.  A :class:`Shadow` decides beside a world, from what that world's vehicles sense, know and hear, and says where
the two part.  The sectors are taken from the vehicles; they have tests of their own.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from swarmctl.core import fence
from swarmctl.core.arrays import Floats, Integers
from swarmctl.core.planners import belief, common, sectors
from swarmctl.core.world import World

Cell = tuple[int, int]
Flags = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
Seen = tuple[float, float, float]  # when, east, north
PLACES = 32  # in the table of vehicles met


@dataclass
class Told:
    """What a vehicle's beacon says."""

    visited: Flags
    lap: int
    met: dict[int, tuple[int, Seen]]
    east: float
    north: float


@dataclass
class Mind:
    """What one vehicle remembers."""

    visited: Flags
    barred: Flags
    was: tuple[float, float]
    lap: int = 0
    met: dict[int, tuple[int, Seen]] = field(
        default_factory=dict
    )  # place in the table: who, and when and where
    goal: Cell | None = None
    first_leg: bool = True
    lost: bool = False
    decide_at: float = 0.0
    give_up_at: float = 0.0


class Shadow:
    """Plain minds beside a world that is at its start, prepared."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.settings = {name: float(world.settings[0][name]) for name in world.settings.dtype.names}
        self.period = float(world.rules[0]["period"])
        self._lay_cells()
        self.minds = [
            Mind(
                self._nowhere(), ~self.legal, (float(pose["east"]), float(pose["north"])),
                first_leg=bool(memory["home"] == 0.0),
            )
            for pose, memory in zip(world.poses, world.memory, strict=True)
        ]  # fmt: skip
        self.own = [self._own(i) for i in range(len(self.minds))]
        self.told: dict[int, list[Told]] = {}

    def _nowhere(self) -> Flags:
        return np.zeros((len(self.north), len(self.east)), bool)

    def _lay_cells(self) -> None:
        edges, reach = self.world.fences.plan, float(self.world.fleet["sensor_range"].min())
        corners = edges[:, :2]
        low, high = corners.min(axis=0), corners.max(axis=0)
        cell = max(self.settings["cell"] * reach, float((high - low).max()) / 60)
        self.cell = min(cell, self.settings["cell_most"] * reach)
        columns, rows = (max(round(float(extent) / self.cell), 1) for extent in high - low)
        west = 0.5 * (low[0] + high[0] - columns * self.cell)
        south = 0.5 * (low[1] + high[1] - rows * self.cell)
        self.east: Floats = np.array([west + (k + 0.5) * self.cell for k in range(columns)])
        self.north: Floats = np.array([south + (k + 0.5) * self.cell for k in range(rows)])
        self.legal = np.array([[fence.inside(edges, x, y) for x in self.east] for y in self.north])

    def _own(self, i: int) -> Flags:
        """The cells in vehicle ``i``'s sector."""
        own = [[sectors.own(self.world.memory, i, float(x), float(y)) for x in self.east] for y in self.north]
        return np.array(own)

    def _near(self, east: float, north: float, reach: float) -> Flags:
        """The cells with their centre within ``reach`` of a place."""
        dx, dy = self.east[None, :] - east, self.north[:, None] - north
        return dx * dx + dy * dy <= reach * reach

    def tell(self, tick: int) -> None:
        """Keep what everybody's beacon says at ``tick``."""
        self.told[tick] = [
            Told(mind.visited.copy(), mind.lap, dict(mind.met), float(pose["east"]), float(pose["north"]))
            for mind, pose in zip(self.minds, self.world.poses, strict=True)
        ]

    def decide(self, tick: int, headings: Floats) -> list[Cell | None]:
        """Everybody's goal (row, column) after ``tick``; ``headings`` (V, 2) are those they had before."""
        slot = self.world.arriving(tick)
        for i, mind in enumerate(self.minds):
            progress = self._see(i, mind)
            heard = self.world.heard[slot, i, : self.world.heard_count[slot, i]]
            sent = tick - int(self.world.rules[0]["radio_delay"])
            self._hear(i, mind, [int(j) for j in heard], sent)
            self._plan(i, mind, tick * self.period, headings[i], progress)
        return [mind.goal for mind in self.minds]

    def _see(self, i: int, mind: Mind) -> bool:
        east, north = (float(self.world.poses[i][axis]) for axis in ("east", "north"))
        reach = self.settings["visited"] * float(self.world.fleet[i]["sensor_range"])
        dx, dy = east - mind.was[0], north - mind.was[1]
        points = max(math.ceil(math.sqrt(dx * dx + dy * dy) / (0.5 * self.cell)), 1)
        before = mind.visited.sum()
        for k in range(points):
            mind.visited |= self._near(east - k / points * dx, north - k / points * dy, reach)
        mind.was = (east, north)
        return bool(mind.visited.sum() > before)

    def _hear(self, i: int, mind: Mind, heard: list[int], sent: int) -> None:
        beacons = {j: self.told[sent][j] for j in heard}
        latest = max([mind.lap, *(told.lap for told in beacons.values())])
        if latest > mind.lap:
            self._begin_lap(mind, latest)
        for j, told in beacons.items():
            if told.lap == mind.lap:
                mind.visited |= told.visited
            for other, seen in [(j, (sent * self.period, told.east, told.north)), *told.met.values()]:
                known = mind.met.get(other % PLACES)
                if other != i and (known is None or seen[0] > known[1][0]):
                    mind.met[other % PLACES] = (other, seen)

    def _begin_lap(self, mind: Mind, lap: int) -> None:
        mind.lap, mind.visited, mind.barred = lap, self._nowhere(), ~self.legal

    def _plan(self, i: int, mind: Mind, now: float, heading: Floats, progress: bool) -> None:
        if mind.first_leg and not self._first_leg_ends(i, heading):
            return
        mind.first_leg = False
        is_open = mind.goal is not None and not (mind.visited | mind.barred)[mind.goal]
        if mind.lost or (is_open and now < mind.decide_at):
            return
        fresh = progress or not is_open
        if mind.goal is not None and not fresh and now > mind.give_up_at:
            row, column = mind.goal
            block = (slice(max(row - 1, 0), row + 2), slice(max(column - 1, 0), column + 2))
            mind.barred[block] |= ~mind.visited[block]
            fresh = True
        self._choose(i, mind, now, heading, fresh)
        if mind.goal is None:
            self._begin_lap(mind, mind.lap + 1)
            self._choose(i, mind, now, heading, True)
            mind.lost = mind.goal is None

    def _first_leg_ends(self, i: int, heading: Floats) -> bool:
        if self.world.knowledge[i]["in_range"] > 0:
            return True
        east, north = self.world.poses[i]["east"], self.world.poses[i]["north"]
        reach = common.look_ahead(self.world.fleet, i, self.world.rules)
        return not fence.legal(
            self.world.fences.plan, east, north, east + reach * heading[0], north + reach * heading[1]
        )

    def _choose(self, i: int, mind: Mind, now: float, heading: Floats, fresh: bool) -> None:
        pose, speed = self.world.poses[i], float(self.world.fleet[i]["speed"])
        worth = self._worth(i, mind)
        padded = np.pad(worth, 1)
        rows, columns = worth.shape
        total = sum(padded[r : r + rows, c : c + columns] for r in range(3) for c in range(3))
        best, mind.goal = 0.0, None
        for row, column in np.argwhere(~(mind.visited | mind.barred)).tolist():
            value = self._value(i, mind, now, heading, (row, column), int(total[row, column]))
            if value > best:
                best, mind.goal = value, (row, column)
        mind.decide_at = now + self.settings["decide_s"]
        if fresh and mind.goal is not None:
            dx = self.east[mind.goal[1]] - pose["east"]
            dy = self.north[mind.goal[0]] - pose["north"]
            flight = math.sqrt(dx * dx + dy * dy) / speed
            mind.give_up_at = now + 30.0 + self.settings["patience"] * flight

    def _worth(self, i: int, mind: Mind) -> Integers:
        """What each cell is worth by itself, in thousandths."""
        reach = self.settings["near_target"] * float(self.world.fleet[i]["sensor_range"])
        promising = self._nowhere()
        for contact in self.world.contacts_of(i):
            promising |= self._near(float(contact["east"]), float(contact["north"]), reach)
        empty = np.pad((mind.visited & ~promising & ~mind.barred).astype(int), 2)
        count = np.zeros(promising.shape)
        for row in range(5):
            for column in range(5):
                count += empty[row : row + promising.shape[0], column : column + promising.shape[1]]
        share = np.minimum(1.0, count / (25.0 * self.settings["empty_share"]))
        value = 1000.0 * (1.0 - self.settings["emptiness"] * share)
        value = np.where(self.own[i], value, self.settings["foreign"] * value)
        value = np.where(promising, 1000.0 * self.settings["promising"], value)
        return np.where(mind.visited | mind.barred, 0, np.rint(value)).astype(np.int64)

    def _value(self, i: int, mind: Mind, now: float, heading: Floats, cell: Cell, total: int) -> float:
        """What a cell is worth a second."""
        pose = self.world.poses[i]
        east, north = float(self.east[cell[1]]), float(self.north[cell[0]])
        dx, dy = east - float(pose["east"]), north - float(pose["north"])
        distance = math.sqrt(dx * dx + dy * dy)
        ahead, aside = heading[0] * dx + heading[1] * dy, heading[0] * dy - heading[1] * dx
        turn = abs(math.atan2(aside, ahead))
        takes = distance / float(self.world.fleet[i]["speed"]) + self.settings["arrival_s"]
        value = total / (takes + self.settings["turn_s"] * turn)
        for _, (at, other_east, other_north) in mind.met.values():
            x, y = other_east - east, other_north - north
            if at >= now - self.settings["seen_s"] and x * x + y * y < distance * distance:
                return value * self.settings["nearer"]
        return value


class Watched:
    """A world whose decisions are compared with plain ones as they are made; ``parted`` tells where they differ."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.shadow: Shadow | None = None
        self.compared = 0
        self.goals: set[Cell] = set()
        self.parted: list[str] = []

    def share(self, tick: int) -> None:
        """Before the world's own ``share``: beacons say what was known after the last decision."""
        if self.shadow is None:
            self.shadow = Shadow(self.world)
        self.shadow.tell(tick)

    def decided(self, tick: int, headings: Floats) -> None:
        """After the world's own ``decide``; ``headings`` are those from before."""
        assert self.shadow is not None
        wanted = self.shadow.decide(tick, headings)
        for i, goal in enumerate(wanted):
            row, column = (int(self.world.memory[i][name]) for name in ("goal_row", "goal_column"))
            leg = bool(self.world.memory[i]["mode"] == belief.FIRST_LEG)
            made = (row, column) if row >= 0 else None
            if made != goal or leg != self.shadow.minds[i].first_leg:
                self.parted.append(f"tick {tick}, vehicle {i}: {made}, plainly {goal}")
            self.compared += 1
            self.goals |= {goal} if goal else set()
