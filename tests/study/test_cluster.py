"""A study on a real Dask scheduler and real workers: the same bits as here, whoever dies, or a plain refusal."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import llvmlite.binding
import numpy as np
import pytest
from click.testing import CliRunner
from distributed import Client

from swarmctl.cli import main
from swarmctl.core.arrays import Records
from swarmctl.mission.load import load
from swarmctl.study import cluster as clusters
from swarmctl.study import execute
from swarmctl.study.cluster import cluster, code, judge
from swarmctl.study.errors import ClusterError

ROOT = Path(__file__).parents[2]
PATIENCE_S = 60.0
RUNS = range(1, 241)
OF_THE_MACHINE = ("wall_s", "uav_steps_per_s", "threads", "run", "machine")


def until(met: Callable[[], bool]) -> None:
    """Wait until a condition is met, with a deadline."""
    deadline = time.monotonic() + PATIENCE_S
    pause = threading.Event()
    while not met():
        assert time.monotonic() < deadline, "waited in vain"
        pause.wait(0.02)


@contextmanager
def started(*command: str, **settings: str) -> Iterator[subprocess.Popen[bytes]]:
    """One of Dask's programs in a process of its own, killed in the end."""
    process = subprocess.Popen(
        [sys.executable, "-m", *command],
        env={**os.environ, "PYTHONPATH": str(ROOT), **settings},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def scheduler(folder: Path, **settings: str) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler on a free port: its address and its process."""
    file = folder / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
    with started("dask", "scheduler", *options, **settings) as process:
        until(lambda: file.exists() and file.read_text().endswith("}"))
        yield json.loads(file.read_text())["address"], process


def worker(address: str, name: str, **settings: str) -> AbstractContextManager[subprocess.Popen[bytes]]:
    """A worker of one thread and without a nanny, so that killing it is killing it."""
    options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1", "--name", name)
    return started("dask", "worker", address, *options, **settings)


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with scheduler(tmp_path_factory.mktemp("scheduler")) as (address, _):
        yield address


@pytest.fixture
def address(lasting: str) -> str:
    """A scheduler that has lost the workers of the test before."""
    with Client(lasting) as client:
        until(lambda: not client.nthreads())
    return lasting


def study(executor: execute.Executor, done: execute.Done = lambda runs: None) -> Records:
    jobs = execute.jobs_of(load(), "fco", RUNS, chunk=5)
    return np.concatenate(execute.run_jobs(jobs, executor, done))


def address_of(client: Client, name: str) -> str:
    workers = client.scheduler_info(n_workers=-1)["workers"]
    return next(address for address, known in workers.items() if known["name"] == name)


def test_a_worker_killed_in_mid_study_changes_no_bit(address: str) -> None:
    with execute.local(2) as threads:
        here = study(threads)
    with worker(address, "stays"), worker(address, "dies") as victim, Client(address) as client:
        client.wait_for_workers(2, PATIENCE_S)
        where = address_of(client, "dies")
        lost: list[str] = []

        def kill(runs: int) -> None:
            if lost:
                return
            victim.send_signal(signal.SIGSTOP)  # so that what it has to do it will not have done
            until(lambda: bool(client.processing()[where]))
            lost.extend(client.processing()[where])
            victim.kill()

        with cluster(address) as executor:
            there = study(executor, kill)
        assert lost
        assert list(client.nthreads()) == [address_of(client, "stays")]
    assert there.tobytes() == here.tobytes()


@pytest.mark.parametrize(
    "command",
    [("study", "--algo", "fco", "--runs", "20"), ("tune", "--algo", "fco", "--trials", "3", "--runs", "8")],
)
def test_commands_come_to_the_same_on_a_cluster(
    command: tuple[str, ...], address: str, tmp_path: Path
) -> None:
    def told(*options: str) -> dict[str, object]:
        result = CliRunner().invoke(main, [*command, "--json", *options])
        assert result.exit_code == 0, result.stderr
        content = json.loads(result.stdout)
        return {key: value for key, value in content.items() if key not in OF_THE_MACHINE}

    with worker(address, "only"):
        there = told("--cluster", address, "--out", str(tmp_path / "there"))
    assert there == told("--workers", "2", "--out", str(tmp_path / "here"))


def test_a_scheduler_that_dies_in_mid_study_is_an_error_and_no_waiting(tmp_path: Path) -> None:
    with (
        scheduler(tmp_path) as (address, process),
        worker(address, "only"),
        pytest.raises(ClusterError, match=r"the scheduler went away"),
        cluster(address) as executor,
    ):
        study(executor, lambda runs: process.kill())


def test_a_job_that_its_workers_die_of_is_given_up(tmp_path: Path) -> None:
    with (
        scheduler(tmp_path, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0") as (address, _),
        worker(address, "dies of it"),
        pytest.raises(ClusterError, match=r"a job was lost with several workers in turn"),
        cluster(address) as executor,
    ):
        executor.submit(os._exit, 1).result(PATIENCE_S)


def test_what_was_not_begun_is_taken_back_when_a_study_is_stopped(address: str) -> None:
    def stop(runs: int) -> None:
        raise KeyboardInterrupt

    with worker(address, "only"), Client(address) as client:
        with pytest.raises(KeyboardInterrupt), cluster(address) as executor:
            study(executor, stop)
        until(lambda: not any(client.processing().values()))


def test_a_worker_with_other_kernels_is_refused_by_name(address: str) -> None:
    with worker(address, "other", NUMBA_OPT="2"), Client(address) as client:
        client.wait_for_workers(1, PATIENCE_S)
        where = address_of(client, "other")
        with pytest.raises(
            ClusterError, match=rf"{where} would not give the same bits: compiled kernels"
        ) as refused:
            enter(address)
        assert "NumPy" not in str(refused.value)


def test_a_worker_that_joins_later_is_asked_with_every_job() -> None:
    with pytest.raises(ClusterError, match=r"NumPy .*, not 9\.9"):
        clusters._checked({**code(), "NumPy": "9.9"}, len, "unused")
    assert clusters._checked(code(), len, "four") == 4


def test_workers_of_one_kind_may_be_another_kind_than_this_machine() -> None:
    other = {**code(), "CPU": "z80"}
    assert judge({"a": other, "b": other}) == other
    with pytest.raises(ClusterError, match=rf"worker b .*CPU {code()['CPU']}, not z80"):
        judge({"a": other, "b": code()})


def test_workers_of_another_kind_than_this_machine_are_told(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    theirs = code()["CPU"]
    monkeypatch.setattr(llvmlite.binding, "get_host_cpu_name", lambda: "z80")  # here, not on the worker
    code.cache_clear()
    said: list[str] = []
    try:
        with worker(address, "only"), cluster(address, said.append):
            pass
    finally:
        code.cache_clear()
    assert said == [
        f"cluster at {address}: 1 workers, {theirs}",
        "this machine is z80: here the same study may differ in the last digits",
    ]


def test_a_worker_without_swarmctl_is_named() -> None:
    missing = ModuleNotFoundError("No module named 'swarmctl'")
    with pytest.raises(ClusterError, match=r"worker b: No module named 'swarmctl'"):
        judge({"a": code(), "b": missing})


def test_a_scheduler_without_workers_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "WORKERS_S", 0.1)
    with pytest.raises(ClusterError, match=rf"{address}: the scheduler has no workers"):
        enter(address)


def test_a_port_where_somebody_else_answers_is_no_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "CONNECT_S", 0.3)
    with (
        socket.create_server(("127.0.0.1", 0)) as somebody,
        pytest.raises(ClusterError, match=r"no Dask scheduler answers there"),
    ):
        enter(f"tcp://127.0.0.1:{somebody.getsockname()[1]}")


def test_tls_that_is_not_set_up_is_said(address: str) -> None:
    with pytest.raises(ClusterError, match=r"no Dask scheduler answers there .*TLS"):
        enter(address.replace("tcp:", "tls:"))


@pytest.mark.parametrize(
    "nowhere", ["tcp://127.0.0.1:9", "127.0.0.1", "udpin://127.0.0.1:14540", "tcp://a:b"]
)
def test_no_scheduler_is_said_in_one_line(nowhere: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "CONNECT_S", 0.2)
    with pytest.raises(
        ClusterError, match=rf"^{nowhere}: no Dask scheduler answers there .*dask scheduler\)$"
    ):
        enter(nowhere)


def test_the_extra_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "find_spec", lambda name: None)
    with pytest.raises(ClusterError, match=r"pip install 'swarmctl\[cluster\]'"):
        enter("tcp://127.0.0.1:9")


def enter(address: str) -> None:
    """Ask for a cluster and go at once."""
    with cluster(address):
        pass
