"""Every kind of bad input: one clear message, the right exit code, no traceback, nothing half-written."""

import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result

from swarmctl.record import folder as run_folder
from swarmctl.record import mcap_log, tlog

from .given import SMALL, Swarmctl

NAMED_PADS = SMALL.replace("altitude_m: 8", "altitude_m: 8, launch: [[310, 310], [50, 50], [100, 50]]")
NO_ROOM_FOR_PADS = SMALL.replace("[300, 380, 300, 380]", "[0, 60, 0, 60]")


def files_below(path: Path) -> list[str]:
    """Everything below a folder."""
    return sorted(str(item.relative_to(path)) for item in path.rglob("*"))


def refused(result: Result, *words: str, code: int = 2) -> None:
    """Exit code, message on stderr that holds all the words, nothing on stdout."""
    assert result.exit_code == code, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    missing = [word for word in words if word not in result.stderr]
    assert missing == [], result.stderr


BAD_MISSIONS: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    "unknown key": ("name: a\nduraton_s: 1\n", ("m.yaml:2:1: duraton_s", "did you mean duration_s?")),
    "wrong type": ("duration_s: soon\n", ("m.yaml:1:1: duration_s", "must be a number")),
    "number as text": ("duration_s: '7'\n", ("m.yaml:1:1: duration_s", "must be a number, not '7'")),
    "impossible value": ("vehicles: {speed_mps: 500}\n", ("m.yaml:1:12: vehicles.speed_mps", "30, not 500")),
    "nan": ("duration_s: .nan\n", ("m.yaml:1:1: duration_s", "finite")),
    "infinity": ("sensor: {range_m: .inf}\n", ("m.yaml:1:10: sensor.range_m", "finite")),
    "self-crossing fence": (
        "area: {polygon_m: [[0, 0], [900, 900], [900, 0], [0, 900]]}\n",
        ("m.yaml:1:8: area.polygon_m", "crosses itself at [450, 450]", "in order"),
    ),
    "launch in a keep-out": (
        NAMED_PADS,
        ("m.yaml:6:61: vehicles.launch[0]", "[310.0, 310.0] is inside keep_out[0]"),
    ),
    "pads in a keep-out": (NO_ROOM_FOR_PADS, ("m.yaml:6:1: vehicles.launch", "3 pads does not fit")),
    "not yaml": ("a: [1, 2\nb: }\n", ("m.yaml:2",)),
    "binary": (b"\x00\x01\xff\xfe" * 50, ("m.yaml",)),
    "runs code": ("name: !!python/object/apply:os.system ['touch /tmp/owned']\n", ("m.yaml:1",)),
    "empty list of vehicles": ("vehicles: []\n", ("m.yaml:1:1: vehicles",)),
    "a list": ("- 1\n- 2\n", ("m.yaml",)),
    "unknown algorithm": ("planner: {algorithm: fcoo}\n", ("m.yaml:1:11: planner.algorithm", "fco")),
    "unknown parameter": (
        "planner: {parameters: {fco: {inertial: 1}}}\n",
        ("planner.parameters.fco.inertial", "did you mean inertia?"),
    ),
    "a duplicate key": ("name: a\nname: b\n", ("m.yaml:2:1", "name")),
    "a missing file": ("area: {file: nowhere.kml}\n", ("m.yaml:1:8: area.file", "nowhere.kml")),
}


@pytest.mark.parametrize("name", list(BAD_MISSIONS))
@pytest.mark.parametrize("command", ["fly", "check"])
def test_a_bad_mission_names_file_line_and_key(
    swarmctl: Swarmctl, tmp_path: Path, name: str, command: str
) -> None:
    content, words = BAD_MISSIONS[name]
    mission = tmp_path / "m.yaml"
    mission.write_bytes(content if isinstance(content, bytes) else content.encode())
    where = ("--out", tmp_path / "run") if command == "fly" else ()
    refused(swarmctl(command, "--mission", mission, *where), *words)
    assert files_below(tmp_path) == ["m.yaml"]


def test_all_faults_are_told_at_once(swarmctl: Swarmctl, tmp_path: Path) -> None:
    mission = tmp_path / "m.yaml"
    mission.write_text("duration_s: -1\nvehicles: {speed: 3}\nradio: {loss: 2}\n")
    result = swarmctl("fly", "--mission", mission, "--out", tmp_path / "run")
    refused(result, "m.yaml:1:1: duration_s", "m.yaml:2:12: vehicles.speed", "m.yaml:3:9: radio.loss")


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--duration", "nan"), ("command line: duration_s", "finite")),
        (("--duration", "-5"), ("command line: duration_s", "greater than 0")),
        (("--duration", "inf"), ("command line: duration_s", "finite")),
        (("--duration", "long"), ("--duration", "'long' is not a valid float")),
        (("--vehicles", "0"), ("--vehicles", "0 is not in the range")),
        (("--vehicles", "2.5"), ("--vehicles", "not a valid integer")),
        (("--vehicles", "100000"), ("command line: vehicles.count", "10000")),
        (("--seed", "-1"), ("--seed", "not in the range")),
        (("--seed", "x"), ("--seed", "not a valid integer")),
        (("--algo", "pso"), ("--algo", "'pso' is not one of", "fco")),
        (("--speed", "warp"), ("--speed", "'warp'")),
        (("--sped", "max"), ("No such option '--sped'", "--speed")),
        (("extra",), ("unexpected extra argument",)),
    ],
)
def test_bad_flags_of_fly(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, flags: tuple[str, ...], words: tuple[str, ...]
) -> None:
    refused(swarmctl("fly", "--mission", small, "--out", tmp_path / "run", *flags), *words)
    assert files_below(tmp_path) == ["small.yaml"]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("nothing",), ("No such command 'nothing'",)),
        (("fly", "--mission", "nowhere.yaml"), ("nowhere.yaml", "no such file", "packaged missions")),
        (("check", "--mission", "nowhere.yaml"), ("nowhere.yaml", "no such file")),
        (("check", "--mission", "/"), ("/: cannot be read",)),
        (("check", "--seed", "3"), ("No such option",)),
        (("check", "--connect", "nonsense"), ("'nonsense' is no connect URL",)),
        (("algos", "--verbose"), ("No such option",)),
        (("control", "nowhere", "hold"), ("nowhere: no flight is under way there",)),
        (("control", "nowhere", "dance"), ("'dance' is not one of",)),
        (("control", "nowhere", "retake"), ("retake needs the ID of a vehicle",)),
        (("control", "nowhere", "land", "3"), ("land takes no ID",)),
        (("replay",), ("Missing argument 'RUN'",)),
        (("replay", "nowhere"), ("nowhere: no such run",)),
        (("replay", "nowhere", "--algo", "zigzag"), ("'zigzag' is not one of",)),
        (("report",), ("Missing argument 'RUN'",)),
        (("report", "nowhere"), ("nowhere: no such run",)),
    ],
)
def test_bad_command_lines(
    swarmctl: Swarmctl, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: tuple[str, ...],
    words: tuple[str, ...],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    refused(swarmctl(*line), *words)
    assert files_below(tmp_path) == []


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("dynamics: ideal", ("dynamics", "fly flies multicopters", "leave the key out")),
        ("safety: {fence_margin_m: 0}", ("safety.fence_margin_m", "needs 2 m", "raise it")),
    ],
)
def test_what_fly_cannot_fly_is_refused(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, line: str, words: tuple[str, ...]
) -> None:
    small.write_text(f"{SMALL}{line}\n")
    refused(swarmctl("fly", "--mission", small, "--out", tmp_path / "run"), *words)
    assert files_below(tmp_path) == ["small.yaml"]


# Folders that cannot be written.


def test_a_folder_with_something_in_it_is_left_alone(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    refused(swarmctl("fly", "--mission", small, "--out", out), str(out), "not empty", "choose another --out")
    assert files_below(out) == ["notes.txt"]
    assert (out / "notes.txt").read_text() == "mine"


def test_a_finished_run_is_never_flown_over(swarmctl: Swarmctl, small: Path, flown: Path) -> None:
    before = (flown / "flight.mcap").read_bytes()
    refused(swarmctl("fly", "--mission", small, "--out", flown), "not empty")
    assert (flown / "flight.mcap").read_bytes() == before


@pytest.mark.parametrize("name", ["small.yaml", "small.yaml/run", "small.yaml/a/b"])
def test_a_path_below_a_file_is_told(swarmctl: Swarmctl, small: Path, tmp_path: Path, name: str) -> None:
    refused(swarmctl("fly", "--mission", small, "--out", tmp_path / name), "small.yaml", "--out")
    assert files_below(tmp_path) == ["small.yaml"]


def test_a_file_system_that_takes_no_folders_is_told(swarmctl: Swarmctl, small: Path) -> None:
    refused(swarmctl("fly", "--mission", small, "--out", "/proc/run/one"), "/proc/run", "cannot write")


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders can be made, but there is no room for a file's content."""

    def no_room(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", no_room)


@pytest.mark.usefixtures("full_disk")
def test_a_full_disk_is_told_before_the_flight(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    refused(swarmctl("fly", "--mission", small, "--out", tmp_path / "a" / "b"), "No space left", "make room")
    assert files_below(tmp_path) == ["small.yaml"]


class FillsUp:
    """A file on a disk that is full after so many bytes."""

    def __init__(self, file: Any, room: int) -> None:
        self._file, self._room = file, room

    def write(self, data: Any) -> int:
        """Write, while there is room."""
        if self._room < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._room -= len(data)
        return int(self._file.write(data))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


@pytest.mark.parametrize(("module", "name"), [(mcap_log, "flight.mcap"), (tlog, "flight.tlog")])
def test_a_disk_that_fills_up_in_flight_is_told(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: Any, name: str
) -> None:
    opened = Path.open

    def opens(path: Path, *arguments: Any, **named: Any) -> Any:
        file = opened(path, *arguments, **named)
        return FillsUp(file, 70_000) if path.name == name and arguments[:1] == ("wb",) else file

    monkeypatch.setattr(Path, "open", opens)
    result = swarmctl("fly", "--mission", small, "--out", tmp_path / "run")
    refused(result, f"{name}: cannot write: No space left", "make room")
    assert "run:" not in result.stdout


@pytest.mark.parametrize("name", ["flight.mcap", "flight.tlog"])
def test_a_real_full_device_is_told(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """The recording goes to /dev/full, which opens and then refuses every byte."""
    made = run_folder.RunFolder.create

    def with_a_full_file(out: Path | None, **named: Any) -> run_folder.RunFolder:
        folder = made(out, **named)
        (folder.path / name).symlink_to("/dev/full")
        return folder

    monkeypatch.setattr(run_folder.RunFolder, "create", with_a_full_file)
    refused(swarmctl("fly", "--mission", small, "--out", tmp_path / "run"), name, "No space left")


# Runs that cannot be read.


def test_a_recording_that_is_none_is_told(swarmctl: Swarmctl, tmp_path: Path) -> None:
    (tmp_path / "mission.yaml").write_text(SMALL)
    (tmp_path / "flight.mcap").write_bytes(b"not at all")
    refused(swarmctl("replay", tmp_path), "flight.mcap", "not an MCAP file")
    refused(swarmctl("report", tmp_path), "flight.mcap", "not an MCAP file")


def test_a_folder_without_a_recording_is_told(swarmctl: Swarmctl, tmp_path: Path) -> None:
    (tmp_path / "mission.yaml").write_text(SMALL)
    refused(swarmctl("replay", tmp_path), "not a run folder", "flight.mcap")


def test_a_report_on_a_spoilt_mission_is_told(swarmctl: Swarmctl, flown: Path, tmp_path: Path) -> None:
    (tmp_path / "flight.mcap").write_bytes((flown / "flight.mcap").read_bytes())
    (tmp_path / "mission.yaml").write_text("duration_s: never\n")
    refused(swarmctl("report", tmp_path), "mission.yaml:1:1: duration_s")


def test_a_report_that_cannot_be_written_is_told(swarmctl: Swarmctl, flown: Path, tmp_path: Path) -> None:
    for name in ("flight.mcap", "mission.yaml"):
        (tmp_path / name).write_bytes((flown / name).read_bytes())
    (tmp_path / "tracks.png").mkdir()
    refused(swarmctl("report", tmp_path), "tracks.png", "cannot write")


def test_no_code_in_a_mission_is_run(swarmctl: Swarmctl, tmp_path: Path) -> None:
    mission = tmp_path / "m.yaml"
    mission.write_text(f"name: !!python/object/apply:os.mkdir ['{tmp_path / 'owned'}']\n")
    refused(swarmctl("check", "--mission", mission), "m.yaml:1")
    assert files_below(tmp_path) == ["m.yaml"]


def test_a_bad_mission_through_the_console_script_has_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("duraton_s: 1\n")
    command = [sys.executable, "-m", "swarmctl.cli", "fly", "--mission", "m.yaml"]
    run = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith("m.yaml:1:1: duraton_s: unknown key")
    assert run.stderr.count("\n") == 1
    assert files_below(tmp_path) == ["m.yaml"]


def test_a_bad_signing_key_is_named(swarmctl: Swarmctl, tmp_path: Path) -> None:
    key = tmp_path / "key"
    words = ("--connect", "udpin://127.0.0.1:14540", "--signing-key", key)
    refused(swarmctl("check", *words), str(key), "cannot read the signing key")
    refused(swarmctl("fly", "--signing-key", key), "cannot read the signing key")
    key.write_text("secret")
    refused(swarmctl("fly", *words), str(key), "64 hex digits", "openssl rand -hex 32")
    key.write_text("ab" * 32)
    refused(swarmctl("fly", "--signing-key", key), "--signing-key is for vehicles by --connect")
    refused(swarmctl("check", "--signing-key", key), "--signing-key is for vehicles by --connect")
