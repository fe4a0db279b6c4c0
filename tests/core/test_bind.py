"""The kernels' cache: never stale after an edit, used by the next process, and not needed where nothing is writable."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swarmctl
from swarmctl.core import bind, planners

ONE_STEP = """
import json, math, sys
import numpy as np
from swarmctl.core import bind, state
from swarmctl.core.world import Fences, Scene, World, make_settings

square = np.array([[0, 0, 9, 0], [9, 0, 9, 9], [9, 9, 0, 9], [0, 9, 0, 0.0]]) * 1000
fleet, rules = np.zeros(1, state.VEHICLE), np.zeros(1, state.RULES)
fleet["speed"], fleet["heading_east"], rules["period"], rules["ideal"] = 25.0, 1.0, 1.0, 1
nothing = Scene(np.zeros(0, state.TARGET), np.zeros(1, state.GRID), np.zeros(2, np.int64))
first_time = not bind.is_compiled("bounce")
world = World("bounce", fleet, rules, nothing, Fences(square, square, square), make_settings("bounce", {}))
world.poses["east"] = world.poses["north"] = 4500.0
world.memory["heading_east"] = 1.0
world.decide(0)
stats = world.kernels.decide.stats
print(json.dumps({
    "file": bind.__file__, "wish": world.wishes[0].tolist(), "first_time": first_time, "digest": bind.digest(),
    "symbols": [overload.fndesc.mangled_name for overload in world.kernels.decide.overloads.values()],
    "hits": sum(stats.cache_hits.values()), "misses": sum(stats.cache_misses.values()),
}))
"""


def copy_core(to: Path) -> None:
    """The package as far as the kernels need it."""
    core = Path(swarmctl.__file__).parent / "core"
    shutil.copytree(core, to / "swarmctl" / "core", ignore=shutil.ignore_patterns("__pycache__"))
    (to / "swarmctl" / "__init__.py").touch()


def step_in_new_process(copy: Path) -> dict[str, Any]:
    """What one planned step in a process of its own says, with the package at ``copy`` and a cache beside it."""
    env = {**os.environ, "PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(copy / "cache")}
    env.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", ONE_STEP], env=env, cwd=copy, capture_output=True, text=True, check=True
    )
    said: dict[str, Any] = json.loads(done.stdout)
    assert str(said["file"]).startswith(str(copy))
    return said


def compiled_files(copy: Path) -> dict[str, int]:
    """The cache's files and when each was written."""
    files = (copy / "cache").rglob("*.nb*")
    return {str(f.relative_to(copy)): f.stat().st_mtime_ns for f in files}


def test_an_edited_kernel_is_flown_and_an_unedited_one_loaded(tmp_path: Path) -> None:
    copy_core(tmp_path)
    first = step_in_new_process(tmp_path)
    assert first["wish"] == [25.0, 0.0]
    assert (first["first_time"], first["misses"]) == (True, 1)

    edited = tmp_path / "swarmctl" / "core" / "planners" / "common.py"
    stamp = edited.stat()
    source = edited.read_text()
    straight = "    memory[i].throttle = 1.0\n"
    assert source.count(straight) == 1
    edited.write_text(source.replace(straight, straight + "    turn_to(memory, i, 0.0, -1.0)\n"))
    os.utime(edited, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # even where time stamps do not tell
    second = step_in_new_process(tmp_path)
    assert second["wish"] == [0.0, -25.0]
    assert (second["first_time"], second["misses"]) == (True, 1)
    assert second["digest"] != first["digest"]

    before = compiled_files(tmp_path)
    third = step_in_new_process(tmp_path)
    assert third["wish"] == [0.0, -25.0]
    assert (third["first_time"], third["hits"], third["misses"]) == (False, 1, 0)
    assert compiled_files(tmp_path) == before


def test_no_two_processes_name_what_they_compile_alike(tmp_path: Path) -> None:
    """A name that two planners' code had in one cache would have the second flown by the first one's."""
    symbols: list[object] = []
    for name in ("one", "another"):
        copy_core(tmp_path / name)
        symbols += step_in_new_process(tmp_path / name)["symbols"]
    assert len(symbols) == len(set(symbols)) == 2


def test_the_digest_knows_settings_that_change_code_and_only_those(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = bind.digest()
    assert bind.digest() == plain
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere")
    assert bind.digest() == plain
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert bind.digest() != plain


def test_the_cache_lies_in_the_users_cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert bind.cache_folder() == tmp_path / "swarmctl" / "kernels" / bind.digest()
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert bind.cache_folder() == tmp_path / "home" / ".cache" / "swarmctl" / "kernels" / bind.digest()


def test_with_no_writable_cache_a_temporary_folder_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    folder = bind.cache_folder()
    assert folder.is_dir()
    assert folder.is_relative_to(tmp_path / "tmp")
    (folder / "probe").touch()


def test_an_unknown_algorithm_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        bind.bind("no-such")


@pytest.mark.parametrize("name", planners.MODULES)
def test_every_planner_has_what_the_registry_asks_for(name: str) -> None:
    module = planners.module(name)
    assert module.MEMORY.names[:3] == ("heading_east", "heading_north", "throttle")
    assert all(module.MEMORY[field].itemsize % 8 == 0 for field in module.MEMORY.names)
    assert module.TITLE and module.__doc__
    assert len({p.name for p in module.PARAMETERS}) == len(module.PARAMETERS)
    assert all(p.meaning and p.source and np.isfinite(p.number(p.default)) for p in module.PARAMETERS)
    assert planners.catalogue()[name] == {p.name: p.default for p in module.PARAMETERS}
