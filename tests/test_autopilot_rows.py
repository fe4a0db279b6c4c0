"""Every row of what real autopilots were seen to do is played by the stub and survived by the controller.

The rows are those of the tables of PX4 v1.17 and ArduCopter 4.8 (AUTOPILOTS.md).  A test that shows one, or
several, is marked ``@pytest.mark.row(key, ...)``: in tests/stub it shows what the stub plays, in tests/vehicle
what the session makes of the real stub's playing it, so there it counts only in a module that imports the stub.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
ROWS = (
    "px4-links",
    "px4-partner-lock",
    "px4-rates",
    "px4-statustext",
    "px4-origin",
    "px4-projection",
    "px4-mode-numbers",
    "px4-mode-change",
    "px4-ready",
    "px4-takeoff",
    "px4-offboard",
    "px4-after-landing",
    "px4-setpoints-stop",
    "px4-velocity",
    "px4-frames",
    "px4-gcs-loss",
    "px4-rtl",
    "px4-fence",
    "px4-in-the-air",
    "ardupilot-links",
    "ardupilot-ready",
    "ardupilot-streams",
    "ardupilot-modes",
    "ardupilot-takeoff",
    "ardupilot-setpoints-during-takeoff",
    "ardupilot-setpoints-stop",
    "ardupilot-stopping",
    "ardupilot-velocity-limits",
    "ardupilot-frames",
    "ardupilot-position-setpoints",
    "ardupilot-local-frame",
    "ardupilot-rtl",
    "ardupilot-gcs-loss",
    "ardupilot-fence",
    "ardupilot-parameters",
    "ardupilot-no-answer",
    "ardupilot-speedup",
)
NOT_BEHAVIOUR = {
    "px4-cost-speed": "how much of a core the real firmware takes, and how fast six of them run on one machine",
    "ardupilot-cost": "how much of a core the real firmware takes",
}
"""Rows of which there is nothing to play, and why."""
HELPERS = {"storm", "stub_flight"}
"""Modules of tests/vehicle that join sessions to real stubs."""


def marked_rows(module: ast.Module) -> Iterator[str]:
    """The keys of all marks on tests, and on classes of tests."""
    for node in ast.walk(module):
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        for decorator in node.decorator_list:
            if isinstance(decorator, ast.Call) and ast.unparse(decorator.func) == "pytest.mark.row":
                yield from (ast.literal_eval(argument) for argument in decorator.args)


def imports_stub(module: ast.Module) -> bool:
    """Whether it imports the stub, or a helper that does."""
    named = [node.module or "" for node in ast.walk(module) if isinstance(node, ast.ImportFrom)]
    return any(name in HELPERS or name.split(".")[0] == "sim_vehicle_stub" for name in named)


def shown(folder: str) -> dict[str, set[str]]:
    """Row key → the modules in a folder of tests that show it."""
    rows: dict[str, set[str]] = {}
    for path in sorted((TESTS / folder).glob("test_*.py")):
        module = ast.parse(path.read_text())
        if folder == "stub" or imports_stub(module):
            for key in marked_rows(module):
                rows.setdefault(key, set()).add(path.name)
    return rows


STUB, CONTROLLER = shown("stub"), shown("vehicle")


@pytest.mark.parametrize("key", ROWS)
def test_the_stub_plays_the_row_and_the_controller_survives_it(key: str) -> None:
    assert STUB.get(key), f"no test in tests/stub is marked row({key!r})"
    assert CONTROLLER.get(key), f"no test in tests/vehicle that meets the stub is marked row({key!r})"


@pytest.mark.parametrize("folder", [STUB, CONTROLLER], ids=["stub", "vehicle"])
def test_only_rows_that_there_are_are_named(folder: dict[str, set[str]]) -> None:
    assert folder.keys() <= set(ROWS)
    assert not NOT_BEHAVIOUR.keys() & set(ROWS)
