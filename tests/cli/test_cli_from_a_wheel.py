"""Installed from a built wheel, outside the checkout, the program finds its missions and runs.

The sources are copied first, so that building leaves nothing in the checkout.  The wheel is built with the
setuptools at hand if it is new enough (pyproject.toml says which), else pip fetches one.
"""

import os
import shutil
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("swarmctl", "sim_vehicle_stub", "missions")
BUILT_WITH = ("pyproject.toml", "README.md", "LICENSE")
NEEDED_SETUPTOOLS = 77


def run(*command: object, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, its output taken."""
    return subprocess.run(
        [str(part) for part in command], cwd=cwd, env={**os.environ, **environment},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy of the sources."""
    source = tmp_path_factory.mktemp("source")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in BUILT_WITH:
        shutil.copyfile(ROOT / name, source / name)
    new_enough = int(metadata.version("setuptools").split(".")[0]) >= NEEDED_SETUPTOOLS
    isolation = ("--no-build-isolation",) if new_enough else ()
    pip = (sys.executable, "-m", "pip", "wheel", ".", "--no-deps", "--quiet", "--wheel-dir", "wheels")
    built = run(*pip, *isolation, cwd=source)
    assert built.returncode == 0, built.stderr
    (path,) = (source / "wheels").glob("swarmctl-*.whl")
    return path


@pytest.fixture(scope="module")
def site(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the wheel is installed into, and nothing else."""
    path = tmp_path_factory.mktemp("installed") / "site"
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", path)
    installed = run(*pip, wheel, cwd=wheel.parent)
    assert installed.returncode == 0, installed.stderr
    return path


def sources(folder: Path) -> set[str]:
    """The files that a package is made of."""
    found = {path.relative_to(folder) for package in PACKAGES for path in (folder / package).rglob("*")}
    return {str(path) for path in found if path.suffix in (".py", ".yaml", ".geojson")}


def test_the_wheel_holds_every_source_and_every_mission(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert sources(ROOT) - names == set()
    assert [name for name in names if name.startswith("tests")] == []
    assert {"missions/paper.yaml", "missions/lake.geojson", "swarmctl/cli.py"} <= names


def test_it_loads_its_own_paper_mission_outside_the_checkout(site: Path, tmp_path: Path) -> None:
    code = "import swarmctl; from swarmctl.mission.load import load; print(swarmctl.__file__, load().name)"
    loaded = run(sys.executable, "-c", code, cwd=tmp_path, PYTHONPATH=str(site))
    assert loaded.returncode == 0, loaded.stderr
    assert loaded.stdout.split() == [str(site / "swarmctl" / "__init__.py"), "paper"]


def test_its_scripts_run_outside_the_checkout(site: Path, tmp_path: Path) -> None:
    checked = run(site / "bin" / "swarmctl", "check", cwd=tmp_path, PYTHONPATH=str(site))
    assert checked.returncode == 0, checked.stderr
    assert checked.stdout.startswith("paper: valid. 6 vehicles, fco")
    lake = run(site / "bin" / "swarmctl", "check", "--mission", "lake", cwd=tmp_path, PYTHONPATH=str(site))
    assert lake.stdout.startswith("lake: valid. "), lake.stderr
    helped = run(site / "bin" / "sim-vehicle-stub", "--help", cwd=tmp_path, PYTHONPATH=str(site))
    assert helped.returncode == 0, helped.stderr
    assert "--vehicles" in helped.stdout
    assert list(tmp_path.iterdir()) == []
