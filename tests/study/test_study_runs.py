"""A study's runs: the same bits however they are cut and whoever does them; what is finished outlives a stop."""

from concurrent.futures import Executor, Future
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swarmctl.core.arrays import Records
from swarmctl.mission.model import Mission
from swarmctl.study import execute
from swarmctl.study import study as studies
from swarmctl.study.execute import local
from swarmctl.study.runs import RUN, Job, simulate
from swarmctl.study.study import CHUNK, MULTICOPTER_COST, Study, chunk_of, threads_of

from .studied import LastFirst, flown, small_plan, ticking

ALGORITHMS = ("bounce", "fco")
RUNS = 23


def bits(study: Study) -> list[dict[str, bytes]]:
    """All results, byte by byte."""
    return [{name: records.tobytes() for name, records in runs.items()} for runs in study.runs]


@pytest.fixture(scope="module")
def plainly() -> list[dict[str, bytes]]:
    """The results by a plain loop, one run at a time."""
    (cell,) = small_plan(ALGORITHMS, RUNS).cells
    return [
        {
            name: b"".join(simulate(Job(mission, name, (seed,))).tobytes() for seed in range(1, RUNS + 1))
            for name, mission in cell.missions.items()
        }
    ]


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(workers=st.integers(1, 5), chunk=st.integers(1, RUNS + 2))
def test_neither_workers_nor_cutting_shows(plainly: list[dict[str, bytes]], workers: int, chunk: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(studies, "chunk_of", lambda *_: chunk)
        assert bits(flown(small_plan(ALGORITHMS, RUNS), workers)) == plainly


@pytest.mark.parametrize("order", [ALGORITHMS, ALGORITHMS[::-1]])
def test_neither_the_order_of_jobs_nor_of_algorithms_shows(
    plainly: list[dict[str, bytes]], order: tuple[str, ...]
) -> None:
    study = Study(small_plan(order, RUNS))
    study.fly(LastFirst(), ticking())
    assert bits(study) == plainly


def test_a_run_does_not_depend_on_how_many_there_are(plainly: list[dict[str, bytes]]) -> None:
    few = bits(flown(small_plan(ALGORITHMS, 4)))
    assert [runs["fco"] for runs in few] == [plainly[0]["fco"][: 4 * RUN.itemsize]]


def test_multicopters_are_as_indifferent() -> None:
    plan = small_plan(("bounce",), 5, ["dynamics=multicopter", "duration_s=20"])
    one, other = (bits(flown(plan, workers)) for workers in (1, 3))
    assert one == other
    assert flown(plan).runs[0]["bounce"]["flight_s"].min() > 20.0


def test_all_runs_are_counted_and_timed() -> None:
    plan = small_plan(ALGORITHMS, 10, ["duration_s=60,120"])
    study, done, finished = Study(plan), [], []
    with local(2) as executor:
        study.fly(
            executor,
            ticking(),
            done.append,
            lambda cell, name: finished.append((cell.settings["duration_s"], name)),
        )
    assert sum(done) == plan.runs == study.finished == 40
    assert finished == [(60, "bounce"), (60, "fco"), (120, "bounce"), (120, "fco")]
    assert study.complete
    assert study.wall_s == 2.0  # four looks at half a second after the first
    assert study.steps_per_s == 3 * 2 * 10 * (60 + 120) / 2.0


class Stops(Executor):
    """Does jobs at once, and is stopped at a certain one."""

    def __init__(self, good: int, error: BaseException) -> None:
        self.good, self.error = good, error
        self.futures: list[Future[Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Do it, fail it, or leave it waiting."""
        future: Future[Any] = Future()
        self.futures.append(future)
        if len(self.futures) <= self.good:
            future.set_result(fn(*args, **kwargs))
        elif len(self.futures) == self.good + 1:
            future.set_exception(self.error)
        return future


@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("a worker fell over")])
def test_what_is_finished_outlives_a_stop_and_what_is_not_begun_is_given_up(
    plainly: list[dict[str, bytes]], error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(studies, "chunk_of", lambda *_: 10)  # three jobs an algorithm
    study, executor = Study(small_plan(ALGORITHMS, RUNS)), Stops(4, error)
    with pytest.raises(type(error)):
        study.fly(executor, ticking())
    assert bits(study) == [{"bounce": plainly[0]["bounce"]}]
    assert not study.complete
    assert study.finished == RUNS
    assert [future.cancelled() for future in executor.futures] == [False] * 5 + [True]


def mission(**changes: Any) -> Mission:
    return Mission.model_validate({"duration_s": 1600.0, **changes})


def test_jobs_are_small_enough_to_stop_and_to_share_out() -> None:
    assert chunk_of(mission(), 1000, 2) == CHUNK
    assert chunk_of(mission(), 16, 2) == 2
    assert chunk_of(mission(), 3, 8) == 1
    assert chunk_of(mission(vehicles={"count": 60}), 1000, 2) == CHUNK // 10
    assert chunk_of(mission(dynamics="multicopter"), 1000, 2) == max(1, CHUNK // MULTICOPTER_COST)
    assert chunk_of(mission(vehicles={"count": 6000}), 1000, 2) == 1


def test_an_executor_s_threads_are_counted() -> None:
    with local(3) as executor:
        assert threads_of(executor) == 3
    with local() as executor:
        assert threads_of(executor) == execute.os.cpu_count()


def test_warming_up_tells_what_has_to_be_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, str]] = []

    def is_compiled(name: str, entry: str) -> bool:
        asked.append((name, entry))
        return name == "fco"

    def simulated(job: Job) -> Records:
        flights.append((job.algorithm, job.ideal, job.mission.duration_s, job.seeds))
        return simulate(job)

    flights: list[tuple[str, bool, float, tuple[int, ...]]] = []
    told: list[str] = []
    monkeypatch.setattr(studies.bind, "is_compiled", is_compiled)
    monkeypatch.setattr(studies, "simulate", simulated)
    Study(small_plan(ALGORITHMS, RUNS, ["duration_s=60,120"])).warm_up(told.append)
    assert asked == [("bounce", "run_ideal"), ("fco", "run_ideal")]
    assert told == ["bounce"]
    assert flights == [
        ("bounce", True, 1.0, (1,)),
        ("fco", True, 1.0, (1,)),
    ]  # a step each, whatever the settings


def test_workers_elsewhere_are_warmed_up_once_a_thread() -> None:
    class Elsewhere(LastFirst):
        threads = 3

        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            submitted.append((args[0].algorithm, args[0].mission.duration_s))
            return super().submit(fn, *args, **kwargs)

    submitted: list[tuple[str, float]] = []
    Study(small_plan(ALGORITHMS, RUNS)).warm_up_elsewhere(Elsewhere())
    assert submitted == [("bounce", 1.0)] * 3 + [("fco", 1.0)] * 3
