"""Binding: the loop's entry points, compiled once for each planner, and cached without going stale.

Each entry's code object is rebound with the planner's kernels as globals, callees first, and only these bound
functions are cached by Numba.  The cache folder is named by a digest of every source of this package, of the
versions of Python, NumPy and Numba, and of the NUMBA_* settings that change code: an edited kernel never
meets an old cache.  With no writable user cache a temporary folder is used.  This is the only module of the
core that touches files.

What one process compiled is linked in another beside what a third one did, by name; and Numba's names count
functions and record types from one in every process.  Two planners' copies of a function could so have one name
for two layouts of memory, and whichever is loaded second runs the other's.  So each process counts from a
number of its own.
"""

import hashlib
import itertools
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType, SimpleNamespace
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core.bytecode import FunctionIdentity

from . import loop, planners, state

F = TypeVar("F", bound=Callable[..., object])
# Callees first.  Those of a period are copied into what calls them: handing on their twenty arrays costs more than
# they do.
IN_A_PERIOD = ("observe", "inform", "share", "deliver", "decide", "period")
BOUND = ("prepare", *IN_A_PERIOD, "run_ideal", "search", "run_multicopter")
_OWN_NUMBER_BYTES = 6
_NOT_CODE = ("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER")


def digest() -> str:
    """A name for the code that the kernels compile to: sources, versions and compiler settings."""
    sha = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        sha.update(source.name.encode() + b"\0" + source.read_bytes())
    flags = {k: v for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in _NOT_CODE}
    sha.update(repr((sys.version, np.__version__, numba.__version__, sorted(flags.items()))).encode())
    return sha.hexdigest()[:20]


def cache_folder() -> Path:
    """The writable folder that holds the compiled kernels of exactly this code."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = Path(home) / "swarmctl" / "kernels" / digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        return Path(tempfile.mkdtemp(prefix="swarmctl-kernels-"))
    return folder


def _compile(function: Callable[..., Any], name: str, free: dict[str, Any], inline: bool = False) -> Any:
    bound = FunctionType(function.__code__, {**function.__globals__, **free}, name)
    bound.__qualname__ = name  # Numba's cache index goes by it
    # Without Numba's runtime: see jit.kernel.
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "forceinline": inline}
    return numba.njit(cache=True, **options)(bound)


@cache
def _use_cache() -> Path:
    folder = cache_folder()
    numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
    FunctionIdentity._unique_ids = itertools.count(int.from_bytes(os.urandom(_OWN_NUMBER_BYTES), "big"))
    return folder


def is_compiled(name: str, entry: str = "decide") -> bool:
    """Whether ``entry`` for algorithm ``name`` is in the cache already (a first start has to compile)."""
    return any(_use_cache().rglob(f"*.{entry}_{name.replace('-', '_')}-*.nbi"))


@cache
def bind(name: str) -> SimpleNamespace:
    """The loop's entry points for algorithm ``name``, and the dtypes of its memory and its beacons; KeyError for
    an unknown one.

    They compile at their first call with given array types, or load from the cache.
    """
    _use_cache()
    module = planners.module(name)
    free: dict[str, Any] = {"start": module.start, "tell": module.tell, "plan": module.step}
    free["LISTS"] = module.LISTS
    for entry in BOUND:
        free[entry] = _compile(
            getattr(loop, entry), f"{entry}_{name.replace('-', '_')}", free, entry in IN_A_PERIOD
        )
    beacon = getattr(module, "BEACON", state.BEACON)
    return SimpleNamespace(memory_dtype=module.MEMORY, beacon_dtype=beacon, **free)


def compiled(kernel: F) -> F:
    """The cached entry point for one kernel, this package's or another's.

    A kernel from outside this package may only call this package and its own file, whose time stamp Numba's
    cache goes by.
    """
    _use_cache()
    return cast(F, _compile(getattr(kernel, "py_func", kernel), kernel.__name__, {}))
