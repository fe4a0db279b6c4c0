"""Live flights as a user starts them: commands in processes of their own, and what is read of them."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

HOME = (47.397742, 8.545594)
SPEED = "10"
MISSION = """
name: there
origin: {lat: 47.3960, lon: 8.5430, alt_m: 488.0}
area: {size_m: [600, 600]}
sensor: {range_m: 40}
targets: {clusters: 4, count: 80, radius_m: 40}
duration_s: 30
"""
GROUP = "vehicles: {count: 2, speed_mps: 8, altitude_m: 10}\n"
PATIENCE_S = 120
Start = Callable[..., subprocess.Popen[str]]


def fleet_of(*entries: str) -> str:
    """A mission with one entry a vehicle."""
    return MISSION + "vehicles:\n" + "".join(f"  - {{speed_mps: 8, altitude_m: 10, {e}}}\n" for e in entries)


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts `python -m MODULE WORDS`; whatever still runs at the end is killed."""
    running: list[subprocess.Popen[str]] = []

    def run(module: str, *words: Any) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", module, *map(str, words)]
        pipe = subprocess.PIPE
        running.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True))
        return running[-1]

    yield run
    for process in running:
        process.kill()
        process.communicate()


@pytest.fixture
def stubs(start: Start) -> Callable[..., subprocess.Popen[str]]:
    """Two stub vehicles, when they are there."""

    def run(*words: Any) -> subprocess.Popen[str]:
        home = f"{HOME[0]},{HOME[1]},488"
        process = start("sim_vehicle_stub.cli", "--vehicles", 2, "--home", home, "--speed", SPEED, *words)
        read_until(process, "Ctrl-C ends")
        return process

    return run


def read_until(process: subprocess.Popen[str], word: str) -> str:
    """Read stderr until a line holds ``word``; that line."""
    assert process.stderr is not None
    seen = []
    for line in process.stderr:
        seen.append(line)
        if word in line:
            return line
    raise AssertionError(f"{word!r} was never said: {seen}")


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "there.yaml"
    path.write_text(text)
    return path


def flown(process: subprocess.Popen[str]) -> tuple[int, dict[str, Any]]:
    """Wait for a flight's end: exit code and summary."""
    out, err = process.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in err, err
    assert out, err
    return process.returncode, json.loads(out)
