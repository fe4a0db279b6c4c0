"""kill -9 of a controller in mid-flight, and `swarmctl fly --resume`: real processes over UDP and TCP."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from swarmctl.flight import resumption
from swarmctl.live_cli import free_ports
from swarmctl.record import mcap_read
from swarmctl.record.errors import LogError, RunFolderError
from swarmctl.record.searched import Searched, searched

from .processes import PATIENCE_S, Start, flown, read_until

VEHICLES, TARGETS, SEARCH_S = 2, 40, 40.0
MISSION = f"""
name: there
origin: {{lat: 47.3960, lon: 8.5430, alt_m: 488.0}}
area: {{size_m: [400, 400]}}
vehicles: {{count: {VEHICLES}, speed_mps: 8, altitude_m: 25}}
sensor: {{range_m: 60}}
targets: {{clusters: 4, count: {TARGETS}, radius_m: 150}}
duration_s: {SEARCH_S}
"""
SPEED = "4"
"""No faster: PX4 is home a minute after its controller died, and the next one needs seconds of the wall's."""
STAND_BY = """
import sys
from pathlib import Path
from swarmctl import live_cli, resume_cli
from swarmctl.cli import main
from swarmctl.flight import fly, resumption
from swarmctl.mission.load import load
fly.warm_up(load(Path({mission!r})), "fco")
print("standing by", file=sys.stderr, flush=True)
sys.stdin.readline()
main()
"""
PAUSE_S, DEADLINE_S = 0.2, 90.0
Orphans = Callable[[subprocess.Popen[str]], None]


@pytest.fixture
def kill() -> Iterator[Orphans]:
    """Kills a controller as nothing else can; what it leaves behind is ended with the test."""
    orphans: list[int] = []

    def run(controller: subprocess.Popen[str]) -> None:
        children = Path(f"/proc/{controller.pid}/task/{controller.pid}/children").read_text()
        orphans.extend(map(int, children.split()))
        controller.send_signal(signal.SIGKILL)
        assert controller.wait(10.0) == -signal.SIGKILL

    yield run
    for process in orphans:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGTERM)


@pytest.fixture
def stand_by(mission: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts a controller that has loaded everything and begins at the next line on its standard input."""
    running: list[subprocess.Popen[str]] = []

    def run(*words: Any) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", STAND_BY.format(mission=str(mission)), *map(str, words)]
        pipe = subprocess.PIPE
        running.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True))
        read_until(running[-1], "standing by")
        return running[-1]

    yield run
    for process in running:
        process.kill()
        process.communicate()


def go(process: subprocess.Popen[str]) -> None:
    """Let one that stands by begin."""
    assert process.stdin is not None
    process.stdin.write("go\n")
    process.stdin.flush()


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    path = tmp_path / "there.yaml"
    path.write_text(MISSION)
    return path


def on_record(run: Path) -> Searched:
    """What a recording tells of the search so far."""
    return searched(mcap_read.read(run / "flight.mcap"), VEHICLES, TARGETS)


def wait_for_search(run: Path, ticks: int) -> None:
    """Until so many planner ticks are on record, and something was found."""
    pause = threading.Event()
    for _ in range(round(DEADLINE_S / PAUSE_S)):
        with suppress(LogError):
            planned = sum(1 for _ in mcap_read.read(run / "flight.mcap").rows("/decisions"))
            if planned >= ticks and (on_record(run).found >= 0).any():
                return
        pause.wait(PAUSE_S)
    raise AssertionError(f"no {ticks} planner ticks within {DEADLINE_S} s")


def check(run: Path, summary: dict[str, Any], start: Start) -> None:
    """The resumed flight ended well, lost nothing, and both recordings can be replayed."""
    assert [v["outcome"] for v in summary["per_vehicle"]] == ["landed"] * VEHICLES
    assert summary["searched_s"] == SEARCH_S and summary["geofence_violations"] == 0
    before, after = on_record(run), on_record(Path(summary["run"]))
    assert summary["detected"] == int((after.found >= 0).sum())
    known = before.first_seen >= 0
    assert known.any() and (after.first_seen[known] == before.first_seen[known]).all()
    decisions = 0
    for folder in (run, summary["run"]):
        replay = start("swarmctl", "replay", folder, "--json")
        out, err = replay.communicate(timeout=PATIENCE_S)
        assert replay.returncode == 0, out + err
        decisions += json.loads(out)["decisions"]
    assert decisions >= VEHICLES * SEARCH_S


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_our_own_stubs_outlive_their_controller_and_are_found_again(
    autopilot: str, start: Start, stand_by: Start, kill: Orphans, mission: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    resumed = stand_by("fly", "--resume", run, "--out", tmp_path / "on", "--json")
    flight = start(
        "swarmctl", "fly", "--mission", mission, "--speed", SPEED, "--autopilot", autopilot, "--out", run
    )
    read_until(flight, "searching")
    wait_for_search(run, 15)
    with pytest.raises(RunFolderError, match="this flight is under way"):
        resumption.read(run)
    kill(flight)
    go(resumed)
    code, summary = flown(resumed)
    assert code == 0
    assert summary["speed"] == 4.0
    assert {v["autopilot"] for v in summary["per_vehicle"]} == {autopilot}
    check(run, summary, start)


def test_vehicles_by_url_on_one_port_are_taken_back_after_a_typed_yes(
    start: Start, stubs: Start, stand_by: Start, kill: Orphans, mission: Path, tmp_path: Path
) -> None:
    port = free_ports(VEHICLES)
    stubs("--port", port, "--shared", "--autopilot", "px4,ardupilot", "--speed", SPEED)
    run = tmp_path / "run"
    resumed = stand_by("fly", "--resume", run, "--out", tmp_path / "on", "--json")
    flight = start(
        "swarmctl", "fly", "--mission", mission, "--speed", SPEED, "--yes", "--connect", f"udpin://127.0.0.1:{port}",
        "--out", run,
    )  # fmt: skip
    read_until(flight, "searching")
    wait_for_search(run, 15)
    kill(flight)
    go(resumed)
    said = read_until(resumed, "Type yes")
    assert "found in the air: vehicles 1, 2. Type yes to take them back" in said
    out, err = resumed.communicate("yes\n", timeout=PATIENCE_S)
    assert resumed.returncode == 0, err
    check(run, json.loads(out), start)
