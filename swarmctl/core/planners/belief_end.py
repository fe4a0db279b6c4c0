"""What vehicles that fly ``belief`` do when little is left to be found: hold at the densest spot they know.

It is MDC's own aim.  Each vehicle has a place of its own about the spot, by its number, so that they do not all want
the same point.
"""

import math

from .. import fence
from ..arrays import Floats, Records
from ..jit import kernel
from . import common

GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # the angle by which the places about a spot follow one another
ROOM = 1.5  # separations between neighbouring places
PLACES = 32


@kernel
def _count_about(contacts: Records, i: int, known: int, east: float, north: float, reach: float) -> int:
    """How many targets known to vehicle ``i`` lie within ``reach`` of a place."""
    count = 0
    for c in range(known):
        dx, dy = contacts[i, c].east - east, contacts[i, c].north - north
        if dx * dx + dy * dy <= reach * reach:
            count += 1
    return count


@kernel
def _centre_about(
    contacts: Records, i: int, known: int, east: float, north: float, reach: float
) -> tuple[float, float]:
    """The mean place of the known targets within ``reach`` of a place that has some."""
    count, sum_east, sum_north = 0, 0.0, 0.0
    for c in range(known):
        dx, dy = contacts[i, c].east - east, contacts[i, c].north - north
        if dx * dx + dy * dy <= reach * reach:
            count += 1
            sum_east += contacts[i, c].east
            sum_north += contacts[i, c].north
    return sum_east / count, sum_north / count


@kernel
def densest(contacts: Records, i: int, known: int, reach: float) -> tuple[float, float]:
    """The target with the most others within ``reach``, or the middle of those if there are more about that."""
    best, east, north = -1, 0.0, 0.0
    for c in range(known):
        count = _count_about(contacts, i, known, contacts[i, c].east, contacts[i, c].north, reach)
        if count > best:
            best, east, north = count, contacts[i, c].east, contacts[i, c].north
    middle_east, middle_north = _centre_about(contacts, i, known, east, north, reach)
    if _count_about(contacts, i, known, middle_east, middle_north, reach) > best:
        return middle_east, middle_north
    return east, north


@kernel
def own_place(i: int, separation: float, edges: Floats, east: float, north: float) -> tuple[float, float]:
    """Where vehicle ``i`` holds about a spot: on a spiral of places, or at the spot where that is not legal."""
    k = i % PLACES
    away = ROOM * separation * math.sqrt(k)
    x, y = east + away * math.cos(GOLDEN * k), north + away * math.sin(GOLDEN * k)
    return (x, y) if fence.inside(edges, x, y) else (east, north)


@kernel
def approach(
    memory: Records, i: int, fleet: Records, poses: Records, edges: Floats, rules: Records, east: float, north: float
) -> bool:  # fmt: skip
    """Fly to a place nearby and stand there; whether the way is short and free."""
    dx, dy = east - poses[i].east, north - poses[i].north
    distance = math.sqrt(dx * dx + dy * dy)
    if distance > 2.0 * common.look_ahead(fleet, i, rules):
        return False
    if not fence.legal(edges, poses[i].east, poses[i].north, east, north):
        return False
    common.turn_to(memory, i, dx, dy)
    braked = math.sqrt(fleet[i].braking * distance)  # half of what the vehicle could still stop from
    memory[i].throttle = min(1.0, braked / fleet[i].speed, distance / (rules[0].period * fleet[i].speed))
    return True
