"""Each algorithm flies the small mission, everybody lands at home, and the run folder holds what it must."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from sim_vehicle_stub.configured import configured_fleet
from swarmctl.core.planners import MODULES
from swarmctl.mission.load import load
from swarmctl.record import mcap_read
from swarmctl.record.replay import replay
from swarmctl.record.stub_replay import replay_stub

from .flown import Flown, fly, nearest_approach, outside, read_with_pymavlink, told_positions

NUMBER = (int, float)
TOP: dict[str, tuple[type, ...]] = {
    "algorithm": (str,),
    "vehicles": (int,),
    "seed": (int,),
    "duration_s": (float,),
    "speed": (str,),
    "wall_s": NUMBER,
    "real_time_factor": NUMBER,
    "targets": (int,),
    "detected": (int,),
    "detected_fraction": NUMBER,
    "time_to_s": (dict,),
    "mean_targets_in_range": NUMBER,
    "min_separation_m": NUMBER,
    "geofence_violations": (int,),
    "setpoints_sent": (int,),
    "messages_received": (int,),
    "decisions": (int,),
    "setpoint_interval_ms": (dict,),
    "per_vehicle": (list,),
    "run": (str,),
}
PER_VEHICLE: dict[str, tuple[type, ...]] = {
    "id": (int,),
    "autopilot": (str,),
    "outcome": (str,),
    "detected": (int,),
    "distance_m": NUMBER,
    "events": (list,),
    "link": (dict,),
}
LINK = {
    "messages_lost": 0,
    "loss": 0.0,
    "messages_late": 0,
    "messages_bad": 0,
    "setpoint_interval_ms": {"min": 100.0, "p50": 100.0, "p99": 100.0, "max": 100.0},
    "round_trip_ms": {"min": 100.0, "p50": 100.0, "p99": 100.0, "max": 100.0},
}
"""In lockstep nothing is lost, and an answer comes in the next tick."""
MOST_EXTRA_KEYS = 4


@pytest.fixture(scope="module", params=list(MODULES))
def flown(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """The small mission, flown once with each algorithm."""
    name = request.param
    return fly(tmp_path_factory.mktemp(name), {"planner.algorithm": name})


@pytest.fixture(scope="module")
def messages(flown: Flown) -> list[Any]:
    """Everything in flight.tlog, read by pymavlink."""
    return read_with_pymavlink(flown.folder.tlog)


def test_everybody_lands_on_its_own_pad(flown: Flown, messages: list[Any]) -> None:
    assert flown.outcome.exit_code() == 0
    assert [v["outcome"] for v in flown.summary["per_vehicle"]] == ["landed"] * 3
    assert [v["events"] for v in flown.summary["per_vehicle"]] == [[], [], []]
    told = told_positions(messages, 3)
    fleet = flown.outcome.world.fleet
    assert np.hypot(told.east[-1] - fleet["pad_east"], told.north[-1] - fleet["pad_north"]).max() < 1.0
    assert not told.airborne[-1].any()
    assert told.airborne.any(axis=0).all()
    armed = {m.get_srcSystem(): m.base_mode & 128 for m in messages if m.get_type() == "HEARTBEAT"}
    assert {system: armed[system] for system in (1, 2, 3)} == {1: 0, 2: 0, 3: 0}


def test_every_decision_and_setpoint_is_recomputed_bit_for_bit(flown: Flown) -> None:
    result = replay(mcap_read.read(flown.folder.mcap))
    assert result.decisions == result.identical == 3 * 70 == flown.summary["decisions"]
    assert result.setpoints == result.setpoints_identical > 3 * 700
    assert (result.first_difference, result.largest_difference_mps, result.truncated) == (None, 0.0, False)


def test_fresh_stubs_fly_the_same_track(flown: Flown, messages: list[Any]) -> None:
    result = replay_stub(flown.folder, configured_fleet)
    told = sum(m.get_type() == "GLOBAL_POSITION_INT" for m in messages)
    assert (result.positions, result.identical, result.missing, result.max_m) == (told, told, 0, 0.0)


def test_summary_has_the_promised_keys_and_types(flown: Flown) -> None:
    written = json.loads(flown.folder.summary.read_text())
    assert written == flown.summary
    assert [key for key in TOP if not isinstance(written[key], TOP[key])] == []
    assert len(written) <= len(TOP) + MOST_EXTRA_KEYS
    for vehicle in written["per_vehicle"]:
        assert list(vehicle) == list(PER_VEHICLE)
        assert [key for key in PER_VEHICLE if not isinstance(vehicle[key], PER_VEHICLE[key])] == []
        assert {key: vehicle["link"][key] for key in LINK} == LINK
        assert vehicle["link"]["messages_received"] > 1000
        assert vehicle["link"]["setpoints_sent"] > 500
    assert [v["id"] for v in written["per_vehicle"]] == [1, 2, 3]
    assert {v["autopilot"] for v in written["per_vehicle"]} == {"px4"}
    assert list(written["time_to_s"]) == ["25", "50", "75", "85"]
    assert written["setpoint_interval_ms"] == {"p50": 100.0, "p99": 100.0}
    assert (written["vehicles"], written["seed"], written["duration_s"]) == (3, 1, 70.0)
    assert (written["speed"], written["targets"]) == ("max", 80)


def test_summary_figures_agree_with_one_another(flown: Flown) -> None:
    s = flown.summary
    times = list(s["time_to_s"].values())
    reached = [level for level, t in zip((25, 50, 75, 85), times, strict=True) if t is not None]
    assert s["detected"] > 0
    assert s["detected_fraction"] == pytest.approx(s["detected"] / 80, abs=1e-6)
    assert reached == [level for level in (25, 50, 75, 85) if s["detected"] * 100 >= level * 80]
    known = [t for t in times if t is not None]
    assert known == sorted(known)
    assert all(0.0 <= t <= 70.0 for t in known)
    most, together = (
        max(v["detected"] for v in s["per_vehicle"]),
        sum(v["detected"] for v in s["per_vehicle"]),
    )
    assert most <= s["detected"] <= together
    assert s["run"] == str(flown.folder.path)


def test_limits_recomputed_from_the_tlog_are_those_of_the_summary(flown: Flown, messages: list[Any]) -> None:
    told = told_positions(messages, 3)
    nearest = nearest_approach(told)
    assert nearest is not None
    assert nearest >= flown.mission.safety.separation_m
    assert nearest == pytest.approx(flown.summary["min_separation_m"], abs=0.05)
    assert outside(told, slack_m=0.05) == flown.summary["geofence_violations"] == 0
    for i, vehicle in enumerate(flown.summary["per_vehicle"]):
        steps = np.hypot(np.diff(told.east[:, i]), np.diff(told.north[:, i]))
        assert steps.sum() == pytest.approx(vehicle["distance_m"], rel=0.02)


def test_the_tlog_is_whole_and_its_counts_are_those_of_the_summary(flown: Flown, messages: list[Any]) -> None:
    size = sum(8 + len(m.get_msgbuf()) for m in messages)
    assert flown.folder.tlog.stat().st_size == size
    assert not any(m.get_type() == "BAD_DATA" for m in messages)
    assert sum(m.get_srcSystem() in (1, 2, 3) for m in messages) == flown.summary["messages_received"]
    stamps = [m._timestamp for m in messages]
    assert stamps == sorted(stamps)
    for sender in (1, 2, 3):
        numbers = [m.get_seq() for m in messages if m.get_srcSystem() == sender]
        assert numbers == [(numbers[0] + k) % 256 for k in range(len(numbers))]


def test_positions_come_ten_times_a_second_and_setpoints_go_out_so_often(
    flown: Flown, messages: list[Any]
) -> None:
    setpoints = [m for m in messages if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED"]
    assert len(setpoints) >= flown.summary["setpoints_sent"] >= 3 * 700
    told = told_positions(messages, 3)
    searching = told.times_s[told.airborne.all(axis=1)]
    assert np.diff(searching) == pytest.approx(0.1, abs=1e-5)


def test_the_mission_is_written_so_that_it_loads_back_equal(flown: Flown) -> None:
    again = load(flown.folder.mission)
    assert again == flown.mission
    assert again.model_dump() == flown.mission.model_dump()


def test_the_picture_is_a_png_of_a_sensible_size(flown: Flown) -> None:
    data = flown.folder.tracks.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert 800 <= width <= 4000
    assert 400 <= height <= 3000
    assert data[-8:-4] == b"IEND"
    assert 20_000 < len(data) < 2_000_000


def test_a_reader_that_is_not_ours_finds_every_topic_in_the_mcap(flown: Flown) -> None:
    with flown.folder.mcap.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        whole = reader.get_summary()
        assert whole is not None
        assert whole.statistics is not None
        count = {whole.channels[k].topic: n for k, n in whole.statistics.channel_message_counts.items()}
        assert [a.data.decode() for a in reader.iter_attachments()] == [flown.folder.mission.read_text()]
    assert {count[t] for t in ("/rules", "/fleet", "/settings", "/targets", "/fence")} == {1}
    assert {count[t] for t in ("/observations", "/beacons", "/heard", "/decisions")} == {70}
    assert (count["/state"], count["/ticks"] > 700) == (7, True)


def test_observations_in_the_recording_are_what_the_summary_counts(flown: Flown) -> None:
    log = mcap_read.read(flown.folder.mcap)
    seen: set[int] = set()
    for message in log.rows("/observations"):
        seen |= {int(serial) for serial in message.rows["id"] if serial < 80}
    assert len(seen) == flown.summary["detected"]


def only(path: Path) -> list[str]:
    """The names in a folder."""
    return sorted(item.name for item in path.iterdir())


def test_the_folder_holds_the_promised_files_and_nothing_else(flown: Flown) -> None:
    names = ["flight.mcap", "flight.tlog", "mission.yaml", "summary.json", "tracks.png"]
    assert only(flown.folder.path) == names
