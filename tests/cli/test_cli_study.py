"""``swarmctl study``: tables or JSON on stdout, progress on stderr, a folder, and a plain word for bad input."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from swarmctl import study_cli
from swarmctl.study import execute

from .given import SMALL, Swarmctl

ROOT = Path(__file__).parents[2]
FILES = ["found.png", "mission.yaml", "pairs.png", "study.json", "times.png"]
FAST = ("--algo", "bounce,fco", "--runs", 6)
PATIENCE_S = 120
MANY = """
area: {size_m: [9000, 9000]}
vehicles: {count: 1500}
"""


def test_a_study_prints_its_tables_and_where_it_is(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    result = swarmctl("study", "--mission", small, *FAST, "--out", tmp_path / "a" / "b")
    assert result.exit_code == 0
    for part in ("Seconds to a share", "Median of all 6 runs", "95 % interval", "fco", "bounce", "earlier"):
        assert part in result.stdout
    assert result.stdout.endswith(f"run: {tmp_path / 'a' / 'b'}\n")
    assert "studying bounce, fco on small: 6 runs each, 3 vehicles, ideal dynamics" in result.stderr
    assert "bounce: 6 runs done\nfco: 6 runs done\n" in result.stderr
    assert "\x1b" not in result.output
    assert "\r" not in result.output
    assert sorted(path.name for path in (tmp_path / "a" / "b").iterdir()) == FILES


def test_json_is_the_file_and_nothing_else(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    result = swarmctl("study", "--mission", small, *FAST, "--seed", 9, "--json", "--out", tmp_path / "run")
    content = json.loads(result.stdout)
    assert content == json.loads((tmp_path / "run" / "study.json").read_text())
    assert (content["runs"], content["seed"], content["vehicles"]) == (6, 9, 3)
    assert list(content["algorithms"]) == ["bounce", "fco"]


def algorithms_told(swarmctl: Swarmctl, *arguments: object) -> Any:
    result = swarmctl("study", *arguments, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)["algorithms"]


def test_workers_change_nothing_but_the_time(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    one, three = (
        algorithms_told(swarmctl, "--mission", small, *FAST, "--workers", n, "--out", tmp_path / str(n))
        for n in (1, 3)
    )
    assert one == three


def test_the_mission_that_is_kept_gives_the_study_again(
    swarmctl: Swarmctl, small: Path, tmp_path: Path
) -> None:
    flags = ("--vehicles", 4, "--duration", 50, "--set", "planner.inertia=0.9", "--set", "radio.range_m=100")
    first = algorithms_told(swarmctl, "--mission", small, *FAST, *flags, "--out", tmp_path / "a")
    again = algorithms_told(
        swarmctl, "--mission", tmp_path / "a" / "mission.yaml", *FAST, "--out", tmp_path / "b"
    )
    assert first == again
    assert first["fco"]["curve"]["t_s"][-1] == 50.0


def test_a_seed_s_runs_are_those_of_a_study_that_begins_there(
    swarmctl: Swarmctl, small: Path, tmp_path: Path
) -> None:
    whole = algorithms_told(swarmctl, "--mission", small, *FAST, "--out", tmp_path / "a")
    late = algorithms_told(
        swarmctl, "--mission", small, "--algo", "fco", "--runs", 2, "--seed", 5, "--out", tmp_path / "b"
    )
    assert late["fco"]["per_run"]["25"] == whole["fco"]["per_run"]["25"][4:]


def test_a_grid_is_told_in_rows_and_heat_maps(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    flags = (
        "--set",
        "planner.inertia=0.1,0.4",
        "--set",
        "radio.range_m=0,100,300",
        "--out",
        tmp_path / "run",
    )
    result = swarmctl("study", "--mission", small, *FAST, *flags)
    assert result.exit_code == 0
    assert "bounce: seconds to a share" in result.stdout
    assert result.stdout.count("0.4      ") >= 6
    assert "fco, planner.inertia=0.4, radio.range_m=300: 6 runs done" in result.stderr
    names = sorted(path.name for path in (tmp_path / "run").iterdir())
    assert names == ["grid-bounce.png", "grid-fco.png", "mission.yaml", "study.json"]
    content = json.loads((tmp_path / "run" / "study.json").read_text())
    assert len(content["grid"]) == 6


def test_one_setting_is_told_above_the_tables(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    result = swarmctl(
        "study", "--mission", small, *FAST, "--set", "radio.range_m=7", "--out", tmp_path / "run"
    )
    assert result.stdout.startswith("radio.range_m=7\n\nSeconds to")


def test_all_algorithms_are_studied_unless_some_are_named() -> None:
    with study_cli.study.make_context("study", []) as context:
        assert context.params["algorithms"] == tuple(study_cli.MODULES)


def test_the_folder_is_named_by_time(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = swarmctl("study", "--mission", small, "--algo", "bounce", "--runs", 1)
    (run,) = (tmp_path / "runs").iterdir()
    assert run.name.endswith("-study")
    assert len(run.name) == len("20261122-051500-study")
    assert f"run: runs/{run.name}" in result.stdout


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--algo", "pso"), ("--algo", "'pso' is not one of", "fco")),
        (("--algo", "fco,"), ("--algo", "'' is not one of")),
        (("--runs", "0"), ("--runs", "0 is not in the range")),
        (("--runs", "many"), ("--runs", "not a valid integer")),
        (("--seed", "-1"), ("--seed", "not in the range")),
        (("--workers", "0"), ("--workers", "0 is not in the range")),
        (("--vehicles", "0"), ("--vehicles", "0 is not in the range")),
        (("--vehicles", "20000"), ("command line: vehicles.count", "10000")),
        (("--duration", "nan"), ("command line: duration_s", "finite")),
        (("--set", "planner.inertia"), ("--set planner.inertia", "KEY=VALUE")),
        (("--set", "radio.lost=0.1"), ("command line: radio.lost: unknown key", "did you mean loss?")),
        (("--set", "radio.loss=0.1,2"), ("command line: radio.loss", "less than or equal to 1, not 2")),
        (("--set", "planner.inertia=x"), ("command line: planner.inertia: must be a number, not 'x'",)),
        (("--set", "planner.personal=1"), ("'personal' is no parameter of bounce",)),
        (("--set", "planner.algorithm=fco"), ("--set planner.algorithm=fco", "--algo")),
        (("--set", "duration_s=5", "--duration", "6"), ("--set duration_s: another flag gives it too",)),
        (("--constant-density",), ("--constant-density needs --vehicles N",)),
        (("--mission", "nowhere.yaml"), ("nowhere.yaml", "no such file")),
        (("--workers", "2", "--cluster", "tcp://127.0.0.1:1"), ("--cluster has workers of its own",)),
        (("extra",), ("unexpected extra argument",)),
    ],
)
def test_bad_input_is_told_and_leaves_nothing(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, flags: tuple[str, ...], words: tuple[str, ...]
) -> None:
    result = swarmctl("study", "--mission", small, *FAST, "--out", tmp_path / "run", *flags)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert [word for word in words if word not in result.stderr] == [], result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["small.yaml"]


def test_a_folder_with_something_in_it_is_left_alone(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    result = swarmctl("study", "--mission", small, *FAST, "--out", tmp_path)
    assert result.exit_code == 2
    assert "not empty (choose another --out" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["small.yaml"]


def test_a_chart_that_cannot_be_written_costs_no_figures(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from swarmctl.record import drawing
    from swarmctl.record.errors import RunFolderError

    def full(path: Path, data: bytes) -> None:
        raise RunFolderError.writing(path, OSError(28, "No space left on device"))

    monkeypatch.setattr(drawing, "write_whole", full)
    result = swarmctl("study", "--mission", small, *FAST, "--out", tmp_path / "run")
    assert result.exit_code == 2
    assert "found.png: cannot write: No space left" in result.stderr
    assert json.loads((tmp_path / "run" / "study.json").read_text())["complete"]


def test_an_error_of_a_run_is_not_swallowed(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execute, "Job", None)
    with pytest.raises(TypeError):
        swarmctl("study", "--mission", small, *FAST, "--out", tmp_path / "run")
    assert not (tmp_path / "run").exists()


class Running:
    """``swarmctl study`` in a process of its own."""

    def __init__(self, folder: Path, mission: str, *flags: str) -> None:
        (folder / "long.yaml").write_text(mission)
        self.folder = folder / "run"
        command = [
            sys.executable,
            "-m",
            "swarmctl.cli",
            "study",
            "--mission",
            "long.yaml",
            "--out",
            "run",
            "--json",
        ]
        self.process = subprocess.Popen(
            [*command, *flags], cwd=folder, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip

    def wait_for(self, word: str) -> None:
        """Read stderr until a line holds ``word``."""
        assert self.process.stderr is not None
        assert any(word in line for line in self.process.stderr), f"{word!r} was never said"

    def end(self) -> tuple[str, str]:
        """Wait for the end: what more was said on stdout and stderr."""
        return self.process.communicate(timeout=PATIENCE_S)


@contextmanager
def started(folder: Path, mission: str, *flags: str) -> Iterator[Running]:
    running = Running(folder, mission, *flags)
    try:
        yield running
    finally:
        running.process.kill()
        running.process.communicate()


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    """A study of some seconds."""
    mission = SMALL.replace("duration_s: 30", "duration_s: 3000")
    with started(tmp_path, mission, "--algo", "bounce,fco,sweep", "--runs", "1000") as running:
        yield running


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_it_keeps_what_is_finished(running: Running, number: int) -> None:
    running.wait_for("bounce: 1000 runs done")
    running.process.send_signal(number)
    said, told = running.end()
    assert running.process.returncode == 4
    assert "Traceback" not in told
    assert "stopping; press Ctrl-C again to stop at once" in told
    content = json.loads(said)
    assert content == json.loads((running.folder / "study.json").read_text())
    assert "bounce" in content["algorithms"]
    assert "sweep" not in content["algorithms"]
    assert content["complete"] is False
    kept = 1000 * len(content["algorithms"])
    assert f"kept the {kept} of 3000 runs whose algorithms were finished" in told


def test_stopped_before_anything_is_finished_it_leaves_nothing(running: Running) -> None:
    running.wait_for("studying bounce")
    running.process.send_signal(signal.SIGINT)
    said, told = running.end()
    assert (running.process.returncode, said) == (4, "")
    assert "nothing was finished, nothing is kept" in told
    assert "Traceback" not in told
    assert not running.folder.exists()


def test_twice_stops_at_once(tmp_path: Path) -> None:
    """Even while threads are in the middle of a run, which here takes a minute."""
    flags = ("--algo", "bounce", "--runs", "4", "--set", "duration_s=5,86000")
    with started(tmp_path, MANY, *flags) as running:
        running.wait_for("bounce, duration_s=5: 4 runs done")
        running.process.send_signal(signal.SIGINT)
        running.wait_for("kept the 4 of 8 runs")
        with pytest.raises(subprocess.TimeoutExpired):
            running.process.wait(0.5)
        running.process.send_signal(signal.SIGINT)
        assert running.process.wait(5.0) == 4
