"""Each command does what its help says: results on stdout, progress on stderr, exit code 0."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl import __version__
from swarmctl.core import planners

from .given import Swarmctl

COMMANDS = ("fly", "study", "replay", "control", "check", "algos", "report")


def test_fly_prints_its_figures_and_where_they_are(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    result = swarmctl("fly", "--mission", small, "--out", tmp_path / "a" / "b")
    assert result.exit_code == 0
    assert "of 50 targets found" in result.stdout
    assert "3 of 3 vehicles landed" in result.stdout
    assert f"run: {tmp_path / 'a' / 'b'}" in result.stdout
    assert "flying 3 stub vehicles with fco, seed 1" in result.stderr
    parts = ["preparing", "taking off", "searching", "returning", "over"]
    assert [part for part in parts if part in result.stderr] == parts
    assert "\r" not in result.stderr
    assert "\x1b" not in result.output


def test_fly_json_prints_the_summary_and_nothing_else(
    swarmctl: Swarmctl, small: Path, tmp_path: Path
) -> None:
    result = swarmctl("fly", "--mission", small, "--out", tmp_path / "run", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout) == json.loads((tmp_path / "run" / "summary.json").read_text())


def test_fly_obeys_its_flags(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    flags = ("--algo", "sweep", "--vehicles", 4, "--seed", 9, "--duration", 12, "--json", "--yes")
    said = swarmctl("fly", "--mission", small, "--out", tmp_path / "run", *flags)
    summary = json.loads(said.stdout)
    assert (summary["algorithm"], summary["vehicles"], summary["seed"]) == ("sweep", 4, 9)
    assert (summary["duration_s"], summary["decisions"]) == (12.0, 48)
    written = (tmp_path / "run" / "mission.yaml").read_text()
    assert "algorithm: sweep" in written
    assert "duration_s: 12" in written


@pytest.mark.parametrize("name", ["px4", "ardupilot"])
def test_fly_plays_the_autopilot_asked_for(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, name: str
) -> None:
    flags = ("--autopilot", name, "--duration", 5, "--json", "--out", tmp_path / "run")
    said = swarmctl("fly", "--mission", small, *flags)
    assert {v["autopilot"] for v in json.loads(said.stdout)["per_vehicle"]} == {name}
    written = (tmp_path / "run" / "mission.yaml").read_text()
    assert written.count(f"autopilot: {name}") == 2  # the vehicles', and the stub's


def test_fly_names_its_folder_by_time_and_algorithm(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = swarmctl("fly", "--mission", small, "--algo", "bounce", "--duration", 5)
    assert result.exit_code == 0
    (run,) = (tmp_path / "runs").iterdir()
    assert run.name.endswith("-bounce")
    assert len(run.name) == len("20261122-051500-bounce")
    assert f"run: runs/{run.name}" in result.stdout


def test_fly_takes_an_empty_folder_that_is_there(swarmctl: Swarmctl, small: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert swarmctl("fly", "--mission", small, "--duration", 5, "--out", tmp_path / "empty").exit_code == 0
    assert (tmp_path / "empty" / "summary.json").is_file()


def test_replay_says_that_all_is_identical(swarmctl: Swarmctl, flown: Path) -> None:
    result = swarmctl("replay", flown)
    assert result.exit_code == 0
    assert "90 of 90 decisions identical" in result.stdout
    said = json.loads(swarmctl("replay", flown, "--json").stdout)
    assert (said["decisions"], said["identical"], said["first_difference"]) == (90, 90, None)


def test_replay_with_stubs_says_that_all_positions_are_identical(swarmctl: Swarmctl, flown: Path) -> None:
    result = swarmctl("replay", flown, "--stub")
    assert result.exit_code == 0
    assert "0 missing; apart by 0.000 m RMS, 0.000 m at most" in result.stdout
    said = json.loads(swarmctl("replay", flown, "--stub", "--json").stdout)
    assert said["identical"] == said["positions"] > 1000


def test_replay_leaves_the_folder_as_it_was(swarmctl: Swarmctl, flown: Path) -> None:
    before = {path.name: (path.stat().st_mtime_ns, path.read_bytes()) for path in flown.iterdir()}
    swarmctl("replay", flown)
    swarmctl("replay", flown, "--stub")
    assert {path.name: (path.stat().st_mtime_ns, path.read_bytes()) for path in flown.iterdir()} == before


def test_report_draws_the_picture_anew(swarmctl: Swarmctl, flown: Path) -> None:
    (flown / "tracks.png").unlink()
    result = swarmctl("report", flown)
    assert result.exit_code == 0
    assert result.stdout.strip() == str(flown / "tracks.png")
    assert (flown / "tracks.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize(
    "name", [None, "paper", "paper.yaml", "missions/field.yaml", "lake", "mixed", "sitl", "fleet", "drifting"]
)
def test_check_says_what_a_mission_is(swarmctl: Swarmctl, name: str | None) -> None:
    result = swarmctl("check", *(("--mission", name) if name else ()))
    assert result.exit_code == 0
    assert ": valid. " in result.stdout
    assert result.stderr == ""


def test_algos_lists_every_parameter_with_its_source(swarmctl: Swarmctl) -> None:
    text, said = swarmctl("algos").stdout, json.loads(swarmctl("algos", "--json").stdout)
    assert list(said) == list(planners.MODULES)
    for name in planners.MODULES:
        module = planners.module(name)
        assert f"{name}: {module.TITLE}" in text
        assert [p["name"] for p in said[name]["parameters"]] == [p.name for p in module.PARAMETERS]
        assert all(p.source and p.meaning for p in module.PARAMETERS)
    assert "inertia" in text


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS)])
@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_of_every_command(swarmctl: Swarmctl, command: tuple[str, ...], flag: str) -> None:
    result = swarmctl(*command, flag)
    assert result.exit_code == 0
    assert "Usage:" in result.stdout
    assert "--help" in result.stdout


def test_help_names_every_command(swarmctl: Swarmctl) -> None:
    text = swarmctl("--help").stdout
    assert all(f"  {name} " in text for name in COMMANDS)


def test_version(swarmctl: Swarmctl) -> None:
    assert __version__ in swarmctl("--version").stdout


def test_help_needs_nothing_heavy() -> None:
    code = (
        "import sys; from click.testing import CliRunner; from swarmctl.cli import main;"
        "assert CliRunner().invoke(main, ['--help']).exit_code == 0;"
        "print([m for m in ('numba', 'scipy', 'matplotlib', 'shapely', 'pydantic', 'numpy') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout.strip() == "[]"


def test_progress_and_results_part_ways_in_a_pipe(small: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "swarmctl.cli", "fly", "--mission", str(small), "--json"]
    run = subprocess.run(
        [*command, "--out", "run"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["run"] == "run"
    assert "searching" in run.stderr
