"""What vehicles learn and tell, against a model of ten lines in plain Python."""

from dataclasses import dataclass, field

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.core.world import World

from .worlds import fences, fleet_of, rules_of, world_of

FLEET, TARGETS = 3, 12
SERIALS = st.lists(st.integers(0, TARGETS - 1), unique=True, max_size=6)
HEARD = st.lists(st.integers(0, FLEET - 1), unique=True, max_size=FLEET)
PERIODS = st.lists(st.tuples(*[SERIALS] * FLEET, *[HEARD] * FLEET), min_size=1, max_size=12)


@dataclass
class Model:
    """One vehicle: an ordered list without doubles, and the window of it that its next beacon carries."""

    known: list[int] = field(default_factory=list)
    before: int = 0
    seen: int = 0
    cursor: int = 0

    def learn(self, serials: list[int]) -> None:
        self.known += [s for s in serials if s not in self.known]

    def see(self, serials: list[int]) -> None:
        self.before = len(self.known)
        self.learn(serials)
        self.seen = len(self.known) - self.before

    def beacon(self, limit: int) -> list[int]:
        if limit < 0 or len(self.known) <= limit:
            return list(self.known)
        first = self.cursor if self.cursor < len(self.known) else 0
        self.cursor = min(first + limit, len(self.known))
        return self.known[first : self.cursor]


def world(limit: int, delay: int) -> World:
    """Three vehicles that see and hear what a test says."""
    rules = rules_of(radio_delay=delay)
    fleet = fleet_of([(0.0, 0.0)] * FLEET, beacon_contacts=limit)
    return world_of(
        "fco", fleet, rules, fences((-1e6, 1e6, -1e6, 1e6)), [(float(t), 0.0) for t in range(TARGETS)]
    )


def let_see(w: World, i: int, serials: list[int]) -> None:
    """Put sensor reports in place of the sensor's; a target's east is its serial number, its north the reporter's."""
    w.report_count[i] = len(serials)
    for row, serial in enumerate(serials):
        w.reports[i, row] = (serial, serial, 100.0 * i)


def let_hear(w: World, slot: int, i: int, senders: list[int]) -> None:
    """Put a delivery in place of the radio's."""
    others = [j for j in senders if j != i]
    w.heard_count[slot, i] = len(others)
    w.heard[slot, i, : len(others)] = others


@settings(max_examples=150, deadline=None)
@given(PERIODS, st.sampled_from([-1, 0, 1, 3, 100]), st.integers(0, 3))
def test_learns_exactly_what_was_seen_and_told(
    periods: list[tuple[list[int], ...]], limit: int, delay: int
) -> None:
    learns_as_the_models_do(world(limit, delay), periods, limit, delay)


@settings(max_examples=100, deadline=None)
@given(PERIODS, st.integers(0, 3))
def test_what_was_heard_may_be_forgotten_and_is_heard_anew(
    periods: list[tuple[list[int], ...]], delay: int
) -> None:
    w = world(-1, delay)
    w.told = np.zeros((FLEET, 2), np.int64)  # the third vehicle pushes the first out, and the other way round
    learns_as_the_models_do(w, periods, -1, delay)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.lists(st.integers(0, 40), unique=True, max_size=9), max_size=30))
def test_a_full_memory_forgets_the_oldest(periods: list[list[int]]) -> None:
    w = world(-1, 0)
    w.contacts, w.has = np.zeros((FLEET, 4), w.contacts.dtype), np.zeros((FLEET, 8), np.int64)
    w.reports = np.zeros((FLEET, 10), w.reports.dtype)
    learned: list[int] = []
    for tick, serials in enumerate(periods):
        let_see(w, 0, serials)
        w.share(tick)
        for serial in serials:
            if serial not in learned[-4:]:
                learned.append(serial)
        assert w.knowledge["known"][0] == len(learned)
        assert sorted(w.contacts_of(0)["id"]) == sorted(learned[-4:])
        assert sorted(w.has[0][w.has[0] > 0] - 1) == sorted(learned[-4:])


def test_a_full_memory_takes_in_no_more_of_what_others_tell() -> None:
    w = world(-1, 0)
    w.contacts, w.has = np.zeros((FLEET, 4), w.contacts.dtype), np.zeros((FLEET, 8), np.int64)
    for tick, (own, others) in enumerate((([0, 1], [2, 3, 4]), ([], []), ([5], [6, 7]))):
        let_see(w, 0, own)
        let_see(w, 1, others)
        w.share(tick)
        let_hear(w, 0, 0, [1])
        w.decide(tick)
        assert sorted(w.contacts_of(0)["id"]) == ([0, 1, 2, 3], [0, 1, 2, 3], [1, 2, 3, 5])[tick]


def test_what_a_sender_has_forgotten_is_not_told() -> None:
    w = world(-1, 0)
    w.contacts, w.has = np.zeros((FLEET, 4), w.contacts.dtype), np.zeros((FLEET, 8), np.int64)
    for tick, serials in enumerate(([0, 1, 2], [3, 4])):
        let_see(w, 1, serials)
        w.share(tick)
        let_hear(w, 0, 0, [1] if tick else [])
        w.decide(tick)
    assert sorted(w.contacts_of(0)["id"]) == [1, 2, 3, 4]


def learns_as_the_models_do(w: World, periods: list[tuple[list[int], ...]], limit: int, delay: int) -> None:
    """Let the world and the models live through the same periods."""
    models = [Model() for _ in range(FLEET)]
    air: list[
        tuple[list[list[int]], list[list[int]]]
    ] = []  # what was sent, and who hears it, period by period
    for tick, (seen, heard) in enumerate((p[:FLEET], p[FLEET:]) for p in periods):
        for i in range(FLEET):
            let_see(w, i, seen[i])
            models[i].see(seen[i])
        w.share(tick)
        air.append(([m.beacon(limit) for m in models], list(heard)))
        for i in range(FLEET):
            let_hear(w, tick % w.depth, i, heard[i])
        w.decide(tick)
        if tick >= delay:
            sent, hearers = air[tick - delay]
            for i in range(FLEET):
                for j in hearers[i]:
                    if j != i:
                        models[i].learn(sent[j])
        check(w, models, seen)


def check(w: World, models: list[Model], seen: tuple[list[int], ...]) -> None:
    """The arrays say what the models say, in the same order."""
    for i, model in enumerate(models):
        knows = w.knowledge[i]
        row = w.contacts[i][: knows["known"]]
        assert row["id"].tolist() == model.known
        assert row["east"].tolist() == model.known  # positions travel with their numbers
        assert (knows["before"], knows["seen"], knows["in_range"]) == (
            model.before, model.seen, len(seen[i]),
        )  # fmt: skip
        assert sorted(w.has[i][w.has[i] > 0] - 1) == sorted(model.known)


def test_a_position_once_known_is_kept() -> None:
    w = world(-1, 0)
    let_see(w, 0, [4])
    let_see(w, 1, [4])
    w.share(0)
    let_hear(w, 0, 0, [1])
    w.decide(0)
    let_see(w, 0, [4])
    w.share(1)
    assert w.contacts[0][0]["north"] == 0.0
    assert w.knowledge[0]["known"] == 1


def test_a_beacon_says_where_its_sender_is_and_what_it_sees() -> None:
    w = world(-1, 0)
    w.poses[1] = (11.0, 22.0, 33.0, 4.0, 5.0, 6.0)
    let_see(w, 1, [2, 3])
    w.share(0)
    beacon = w.beacons[0, 1]
    assert (beacon["east"], beacon["north"], beacon["v_east"], beacon["v_north"]) == (11.0, 22.0, 4.0, 5.0)
    assert (beacon["in_range"], beacon["first"], beacon["last"]) == (2, 0, 2)


def test_a_window_brings_the_whole_list_in_the_end_though_beacons_are_lost() -> None:
    w = world(2, 0)
    let_see(w, 1, list(range(TARGETS)))
    for tick in range(40):
        w.share(tick)
        let_hear(w, 0, 0, [1] if tick % 5 in (0, 3) else [])  # most of the beacons are lost
        w.decide(tick)
        assert w.beacons[0, 1]["last"] - w.beacons[0, 1]["first"] <= 2
    assert sorted(w.contacts_of(0)["id"].tolist()) == list(range(TARGETS))
    assert w.knowledge[0]["known"] == TARGETS
