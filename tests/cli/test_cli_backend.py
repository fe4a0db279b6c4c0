"""``--backend mavsdk`` where it cannot be: one clear message, exit code 2, nothing opened or written."""

import subprocess
import sys
from pathlib import Path

import pytest

from .given import Swarmctl

URL = ("--connect", "udpin://127.0.0.1:14999")


def refused(swarmctl: Swarmctl, *arguments: object) -> str:
    """What is said on stderr."""
    result = swarmctl(*arguments, "--backend", "mavsdk")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "Traceback" not in result.stderr
    return result.stderr


@pytest.mark.parametrize("speed", [(), ("--speed", "max")])
def test_lockstep_has_no_mavsdk(
    swarmctl: Swarmctl, small: Path, tmp_path: Path, speed: tuple[str, ...]
) -> None:
    said = refused(swarmctl, "fly", "--mission", small, *speed, "--out", tmp_path / "run")
    assert "lockstep has no MAVSDK: --backend mavsdk needs --connect or --speed FACTOR" in said
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("command", ["fly", "check"])
def test_mavsdk_cannot_sign(swarmctl: Swarmctl, small: Path, tmp_path: Path, command: str) -> None:
    said = refused(swarmctl, command, "--mission", small, *URL, "--signing-key", tmp_path / "key")
    assert "MAVSDK cannot sign what it sends: --signing-key needs --backend mavlink" in said


@pytest.mark.parametrize("command", ["fly", "check"])
def test_without_mavsdk_it_says_how_to_get_it(
    swarmctl: Swarmctl, small: Path, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mavsdk", None)
    for name in ("client", "deeds", "session"):
        monkeypatch.delitem(sys.modules, f"swarmctl.vehicle.mavsdk_{name}", raising=False)
    said = refused(swarmctl, command, "--mission", small, *URL)
    assert "--backend mavsdk needs MAVSDK 4.1 (pip install 'mavsdk>=4.1,<5')" in said


def test_nobody_loads_mavsdk_who_does_not_ask_for_it() -> None:
    loads = "import sys, swarmctl.cli, swarmctl.live_cli; sys.exit('mavsdk' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", loads], check=False).returncode == 0
