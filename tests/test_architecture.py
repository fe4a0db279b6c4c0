"""The arrows between the packages, read from the sources: DESIGN's "May import", and who touches clocks and files.

Imports inside functions count too.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# What each part of swarmctl may import of the others; a part may always import itself.
MAY_IMPORT = {
    "core": set(),
    "mavlink": set(),
    "mission": {"core"},
    "vehicle": {"core", "mavlink"},
    "record": {"core", "mavlink", "mission"},
    "study": {"core", "mavlink", "mission", "vehicle", "record"},
    "flight": {"core", "mavlink", "mission", "vehicle", "record"},
    "web": {"record"},
}
STUB_MAY_IMPORT = {"core", "mavlink"}
READS_A_CLOCK = {f"{kind}.{name}" for kind in ("datetime", "date") for name in ("now", "utcnow", "today")}
NOT_IN_CORE = {"logging", "random", "secrets", "socket", "asyncio", "threading", "subprocess", "requests"}
FILES = {"pathlib", "os", "io", "shutil", "tempfile", "glob", "fileinput", "open"}


def sources(package: str) -> list[Path]:
    """Every module of a package, or the one module of that name."""
    folder = ROOT / package
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imported(path: Path) -> Iterator[tuple[str, int]]:
    """Full dotted names of everything a module imports, with the line."""
    package = list(path.relative_to(ROOT).with_suffix("").parts)[:-1]
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            for alias in node.names:
                yield ".".join([*base, *filter(None, [node.module]), alias.name]), node.lineno


def called(path: Path) -> Iterator[tuple[str, int]]:
    """Names of all functions that a module calls, dotted as written, with the line."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node.lineno


def part_of(name: str) -> str | None:
    """Which part of swarmctl a dotted name lies in; None outside swarmctl, "" for the package itself."""
    parts = name.split(".")
    if parts[0] != "swarmctl":
        return None
    return parts[1] if len(parts) > 1 and (parts[1] in MAY_IMPORT or parts[1] == "cli") else ""


def where(path: Path, line: int) -> str:
    return f"{path.relative_to(ROOT)}:{line}"


def test_every_part_is_named_here() -> None:
    folders = {p.name for p in (ROOT / "swarmctl").iterdir() if p.is_dir() and any(p.rglob("*.py"))}
    assert folders <= set(MAY_IMPORT)
    assert len(sources("swarmctl/core")) > 20  # the sources are where this test looks for them


@pytest.mark.parametrize("part", MAY_IMPORT)
def test_a_part_imports_only_what_it_may(part: str) -> None:
    allowed = {*MAY_IMPORT[part], part, None, ""}
    wrong = [
        f"{where(path, line)} imports {name}"
        for path in sources(f"swarmctl/{part}")
        for name, line in imported(path)
        if part_of(name) not in allowed
    ]
    assert not wrong, "\n".join(wrong)


def test_only_the_command_line_wires_the_stub_in() -> None:
    wrong = [
        f"{where(path, line)} imports {name}"
        for path in sources("swarmctl")
        for name, line in imported(path)
        if name.split(".")[0] == "sim_vehicle_stub"
        and path.name not in ("cli.py", "fly_cli.py", "live_cli.py")
    ]
    assert not wrong, "\n".join(wrong)


def test_the_stub_imports_only_core_and_mavlink() -> None:
    allowed = {*STUB_MAY_IMPORT, None}
    wrong = [
        f"{where(path, line)} imports {name}"
        for path in sources("sim_vehicle_stub")
        for name, line in imported(path)
        if part_of(name) not in allowed
    ]
    assert not wrong, "\n".join(wrong)


def test_nothing_of_ours_is_imported_from_the_tests_or_benchmarks() -> None:
    wrong = [
        f"{where(path, line)} imports {name}"
        for package in ("swarmctl", "sim_vehicle_stub")
        for path in sources(package)
        for name, line in imported(path)
        if name.split(".")[0] in ("tests", "benchmarks")
    ]
    assert not wrong, "\n".join(wrong)


def test_only_bind_touches_files_in_the_core() -> None:
    wrong = [
        where(path, line)
        for path in sources("swarmctl/core")
        if path.name != "bind.py"
        for name, line in (*imported(path), *called(path))
        if name.split(".")[0] in FILES
    ]
    assert not wrong, "\n".join(wrong)


def test_the_core_neither_logs_nor_speaks_nor_throws_dice() -> None:
    wrong = [
        f"{where(path, line)}: {name}"
        for path in sources("swarmctl/core")
        for name, line in (*imported(path), *called(path))
        if name.split(".")[0] in NOT_IN_CORE | {"print", "input"}
        or name.startswith(("np.random", "numpy.random"))
    ]
    assert not wrong, "\n".join(wrong)


def test_only_the_flights_clock_reads_a_clock() -> None:
    allowed = {ROOT / "swarmctl" / "flight" / "clock.py", ROOT / "swarmctl" / "cli.py"}
    wrong = [
        f"{where(path, line)}: {name}"
        for path in sources("swarmctl")
        if path not in allowed and ROOT / "swarmctl" / "web" not in path.parents
        for name, line in (
            *((name, line) for name, line in imported(path) if name.split(".")[0] == "time"),
            *((name, line) for name, line in called(path) if ".".join(name.split(".")[-2:]) in READS_A_CLOCK),
        )
    ]
    assert not wrong, "\n".join(wrong)


HEAVY = {"numba", "scipy", "matplotlib", "shapely", "pydantic"}


def test_no_package_loads_heavy_libraries_by_being_named() -> None:
    wrong = [
        f"{where(path, line)} imports {name}"
        for path in sources("swarmctl")
        if path.name == "__init__.py"
        for name, line in imported(path)
        if name.split(".")[0] in HEAVY
    ]
    assert not wrong, "\n".join(wrong)
