"""One mission and one seed give one flight, to the last recorded byte; another seed gives another."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from swarmctl.record import mcap_read

from .flown import SMALL, Flown, fly

MAY_DIFFER = ("wall_s", "real_time_factor", "run", "machine")


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """The flight that others are compared with."""
    return fly(tmp_path_factory.mktemp("first"))


@pytest.fixture(scope="module")
def second(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """The same again."""
    return fly(tmp_path_factory.mktemp("second"))


def figures(summary: dict[str, Any]) -> dict[str, Any]:
    """What must not differ."""
    return {key: value for key, value in summary.items() if key not in MAY_DIFFER}


def recorded(path: Path) -> list[tuple[object, ...]]:
    """All messages of an mcap, by topic, in the order they were written; chunks may be cut differently."""
    log = mcap_read.read(path)
    rows = [(m.topic, m.tick, m.time_s, m.rows.dtype, m.rows.tobytes()) for m in log.rows()]
    return rows + [(e.topic, e.time_s, str(e.content)) for e in log.events()]


def test_the_same_seed_gives_the_same_summary(first: Flown, second: Flown) -> None:
    assert figures(first.summary) == figures(second.summary)
    assert first.summary["run"] != second.summary["run"]


def test_the_same_seed_gives_the_same_bytes_on_every_wire(first: Flown, second: Flown) -> None:
    assert first.folder.tlog.read_bytes() == second.folder.tlog.read_bytes()


def test_the_same_seed_gives_the_same_decisions(first: Flown, second: Flown) -> None:
    assert recorded(first.folder.mcap) == recorded(second.folder.mcap)
    assert first.folder.mission.read_bytes() == second.folder.mission.read_bytes()
    assert first.folder.tracks.read_bytes() == second.folder.tracks.read_bytes()


def test_the_true_tracks_are_the_same_too(first: Flown, second: Flown) -> None:
    for name in ("east", "north", "up"):
        assert first.outcome.track.field(name).tobytes() == second.outcome.track.field(name).tobytes()
    assert first.outcome.found_s.tobytes() == second.outcome.found_s.tobytes()


def test_another_seed_gives_another_flight(first: Flown, tmp_path: Path) -> None:
    other = fly(tmp_path, seed=2)
    assert figures(other.summary) != figures(first.summary)
    assert other.outcome.world.scene.targets.tobytes() != first.outcome.world.scene.targets.tobytes()
    assert other.folder.tlog.read_bytes() != first.folder.tlog.read_bytes()


def test_another_process_with_one_thread_flies_the_same(first: Flown, tmp_path: Path) -> None:
    mission = tmp_path / "small.yaml"
    mission.write_text(SMALL)
    command = [sys.executable, "-m", "swarmctl.cli", "fly", "--mission", str(mission), "--seed", "1"]
    run = subprocess.run(
        [*command, "--out", str(tmp_path / "run")],
        env={**os.environ, "NUMBA_NUM_THREADS": "1", "PYTHONHASHSEED": "7"},
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "run" / "flight.tlog").read_bytes() == first.folder.tlog.read_bytes()
    assert recorded(tmp_path / "run" / "flight.mcap") == recorded(first.folder.mcap)
