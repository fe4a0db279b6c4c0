"""The documents say what the code says."""

import importlib.util
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_session_diagram_is_drawn_from_the_table() -> None:
    spec = importlib.util.spec_from_file_location("draw_session", ROOT / "docs" / "draw_session.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert (ROOT / "docs" / "session.md").read_text() == module.content()


def test_files_that_documents_name_exist() -> None:
    for document in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for name in re.findall(
            r"`((?:swarmctl|tests|missions|benchmarks|docs|core|flight|record|vehicle)/[\w./]+)`",
            document.read_text(),
        ):
            places = (ROOT / name, ROOT / "swarmctl" / name)
            assert any(place.exists() for place in places), f"{document.name} names {name}"


def test_readme_has_the_two_commands_that_ci_runs() -> None:
    lines = (ROOT / "README.md").read_text().splitlines()
    assert (
        lines[lines.index("<!-- main -->") + 1].strip()
        == "pip install . && swarmctl fly --algo fco --vehicles 6"
    )
    assert lines[lines.index("<!-- test -->") + 1].strip() == "pip install '.[test]' && pytest"
