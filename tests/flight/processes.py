"""Commands in processes of their own, as tests of live flights start them, and the mission that they fly."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

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
