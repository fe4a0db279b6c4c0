"""``swarmctl tune`` as it is typed: what it prints where, what it keeps, and how it goes on."""

import fcntl
import json
import os
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml

from .given import SMALL, Swarmctl

ROOT = Path(__file__).parents[2]
PATIENCE_S = 120.0
MANY = ("--trials", "30", "--json")
TUNE = ("tune", "--algo", "bounce", "--runs", "8", "--fresh", "20", "--workers", "2")


def test_stdout_is_a_mission_and_the_folder_keeps_everything(
    swarmctl: Swarmctl, small: Path, tmp_path: Path
) -> None:
    out = tmp_path / "a" / "b"
    result = swarmctl(*TUNE, "--trials", 3, "--mission", small, "--out", out)
    assert result.exit_code == 0, result.stderr
    assert result.stdout == (out / "planner.yaml").read_text()
    assert swarmctl("check", "--mission", out / "planner.yaml").exit_code == 0
    told = json.loads((out / "tune.json").read_text())
    flown = yaml.safe_load(result.stdout)["planner"]["parameters"]["bounce"]
    assert flown == told["parameters"]
    assert (told["trials"], told["metric"], told["fresh"]["runs"]) == (3, "t85", 20)
    assert {file.name for file in out.iterdir()} == {"trials.db", "tune.json", "planner.yaml"}
    assert f"3 trials of 8 runs, into {out}" in result.stderr


def test_the_same_folder_goes_on(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    once = swarmctl(*TUNE, "--trials", 5, "--mission", small, "--out", tmp_path / "once", "--json")
    swarmctl(*TUNE, "--trials", 2, "--mission", small, "--out", tmp_path / "twice")
    again = swarmctl(*TUNE, "--trials", 5, "--mission", small, "--out", tmp_path / "twice", "--json")
    assert json.loads(again.stdout) == json.loads(once.stdout)
    assert "(2 of them are there already)" in again.stderr


@pytest.fixture(scope="module")
def uninterrupted(swarmctl: Swarmctl, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What many trials come to when nothing comes between."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    (folder / "small.yaml").write_text(SMALL)
    result = swarmctl(*TUNE, *MANY, "--mission", folder / "small.yaml", "--out", folder / "out")
    told: dict[str, Any] = json.loads(result.stdout)
    return told


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_a_tuning_that_was_ended_from_outside_goes_on(
    by: signal.Signals, uninterrupted: dict[str, Any], swarmctl: Swarmctl, small: Path, tmp_path: Path
) -> None:
    options = (*TUNE, *MANY, "--mission", str(small), "--out")
    out = tmp_path / "ended"
    process = subprocess.Popen(
        [sys.executable, "-m", "swarmctl.cli", *options, str(out)], text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        wait_for_trials(out / "trials.db", process)
        process.send_signal(by)
        said = process.communicate(timeout=PATIENCE_S)[1]
    finally:
        process.kill()
    if by != signal.SIGKILL:
        assert process.returncode == 4
        assert said.splitlines()[-2:] == [f"what was finished is kept: go on with --out {out}", "stopped"]
    again = swarmctl(*options, out)
    assert again.exit_code == 0, again.stderr
    assert "of them are there already" in again.stderr
    assert json.loads(again.stdout) == uninterrupted


def wait_for_trials(file: Path, process: subprocess.Popen[str]) -> None:
    """Until two trials are finished, and long before all are."""
    deadline = time.monotonic() + PATIENCE_S
    pause = threading.Event()
    while finished_in(file) < 2:
        assert time.monotonic() < deadline and process.poll() is None
        pause.wait(0.02)


def finished_in(file: Path) -> int:
    """How many trials in a file are finished; looked up without touching it."""
    try:
        with closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as trials:
            found = trials.execute("SELECT count(*) FROM trials WHERE state IN ('COMPLETE', 'PRUNED')")
            return int(found.fetchone()[0])
    except sqlite3.OperationalError:  # not made yet
        return 0


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (
            ("--set", "planner.nothing=1"),
            "command line: planner.nothing: 'nothing' is no parameter of bounce",
        ),
        (("--set", "planner.inertia=0.5"), "nothing to tune"),
        (("--set", "duration_s"), "KEY=VALUE"),
        (("--set", "duration_s=20,30"), "--set duration_s: tuning is for one mission"),
        (("--set", "duration_s=soon"), "command line: duration_s"),
        (("--cluster", "tcp://127.0.0.1:9", "--workers", "2"), "no --workers"),
        (("--cluster", "127.0.0.1"), "no Dask scheduler answers there"),
        (("--metric", "t99"), "--metric"),
        (("--mission", "nowhere.yaml"), "nowhere.yaml"),
        (("--trials", "0"), "--trials"),
    ],
)
def test_what_cannot_be_tuned_is_said_and_leaves_nothing(
    options: tuple[str, ...], word: str, swarmctl: Swarmctl, tmp_path: Path
) -> None:
    result = swarmctl("tune", "--algo", "bounce", "--out", tmp_path / "out", *options)
    assert result.exit_code == 2
    assert word in result.stderr
    assert result.stdout == ""
    assert not (tmp_path / "out").exists()


def test_a_folder_with_other_things_in_it_is_refused(swarmctl: Swarmctl, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("all there is")
    result = swarmctl(*TUNE, "--out", tmp_path)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "not empty" in result.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.tex"]


def test_another_question_of_the_same_folder_is_refused(
    swarmctl: Swarmctl, small: Path, tmp_path: Path
) -> None:
    swarmctl(*TUNE, "--trials", 1, "--mission", small, "--out", tmp_path / "out")
    result = swarmctl(*TUNE, "--trials", 1, "--mission", small, "--out", tmp_path / "out", "--metric", "t50")
    assert result.exit_code == 2
    assert "holds trials with another metric" in result.stderr


def test_two_tunings_do_not_share_a_folder(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    swarmctl(*TUNE, "--trials", 1, "--mission", small, "--out", tmp_path / "out")
    other = os.open(tmp_path / "out", os.O_RDONLY)
    try:
        fcntl.flock(other, fcntl.LOCK_EX)
        result = swarmctl(*TUNE, "--trials", 2, "--mission", small, "--out", tmp_path / "out")
    finally:
        os.close(other)
    assert result.exit_code == 2
    assert "another tuning is at work there" in result.stderr
