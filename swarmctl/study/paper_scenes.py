"""Which searches the search figures show: the first seed on which what a figure is about happens.

Two searches of one seed, with and without radio, are the same to the last bit until radio changes somebody's mind,
since every random number depends on seed, vehicle and tick alone.  So the moment at which their tracks part is the
moment at which radio turned a vehicle.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from swarmctl.core.arrays import Floats, Integers
from swarmctl.core.planners import ace as ace_planner
from swarmctl.core.world import World

from .paper_paths import Search, fly_search, heard
from .paper_variants import EXTREME, MANY_VEHICLES, Variant, ace, duration_s, extreme, fco, many, mdc, silent

SEARCHED = 200
"""Seeds that are tried; where it happens on none of them, the first is shown and the caption says so."""

SHOWN_S, SHORT_S = 600.0, 450.0
DRAWN_S = 5
"""A vehicle counts as drawn to another's best place after so long."""

MOWING = (ace_planner.LANE, ace_planner.SHIFT)

TURN_DEG = 60.0
TURN_S = 4
"""A vehicle turns because of radio if so long after its tracks part they lead so far apart."""

AFTERWARDS_S = 60
"""Fig. 19 goes on for so long after what it shows."""

LEAST_MOWED = 5
"""Targets that a vehicle has found before Fig. 21 shows how it gives way."""

APART_S = 60
"""Before this everybody is still close to the launch."""


@dataclass(frozen=True)
class Moment:
    """Something that happens between two vehicles, numbered from 0, at a tick."""

    tick: int
    vehicle: int
    other: int


@dataclass(frozen=True)
class Scene:
    """A search for a figure, what happens in it, and the words below it; ``silent`` is the same without radio."""

    search: Search
    caption: str
    moments: tuple[Moment, ...] = ()
    silent: Search | None = None


def _seeds(first: int) -> Iterator[int]:
    return iter(range(first, first + SEARCHED))


def _words(seed: int, seconds: float, what: str, why: str) -> str:
    return f"{what} Seed {seed}, {why}; {seconds:g} s."


NONE_OF_THEM = f"the first: what this figure is about happened on none of {SEARCHED}"


class Drawn:
    """Watches MDC: for each vehicle, the moments at which another's best place draws it."""

    def __init__(self) -> None:
        self.moments: dict[int, list[Moment]] = {}

    def __call__(self, world: World, tick: int) -> None:
        """Note who on a visit hears of a better place than its own (mdc._neighbours_best)."""
        slot = world.arriving(tick)
        for i, own in enumerate(world.memory):
            if own["best"] == 0 or own["leaving"] != 0:
                continue
            beacons = {j: world.beacons[slot, j] for j in heard(world, tick, i)}
            on_targets = [j for j, beacon in beacons.items() if beacon["in_range"] > 0]
            best = max(on_targets, key=lambda j: int(beacons[j]["best"]), default=None)
            if best is not None and beacons[best]["best"] > own["best"]:
                self.moments.setdefault(i, []).append(Moment(tick, i, best))

    def lasting(self) -> tuple[Moment, ...]:
        """The first moment of every vehicle that is drawn long enough."""
        first = [moments[0] for moments in self.moments.values() if len(moments) >= DRAWN_S]
        return tuple(sorted((m for m in first if m.tick >= APART_S), key=lambda m: m.tick))


def mdc_scenes(first: int) -> tuple[Scene, Scene]:
    """Figs. 12 and 13: MDC without and with radio, where radio draws at least two vehicles to others' best places."""
    for seed in _seeds(first):
        drawn = Drawn()
        search = fly_search(mdc(), seed, SHOWN_S, drawn)
        if len(drawn.lasting()) >= 2:
            why = "the first on which radio draws at least two vehicles to others' best places"
            return _mdc_pair(search, drawn.lasting(), why)
    return _mdc_pair(fly_search(mdc(), first, SHOWN_S), (), NONE_OF_THEM)


def _mdc_pair(search: Search, moments: tuple[Moment, ...], why: str) -> tuple[Scene, Scene]:
    alone = fly_search(silent(search.flown), search.seed, SHOWN_S)
    said = "; ".join(
        f"vehicle {m.vehicle + 1} is drawn to the best place of vehicle {m.other + 1} from {m.tick} s on"
        for m in moments
    )
    with_radio = f"MDC with radio: {said or 'nobody is drawn anywhere'}."
    return (
        Scene(alone, _words(search.seed, SHOWN_S, "MDC without radio.", "that of Fig. 13")),
        Scene(search, _words(search.seed, SHOWN_S, with_radio, why), moments),
    )


class Heard:
    """Watches whom each vehicle hears, tick by tick."""

    def __init__(self) -> None:
        self.by_tick: list[list[list[int]]] = []

    def __call__(self, world: World, tick: int) -> None:
        """Note it."""
        self.by_tick.append([heard(world, tick, i) for i in range(len(world.fleet))])


def fco_scenes(first: int) -> tuple[Scene, Scene]:
    """Figs. 17 and 18: FCO without and with radio, where a vehicle turns because it hears another."""
    for seed in _seeds(first):
        told = Heard()
        search = fly_search(fco(), seed, SHORT_S, told)
        alone = fly_search(silent(fco()), seed, SHORT_S)
        moment = turned(search.places, alone.places, told.by_tick)
        if moment is not None:
            why = f"the first on which radio turns a vehicle by more than {TURN_DEG:g}° off its way"
            return _fco_pair(search, alone, (moment,), why)
    alone = fly_search(silent(fco()), first, SHORT_S)
    return _fco_pair(fly_search(fco(), first, SHORT_S), alone, (), NONE_OF_THEM)


def turned(spoken: Floats, alone: Floats, told: list[list[list[int]]]) -> Moment | None:
    """The first turn that is due to radio: where a vehicle's two tracks (ticks + 1, V, 2) part and lead apart.

    ``told`` says, tick by tick, whom each vehicle hears: one that hears nobody then is not counted.
    """
    differ = (spoken != alone).any(axis=2)
    moments = []
    for i in np.flatnonzero(differ.any(axis=0)):
        tick = int(np.argmax(differ[:, i])) - 1
        if tick < APART_S or tick + TURN_S >= len(spoken) or not told[tick][i]:
            continue
        ways = [track[tick + TURN_S, i] - track[tick, i] for track in (spoken, alone)]
        if _angle_deg(*ways) >= TURN_DEG:
            other = min(told[tick][i], key=lambda j: float(np.hypot(*(spoken[tick, j] - spoken[tick, i]))))
            moments.append(Moment(tick, int(i), other))
    return min(moments, key=lambda m: m.tick, default=None)


def _angle_deg(a: Floats, b: Floats) -> float:
    """Between two ways."""
    turn = math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
    return abs(math.degrees(turn))


def _fco_pair(search: Search, alone: Search, moments: tuple[Moment, ...], why: str) -> tuple[Scene, Scene]:
    said = "; ".join(
        f"at {m.tick} s vehicle {m.vehicle + 1} hears vehicle {m.other + 1} and turns; dashed, its way without radio"
        for m in moments
    )
    with_radio = f"FCO with radio: {said or 'nobody turns'}."
    return (
        Scene(alone, _words(search.seed, SHORT_S, "FCO without radio.", "that of Fig. 18")),
        Scene(search, _words(search.seed, SHORT_S, with_radio, why), moments, alone),
    )


class Revisits:
    """Watches FCO: the ticks at which each vehicle begins a revisit."""

    def __init__(self, vehicles: int) -> None:
        self.begun: list[list[int]] = [[] for _ in range(vehicles)]
        self._under_way: Integers = np.zeros(vehicles, np.int64)

    def __call__(self, world: World, tick: int) -> None:
        """Note those that begin now."""
        now = world.memory["revisiting"]
        for i in np.flatnonzero((now != 0) & (self._under_way == 0)):
            self.begun[i].append(tick)
        self._under_way = now.copy()

    def second(self) -> tuple[int, int] | None:
        """The vehicle that is first to begin its second revisit, and when."""
        again = {i: ticks[1] for i, ticks in enumerate(self.begun) if len(ticks) > 1}
        first = min(again, key=lambda i: again[i], default=None)
        return None if first is None else (first, again[first])


def nine_scene(first: int) -> Scene:
    """Fig. 19: nine vehicles, until shortly after one begins its second revisit."""
    for seed in _seeds(first):
        revisits = Revisits(MANY_VEHICLES)
        fly_search(many(), seed, duration_s(), revisits)
        again = revisits.second()
        if again is not None:
            vehicle, tick = again
            said = (
                f"FCO with nine vehicles: vehicle {vehicle + 1} has nothing new for 200 s and flies back to its "
                f"last aim at {revisits.begun[vehicle][0]} s, and again at {tick} s."
            )
            seconds = min(tick + AFTERWARDS_S, duration_s())
            why = "the first on which a vehicle revisits twice"
            return Scene(fly_search(many(), seed, seconds), _words(seed, seconds, said, why))
    said = _words(first, SHOWN_S, "FCO with nine vehicles.", NONE_OF_THEM)
    return Scene(fly_search(many(), first, SHOWN_S), said)


class GivingWay:
    """Watches ACE: who mowed and leaves now, having heard of one that mows and has found more (ace._outdone)."""

    def __init__(self, vehicles: int) -> None:
        self.moments: list[tuple[Moment, int, int]] = []  #: with how many both have found
        self._modes: Integers = np.zeros(vehicles, np.int64)

    def __call__(self, world: World, tick: int) -> None:
        """Note them."""
        slot = world.arriving(tick)
        for i, own in enumerate(world.memory):
            if self._modes[i] in MOWING and own["mode"] == ace_planner.LEAVING and tick >= APART_S:
                beacons = {j: world.beacons[slot, j] for j in heard(world, tick, i)}
                found = {j: int(b["best"]) for j, b in beacons.items() if b["on_visit"] != 0}
                most = max(found, key=lambda j: found[j], default=None)
                shared = most is not None and _nearest_cluster(world, i) == _nearest_cluster(world, most)
                if most is not None and shared and found[most] > own["found_here"] >= LEAST_MOWED:
                    self.moments.append((Moment(tick, i, most), int(own["found_here"]), found[most]))
        self._modes = world.memory["mode"].copy()


def _nearest_cluster(world: World, vehicle: int) -> int:
    """The cluster of the target nearest to a vehicle."""
    targets, pose = world.scene.targets, world.poses[vehicle]
    apart = np.hypot(targets["east"] - pose["east"], targets["north"] - pose["north"])
    return int(targets["cluster"][np.argmin(apart)])


def ace_scene(first: int) -> Scene:
    """Fig. 21: ACE, where of two that mow one cluster the one that has found fewer leaves."""
    for seed in _seeds(first):
        giving_way = GivingWay(6)
        search = fly_search(ace(), seed, SHORT_S, giving_way)
        if giving_way.moments:
            moment, fewer, more = giving_way.moments[0]
            one, other = moment.vehicle + 1, moment.other + 1
            said = (
                f"ACE: at {moment.tick} s vehicles {one} and {other} mow one cluster and hear each other; "
                f"{one} has found {fewer} targets there, {other} has found {more}, so {one} leaves."
            )
            why = "the first on which that happens"
            return Scene(search, _words(seed, SHORT_S, said, why), (moment,))
    return Scene(fly_search(ace(), first, SHORT_S), _words(first, SHORT_S, "ACE.", NONE_OF_THEM))


def extreme_scenes(first: int, numbers: Mapping[Variant, Integers]) -> list[Scene]:
    """Fig. 16 with either weights: with or without jump-out, whichever gathers more, the seed on which most end at
    one cluster.

    ``numbers`` has, for each variant, how many did, from seed ``first`` on.
    """
    scenes = []
    for name, weights in EXTREME.items():
        jump_out = max((True, False), key=lambda on: float(numbers[extreme(weights, on)].mean()))
        flown = extreme(weights, jump_out)
        most = int(np.argmax(numbers[flown]))
        said = (
            f"MDC at {name}, jump-out {'on' if jump_out else 'off'}: "
            f"{int(numbers[flown][most])} of 6 vehicles end at one cluster."
        )
        why = f"the first of {len(numbers[flown])} on which most do"
        scenes.append(
            Scene(
                fly_search(flown, first + most, duration_s()), _words(first + most, duration_s(), said, why)
            )
        )
    return scenes
