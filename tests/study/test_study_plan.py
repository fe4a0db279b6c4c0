"""A study's plan: a mission for each algorithm and setting, the same seeds for all, every fault told at once."""

from pathlib import Path

import pytest

from swarmctl.core import planners
from swarmctl.mission.errors import MissionError
from swarmctl.mission.scenario import Scenario
from swarmctl.study.errors import StudyError
from swarmctl.study.plan import make_plan, merged
from swarmctl.study.settings import Settings

SEEDS = range(3, 8)


def test_a_parameter_without_an_algorithm_is_that_of_each_algorithm_studied() -> None:
    plan = make_plan(None, ["fco", "mdc"], SEEDS, {}, ["planner.inertia=0.1,0.9"])
    flown = [
        (name, mission.planner.algorithm, mission.planner.parameters[name]["inertia"])
        for cell in plan.cells
        for name, mission in cell.missions.items()
    ]
    assert flown == [
        ("fco", "fco", 0.1), ("mdc", "mdc", 0.1), ("fco", "fco", 0.9), ("mdc", "mdc", 0.9),
    ]  # fmt: skip
    assert [axis.key for axis in plan.varied] == ["planner.inertia"]
    assert plan.runs == 2 * 2 * 5


def test_an_algorithm_without_the_parameter_is_named_and_the_others_are_not() -> None:
    with pytest.raises(MissionError) as raised:
        make_plan(None, ["fco", "bounce", "sweep"], SEEDS, {}, ["planner.personal=0.1,0.2"])
    said = str(raised.value)
    assert "planner.personal: 'personal' is no parameter of bounce" in said
    assert "no parameter of sweep" in said
    assert "of fco" not in said
    assert said.count("\n") == 1  # each fault once, however many values


def test_all_faults_of_all_settings_are_told_at_once() -> None:
    with pytest.raises(MissionError) as raised:
        make_plan(None, ["fco"], SEEDS, {"duration_s": -1.0}, ["radio.loss=0.5,2", "nonsense=1"])
    keys = {problem.key for problem in raised.value.problems}
    assert keys == {"duration_s", "radio.loss", "nonsense"}


@pytest.mark.parametrize("algorithm", planners.MODULES)
def test_every_algorithm_s_own_parameters_can_be_set(algorithm: str) -> None:
    for parameter in planners.module(algorithm).PARAMETERS:
        plan = make_plan(None, [algorithm], SEEDS, {}, [f"planner.{parameter.name}={parameter.default}"])
        assert plan.cells[0].missions[algorithm].planner.parameters[algorithm] == {
            parameter.name: parameter.default
        }


def test_one_vehicle_s_speed_and_every_sensor_can_be_set() -> None:
    sets = ["vehicles.0.speed_mps=5,10", "vehicles.sensor.range_m=77"]
    plan = make_plan(Path("fleet"), ["fco"], SEEDS, {}, sets)
    fleets = [Scenario(cell.mission, ideal=True).fleet(1) for cell in plan.cells]
    assert [fleet["speed"].tolist() for fleet in fleets] == [
        [5, 30, 15, 15, 25, 25], [10, 30, 15, 15, 25, 25],
    ]  # fmt: skip
    assert all((fleet["sensor_range"] == 77).all() for fleet in fleets)


def test_every_algorithm_meets_the_same_layouts() -> None:
    (cell,) = make_plan(None, list(planners.MODULES), SEEDS, {}, []).cells
    for seed in SEEDS:
        layouts = set()
        for mission in cell.missions.values():
            scenario = Scenario(mission, ideal=True)
            layouts.add((scenario.scene(seed).targets.tobytes(), scenario.fleet(seed).tobytes()))
        assert len(layouts) == 1


def test_a_key_that_a_flag_gives_too_is_refused() -> None:
    given: Settings = {"vehicles.count": 3}
    with pytest.raises(StudyError, match=r"--set vehicles\.count: another flag gives it too"):
        make_plan(None, ["fco"], SEEDS, given, ["vehicles.count=6,9"])


def test_pads_that_do_not_fit_are_told(tmp_path: Path) -> None:
    mission = tmp_path / "m.yaml"
    mission.write_text(
        "area: {size_m: [90, 90]}\nvehicles: {count: 90, launch: as_found, speed_mps: 2}\n"
        "dynamics: multicopter\nsensor: {range_m: 20}\ntargets: {clusters: 1, count: 5, radius_m: 10}\n"
    )
    with pytest.raises(StudyError, match=r"vehicles\.launch: .*90 pads"):
        make_plan(mission, ["fco"], SEEDS, {}, [])


def test_the_dynamics_are_ideal_unless_the_mission_says_otherwise() -> None:
    plan = make_plan(None, ["fco"], SEEDS, {}, ["dynamics=null,ideal,multicopter"])
    assert [cell.dynamics for cell in plan.cells] == ["ideal", "ideal", "multicopter"]


def test_who_sees_what_messages_carry_is_a_multicopter() -> None:
    plan = make_plan(None, ["fco"], SEEDS, {}, ["observations=exact,wire"])
    assert [cell.dynamics for cell in plan.cells] == ["ideal", "multicopter"]


def test_the_mission_that_is_kept_holds_every_algorithm_s_parameters() -> None:
    (cell,) = make_plan(None, ["fco", "mdc"], SEEDS, {}, ["planner.inertia=0.7", "duration_s=100"]).cells
    kept = merged(cell)
    assert kept.planner.parameters["fco"]["inertia"] == kept.planner.parameters["mdc"]["inertia"] == 0.7
    assert kept.duration_s == 100


def test_at_constant_density_the_mission_grows_with_its_vehicles() -> None:
    plan = make_plan(None, ["fco", "mdc"], SEEDS, {}, ["vehicles.count=6,24"], constant_density=True)
    small, large = (list(cell.missions.values()) for cell in plan.cells)
    assert {m.area.size_m for m in small} == {(5000.0, 5000.0)}
    assert {m.area.size_m for m in large} == {(10000.0, 10000.0)}
    assert {(len(m.fleet), m.targets.count, m.targets.clusters) for m in large} == {(24, 1800, 24)}
    assert [cell.settings for cell in plan.cells] == [{"vehicles.count": 6}, {"vehicles.count": 24}]


@pytest.mark.parametrize("count", ["0", "2.5", "many", "20000"])
def test_an_impossible_number_of_vehicles_is_told_at_constant_density_too(count: str) -> None:
    with pytest.raises(MissionError, match=r"command line: vehicles\.count"):
        make_plan(None, ["fco"], SEEDS, {}, [f"vehicles.count=6,{count}"], constant_density=True)


def test_constant_density_needs_a_number_of_vehicles() -> None:
    with pytest.raises(StudyError, match="--constant-density needs --vehicles N"):
        make_plan(None, ["fco"], SEEDS, {}, [], constant_density=True)
