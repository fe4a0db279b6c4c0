"""Runs: one mission flown many times over, each seed its own layout, and what each run came to.

A :class:`Job` is what one worker does at a time: some seeds of one mission with one algorithm.  :func:`simulate`
does it, here or on another machine; its result is one RUN record a seed and depends on nothing else, so that
neither the number of workers nor the cutting into jobs shows in a study.
"""

from dataclasses import dataclass

import numpy as np

from swarmctl.core import stages
from swarmctl.core.arrays import Floats, Integers, Records
from swarmctl.core.world import World
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario

LEVELS_PERCENT = (25, 50, 75, 85, 95)
CURVE_POINTS = 161

# What one run came to.  Times are seconds of search, infinity where a level was never reached; ``curve`` is the
# share found at CURVE_POINTS moments evenly from 0 to the search's end (``curve_times``).  ``in_range`` is the mean
# number of targets in a vehicle's range over all steps and vehicles, ``in_range_when_any`` over those steps in
# which it has any (0 if none).  The last four are of multicopter dynamics: vehicle-ticks outside the fence, the
# share of the search spent standing, the flight's length from take-off to the last landing, and who is not down.
RUN = np.dtype(
    [
        ("seed", "<i8"),
        ("time_s", "<f8", (len(LEVELS_PERCENT),)),
        ("final_fraction", "<f8"),
        ("in_range", "<f8"),
        ("in_range_when_any", "<f8"),
        ("min_separation_m", "<f8"),
        ("curve", "<f8", (CURVE_POINTS,)),
        ("outside", "<i8"),
        ("standing", "<f8"),
        ("flight_s", "<f8"),
        ("not_down", "<i8"),
    ]
)


@dataclass(frozen=True)
class Job:
    """Some seeds of one mission with one algorithm; ``ideal`` dynamics or a guarded multicopter's."""

    mission: Mission
    algorithm: str
    seeds: tuple[int, ...]
    ideal: bool = True


def is_ideal(mission: Mission) -> bool:
    """Whether a study of this mission is in ideal dynamics: it is, unless the mission says multicopter.

    Or unless it says ``observations: wire`` and nothing of dynamics: messages are a multicopter's.
    """
    if mission.dynamics is None:
        return mission.observations == "exact"
    return mission.dynamics == "ideal"


def curve_times(duration_s: float) -> Floats:
    """The moments (CURVE_POINTS,) of RUN's curve, in seconds of search."""
    return np.linspace(0.0, duration_s, CURVE_POINTS)


def simulate(job: Job) -> Records:
    """Fly every seed of the job; one RUN record each, in the seeds' order."""
    scenario = Scenario(job.mission, ideal=job.ideal)
    runs = np.zeros(len(job.seeds), RUN)
    moments = curve_times(job.mission.duration_s)
    world: World | None = None
    for run, seed in zip(runs, job.seeds, strict=True):
        world = scenario.world(seed, job.algorithm, world)
        run["seed"] = seed
        if job.ideal:
            in_range = world.run_ideal()
            run["min_separation_m"] = world.nearest_m
        else:
            in_range, account, length = world.run_multicopter()
            run["min_separation_m"], run["outside"], run["flight_s"] = account[0], account[1], length
            run["standing"] = account[2] / account[3] if account[3] > 0 else 0.0
            run["not_down"] = (world.errands["stage"] != stages.LANDED).sum()
        _take_figures(run, world, in_range, moments)
    return runs


def _take_figures(run: np.void, world: World, in_range: Integers, moments: Floats) -> None:
    """Fill in what both dynamics have."""
    found = np.sort(world.found[world.found >= 0]) * float(world.rules[0]["period"])
    count = len(world.found)
    needed = [-(-percent * count // 100) for percent in LEVELS_PERCENT]  # rounded up
    run["time_s"] = [found[n - 1] if 0 < n <= len(found) else np.inf for n in needed]
    run["curve"] = found.searchsorted(moments, side="right") / max(count, 1)
    run["final_fraction"] = len(found) / max(count, 1)
    total, steps_with_any = in_range.sum(axis=0)
    run["in_range"] = total / (len(in_range) * len(world.fleet))
    run["in_range_when_any"] = total / steps_with_any if steps_with_any else 0.0
