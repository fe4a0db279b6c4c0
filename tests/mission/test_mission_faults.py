"""Every fault of a mission file is named with file, line, column, key and what to do, and all at once."""

from collections.abc import Callable

import pytest

Complaints = Callable[..., list[str]]


# Single keys.


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("foo: 1", "m.yaml:1:1: foo: unknown key (known: area, "),
        ("name: a\nduraton_s: 1", "m.yaml:2:1: duraton_s: unknown key (did you mean duration_s?)"),
        ("vehicles: {spacing: 30}", "m.yaml:1:12: vehicles.spacing: unknown key (did you mean spacing_m?)"),
        (
            "vehicles: [{sensor: {range: 3}}]",
            "m.yaml:1:22: vehicles[0].sensor.range: unknown key (did you mean range_m?)",
        ),
        ("vehicles: [{count: 3}]", "m.yaml:1:13: vehicles[0].count: unknown key (did you mean connect?)"),
        ("keep_out: [{circle_m: {radius_m: 3}}]", "m.yaml:1:13: keep_out[0].circle_m.center_m: missing"),
        ("<<: {name: x}", "m.yaml:1:1: <<: unknown key"),
        ("duration_s: '7'", "m.yaml:1:1: duration_s: must be a number, not '7'"),
        ("duration_s: true", "m.yaml:1:1: duration_s: must be a number, not True"),
        ("duration_s: .nan", "m.yaml:1:1: duration_s: must be a finite number, not nan"),
        ("duration_s: 1e999", "m.yaml:1:1: duration_s: must be a finite number, not inf"),
        ("duration_s: 0", "m.yaml:1:1: duration_s: must be greater than 0, not 0"),
        ("area: {size_m: [.inf, 5]}", "m.yaml:1:17: area.size_m[0]: must be a finite number, not inf"),
        ("area: {size_m: [5]}", "m.yaml:1:8: area.size_m: a value is missing"),
        ("area: {size_m: [1, 2, 3]}", "m.yaml:1:8: area.size_m: has 3 entries, at most 2 are allowed"),
        (
            "area: {polygon: [[91, 8], [47, 8], [47, 9]]}",
            "m.yaml:1:19: area.polygon[0][0]: must be less than or equal to 90",
        ),
        ("area: {polygon: [[47, 8], [47, 9]]}", "m.yaml:1:8: area.polygon: needs at least 3 entries, not 2"),
        ("area: {polygon_m: [[0, 0], [0, 1], [1]]}", "m.yaml:1:36: area.polygon_m[2]: a value is missing"),
        ("area: {}", "m.yaml:1:1: area: give one of size_m, polygon, polygon_m, file"),
        ("area: {size_m: [9, 9], file: x.kml}", "m.yaml:1:1: area: give only one of size_m and file"),
        ("area:", "m.yaml:1:1: area: must be a mapping of keys, not null"),
        ("keep_out: [{box_m: [1700, 1500, 0, 1]}]", "m.yaml:1:13: keep_out[0].box_m: the order is east_min"),
        ("keep_out: [{}]", "m.yaml:1:12: keep_out[0]: give one of box_m"),
        ("origin: {lat: 86}", "m.yaml:1:10: origin.lat: must be less than or equal to 85, not 86"),
        ("origin: {lon: 181}", "m.yaml:1:10: origin.lon: must be less than or equal to 180, not 181"),
        (
            "vehicles: 6",
            "m.yaml:1:1: vehicles: must be a mapping (count: ...) or a list, one entry a vehicle, not 6",
        ),
        ("vehicles: []", "m.yaml:1:1: vehicles: needs at least 1 entries, not 0"),
        (
            "vehicles: {count: 10001}",
            "m.yaml:1:12: vehicles.count: must be less than or equal to 10000, not 10001",
        ),
        ("vehicles: {count: 2.5}", "m.yaml:1:12: vehicles.count: must be a whole number, not 2.5"),
        (
            "vehicles: {speed_mps: 31}",
            "m.yaml:1:12: vehicles.speed_mps: must be less than or equal to 30, not 31",
        ),
        (
            "vehicles: {launch: here}",
            "m.yaml:1:12: vehicles.launch: must be 'corner', 'spread' or 'as_found', not 'here'",
        ),
        (
            "vehicles: {launch: 5}",
            "m.yaml:1:12: vehicles.launch: must be corner, spread, as_found, or a list of",
        ),
        (
            "vehicles: [{connect: 'tcp:/x'}]",
            "m.yaml:1:13: vehicles[0].connect: is not of the right form, not 'tcp:/x' (as udpin",
        ),
        (
            "sensor: {detection_probability: 1.1}",
            "m.yaml:1:10: sensor.detection_probability: must be less than or equal to 1",
        ),
        ("targets: {motion: fly}", "m.yaml:1:11: targets.motion: must be 'static' or 'wander', not 'fly'"),
        (
            "targets: {cluster_motion: wander}",
            "m.yaml:1:11: targets.cluster_motion: must be 'static' or 'drift', not 'wander'",
        ),
        ("targets: {wander_mps: 0}", "m.yaml:1:11: targets.wander_mps: must be greater than 0, not 0"),
        ("targets: {cluster_mps: 31}", "m.yaml:1:11: targets.cluster_mps: must be less than or equal to 30"),
        ("radio: {loss: -0.1}", "m.yaml:1:9: radio.loss: must be greater than or equal to 0"),
        ("name: 5", "m.yaml:1:1: name: must be text, not 5 (put it in quotes)"),
        (
            "planner: {parameters: {fco: {inertia: [1]}}}",
            "m.yaml:1:30: planner.parameters.fco.inertia: must be a number",
        ),
        (
            "planner: {parameters: {fco: {inertai: 1}}}",
            "m.yaml:1:30: planner.parameters.fco.inertai: 'inertai' is no parameter",
        ),
        ("planner: {parameters: {fcoo: {}}}", "m.yaml:1:24: planner.parameters.fcoo: 'fcoo' is no algorithm"),
        (
            "planner: {parameters: {belief: {then: 3}}}",
            "m.yaml:1:33: planner.parameters.belief.then: must be text, not 3",
        ),
        (
            "planner: {parameters: {belief: {then: hover}}}",
            "m.yaml:1:33: planner.parameters.belief.then: must be hold or converge, not 'hover'",
        ),
        ("dynamics: rocket", "m.yaml:1:1: dynamics: must be 'ideal' or 'multicopter', not 'rocket'"),
        ("duration_s: !!binary aGVsbG8=", "m.yaml:1:13: duration_s: the tag"),
        ("- 1", "m.yaml:1:1: must be a mapping of keys, not [1]"),
        ("hello", "m.yaml:1:1: must be a mapping of keys, not 'hello'"),
    ],
)
def test_a_wrong_key_is_named_with_its_place(complaints: Complaints, text: str, line: str) -> None:
    (found,) = complaints(text)
    assert found.startswith(line)


# Keys together.


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "area: {polygon_m: [[0, 0], [1000, 1000], [1000, 0], [0, 1000]]}",
            "m.yaml:1:8: area.polygon_m: the fence crosses itself at [500, 500] m",
        ),
        (
            "dynamics: ideal\nobservations: wire",
            "m.yaml:2:1: observations: ideal points send no messages",
        ),
        (
            "area: {polygon_m: [[0, 0], [500, 0], [1000, 0]]}",
            "m.yaml:1:8: area.polygon_m: the fence",
        ),
        ("area: {polygon: [[47, 8], [50, 8], [50, 9]]}", "m.yaml:1:8: area.polygon: reaches "),
        (
            "keep_out: [{polygon_m: [[100, 100], [200, 200], [200, 100], [100, 200]]}]",
            "m.yaml:1:12: keep_out[0]: the keep-out crosses itself at [150, 150] m",
        ),
        (
            "keep_out: [{box_m: [-10, 5010, -10, 5010]}]",
            "m.yaml:1:12: keep_out[0]: with 20 m kept from it, leaves nothing",
        ),
        (
            "keep_out: [{box_m: [2000, 2100, 10, 4990]}]",
            "m.yaml:1:12: keep_out[0]: with 20 m kept from it, cuts the area",
        ),
        (
            "keep_out: [{box_m: [9, 99, 900, 990]}, {box_m: [2000, 2100, 0, 2500]}, "
            "{box_m: [2050, 2150, 2400, 5000]}]",
            "m.yaml:1:72: keep_out[2]: with 20 m kept from it, cuts the area",
        ),
        ("area: {size_m: [30, 500]}", "m.yaml:1:8: area.size_m: a fence margin of 20 m leaves nothing"),
        (
            "safety: {fence_margin_m: 2500}",
            "m.yaml:1:10: safety.fence_margin_m: a fence margin of 2500 m leaves nothing",
        ),
        (
            "area: {polygon_m: [[0,0],[900,0],[900,480],[930,480],[930,0],[2000,0],"
            "[2000,999],[930,999],[930,520],[900,520],[900,999],[0,999]]}",
            "m.yaml:1:8: area.polygon_m: a fence margin of 20 m cuts the area in parts",
        ),
        (
            "vehicles: {count: 1, launch: [[10, 500]]}",
            "m.yaml:1:31: vehicles.launch[0]: [10.0, 500.0] is nearer than",
        ),
        (
            "vehicles: {count: 1, launch: [[-10, 500]]}",
            "m.yaml:1:31: vehicles.launch[0]: [-10.0, 500.0] is outside",
        ),
        (
            "vehicles: [{launch: [500, 500]}]\nkeep_out: [{circle_m: {center_m: [550, 500], radius_m: 60}}]",
            "m.yaml:1:13: vehicles[0].launch: [500.0, 500.0] is inside keep_out[0] (move the launch point)",
        ),
        (
            "vehicles: {count: 2, launch: [[100, 100], [110, 100]]}",
            "m.yaml:1:43: vehicles.launch[1]: 10.0 m from launch point 0, nearer than safety.separation_m",
        ),
        (
            "vehicles: {count: 2, launch: [[100, 100]]}",
            "m.yaml:1:22: vehicles.launch: 1 launch points for 2 vehicles",
        ),
        (
            "vehicles: {spacing_m: 10}",
            "m.yaml:1:12: vehicles.spacing_m: 10 m is less than safety.separation_m",
        ),
        (
            "vehicles: {count: 400}\narea: {size_m: [200, 200]}",
            "m.yaml:1:1: vehicles.launch: corner: a grid of 380 x 380",
        ),
        ("keep_out: [{box_m: [0, 60, 0, 60]}]", "m.yaml:1:1: vehicles.launch: corner: a grid of 40 x 20 m"),
        (
            "vehicles: [{launch: [100, 100]}, {launch: corner}]",
            "m.yaml:1:35: vehicles[1].launch: is corner, but a point for the first vehicle",
        ),
        (
            "safety: {minimum_vehicles: 7}",
            "m.yaml:1:10: safety.minimum_vehicles: 7, but there are 6 vehicles",
        ),
        (
            "vehicles: [{speed_mps: 9}, {radio: {delay_s: 2}}]",
            "m.yaml:1:37: vehicles[1].radio.delay_s: the delay is that of the network",
        ),
        ("planner: {period_s: 0.25}", "m.yaml:1:11: planner.period_s: 0.25 s is 2.5 setpoints at 10 Hz"),
        (
            "targets: {positions_m: [[9, 9], [5001, 0]]}",
            "m.yaml:1:33: targets.positions_m[1]: target 1 at [5001.0, 0.0] is outside",
        ),
        ("targets: {positions_m: [[9, 9]], count: 2}", "m.yaml:1:34: targets.count: 2, but 1 are placed"),
        ("targets: {positions_m: [], file: x}", "m.yaml:1:1: targets: give only one of file and positions_m"),
    ],
)
def test_keys_that_do_not_go_together(complaints: Complaints, text: str, line: str) -> None:
    (found,) = complaints(text)
    assert found.startswith(line)


def test_everything_wrong_is_said_at_once(complaints: Complaints) -> None:
    found = complaints(
        "nmae: x\n"
        "area: {polygon_m: [[0, 0], [1000, 1000], [1000, 0], [0, 1000]]}\n"
        "vehicles: {count: two, speed_mps: 31}\n"
        "keep_out: [{circle_m: {center_m: [1, 1]}}]\n"
        "targets: {file: none.geojson}\n"
        "planner: {algorithm: pso, parameters: {fco: {inertai: 1}}}\n"
        "safety: {separation_m: .nan}\n"
        "radio: {loss: 2}\n"
        "radio: {loss: 0}\n",
        {"planner.period_s": 0.25, "sensor.range": 5},
    )
    assert [line.split(": ")[:2] for line in found] == [
        ["m.yaml:1:1", "nmae"],
        ["m.yaml:2:8", "area.polygon_m"],
        ["m.yaml:3:12", "vehicles.count"],
        ["m.yaml:3:24", "vehicles.speed_mps"],
        ["m.yaml:4:13", "keep_out[0].circle_m.radius_m"],
        ["m.yaml:5:11", "targets.file"],
        ["m.yaml:6:11", "planner.algorithm"],
        ["m.yaml:6:46", "planner.parameters.fco.inertai"],
        ["m.yaml:7:10", "safety.separation_m"],
        ["m.yaml:8:9", "radio.loss"],
        ["m.yaml:9:1", "radio"],
        ["command line", "sensor.range"],
        ["command line", "planner.period_s"],
    ]


def test_one_mistake_is_said_once(complaints: Complaints) -> None:
    # A fence that crosses itself leaves nothing to say of the pads and targets in it.
    text = "area: {polygon_m: [[0, 0], [9, 9], [9, 0], [0, 9]]}\ntargets: {positions_m: [[99, 99]]}"
    assert len(complaints(text)) == 1
