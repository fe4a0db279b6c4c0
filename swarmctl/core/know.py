"""Know: what one vehicle has seen and been told, and what it tells others.

A vehicle's contacts are an append-only list in the order it learned of them, so "new since the last period"
is the tail of the list, and what a neighbour has already been told is a prefix of it.  A beacon carries the
list up to its length when sent (or a window of it, where the radio's bandwidth allows no more).
"""

from .arrays import Flags, Integers, Records
from .jit import kernel


@kernel
def _learn(
    knowledge: Records, i: int, contacts: Records, has: Flags, serial: int, east: float, north: float
) -> None:
    if has[i, serial] != 0:
        return
    has[i, serial] = 1
    k = knowledge[i].known
    contacts[i, k].id = serial
    contacts[i, k].east = east
    contacts[i, k].north = north
    knowledge[i].known = k + 1


@kernel
def learn_seen(
    knowledge: Records, i: int, contacts: Records, has: Flags, reports: Records, count: int
) -> None:
    """Take in what vehicle ``i``'s own sensor reported this period."""
    knowledge[i].before = knowledge[i].known
    knowledge[i].in_range = count
    for r in range(count):
        _learn(knowledge, i, contacts, has, reports[i, r].id, reports[i, r].east, reports[i, r].north)
    knowledge[i].seen = knowledge[i].known - knowledge[i].before


@kernel
def announce(beacons: Records, slot: int, i: int, fleet: Records, poses: Records, knowledge: Records) -> None:
    """Fill the part of vehicle ``i``'s beacon that no planner decides: where it is and which contacts it sends.

    A vehicle's ``beacon_contacts`` fit its beacon (negative: all); where the list is longer, a window of it
    moves on from beacon to beacon.
    """
    limit = fleet[i].beacon_contacts
    beacons[slot, i].east = poses[i].east
    beacons[slot, i].north = poses[i].north
    beacons[slot, i].v_east = poses[i].v_east
    beacons[slot, i].v_north = poses[i].v_north
    beacons[slot, i].in_range = knowledge[i].in_range
    known = knowledge[i].known
    first = 0
    last = known
    if limit >= 0 and known > limit:
        first = knowledge[i].cursor if knowledge[i].cursor < known else 0
        last = min(first + limit, known)
        knowledge[i].cursor = last
    beacons[slot, i].first = first
    beacons[slot, i].last = last


@kernel
def learn_told(
    knowledge: Records, i: int, contacts: Records, has: Flags, beacons: Records, heard: Integers, count: int,
    slot: int, told: Integers,
) -> None:  # fmt: skip
    """Take in the contacts of every beacon vehicle ``i`` heard; ``told[i, j]`` of j's list it has already."""
    for k in range(count):
        j = heard[slot, i, k]
        first = beacons[slot, j].first
        last = beacons[slot, j].last
        if first <= told[i, j]:
            first = min(told[i, j], last)
            told[i, j] = max(told[i, j], last)
        for c in range(first, last):
            _learn(knowledge, i, contacts, has, contacts[j, c].id, contacts[j, c].east, contacts[j, c].north)
