"""From file and command line to a mission: packaged missions, defaults, fleets, settings."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from swarmctl.mission import geometry, pads
from swarmctl.mission.errors import MissionError
from swarmctl.mission.load import load, packaged
from swarmctl.mission.model import Mission, VehicleGroup

Complaints = Callable[..., list[str]]
Read = Callable[..., Mission]


# What comes with the program.


def test_every_packaged_mission_loads() -> None:
    some = {"paper", "sitl", "field", "lake", "mixed", "wandering", "drifting", "fleet"}
    assert some <= set(packaged())
    for name in packaged():
        assert load(name).name == name


def test_the_default_is_the_reference_scenario(small_catalogue: None) -> None:
    mission = load()
    assert mission == load("paper") == load(Path("paper.yaml")) == load("missions/paper")
    assert (mission.area.size_m, mission.duration_s, mission.planner.algorithm) == ((5000, 5000), 1600, "fco")
    assert [item.box_m for item in mission.keep_out] == [(1500, 1700, 3200, 4000), (3500, 4200, 1500, 1700)]
    assert len(mission.fleet) == 6
    vehicle, targets = mission.fleet[5], mission.targets
    assert (vehicle.speed_mps, vehicle.sensor.range_m, vehicle.radio.range_m) == (25, 200, 600)
    assert (targets.clusters, targets.count, targets.radius_m, targets.hot_spot_share) == (6, 450, 300, 0.4)
    assert mission.dynamics is None


def test_the_paper_writes_out_the_defaults(small_catalogue: None) -> None:
    plain = Mission(name="paper", keep_out=load("paper").keep_out)
    assert load("paper") == plain


@pytest.mark.parametrize("name", ["wandering", "drifting", "fleet"])
def test_those_studied_beside_the_reference_differ_from_it_in_one_section(
    name: str, small_catalogue: None
) -> None:
    mission, paper = load(name), load("paper")
    section = "vehicles" if name == "fleet" else "targets"
    assert getattr(mission, section) != getattr(paper, section)
    same = {"name": "paper", section: getattr(paper, section)}
    assert mission.model_copy(update=same) == paper


def test_the_mixed_fleet_sweeps_as_much_ground_as_the_reference(small_catalogue: None) -> None:
    swept = [sum(v.speed_mps * v.sensor.range_m for v in load(name).fleet) for name in ("fleet", "paper")]
    assert swept[0] == pytest.approx(swept[1], rel=0.01)


def test_sitl_vehicles_stand_inside(small_catalogue: None) -> None:
    mission = load("sitl")
    legal = geometry.regions(mission).legal
    east, north = geometry.local_m(((47.397742, 8.545594),), mission.origin)[0]
    for k in range(6):
        assert legal.contains(geometry.shapely.Point(east + 20 * k, north).buffer(15))
    assert mission.launch == "as_found"
    assert pads.launch_pads(mission) is None


def test_a_file_comes_before_a_packaged_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_catalogue: None
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("paper.yaml").write_text("name: mine")
    assert load("paper.yaml").name == "mine"
    assert load("paper").name == "paper"


@pytest.mark.parametrize("name", ["nowhere.yaml", "elsewhere/paper.yaml", "nul\0byte", "x" * 5000])
def test_a_missing_file_names_the_packaged_missions(name: str) -> None:
    with pytest.raises(MissionError, match=r"packaged missions: .*paper"):
        load(name)


def test_a_folder_is_not_a_mission(tmp_path: Path) -> None:
    with pytest.raises(MissionError, match="cannot be read: is a directory"):
        load(tmp_path)


def test_an_empty_mapping_is_all_defaults(read: Read) -> None:
    assert read("{}") == Mission()


# The fleet.


def test_layers_lift_each_vehicle(read: Read) -> None:
    mission = read("vehicles: {count: 3, altitude_m: 50, layer_m: 6}")
    assert [vehicle.altitude_m for vehicle in mission.fleet] == [50, 56, 62]


def test_entries_replace_the_missions_own_key_by_key(read: Read) -> None:
    mission = read(
        "sensor: {range_m: 150, position_noise_m: 2}\n"
        "radio: {bandwidth_bps: 1000}\n"
        "vehicles:\n"
        "  - {sensor: {range_m: 90}, launch: [100, 100]}\n"
        "  - {radio: {bandwidth_bps: null}, speed_mps: 9, launch: [200, 100], autopilot: ardupilot}\n"
    )
    first, second = mission.fleet
    assert (first.sensor.range_m, first.sensor.position_noise_m, first.radio.bandwidth_bps) == (90, 2, 1000)
    assert (second.sensor.range_m, second.radio.bandwidth_bps, second.speed_mps) == (150, None, 9)
    assert (first.launch, second.launch, second.autopilot) == ((100, 100), (200, 100), "ardupilot")
    assert mission.launch == ((100, 100), (200, 100))


def test_a_mission_cannot_be_changed(read: Read) -> None:
    with pytest.raises(ValidationError):
        read("{}").duration_s = 3  # type: ignore[misc]


# The command line.


def test_settings_replace_what_the_file_says(read: Read) -> None:
    settings = {"vehicles.count": 3, "planner.inertia": 0.2, "planner.algorithm": "mdc", "radio.loss": 0.5}
    mission = read("vehicles: {count: 9, speed_mps: 7}\nplanner: {algorithm: fco}", settings)
    assert mission.vehicles == VehicleGroup(count=3, speed_mps=7)
    assert mission.planner.parameters == {"mdc": {"inertia": 0.2}}
    assert mission.radio.loss == 0.5


def test_settings_come_before_validation(read: Read) -> None:
    assert read("duration_s: -5", {"duration_s": 60}).duration_s == 60


def test_a_planner_setting_goes_to_the_algorithm_in_the_file(read: Read) -> None:
    mission = read("planner: {algorithm: mdc}", {"planner.inertia": 0.1, "planner.period_s": 2})
    assert mission.planner.parameters == {"mdc": {"inertia": 0.1}}
    assert mission.planner.period_s == 2


def test_settings_reach_into_lists(read: Read) -> None:
    text = "vehicles: [{speed_mps: 5}, {}]\nkeep_out: [{box_m: [1000, 1100, 1000, 1100]}]"
    mission = read(
        text, {"vehicles.altitude_m": 70, "vehicles.1.speed_mps": 6, "keep_out.0.box_m": (500, 600, 500, 600)}
    )
    assert [(v.speed_mps, v.altitude_m) for v in mission.fleet] == [(5, 70), (6, 70)]
    assert mission.keep_out[0].box_m == (500, 600, 500, 600)


@pytest.mark.parametrize(
    ("text", "key", "value", "message"),
    [
        ("{}", "vehicles.count", 0, "vehicles.count: must be greater than or equal to 1, not 0"),
        ("{}", "vehicles.cuont", 3, "vehicles.cuont: unknown key (did you mean count?)"),
        ("{}", "planner.inertai", 3, "planner.inertai: 'inertai' is no parameter of fco (did"),
        (
            "{}",
            "planner.algorithm",
            "pso",
            "planner.algorithm: 'pso' is no algorithm (known: ace, belief, fco, mdc)",
        ),
        (
            "{}",
            "planner.inertia",
            "much",
            "planner.inertia: must be a number, not 'much' (its default is 0.4)",
        ),
        ("{}", "duration_s", "10", "duration_s: must be a number, not '10'"),
        ("vehicles: [{}, {}]", "vehicles.count", 3, "vehicles.count: cannot be set: the mission lists its 2"),
        (
            "vehicles: [{}, {}]",
            "vehicles.2.speed_mps",
            3,
            "vehicles.2.speed_mps: cannot be set: the list has 2",
        ),
        ("name: x", "name.first", "y", "name.first: cannot be set: there are no keys below 'x'"),
        ("{}", "", 1, "unknown key"),
        (
            "keep_out: [{box_m: [1, 2, 3, 4]}]",
            "keep_out",
            [{"box_m": [2, 1, 3, 4]}],
            "keep_out[0].box_m: the order",
        ),
    ],
)
def test_a_wrong_setting_names_the_command_line(
    complaints: Complaints, text: str, key: str, value: object, message: str
) -> None:
    (line,) = complaints(text, {key: value})
    assert line.startswith("command line: ")
    assert message in line


def test_ideal_vehicles_need_no_margin_and_no_pads(read: Read) -> None:
    text = "dynamics: ideal\nvehicles: {count: 2, launch: [[0, 0], [0, 0]]}\narea: {size_m: [30, 30]}"
    assert read(text).launch == ((0, 0), (0, 0))
    assert read("dynamics: ideal\nvehicles: {count: 500}\narea: {size_m: [90, 90]}").launch == "corner"


def test_ten_thousand_vehicles_load(read: Read) -> None:
    mission = read("vehicles: {count: 10000, spacing_m: 30}")
    places = pads.launch_pads(mission)
    assert places is not None
    assert places.shape == (10_000, 2)
    assert np.array_equal(places[100], [25, 55])
