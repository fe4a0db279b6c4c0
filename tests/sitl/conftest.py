"""Real PX4 and ArduCopter flown by the command line, where `--px4` and `--arducopter` say where they are.

    pytest tests/sitl --px4 BUILD_DIR --arducopter BINARY

Nothing here is collected without these paths; a test that needs a firmware whose path is missing is not there
either.  What was seen is in docs/autopilots.md.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from .firmware import Simulators

MISSION = Path(__file__).parents[2] / "missions" / "sitl.yaml"
PATIENCE_S = 900.0
OPTIONS = {"px4": "--px4", "ardupilot": "--arducopter"}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Real firmware is flown only where somebody says where it is."""
    return None if any(config.getoption(option) for option in OPTIONS.values()) else True


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """One test a firmware that is there."""
    if "firmware" in metafunc.fixturenames:
        there = [name for name, option in OPTIONS.items() if metafunc.config.getoption(option)]
        metafunc.parametrize("firmware", there)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests of both firmwares need both."""
    missing = [name for name, option in OPTIONS.items() if not config.getoption(option)]
    gone = [item for item in items for mark in item.iter_markers("needs") if set(mark.args) & set(missing)]
    config.hook.pytest_deselected(items=gone)
    items[:] = [item for item in items if item not in gone]


@pytest.fixture
def simulators(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Simulators]:
    """No instance yet; all that a test starts are stopped."""
    option = request.config.getoption
    first = int(os.environ.get("SITL_FIRST", "0"))
    found = Simulators(tmp_path / "sitl", option("--px4"), option("--arducopter"), first)
    yield found
    found.stop()


class Flight:
    """A `swarmctl fly` under way."""

    def __init__(self, run: Path, words: list[str]) -> None:
        self.run = run
        command = [sys.executable, "-m", "swarmctl", "fly", *words, "--out", str(run), "--json", "--yes"]
        self._said = run.with_suffix(".txt").open("w+")
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self._said, text=True, start_new_session=True
        )

    @property
    def said(self) -> str:
        """What it has told on stderr so far."""
        return Path(self._said.name).read_text()

    def ended(self) -> tuple[int, dict[str, Any]]:
        """Wait for its end: exit code and summary; without one, what it said is the failure."""
        out, _ = self.process.communicate(timeout=PATIENCE_S)
        assert out, f"exit {self.process.returncode}: {self.said}"
        return self.process.returncode, json.loads(out)

    def kill(self) -> None:
        """kill -9."""
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def close(self) -> None:
        """Whatever became of it."""
        self.process.kill()
        self.process.wait()
        self._said.close()


Fly = Callable[..., Flight]


@pytest.fixture
def fly(tmp_path: Path) -> Iterator[Fly]:
    """Starts `swarmctl fly WORDS` on missions/sitl.yaml; whatever still flies at the end is killed."""
    flights: list[Flight] = []

    def begin(*words: Any, mission: Path | None = MISSION) -> Flight:
        given = [] if mission is None else ["--mission", str(mission)]
        flights.append(Flight(tmp_path / f"run{len(flights)}", given + [str(word) for word in words]))
        return flights[-1]

    yield begin
    for flight in flights:
        flight.close()


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """missions/sitl.yaml for two vehicles."""
    path = tmp_path / "two.yaml"
    path.write_text(MISSION.read_text().replace("count: 6", "count: 2"))
    return path
