"""What a study flies: for every combination of settings a mission for each algorithm, all on the same seeds.

Every algorithm has a mission of its own, since ``planner.inertia`` on the command line means that parameter of
whichever algorithm is flown.  All of them are loaded, and all that is wrong is said, before anything is flown.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from swarmctl.mission.errors import MissionError, Problem
from swarmctl.mission.load import load
from swarmctl.mission.model import MOST_VEHICLES, Mission
from swarmctl.mission.scaling import at_constant_density
from swarmctl.mission.scenario import Scenario

from .errors import StudyError
from .runs import is_ideal
from .settings import ALGORITHM, Axis, Settings, grid, read_axes

VEHICLES = "vehicles.count"


@dataclass(frozen=True)
class Cell:
    """One combination of settings (none, in a study without ``--set``), and its mission for each algorithm."""

    settings: Settings
    missions: Mapping[str, Mission]

    @property
    def mission(self) -> Mission:
        """The first algorithm's: all are alike but for the planner."""
        return next(iter(self.missions.values()))

    @property
    def dynamics(self) -> str:
        """ideal or multicopter."""
        return "ideal" if is_ideal(self.mission) else "multicopter"


@dataclass(frozen=True)
class Plan:
    """A whole study: ``axes`` are the keys that vary, ``cells`` their combinations, ``seeds`` those of every cell."""

    axes: Sequence[Axis]
    cells: Sequence[Cell]
    seeds: range

    @property
    def algorithms(self) -> list[str]:
        """What is compared, in the order asked for."""
        return list(self.cells[0].missions)

    @property
    def varied(self) -> list[Axis]:
        """The axes that have more than one value: the dimensions of the grid."""
        return [axis for axis in self.axes if len(axis.values) > 1]

    @property
    def runs(self) -> int:
        """How many runs there are in all."""
        return len(self.cells) * len(self.algorithms) * len(self.seeds)


def make_plan(
    mission_file: Path | None, algorithms: Sequence[str], seeds: range, given: Settings, sets: Iterable[str],
    constant_density: bool = False,
) -> Plan:  # fmt: skip
    """The plan of a study; ``given`` are keys that flags of their own set, ``sets`` what ``--set`` was given.

    ``constant_density``: area, clusters and targets grow with the number of vehicles.
    Raises StudyError or MissionError, the latter with everything that is wrong with any of the missions.
    """
    axes = read_axes(sets)
    twice = [axis.key for axis in axes if axis.key in given]
    if twice:
        raise StudyError(f"--set {twice[0]}: another flag gives it too (leave one of them out)")
    if constant_density and VEHICLES not in {*given, *(axis.key for axis in axes)}:
        raise StudyError(f"--constant-density needs --vehicles N (or --set {VEHICLES}=N,N)")
    mission_with = partial(_load_at_density if constant_density else load, mission_file)
    problems: dict[str, Problem] = {}
    cells = [Cell(one, _missions(mission_with, algorithms, {**given, **one}, problems)) for one in grid(axes)]
    if problems:
        raise MissionError(list(problems.values()))
    for cell in cells:
        _refuse_crowded(cell.mission)
    return Plan(axes, cells, seeds)


def _missions(
    mission_with: Callable[[Settings], Mission], algorithms: Sequence[str], settings: Settings,
    problems: dict[str, Problem],
) -> dict[str, Mission]:  # fmt: skip
    """A mission for each algorithm; what is wrong goes into ``problems``, each once."""
    missions = {}
    for name in algorithms:
        try:
            missions[name] = mission_with({ALGORITHM: name, **settings})
        except MissionError as error:
            problems.update({str(problem): problem for problem in error.problems})
    return missions


def _load_at_density(mission_file: Path | None, settings: Settings) -> Mission:
    """The mission grown or shrunk to as many vehicles as the settings say.  Raises MissionError."""
    count = settings[VEHICLES]
    if not isinstance(count, int) or not 1 <= count <= MOST_VEHICLES:
        return load(mission_file, settings)  # which says what is wrong with it
    others = {key: value for key, value in settings.items() if key != VEHICLES}
    grown = at_constant_density(load(mission_file, others), count)
    return load(mission_file, {**others, **grown})


def _refuse_crowded(mission: Mission) -> None:
    """A launch as found stands for the corner grid in a study, which the mission's checks did not look at."""
    try:
        Scenario(mission, ideal=is_ideal(mission)).starts  # noqa: B018 - tried, not used
    except ValueError as error:
        raise StudyError(f"vehicles.launch: {error} (name the pads, or fly fewer)") from None


def merged(cell: Cell) -> Mission:
    """One mission that holds every algorithm's parameters: studied again, it gives the cell again."""
    parameters = dict(cell.mission.planner.parameters)
    for name, mission in cell.missions.items():
        if name in mission.planner.parameters:
            parameters[name] = mission.planner.parameters[name]
    planner = cell.mission.planner.model_copy(update={"parameters": parameters})
    return cell.mission.model_copy(update={"planner": planner})
