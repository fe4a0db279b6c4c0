"""The command line in this process: what it prints on which stream, and its exit code."""

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from swarmctl.cli import main

from .given import SMALL, Swarmctl


@pytest.fixture(scope="session")
def swarmctl() -> Swarmctl:
    """Run a command; what would be a traceback fails the test."""

    def run(*arguments: object) -> Result:
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A mission file that flies in a second."""
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="session")
def flown(tmp_path_factory: pytest.TempPathFactory, swarmctl: Swarmctl) -> Path:
    """The folder of a finished flight."""
    folder = tmp_path_factory.mktemp("flown")
    (folder / "small.yaml").write_text(SMALL)
    result = swarmctl("fly", "--mission", folder / "small.yaml", "--out", folder / "run")
    assert result.exit_code == 0, result.stderr
    return folder / "run"
