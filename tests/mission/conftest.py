"""Missions written to a folder of the test's own, and a small catalogue of algorithms."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from swarmctl.core import planners
from swarmctl.mission.errors import MissionError
from swarmctl.mission.load import load
from swarmctl.mission.model import Mission

CATALOGUE: dict[str, dict[str, float | str]] = {
    "fco": {"inertia": 0.4, "personal": 0.4, "global": 0.2, "random": 0.05},
    "mdc": {"inertia": 0.4},
    "ace": {},
    "belief": {"then": "hold"},
}


@pytest.fixture
def small_catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests of the reader do not hang on which planners there are."""
    monkeypatch.setattr(planners, "catalogue", lambda: CATALOGUE)


Loader = Callable[..., Mission]


@pytest.fixture
def read(tmp_path: Path, small_catalogue: None) -> Loader:
    """Load a mission from its text, as m.yaml."""

    def read_text(text: str | bytes, settings: Mapping[str, object] | None = None) -> Mission:
        path = tmp_path / "m.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load(path, settings)

    return read_text


@pytest.fixture
def complaints(read: Loader, tmp_path: Path) -> Callable[..., list[str]]:
    """What is wrong with a mission's text, a line each, the test's own folder left out."""

    def complain(text: str | bytes, settings: Mapping[str, object] | None = None) -> list[str]:
        with pytest.raises(MissionError) as caught:
            read(text, settings)
        assert str(caught.value) == "\n".join(str(problem) for problem in caught.value.problems)
        return [str(problem).replace(f"{tmp_path}/", "") for problem in caught.value.problems]

    return complain
