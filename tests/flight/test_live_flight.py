"""Live flights against stub processes over UDP, at many times real time: the same swarm on the wall's clock."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

MISSION = """
name: small
area: {size_m: [300, 300]}
vehicles: {count: 3, speed_mps: 10, altitude_m: 10}
sensor: {range_m: 40}
targets: {clusters: 2, count: 40, radius_m: 40}
safety: {fence_margin_m: 15}
duration_s: 40
"""


def swarmctl(*words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "swarmctl", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.fixture
def mission(tmp_path: Path) -> str:
    path = tmp_path / "small.yaml"
    path.write_text(MISSION)
    return str(path)


def wait_for(process: subprocess.Popen[str], word: str) -> None:
    """Read the flight's progress until a line has ``word``."""
    assert process.stderr is not None
    seen = []
    for line in process.stderr:
        seen.append(line)
        if word in line:
            return
    raise AssertionError(f"no {word!r} in {seen}")


def test_flies_and_replays(mission: str, tmp_path: Path) -> None:
    out = str(tmp_path / "run")
    flight = swarmctl("fly", "--mission", mission, "--speed", "10", "--out", out, "--json")
    stdout, stderr = flight.communicate(timeout=120)
    assert flight.returncode == 0, stderr
    summary = json.loads(stdout)
    assert summary["speed"] == 10.0
    assert [v["outcome"] for v in summary["per_vehicle"]] == ["landed"] * 3
    assert summary["geofence_violations"] == 0
    assert summary["min_separation_m"] >= 15.0
    assert summary["decisions"] == 3 * 40
    replay = swarmctl("replay", out, "--json")
    stdout, stderr = replay.communicate(timeout=60)
    assert replay.returncode == 0, stderr
    replayed = json.loads(stdout)
    assert replayed["decisions"] == replayed["identical"] == 120


def test_obeys_control(mission: str, tmp_path: Path) -> None:
    out = str(tmp_path / "run")
    flight = swarmctl(
        "fly", "--mission", mission, "--speed", "10", "--duration", "4000", "--out", out, "--json"
    )
    wait_for(flight, "searching")
    for order, state in (("hold", "holding"), ("resume", "searching"), ("return", "returning")):
        control = swarmctl("control", out, order)
        answer, error = control.communicate(timeout=30)
        assert control.returncode == 0, error
        assert answer.startswith(order) and answer.strip().endswith(state)
    stdout, stderr = flight.communicate(timeout=120)
    assert flight.returncode == 0, stderr
    assert [v["outcome"] for v in json.loads(stdout)["per_vehicle"]] == ["landed"] * 3
    late = swarmctl("control", out, "hold")
    _, error = late.communicate(timeout=30)
    assert late.returncode == 2
    assert "no flight is under way" in error


def test_nobody_there(mission: str, tmp_path: Path) -> None:
    out = tmp_path / "run"
    flight = swarmctl(
        "fly", "--mission", mission, "--connect", "udpin://127.0.0.1:39871", "--connect-timeout", "0.5", "--yes",
        "--out", str(out),
    )  # fmt: skip
    _, error = flight.communicate(timeout=60)
    assert flight.returncode == 3
    assert "heard 0 of 3 vehicles" in error
    assert not out.exists()


def test_a_bad_url_is_a_bad_command_line(mission: str, tmp_path: Path) -> None:
    flight = swarmctl("fly", "--mission", mission, "--connect", "nonsense", "--out", str(tmp_path / "run"))
    _, error = flight.communicate(timeout=60)
    assert flight.returncode == 2
    assert "no connect URL" in error
