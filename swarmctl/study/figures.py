"""The figures of a study: what is in study.json, and what tables and charts show of it.

All of them come out of RUN records; nothing here knows how these were made.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from swarmctl.core.arrays import Floats, Records
from swarmctl.mission.model import Mission

from .plan import Cell
from .runs import LEVELS_PERCENT, curve_times, is_ideal
from .statistics import Paired, Summary, compare, numbers, shares, summarise
from .study import Study

LEVELS = tuple(str(percent) for percent in LEVELS_PERCENT)
BAND = (0.1, 0.9)
"""The quantiles between which a curve's band lies."""

DIGITS = 6
"""Decimals kept of curves: to a millionth of the targets."""

FLOWN = {
    "final_fraction": "final_fraction",
    "mean_targets_in_range": "in_range",
    "mean_targets_in_range_when_any": "in_range_when_any",
    "min_separation_m": "min_separation_m",
}
MULTICOPTER = {
    "outside_vehicle_ticks": "outside",
    "not_down": "not_down",
    "standing_share": "standing",
    "flight_s": "flight_s",
}
"""study.json's name of a figure: RUN's field; the second lot means nothing in ideal dynamics."""


@dataclass(frozen=True)
class Figures:
    """One algorithm's runs, told: ``time_to_s`` by level, ``other`` by study.json's names.

    ``late_s`` is the mean time by level if a run that never got there counts as the search's length: it is always
    defined, and so what settings are compared by.  Curves are shares of the targets at ``t_s``.
    """

    runs: Records
    duration_s: float
    time_to_s: Mapping[str, Summary]
    late_s: Mapping[str, float]
    other: Mapping[str, Summary]
    t_s: Floats
    fraction: Floats
    low: Floats
    high: Floats

    def times(self, level: str) -> Floats:
        """Seconds to the level (R,), infinite for never, in the seeds' order."""
        column: Floats = self.runs["time_s"][:, LEVELS.index(level)]
        return column

    def as_json(self) -> dict[str, object]:
        """The algorithm's part of study.json."""
        curve = {"t_s": self.t_s, "fraction": self.fraction, "p10": self.low, "p90": self.high}
        return {
            "time_to_s": {level: summary.as_json() for level, summary in self.time_to_s.items()},
            "mean_time_never_as_end_s": dict(self.late_s),
            **{name: summary.as_json() for name, summary in self.other.items()},
            "curve": {name: numbers(np.round(values, DIGITS)) for name, values in curve.items()},
            "per_run": {level: numbers(self.times(level)) for level in LEVELS},
        }


@dataclass(frozen=True)
class CellFigures:
    """One combination of settings: the figures of each algorithm, and every pair of them at every level."""

    cell: Cell
    algorithms: Mapping[str, Figures]
    paired: Mapping[tuple[str, str, str], Paired]

    def as_json(self) -> dict[str, object]:
        """The keys that a study of one cell has at its top."""
        return {
            "dynamics": self.cell.dynamics,
            "algorithms": {name: figures.as_json() for name, figures in self.algorithms.items()},
            "paired": [
                {"a": a, "b": b, "level": level, **paired.as_json()}
                for (a, b, level), paired in self.paired.items()
            ],
        }


def figures_of(runs: Records, mission: Mission) -> Figures:
    """What the runs (R,) RUN of one mission and algorithm come to."""
    names = FLOWN if is_ideal(mission) else {**FLOWN, **MULTICOPTER}
    times = dict(zip(LEVELS, runs["time_s"].T, strict=True))
    low, high = shares(runs["curve"], BAND)
    return Figures(
        runs=runs,
        duration_s=mission.duration_s,
        time_to_s={level: summarise(column) for level, column in times.items()},
        late_s={level: float(np.minimum(c, mission.duration_s).mean()) for level, c in times.items()},
        other={name: summarise(runs[field]) for name, field in names.items()},
        t_s=curve_times(mission.duration_s),
        fraction=runs["curve"].mean(axis=0),
        low=low,
        high=high,
    )


def figures_of_cell(cell: Cell, runs: Mapping[str, Records]) -> CellFigures:
    """The figures of all that was flown of a cell."""
    told = {name: figures_of(records, cell.missions[name]) for name, records in runs.items()}
    pairs = combinations(told, 2)
    paired = {
        (a, b, level): compare(told[a].times(level), told[b].times(level))
        for a, b in pairs
        for level in LEVELS
    }
    return CellFigures(cell, told, paired)


def study_json(study: Study, cells: Sequence[CellFigures], run: str) -> dict[str, object]:
    """study.json.  With a grid, the keys at the top are its first cell's, and ``grid`` has them all."""
    plan, mission = study.plan, cells[0].cell.mission
    head = {
        "runs": len(plan.seeds),
        "seed": plan.seeds[0],
        "mission": mission.name,
        "vehicles": len(mission.fleet),
        "duration_s": mission.duration_s,
        "complete": study.complete,
        "wall_s": round(study.wall_s, 4),
        "uav_steps_per_s": round(study.steps_per_s, 1),
        "threads": study.threads,
        "settings": cells[0].cell.settings,
        **cells[0].as_json(),
        "run": run,
    }
    if plan.varied:
        head["grid"] = [{"settings": one.cell.settings, **one.as_json()} for one in cells]
    return head
