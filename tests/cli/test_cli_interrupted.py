"""Ctrl-C and SIGTERM end a flight under way: everybody lands, and the folder is a run like any other."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .given import Swarmctl

ROOT = Path(__file__).parents[2]
LONG = """
name: long
area: {size_m: [3000, 3000]}
vehicles: {count: 6, speed_mps: 25, altitude_m: 20}
targets: {clusters: 5, count: 300, radius_m: 200}
duration_s: 86000
"""
"""So long that the signal always comes before the end: a minute of wall time and more."""
PATIENCE_S = 120


class Flight:
    """``swarmctl fly`` in a process of its own."""

    def __init__(self, folder: Path) -> None:
        (folder / "long.yaml").write_text(LONG)
        self.run = folder / "run"
        command = [sys.executable, "-m", "swarmctl.cli", "fly", "--mission", "long.yaml", "--out", "run"]
        self.process = subprocess.Popen(
            [*command, "--json"], cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        self.said: list[str] = []

    def wait_for(self, word: str) -> None:
        """Read stderr until a line holds ``word``."""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said.append(line)
            if word in line:
                return
        raise AssertionError(f"{word!r} was never said: {self.said}")

    def end(self) -> tuple[int, dict[str, Any]]:
        """Wait for the end: the exit code and the summary from stdout."""
        out, err = self.process.communicate(timeout=PATIENCE_S)
        self.said.append(err)
        assert "Traceback" not in err, err
        summary: dict[str, Any] = json.loads(out)
        return self.process.returncode, summary


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    """A long flight that has just begun to search."""
    flight = Flight(tmp_path)
    try:
        flight.wait_for("searching")
        yield flight
    finally:
        flight.process.kill()
        flight.process.communicate()


def assert_good_run(flight: Flight, summary: dict[str, Any], swarmctl: Swarmctl) -> None:
    """All landed, no limit was broken, and the folder can be read, replayed and drawn."""
    assert summary == json.loads((flight.run / "summary.json").read_text())
    assert [v["outcome"] for v in summary["per_vehicle"]] == ["landed"] * 6
    assert summary["min_separation_m"] >= 15.0
    assert summary["geofence_violations"] == 0
    assert 0.0 < summary["searched_s"] < 86_000.0
    names = ["flight.mcap", "flight.tlog", "mission.yaml", "summary.json", "tracks.png"]
    assert sorted(path.name for path in flight.run.iterdir()) == names
    replayed = json.loads(swarmctl("replay", flight.run, "--json").stdout)
    assert replayed["decisions"] == replayed["identical"] == summary["decisions"] > 0
    assert not replayed["truncated"]
    stubs = json.loads(swarmctl("replay", flight.run, "--stub", "--json").stdout)
    assert stubs["identical"] == stubs["positions"] > 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_once_brings_everybody_home(flight: Flight, number: int, swarmctl: Swarmctl) -> None:
    flight.process.send_signal(number)
    code, summary = flight.end()
    assert code == 4
    said = "".join(flight.said)
    assert "returning; press Ctrl-C again to land now" in said
    assert "landing now" not in said
    assert_good_run(flight, summary, swarmctl)


def test_twice_lands_everybody_now(flight: Flight, swarmctl: Swarmctl) -> None:
    flight.process.send_signal(signal.SIGINT)
    flight.wait_for("press Ctrl-C again")
    flight.process.send_signal(signal.SIGINT)
    code, summary = flight.end()
    assert code == 4
    assert "landing now" in "".join(flight.said)
    assert_good_run(flight, summary, swarmctl)
