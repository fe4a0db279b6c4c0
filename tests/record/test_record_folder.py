"""A run folder is made whole, or not at all with the reason said."""

import errno
import json
import os
from datetime import datetime
from pathlib import Path

import pytest

from swarmctl.record.errors import RunFolderError
from swarmctl.record.folder import RunFolder

NOW = datetime(2026, 11, 22, 5, 15, 0)


def create(out: Path | None) -> RunFolder:
    return RunFolder.create(out, algorithm="dpso-u", now=NOW)


def test_the_default_name_tells_time_and_algorithm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    paths = [create(None).path for _ in range(3)]
    names = ["20261122-051500-dpso-u", "20261122-051500-dpso-u-2", "20261122-051500-dpso-u-3"]
    assert paths == [Path("runs") / name for name in names]
    assert all(path.is_dir() and not any(path.iterdir()) for path in paths)


def test_a_folder_is_made_with_its_parents(tmp_path: Path) -> None:
    folder = create(tmp_path / "a" / "b" / "c")
    assert folder.path.is_dir()
    files = [folder.mission, folder.mcap, folder.tlog, folder.summary, folder.tracks, folder.report]
    assert [file.name for file in files] == [
        "mission.yaml",
        "flight.mcap",
        "flight.tlog",
        "summary.json",
        "tracks.png",
        "report.html",
    ]
    assert {file.parent for file in files} == {folder.path}


def test_an_empty_folder_is_used_and_one_with_anything_in_it_refused(tmp_path: Path) -> None:
    assert create(tmp_path).path == tmp_path
    (tmp_path / ".hidden").touch()
    with pytest.raises(RunFolderError, match=r"not empty \(choose another --out"):
        create(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == [".hidden"]


def test_a_file_in_the_way_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "runs").touch()
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    with pytest.raises(RunFolderError, match="runs: exists and is not a folder"):
        create(tmp_path / "runs")
    with pytest.raises(RunFolderError, match="dangling: exists and is not a folder"):
        create(tmp_path / "dangling")
    with pytest.raises(RunFolderError, match="cannot write"):
        create(tmp_path / "runs" / "one")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RunFolderError, match="cannot write"):
        create(None)


@pytest.mark.parametrize("name", ["x" * 300, "/proc/swarmctl/run"])
def test_a_place_that_takes_no_folder_is_told(tmp_path: Path, name: str) -> None:
    with pytest.raises(RunFolderError, match="cannot write"):
        create(tmp_path / "parent" / name)
    assert not any(tmp_path.iterdir())


def refuse(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(RunFolderError, match=r"run: cannot write: No space left on device \(make room"):
        create(tmp_path / "parent" / "run")
    assert not any(tmp_path.iterdir())
    with pytest.raises(RunFolderError, match="No space left"):
        create(tmp_path)
    assert tmp_path.is_dir()
    assert not any(tmp_path.iterdir())


def test_small_files_are_written_whole_or_left_as_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = create(tmp_path / "run")
    folder.write_json(folder.summary, {"algorithm": "größer", "time_to_s": {"85": None}})
    before = folder.summary.read_bytes()
    assert json.loads(before) == {"algorithm": "größer", "time_to_s": {"85": None}}
    assert before.endswith(b"\n")
    assert list(folder.path.iterdir()) == [folder.summary]
    with pytest.raises(ValueError, match="JSON"):
        folder.write_json(folder.summary, {"x": float("inf")})
    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(RunFolderError, match=r"summary\.json: cannot write: No space left"):
        folder.write_text(folder.summary, "half")
    assert folder.summary.read_bytes() == before
    assert list(folder.path.iterdir()) == [folder.summary]


def test_a_recorded_run_opens(tmp_path: Path) -> None:
    (tmp_path / "mission.yaml").touch()
    (tmp_path / "flight.mcap").touch()
    assert RunFolder.open(tmp_path) == RunFolder(tmp_path)


def test_what_is_no_run_is_told(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="absent: no such run"):
        RunFolder.open(tmp_path / "absent")
    with pytest.raises(RunFolderError, match="no such run"):
        RunFolder.open(tmp_path / ("x" * 300))
    with pytest.raises(RunFolderError, match=r"it has no mission\.yaml and no flight\.mcap"):
        RunFolder.open(tmp_path)
    (tmp_path / "mission.yaml").touch()
    (tmp_path / "flight.mcap").mkdir()
    with pytest.raises(RunFolderError, match=r"it has no flight\.mcap$"):
        RunFolder.open(tmp_path)
    with pytest.raises(RunFolderError, match="not a folder"):
        RunFolder.open(tmp_path / "mission.yaml")
