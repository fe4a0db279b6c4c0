"""Sense: what one vehicle's sensor reports at its pose.  It emulates a camera with its detector.

Every target within the sensor's radius is reported with the detection probability, its position with the
noise; now and then the sensor reports something that is not there.  A real detector feeds the same reports.
"""

import math

from . import scene
from .arrays import Integers, Records
from .jit import kernel
from .randoms import ALARM, DETECT, NOISE, normal, uniform

WANDER_REACH = 1.5  # how far off its place a wandering target can be, as a share of its swing: √2 at most


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
def sense(
    fleet: Records, i: int, poses: Records, targets: Records, grid: Records, starts: Integers,
    alarms: Integers, rules: Records, tick: int, reports: Records, found: Integers,
) -> int:  # fmt: skip
    """Write what vehicle ``i`` sees at ``tick`` into ``reports[i]`` and return how many they are.

    ``alarms`` (V,) counts its false alarms, which numbers them; ``found`` (T,) keeps the first tick at
    which any vehicle reported the target (-1: not yet).
    """
    seed = rules[0].seed
    reach = fleet[i].sensor_range
    x, y = poses[i].east, poses[i].north
    now = tick * rules[0].period
    look = reach + WANDER_REACH * grid[0].wander
    here = scene.cell_of(grid, x, y)
    around = grid[0].block
    empty = starts[here, 1] == 0
    if look > around * grid[0].cell:
        around = int(look / grid[0].cell) + 1
        empty = False
    row, column = here // grid[0].columns, here % grid[0].columns
    west, east = max(column - around, 0), min(column + around, grid[0].columns - 1)
    south, north = max(row - around, 0), min(row + around, grid[0].rows - 1)
    count = 0
    if empty:
        north = south - 1  # no row to look through, as is mostly so
    for r in range(south, north + 1):
        first, last = r * grid[0].columns + west, r * grid[0].columns + east
        for t in range(starts[first, 0], starts[last + 1, 0]):
            tx, ty = scene.place_at(grid, targets, t, now)
            if (tx - x) * (tx - x) + (ty - y) * (ty - y) > reach * reach:
                continue
            chance = fleet[i].detection_probability
            if chance < 1.0 and uniform(seed, i, tick, DETECT + t) >= chance:
                continue
            noise = fleet[i].position_noise
            if noise > 0.0:
                tx += noise * normal(seed, i, tick, NOISE + 2 * t)
                ty += noise * normal(seed, i, tick, NOISE + 2 * t + 1)
            if count < reports.shape[1] - 1:  # room is kept for a false alarm
                count = _report(reports, count, i, t, tx, ty)
            if found[t] < 0:
                found[t] = tick
    if fleet[i].alarms_per_second > 0.0:
        count = _false_alarm(fleet, i, poses, alarms, rules, tick, reports, count)
    return count
