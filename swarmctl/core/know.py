"""Know: what one vehicle has seen and been told, and what it tells others.

A vehicle's contacts are a list in the order it learned of them, so "new since the last period" is the tail of the
list, and what a neighbour has already been told is a prefix of it.  A beacon carries the list up to its length when
sent (or a window of it, where the radio's bandwidth allows no more).

Memory has an end.  ``contacts`` is a ring of a power of two.  Once it is full, what others tell is not taken in any
more (two who know different things would for ever make one another forget them), and for what a vehicle sees itself
it forgets the oldest.  ``has`` is the same as a set, open-addressed by serial number, and ``told`` a table of how much
of whose list was heard, by number of vehicle: one that is pushed out of it is merely listened to anew.  So what
vehicles know takes no room that grows with vehicles × targets; up to 20 vehicles forget nothing of 100,000 targets.
"""

from .arrays import Integers, Records
from .jit import kernel

MOST_CONTACTS = 1 << 21  # what all vehicles together remember, in equal shares
LEAST_CONTACTS = 1024  # what a vehicle remembers, however many there are
MOST_PEERS = 64  # of whose lists it remembers how much it heard
_OWNER = 1 << 40  # told: (number of vehicle + 1) * _OWNER + how much of its list was heard


@kernel
def _slot(has: Integers, i: int, serial: int) -> int:
    """Where ``serial`` is in vehicle ``i``'s set, or the free place where it would go."""
    mask = has.shape[1] - 1
    slot = serial & mask
    while has[i, slot] != 0 and has[i, slot] != serial + 1:
        slot = (slot + 1) & mask
    return int(slot)


@kernel
def _known(has: Integers, i: int, serial: int) -> bool:
    """Whether ``serial`` is in the set, by its own place in it; one that had to move on may be denied."""
    return bool(has[i, serial & (has.shape[1] - 1)] == serial + 1)


@kernel
def _forget(has: Integers, i: int, serial: int) -> None:
    """Take ``serial`` out of the set; those behind it that it had pushed on move up (Knuth, 6.4 R)."""
    mask = has.shape[1] - 1
    hole = _slot(has, i, serial)
    slot = hole
    while True:
        slot = (slot + 1) & mask
        if has[i, slot] == 0:
            break
        home = (has[i, slot] - 1) & mask
        if (slot - home) & mask >= (slot - hole) & mask:
            has[i, hole] = has[i, slot]
            hole = slot
    has[i, hole] = 0


@kernel
def _learn(
    knowledge: Records, i: int, contacts: Records, has: Integers, serial: int, east: float, north: float
) -> None:
    slot = _slot(has, i, serial)
    if has[i, slot] != 0:
        return
    k = knowledge[i].known
    row = k & (contacts.shape[1] - 1)
    if k >= contacts.shape[1]:
        _forget(has, i, contacts[i, row].id)
        slot = _slot(has, i, serial)
    has[i, slot] = serial + 1
    contacts[i, row].id = serial
    contacts[i, row].east = east
    contacts[i, row].north = north
    knowledge[i].known = k + 1


@kernel
def learn_seen(
    knowledge: Records, i: int, contacts: Records, has: Integers, reports: Records, count: int
) -> None:
    """Take in what vehicle ``i``'s own sensor reported this period."""
    knowledge[i].before = knowledge[i].known
    knowledge[i].in_range = count
    for r in range(count):
        serial = reports[i, r].id
        if not _known(has, i, serial):
            _learn(knowledge, i, contacts, has, serial, reports[i, r].east, reports[i, r].north)
    knowledge[i].seen = knowledge[i].known - knowledge[i].before


@kernel
def announce(
    beacons: Records, slot: int, i: int, fleet: Records, poses: Records, knowledge: Records, lists: bool
) -> None:
    """Fill the part of vehicle ``i``'s beacon that no planner decides: where it is and which contacts it sends.

    A vehicle's ``beacon_contacts`` fit its beacon (negative: all); where the list is longer, a window of it
    moves on from beacon to beacon.  Without ``lists`` it sends none: no planner of this kind has a use for them.
    """
    beacons[slot, i].east = poses[i].east
    beacons[slot, i].north = poses[i].north
    beacons[slot, i].v_east = poses[i].v_east
    beacons[slot, i].v_north = poses[i].v_north
    beacons[slot, i].in_range = knowledge[i].in_range
    limit = fleet[i].beacon_contacts
    known = knowledge[i].known if lists else 0
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
    knowledge: Records, i: int, contacts: Records, has: Integers, beacons: Records, heard: Integers, count: int,
    slot: int, told: Integers,
) -> None:  # fmt: skip
    """Take in the contacts of every beacon vehicle ``i`` heard, but for what it was told before (``told``)."""
    for k in range(count):
        j = heard[slot, i, k]
        first = beacons[slot, j].first
        last = beacons[slot, j].last
        peer = j & (told.shape[1] - 1)
        owner = (j + 1) * _OWNER
        heard_before = told[i, peer] - owner if owner <= told[i, peer] < owner + _OWNER else 0
        if first <= heard_before:
            first = min(heard_before, last)
            told[i, peer] = owner + max(heard_before, last)
        first = max(
            first, knowledge[j].known - contacts.shape[1]
        )  # what the sender itself has forgotten since
        for c in range(first, last):
            if knowledge[i].known >= contacts.shape[1]:
                break
            row = c & (contacts.shape[1] - 1)
            _learn(
                knowledge,
                i,
                contacts,
                has,
                contacts[j, row].id,
                contacts[j, row].east,
                contacts[j, row].north,
            )


@kernel
def first_new(knowledge: Records, i: int, contacts: Records) -> int:
    """The first of this period's new contacts, as a number in the list: contact k is in row k & (C - 1)."""
    return int(max(knowledge[i].before, knowledge[i].known - contacts.shape[1]))


@kernel
def index(knowledge: Records, i: int, contacts: Records, has: Integers) -> None:
    """Make vehicle ``i``'s set anew from its list."""
    for slot in range(has.shape[1]):
        has[i, slot] = 0
    for row in range(min(knowledge[i].known, contacts.shape[1])):
        serial = contacts[i, row].id
        has[i, _slot(has, i, serial)] = serial + 1
