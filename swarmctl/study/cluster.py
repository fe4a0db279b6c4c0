"""A study's jobs on many machines: a running Dask scheduler and its workers as an executor.

A job's result depends on the job alone, so it does not matter which worker does it, nor that one which died with
its worker is done again.  It does matter that all workers run this very code: what it consists of is compared
before the first job, and again with every job, since workers come and go.

Bit-equality is promised on one kind of CPU.  Workers of several kinds are therefore refused; if all are of one
kind that is not this machine's, the results are those of their kind, which is told.
"""

import asyncio
import hashlib
import logging
import os
import platform
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import llvmlite.binding
import numba
import numpy
import shapely

import swarmctl
from swarmctl.core import bind

from .errors import ClusterError

if TYPE_CHECKING:
    from distributed import Client

P = ParamSpec("P")
T = TypeVar("T")
Code = dict[str, str]
Say = Callable[[str], None]

CONNECT_S = 5.0
WORKERS_S = 5.0
PACKAGES = ("core", "mission", "study")
CPU = "CPU"


@cache
def code() -> Code:
    """What decides a result's bits on this machine, by the name that a message calls it."""
    return {
        "swarmctl": swarmctl.__version__,
        "sources of swarmctl": _sources(),
        "compiled kernels": bind.digest(),
        "Python": platform.python_version(),
        "NumPy": numpy.__version__,
        "Numba": numba.__version__,
        "Shapely": f"{shapely.__version__} with GEOS {shapely.geos_version_string}",
        CPU: os.environ.get("NUMBA_CPU_NAME") or llvmlite.binding.get_host_cpu_name(),
    }


def _sources() -> str:
    sha = hashlib.sha256()
    root = Path(swarmctl.__file__).parent
    for package in PACKAGES:
        for source in sorted((root / package).rglob("*.py")):
            sha.update(str(source.relative_to(root)).encode() + b"\0" + source.read_bytes())
    return sha.hexdigest()[:20]


@contextmanager
def cluster(address: str, say: Say = lambda text: None) -> Iterator[Executor]:
    """The workers of the Dask scheduler at ``address`` as an executor; ``say`` is told who they are.

    Raises ClusterError if there is no scheduler, no worker, or one that runs other code than this.
    """
    client = _connect(address)
    from distributed import KilledWorker

    try:
        yield _Checked(client, _agreed(client, address, say))
    except CancelledError:
        raise ClusterError(
            f"{address}: the scheduler went away in mid-study (start it and study again)"
        ) from None
    except KilledWorker as error:
        raise ClusterError(f"{address}: a job was lost with several workers in turn: {error}") from None
    finally:
        client.close(timeout=CONNECT_S)


def _connect(address: str) -> "Client":
    if find_spec("distributed") is None:
        raise ClusterError("--cluster needs the extra: pip install 'swarmctl[cluster]'")
    from distributed import Client

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what goes wrong is said here, in one line
    try:
        asyncio.run(_greet(address))
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # the last two: TLS here or there alone
        raise ClusterError(
            f"{address}: no Dask scheduler answers there ({error or type(error).__name__}; start one: dask scheduler)"
        ) from None


async def _greet(address: str) -> None:
    """Connect and part: a client that cannot connect leaves complaints at the terminal, this only raises."""
    from distributed.comm import connect
    from distributed.security import Security

    arguments = Security().get_connection_args("client")
    # A time limit of our own: theirs ends with the connection, and somebody else's server may never say a word.
    greeted = await asyncio.wait_for(connect(address, timeout=CONNECT_S, **arguments), CONNECT_S)
    await greeted.close()


def _agreed(client: "Client", address: str, say: Say) -> Code:
    """What every worker must run.  Raises ClusterError if there is none, or one runs something else."""
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError:
        raise ClusterError(
            f"{address}: the scheduler has no workers (start some: dask worker {address})"
        ) from None
    found = client.run(code, on_error="return")
    expected = judge(found)
    say(f"cluster at {address}: {len(found)} workers, {expected[CPU]}")
    if expected[CPU] != code()[CPU]:
        say(f"this machine is {code()[CPU]}: here the same study may differ in the last digits")
    return expected


def judge(found: Mapping[str, Code | BaseException]) -> Code:
    """The code that all workers (by address) run.  Raises ClusterError for those that do not run this one."""
    broken = [f"worker {worker}: {error}" for worker, error in found.items() if not isinstance(error, dict)]
    if broken:
        raise ClusterError("\n".join([*broken, "(install the same swarmctl on every machine)"]))
    codes = {worker: own for worker, own in found.items() if isinstance(own, dict)}
    expected = {**code(), CPU: next(iter(codes.values()))[CPU]}
    lines = [line for worker, own in codes.items() if (line := _difference(worker, own, expected))]
    if lines:
        raise ClusterError("\n".join(lines))
    return expected


def _difference(worker: str, own: Code, expected: Code) -> str:
    """What the worker has otherwise, in a line; empty if nothing."""
    parts = [
        f"{name} {own.get(name)}, not {value}" for name, value in expected.items() if own.get(name) != value
    ]
    return f"worker {worker} would not give the same bits: {'; '.join(parts)}" if parts else ""


class _Checked(Executor):
    """Dask's own executor, with every job checked where it is done."""

    def __init__(self, client: "Client", expected: Code) -> None:
        # pure=False: a key for each job, or a job that is asked for twice would be answered from memory.
        self._inner: Executor = client.get_executor(pure=False)
        self._expected = expected
        self.threads = sum(client.nthreads().values())

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> "Future[T]":
        """Have ``fn`` called by a worker."""
        return self._inner.submit(_checked, self._expected, fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Nothing is submitted any more."""
        self._inner.shutdown(wait=wait, cancel_futures=cancel_futures)


def _checked(expected: Code, work: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Do the work if this worker runs the expected code; it may have joined after the others were asked."""
    line = _difference(platform.node(), code(), expected)
    if line:
        raise ClusterError(line)
    return work(*args, **kwargs)
