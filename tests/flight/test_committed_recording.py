"""A recording made by an earlier version is still decoded, recomputed and flown again.

It was made on another machine: its sines and cosines may round otherwise, so a tolerance is stated instead of
identity.  A change that is meant to alter what is recorded comes with ``python tests/data/refresh.py``.
"""

import gzip
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from sim_vehicle_stub.configured import configured_fleet
from swarmctl.cli import main
from swarmctl.core import stages
from swarmctl.mission.load import load
from swarmctl.record import mcap_read
from swarmctl.record.folder import RunFolder
from swarmctl.record.replay import replay
from swarmctl.record.stub_replay import replay_stub

from .flown import read_with_pymavlink

SEARCH = Path(__file__).parents[1] / "data" / "search"
TOLERANCE_MPS = 1e-6
TOLERANCE_M = 0.05
MOST_BYTES = 300_000


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """The committed run folder, its tlog unpacked."""
    path = tmp_path_factory.mktemp("recording") / "search"
    shutil.copytree(SEARCH, path)
    packed = path / "flight.tlog.gz"
    (path / "flight.tlog").write_bytes(gzip.decompress(packed.read_bytes()))
    packed.unlink()
    return RunFolder.open(path)


@pytest.fixture(scope="module")
def summary(folder: RunFolder) -> dict[str, Any]:
    """What was summed up then."""
    content: dict[str, Any] = json.loads(folder.summary.read_text())
    return content


def test_it_is_small_and_names_no_machine(summary: dict[str, Any]) -> None:
    files = list(SEARCH.iterdir())
    assert sum(file.stat().st_size for file in files) < MOST_BYTES
    assert sorted(f.name for f in files) == ["flight.mcap", "flight.tlog.gz", "mission.yaml", "summary.json"]
    assert summary["run"] == "search"


def test_it_is_decoded_whole(folder: RunFolder, summary: dict[str, Any]) -> None:
    log = mcap_read.read(folder.mcap)
    assert not log.truncated
    assert log.metadata["flight"]["algorithm"] == summary["algorithm"] == "fco"
    decided = list(log.rows("/decisions"))
    assert sum(len(message.rows) for message in decided) == summary["decisions"] == 120
    ticks = np.array([message.rows for message in log.rows("/ticks")])
    searching = (ticks["stage"] == stages.SEARCH) & (ticks["ordered_home"] == 0)
    assert searching.sum(axis=0).tolist() == [400, 400, 400]
    assert [event.content["text"] for event in log.events() if event.content["kind"] == "search"] == [
        "all vehicles are up"
    ]


def test_its_mission_is_still_valid_and_the_one_in_the_mcap(folder: RunFolder) -> None:
    mission = load(folder.mission)
    assert (mission.name, len(mission.fleet), mission.duration_s) == ("search", 3, 40.0)
    assert mcap_read.read(folder.mcap).attachments["mission.yaml"] == folder.mission.read_text()


def test_its_decisions_are_recomputed_within_the_tolerance(
    folder: RunFolder, summary: dict[str, Any]
) -> None:
    result = replay(mcap_read.read(folder.mcap))
    assert result.decisions == summary["decisions"]
    assert result.setpoints > 3 * 400
    assert result.largest_difference_mps < TOLERANCE_MPS, result.as_text()


def test_its_setpoints_fly_the_same_tracks_within_the_tolerance(folder: RunFolder) -> None:
    result = replay_stub(folder, configured_fleet)
    assert (result.positions > 1000, result.missing) == (True, 0)
    assert result.max_m < TOLERANCE_M


def test_its_tlog_is_read_by_pymavlink(folder: RunFolder, summary: dict[str, Any]) -> None:
    messages = read_with_pymavlink(folder.tlog)
    assert folder.tlog.stat().st_size == sum(8 + len(m.get_msgbuf()) for m in messages)
    assert sum(m.get_srcSystem() in (1, 2, 3) for m in messages) == summary["messages_received"]


def test_another_algorithm_plans_on_it(folder: RunFolder) -> None:
    result = replay(mcap_read.read(folder.mcap), "bounce")
    assert (result.decisions, result.same) == (120, False)
    assert result.largest_difference_mps > 0.1


def test_its_report_is_drawn(folder: RunFolder) -> None:
    result = CliRunner().invoke(main, ["report", str(folder.path)])
    assert result.exit_code == 0, result.output
    assert folder.tracks.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
