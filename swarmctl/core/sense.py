"""Sense: what one vehicle's sensor reports at its pose.  It emulates a camera with its detector.

Every target within the sensor's radius is reported with the detection probability, its position with the
noise; now and then the sensor reports something that is not there.  A real detector feeds the same reports.
"""

import math

import numpy as np

from . import roam, scene
from .arrays import Integers, Records
from .jit import kernel
from .randoms import ALARM, DETECT, NOISE, normal, uniform


@kernel
def _report(reports: Records, count: int, i: int, serial: int, east: float, north: float) -> int:
    reports[i, count].id = serial
    reports[i, count].east = east
    reports[i, count].north = north
    return count + 1


@kernel
def _false_alarm(
    fleet: Records, i: int, poses: Records, alarms: Integers, rules: Records, tick: int, reports: Records,
    count: int,
) -> int:  # fmt: skip
    """Report something that is not there, somewhere within the sensor's radius."""
    seed = rules[0].seed
    if uniform(seed, i, tick, ALARM) >= fleet[i].alarms_per_second * rules[0].period:
        return count
    angle = scene.TURN * uniform(seed, i, tick, ALARM + 1)
    distance = fleet[i].sensor_range * math.sqrt(uniform(seed, i, tick, ALARM + 2))
    slots = rules[0].alarm_slots
    serial = rules[0].targets + i * slots + alarms[i] % slots
    alarms[i] += 1
    east = poses[i].east + distance * math.cos(angle)
    return _report(reports, count, i, serial, east, poses[i].north + distance * math.sin(angle))


@kernel
def _in_range(
    fleet: Records, i: int, poses: Records, targets: Records, grid: Records, starts: Integers, now: float,
    reports: Records,
) -> int:  # fmt: skip
    """Write every target within the sensor's radius into ``reports[i]``; returns how many.

    As many as there is room for, less one for a false alarm.
    """
    reach = fleet[i].sensor_range
    x, y = poses[i].east, poses[i].north
    look = reach + grid[0].stray
    here = scene.cell_of(grid, x, y)
    around = grid[0].block
    if look > around * grid[0].cell:
        around = int(look / grid[0].cell) + 1
    elif starts[here, 1] == 0:
        return 0  # empty ground, as mostly
    row, column = here // grid[0].columns, here % grid[0].columns
    west, east = max(column - around, 0), min(column + around, grid[0].columns - 1)
    moving = grid[0].stray > 0.0
    room = reports.shape[1] - 1
    count = 0
    for r in range(max(row - around, 0), min(row + around, grid[0].rows - 1) + 1):
        first, last = starts[r * grid[0].columns + west, 0], starts[r * grid[0].columns + east + 1, 0]
        # Unsigned, or every access would look whether the index counts from the end.
        for t in range(np.uint64(first), np.uint64(last)):
            tx, ty = targets[t].east, targets[t].north
            if moving:
                tx, ty = roam.place_at(grid, targets, t, now)
            if (tx - x) * (tx - x) + (ty - y) * (ty - y) <= reach * reach and count < room:
                count = _report(reports, count, i, t, tx, ty)
    return count


@kernel
def _overlook(fleet: Records, i: int, rules: Records, tick: int, reports: Records, count: int) -> int:
    """Take out of the reports what the detector misses; returns how many are left."""
    left = 0
    for c in range(count):
        t = reports[i, c].id
        if uniform(rules[0].seed, i, tick, DETECT + t) < fleet[i].detection_probability:
            left = _report(reports, left, i, t, reports[i, c].east, reports[i, c].north)
    return left


@kernel
def _misplace(fleet: Records, i: int, rules: Records, tick: int, reports: Records, count: int) -> None:
    """Add the position noise."""
    for c in range(count):
        t = reports[i, c].id
        reports[i, c].east += fleet[i].position_noise * normal(rules[0].seed, i, tick, NOISE + 2 * t)
        reports[i, c].north += fleet[i].position_noise * normal(rules[0].seed, i, tick, NOISE + 2 * t + 1)


@kernel
def sense(
    fleet: Records, i: int, poses: Records, targets: Records, grid: Records, starts: Integers,
    alarms: Integers, rules: Records, tick: int, reports: Records, found: Integers,
) -> int:  # fmt: skip
    """Write what vehicle ``i`` sees at ``tick`` into ``reports[i]`` and return how many they are.

    ``alarms`` (V,) counts its false alarms, which numbers them; ``found`` (T,) keeps the first tick at
    which any vehicle reported the target (-1: not yet).
    """
    now = tick * rules[0].period
    count = _in_range(fleet, i, poses, targets, grid, starts, now, reports)
    if fleet[i].detection_probability < 1.0:
        count = _overlook(fleet, i, rules, tick, reports, count)
    if fleet[i].position_noise > 0.0:
        _misplace(fleet, i, rules, tick, reports, count)
    for c in range(count):
        if found[reports[i, c].id] < 0:
            found[reports[i, c].id] = tick
    if fleet[i].alarms_per_second > 0.0:
        count = _false_alarm(fleet, i, poses, alarms, rules, tick, reports, count)
    return count
