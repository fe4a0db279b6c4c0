"""A replay that differs says where, when, for whom, and what went in; and exits with 5."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from swarmctl.cli import main
from swarmctl.core import planners, stages
from swarmctl.core.world import World
from swarmctl.record import mcap_read
from swarmctl.record.mcap_read import Rows

from .flown import Flown, fly, read_with_pymavlink
from .rewritten import rewrite, unchanged


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """A good recording."""
    return fly(tmp_path_factory.mktemp("good"))


Altered = Callable[[Callable[[Rows], None]], Path]


@pytest.fixture
def altered(flown: Flown, tmp_path: Path) -> Altered:
    """Make a run folder from the good one, with a change in its recording."""

    def alter(change: Callable[[Rows], None]) -> Path:
        rewrite(flown.folder.mcap, tmp_path / "flight.mcap", change)
        (tmp_path / "mission.yaml").write_bytes(flown.folder.mission.read_bytes())
        (tmp_path / "flight.tlog").write_bytes(flown.folder.tlog.read_bytes())
        return tmp_path

    return alter


def replay(run: Path, *flags: str) -> Result:
    """``swarmctl replay RUN``; a traceback fails the test."""
    result = CliRunner().invoke(main, ["replay", str(run), *flags])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def replayed(run: Path, *flags: str) -> tuple[int, dict[str, Any]]:
    """The exit code and the JSON of a replay."""
    result = replay(run, "--json", *flags)
    content: dict[str, Any] = json.loads(result.stdout)
    return result.exit_code, content


def change_one(topic: str, nth: int, field: str, vehicle: int, by: float) -> Callable[[Rows], None]:
    """Add ``by`` to one field of one vehicle in the ``nth`` message of a topic."""
    count = 0

    def change(message: Rows) -> None:
        nonlocal count
        if message.topic == topic:
            if count == nth:
                message.rows[field][vehicle - 1] += by
            count += 1

    return change


def test_a_copy_replays_identically(altered: Altered) -> None:
    code, said = replayed(altered(unchanged))
    assert (code, said["first_difference"], said["identical"]) == (0, None, said["decisions"])
    assert said["decisions"] == 210
    text = replay(altered(unchanged))
    assert "210 of 210 decisions identical" in text.stdout


def test_a_changed_setpoint_is_the_guards(altered: Altered) -> None:
    run = altered(change_one("/ticks", 400, "set_v_east", vehicle=2, by=1e-9))
    code, said = replayed(run)
    first = said["first_difference"]
    assert code == 5
    assert (said["decisions"], said["identical"]) == (210, 209)
    assert said["setpoints"] - said["setpoints_identical"] == 1
    assert (first["stage"], first["vehicle"]) == ("guard", 2)
    assert first["recorded"]["set_v_east"] - first["recomputed"]["set_v_east"] == pytest.approx(
        1e-9, abs=1e-12
    )
    assert said["largest_difference_mps"] == pytest.approx(1e-9, abs=1e-12)
    assert first["input"]["pose"]["up"] > 0.0
    text = replay(run)
    assert text.exit_code == 5
    assert all(word in text.stdout for word in ("209 of 210", '"guard"', '"vehicle": 2', '"pose"'))


def test_a_changed_wish_is_the_planners(altered: Altered) -> None:
    run = altered(change_one("/decisions", 33, "v_north", vehicle=3, by=0.5))
    code, said = replayed(run)
    first = said["first_difference"]
    assert code == 5
    assert said["identical"] == 209
    assert (first["stage"], first["tick"], first["vehicle"]) == ("plan", 33, 3)
    assert first["recorded"]["v_north"] - first["recomputed"]["v_north"] == pytest.approx(0.5)
    assert said["largest_difference_mps"] == pytest.approx(0.5)
    assert set(first["input"]) >= {"pose", "knowledge", "memory", "heard"}


def test_a_changed_observation_shows_in_the_same_tick(altered: Altered, flown: Flown) -> None:
    changed: list[tuple[int, int]] = []

    def move_a_report(message: Rows) -> None:
        if message.topic == "/observations" and len(message.rows) and not changed and message.tick > 5:
            changed.append((message.tick, int(message.rows["vehicle"][0]) + 1))
            message.rows["id"][0] = (message.rows["id"][0] + 7) % 80

    run = altered(move_a_report)
    code, said = replayed(run)
    assert changed
    assert code == 5
    assert said["first_difference"]["stage"] in ("beacon", "plan")
    assert said["first_difference"]["tick"] >= changed[0][0]
    assert said["identical"] < 210


def test_a_changed_pose_shows_in_the_same_tick(altered: Altered) -> None:
    changed: list[int] = []

    def put_one_beside_another(message: Rows) -> None:
        if message.topic == "/ticks" and (message.rows["stage"] == stages.SEARCH).all() and not changed:
            changed.append(message.tick)
            for name in ("east", "north", "up"):
                message.rows[name][0] = message.rows[name][1] + 1.0

    code, said = replayed(altered(put_one_beside_another))
    first = said["first_difference"]
    assert code == 5
    # The first search tick is a planner tick too: the beacon that tells the pose is the first to differ.
    assert (first["stage"], first["tick"]) == ("beacon", 0)
    assert said["identical"] < 210


def test_a_recorded_nan_is_a_difference_and_not_an_error(altered: Altered) -> None:
    code, said = replayed(altered(change_one("/ticks", 300, "set_v_north", vehicle=1, by=np.nan)))
    assert code == 5
    assert said["first_difference"]["recorded"]["set_v_north"] == "nan"


def test_a_planner_that_was_changed_since_differs(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    decide = World.decide

    def turned(world: World, tick: int) -> None:
        decide(world, tick)
        if tick == 41:
            world.wishes["v_east"][1] += 0.25

    monkeypatch.setattr(World, "decide", turned)
    code, said = replayed(flown.folder.path)
    first = said["first_difference"]
    assert code == 5
    assert (first["stage"], first["tick"], first["vehicle"]) == ("plan", 41, 2)
    assert said["identical"] == 209


@pytest.mark.parametrize("name", [name for name in planners.MODULES if name != "fco"])
def test_another_algorithm_differs_by_how_much(flown: Flown, name: str) -> None:
    code, said = replayed(flown.folder.path, "--algo", name)
    assert code == 5
    assert said["decisions"] == 210
    assert said["identical"] < 210
    assert 1.0 < said["largest_difference_mps"] <= 36.0 + 1e-9
    assert said["first_difference"]["stage"] == "plan"
    text = replay(flown.folder.path, "--algo", name)
    assert text.exit_code == 5
    assert "wishes differ by" in text.stdout
    assert said["mean_difference_mps"] > 1.0


def test_the_recorded_algorithm_by_name_is_no_other(flown: Flown) -> None:
    code, said = replayed(flown.folder.path, "--algo", "fco")
    assert (code, said["identical"], said["setpoints"] > 0) == (0, 210, True)


def test_a_recording_that_was_cut_off_replays_as_far_as_it_goes(flown: Flown, tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    rewrite(flown.folder.mcap, whole, unchanged, chunk_bytes=20_000)
    data = whole.read_bytes()
    (tmp_path / "flight.mcap").write_bytes(data[: len(data) * 4 // 10])
    (tmp_path / "mission.yaml").write_bytes(flown.folder.mission.read_bytes())
    code, said = replayed(tmp_path)
    assert (code, said["truncated"]) == (0, True)
    assert 0 < said["decisions"] < 210
    assert said["identical"] == said["decisions"]
    assert "cut off" in replay(tmp_path).stdout


@pytest.mark.parametrize("snapshot", [1, 4, 6])
def test_replay_begins_at_any_snapshot(flown: Flown, tmp_path: Path, snapshot: int) -> None:
    """All that matters is in a snapshot: the ticks before it are not needed."""
    states = list(mcap_read.read(flown.folder.mcap).rows("/state"))
    begin_s = states[snapshot].time_s
    rewrite(flown.folder.mcap, tmp_path / "flight.mcap", unchanged, begin_s=begin_s)
    (tmp_path / "mission.yaml").write_bytes(flown.folder.mission.read_bytes())
    code, said = replayed(tmp_path)
    assert (said["decisions"], said["identical"]) == (210 - 30 * snapshot, 210 - 30 * snapshot)
    assert (code, said["setpoints_identical"]) == (0, said["setpoints"])


def test_a_recording_that_was_cut_off_before_the_flight_is_told(flown: Flown, tmp_path: Path) -> None:
    (tmp_path / "flight.mcap").write_bytes(flown.folder.mcap.read_bytes()[:300])
    (tmp_path / "mission.yaml").write_bytes(flown.folder.mission.read_bytes())
    result = replay(tmp_path)
    assert result.exit_code == 2
    assert "flight.mcap: no flight in it" in result.stderr


def test_the_first_half_of_a_flight_is_the_same_half(altered: Altered, flown: Flown) -> None:
    run = altered(unchanged)
    kept = bytearray()
    for message in read_with_pymavlink(flown.folder.tlog):
        if message._timestamp < 60.0:
            kept += stamped(message)
    (run / "flight.tlog").write_bytes(kept)
    code, said = replayed(run, "--stub")
    assert (code, said["missing"], said["identical"]) == (0, 0, said["positions"])
    assert said["positions"] > 1000


def test_setpoints_that_are_missing_fly_another_track(altered: Altered, flown: Flown) -> None:
    run = altered(unchanged)
    kept = bytearray()
    for message in read_with_pymavlink(flown.folder.tlog):
        is_setpoint = message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
        if not (is_setpoint and message.target_system == 1 and 40.0 <= message._timestamp < 40.8):
            kept += stamped(message)
    (run / "flight.tlog").write_bytes(kept)
    code, said = replayed(run, "--stub")
    assert code == 5
    assert said["identical"] < said["positions"]
    assert said["max_m"] > said["rms_m"] > 0.0
    text = replay(run, "--stub")
    assert text.exit_code == 5
    assert f"{said['identical']} of {said['positions']} positions identical" in text.stdout


def stamped(message: Any) -> bytes:
    """A message as it lies in a tlog."""
    stamp: int = round(message._timestamp * 1e6)
    return stamp.to_bytes(8, "big") + bytes(message.get_msgbuf())


def test_stub_replay_without_a_tlog_is_told(altered: Altered) -> None:
    run = altered(unchanged)
    (run / "flight.tlog").unlink()
    result = replay(run, "--stub")
    assert result.exit_code == 2
    assert "flight.tlog: cannot read: No such file" in result.stderr


@pytest.mark.parametrize(
    ("name", "message"),
    [("missing", "no such run"), ("empty", "not a run folder"), ("file", "not a folder")],
)
@pytest.mark.parametrize("flag", [(), ("--stub",), ("--json",), ("--algo", "mdc")])
def test_what_is_no_run_is_told(name: str, message: str, flag: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("x")
    result = replay(tmp_path / name, *flag)
    assert result.exit_code == 2
    assert message in result.stderr
    assert str(tmp_path / name) in result.stderr
    assert result.stdout == ""
