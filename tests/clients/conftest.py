"""Fixtures of the tests with clients that nobody here wrote."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .meeting import Meeting, meeting


@pytest.fixture(params=["px4", "ardupilot"])
def autopilot(request: pytest.FixtureRequest) -> str:
    """Each firmware that the stub plays."""
    name: str = request.param
    return name


@pytest.fixture
def meet(autopilot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Meeting]]:
    """Have a vehicle and MAVSDK meet; what MAVSDK keeps in temporary folders must be gone afterwards."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with contextlib.ExitStack() as stack:
        yield lambda **how: stack.enter_context(meeting(autopilot, **how))
        assert list(tmp_path.iterdir()), "MAVSDK keeps nothing here: nothing is watched"
    assert list(tmp_path.iterdir()) == []
