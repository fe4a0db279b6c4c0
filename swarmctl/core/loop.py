"""The loop: sense → know ⇄ radio → plan, once a planner period, for every vehicle.

Written once, bound to each planner by core/bind.py, which supplies the free names ``start``, ``tell``, ``plan`` and
``LISTS`` (whether beacons carry contacts).  A flight calls the four stages one by one, so that its recorder sees
what passes between them and a replay can put recorded reports and deliveries in their place; a study calls
``period`` and ``run_ideal``, or ``run_multicopter``.
Arrays have one row a vehicle:

    fleet VEHICLE, poses POSE, knowledge KNOWLEDGE, memory the planner's MEMORY, wishes WISH
    contacts (V, C) CONTACT          what each vehicle knows, in the order it learned it: a ring (core/know.py)
    has (V, H), told (V, P)          the same as a set; how much of whose list was heard
    reports (V, R) CONTACT, report_count (V,)             this period's sensor reports
    beacons (D, V) BEACON, heard (D, V, K), heard_count (D, V)    a ring of D periods' beacons and hearers
"""

import math
from typing import TYPE_CHECKING

from . import homing, know, radio, sense, stages, steering, wire
from .arrays import Floats, Integers, Records
from .jit import kernel

if TYPE_CHECKING:
    from .planners.bounce import start, tell
    from .planners.bounce import step as plan

    LISTS = True


def prepare(memory: Records, fleet: Records, rules: Records, edges: Floats) -> None:
    """Give every planner its initial heading and whatever it prepares at launch."""
    for i in range(fleet.shape[0]):
        memory[i].heading_east = fleet[i].heading_east
        memory[i].heading_north = fleet[i].heading_north
        memory[i].throttle = 1.0
        start(memory, i, fleet, rules, edges)


def observe(
    fleet: Records, poses: Records, targets: Records, grid: Records, starts: Integers, alarms: Integers,
    rules: Records, tick: int, reports: Records, report_count: Integers, found: Integers,
) -> None:  # fmt: skip
    """Sense: the emulated sensors' reports at ``tick``."""
    for i in range(fleet.shape[0]):
        report_count[i] = sense.sense(
            fleet, i, poses, targets, grid, starts, alarms, rules, tick, reports, found
        )


def inform(
    memory: Records, i: int, fleet: Records, poses: Records, knowledge: Records, contacts: Records,
    has: Integers, reports: Records, count: int, beacons: Records, slot: int,
) -> None:  # fmt: skip
    """Know, first half, of one vehicle: learn the ``count`` reports of the own sensor, and make the beacon."""
    know.learn_seen(knowledge, i, contacts, has, reports, count)
    know.announce(beacons, slot, i, fleet, poses, knowledge, LISTS)
    tell(memory, i, beacons, slot)


def share(
    memory: Records, fleet: Records, poses: Records, knowledge: Records, contacts: Records, has: Integers,
    reports: Records, report_count: Integers, beacons: Records, slot: int,
) -> None:  # fmt: skip
    """Know, first half: learn what the own sensor reported, and make the beacon."""
    for i in range(poses.shape[0]):
        inform(memory, i, fleet, poses, knowledge, contacts, has, reports, report_count[i], beacons, slot)


def deliver(
    fleet: Records, poses: Records, rules: Records, tick: int, slot: int, heard: Integers,
    heard_count: Integers,
) -> float:  # fmt: skip
    """Radio: who will hear the beacons sent at ``tick``; the squared distance (m²) of the nearest two vehicles."""
    return radio.deliver(fleet, poses, rules, tick, slot, heard, heard_count)


def decide(
    memory: Records, fleet: Records, poses: Records, knowledge: Records, contacts: Records, has: Integers,
    told: Integers, beacons: Records, heard: Integers, heard_count: Integers, slot: int, edges: Floats,
    rules: Records, settings: Records, tick: int, wishes: Records,
) -> None:  # fmt: skip
    """Know, second half, and plan: learn what was heard, then let each planner turn its heading.

    ``slot`` is that of the beacons which arrive now, sent ``rules.radio_delay`` periods ago.
    """
    for i in range(poses.shape[0]):
        if LISTS:
            know.learn_told(knowledge, i, contacts, has, beacons, heard, heard_count[slot, i], slot, told)
        plan(
            memory, i, fleet, poses, knowledge, contacts, beacons, heard, heard_count, slot, edges, rules,
            settings, tick,
        )  # fmt: skip
        speed = fleet[i].speed * memory[i].throttle
        wishes[i].v_east = speed * memory[i].heading_east
        wishes[i].v_north = speed * memory[i].heading_north


def period(
    memory: Records, fleet: Records, poses: Records, knowledge: Records, contacts: Records, has: Integers,
    told: Integers, targets: Records, grid: Records, starts: Integers, alarms: Integers, reports: Records,
    report_count: Integers, found: Integers, beacons: Records, heard: Integers, heard_count: Integers,
    edges: Floats, rules: Records, settings: Records, tick: int, wishes: Records,
) -> float:  # fmt: skip
    """All four stages of one period; returns what ``deliver`` does.

    Each vehicle senses and informs at one go, while its memory is at hand; none sees what another did meanwhile.
    """
    depth = beacons.shape[0]
    slot = tick % depth
    arriving = (tick + depth - rules[0].radio_delay) % depth
    for i in range(poses.shape[0]):
        report_count[i] = sense.sense(
            fleet, i, poses, targets, grid, starts, alarms, rules, tick, reports, found
        )
        inform(memory, i, fleet, poses, knowledge, contacts, has, reports, report_count[i], beacons, slot)
    nearest = deliver(fleet, poses, rules, tick, slot, heard, heard_count)
    decide(
        memory, fleet, poses, knowledge, contacts, has, told, beacons, heard, heard_count, arriving, edges,
        rules, settings, tick, wishes,
    )  # fmt: skip
    return nearest


@kernel
def count_in_range(knowledge: Records, tick: int, in_range: Integers) -> None:
    """Into row ``tick``: targets in range, summed over all vehicles, and how many vehicles have any."""
    for i in range(knowledge.shape[0]):
        in_range[tick, 0] += knowledge[i].in_range
        in_range[tick, 1] += 1 if knowledge[i].in_range > 0 else 0


def run_ideal(
    memory: Records, fleet: Records, poses: Records, knowledge: Records, contacts: Records, has: Integers,
    told: Integers, targets: Records, grid: Records, starts: Integers, alarms: Integers, reports: Records,
    report_count: Integers, found: Integers, beacons: Records, heard: Integers, heard_count: Integers,
    edges: Floats, rules: Records, settings: Records, wishes: Records, in_range: Integers,
) -> float:  # fmt: skip
    """A whole search in ideal dynamics, x += v dt (eq. 2); ``in_range`` as count_in_range fills it.

    Returns how near (m) two vehicles came.
    """
    prepare(memory, fleet, rules, edges)
    nearest = math.inf
    for tick in range(in_range.shape[0]):
        squared = period(
            memory, fleet, poses, knowledge, contacts, has, told, targets, grid, starts, alarms, reports,
            report_count, found, beacons, heard, heard_count, edges, rules, settings, tick, wishes,
        )  # fmt: skip
        nearest = min(nearest, squared)
        count_in_range(knowledge, tick, in_range)
        for i in range(poses.shape[0]):
            poses[i].v_east = wishes[i].v_east
            poses[i].v_north = wishes[i].v_north
            poses[i].east += wishes[i].v_east * rules[0].period
            poses[i].north += wishes[i].v_north * rules[0].period
    return math.sqrt(nearest)


def search(
    memory: Records, fleet: Records, truth: Records, poses: Records, knowledge: Records, contacts: Records,
    has: Integers, told: Integers, targets: Records, grid: Records, starts: Integers, alarms: Integers,
    reports: Records, report_count: Integers, found: Integers, beacons: Records, heard: Integers,
    heard_count: Integers, edges: Floats, guard_edges: Floats, raw_edges: Floats, rules: Records,
    settings: Records, wishes: Records, errands: Records, paths: Records, wants: Records, sent: Floats,
    setpoints: Records, orders: Integers, in_range: Integers, account: Floats, begun: int, first: int, end: int,
) -> int:  # fmt: skip
    """Setpoint ticks ``first`` to ``end`` - 1 of a search that began at tick ``begun``, and of the return after it.

    Returns the tick at which everybody had landed, or ``end``.
    """
    per_period = round(rules[0].period / rules[0].interval)
    for k in range(first, end):
        ahead, now = k - begun, k * rules[0].interval
        if ahead % per_period == 0 and ahead // per_period < in_range.shape[0]:
            tick = ahead // per_period
            period(
                memory, fleet, poses, knowledge, contacts, has, told, targets, grid, starts, alarms, reports,
                report_count, found, beacons, heard, heard_count, edges, rules, settings, tick, wishes,
            )  # fmt: skip
            count_in_range(knowledge, tick, in_range)
        if ahead == in_range.shape[0] * per_period:
            orders[:] = 1
            homing.order_home(fleet, poses, errands, orders, now, rules, edges, guard_edges)
        steering.go_on(
            fleet, truth, poses, errands, wishes, now, rules, edges, guard_edges, raw_edges, paths, wants, sent,
            setpoints, account,
        )  # fmt: skip
        if steering.all_landed(errands):
            return k
    return end


def run_multicopter(
    memory: Records, fleet: Records, truth: Records, poses: Records, knowledge: Records, contacts: Records,
    has: Integers, told: Integers, targets: Records, grid: Records, starts: Integers, alarms: Integers,
    reports: Records, report_count: Integers, found: Integers, beacons: Records, heard: Integers,
    heard_count: Integers, edges: Floats, guard_edges: Floats, raw_edges: Floats, rules: Records,
    settings: Records, wishes: Records, errands: Records, paths: Records, wants: Records, sent: Floats,
    setpoints: Records, orders: Integers, in_range: Integers, account: Floats, most_ticks: int,
) -> int:  # fmt: skip
    """A whole mission as a multicopter flies it, from take-off to landing, guarded at every setpoint tick.

    Stages read ``poses``, which messages may have rounded; ``truth`` moves.  Returns the number of setpoint ticks;
    ``most_ticks`` means that not everybody landed.
    """
    prepare(memory, fleet, rules, edges)
    wire.observe(truth, poses, rules)
    for i in range(errands.shape[0]):
        errands[i].stage = stages.TAKE_OFF
    for k in range(most_ticks):
        if steering.release(errands):
            return search(
                memory, fleet, truth, poses, knowledge, contacts, has, told, targets, grid, starts, alarms,
                reports, report_count, found, beacons, heard, heard_count, edges, guard_edges, raw_edges, rules,
                settings, wishes, errands, paths, wants, sent, setpoints, orders, in_range, account, k, k,
                most_ticks,
            )  # fmt: skip
        steering.go_on(
            fleet, truth, poses, errands, wishes, k * rules[0].interval, rules, edges, guard_edges, raw_edges,
            paths, wants, sent, setpoints, account,
        )  # fmt: skip
    return most_ticks
