"""What the tests of studies share: a mission that is done in a moment, and studies of it."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from swarmctl.study.execute import local
from swarmctl.study.plan import Plan, make_plan
from swarmctl.study.study import Study

SMALL = """
name: small
area: {size_m: [900, 800]}
keep_out:
  - {box_m: [300, 380, 300, 380]}
vehicles: {count: 3, speed_mps: 18, altitude_m: 8}
sensor: {range_m: 100}
radio: {range_m: 200}
targets: {clusters: 3, count: 40, radius_m: 60}
duration_s: 120
"""


def small_plan(algorithms: Sequence[str], runs: int, sets: Sequence[str] = ()) -> Plan:
    """A plan of the small mission, with seeds from 1."""
    with TemporaryDirectory() as folder:
        mission = Path(folder) / "small.yaml"
        mission.write_text(SMALL)
        return make_plan(mission, algorithms, range(1, runs + 1), {}, sets)


def flown(plan: Plan, workers: int = 2) -> Study:
    """The plan's study, done; its clock counts half seconds."""
    study = Study(plan)
    with local(workers) as executor:
        study.fly(executor, ticking())
    return study


def ticking() -> Callable[[], float]:
    """A clock that is half a second on at every look."""
    looks = iter(range(10**9))
    return lambda: 0.5 * next(looks)


class LastFirst(Executor):
    """Does nothing until a result is asked for, then everything, last come first."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future[Any], Callable[[], Any]]] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Put it on the pile."""
        future = _Asked(self)
        self.waiting.append((future, lambda: fn(*args, **kwargs)))
        return future

    def work(self) -> None:
        """Do all that waits."""
        while self.waiting:
            future, call = self.waiting.pop()
            if future.set_running_or_notify_cancel():
                future.set_result(call())


class _Asked(Future[Any]):
    """A result that is worked for when somebody asks."""

    def __init__(self, executor: LastFirst) -> None:
        super().__init__()
        self._executor = executor

    def result(self, timeout: float | None = None) -> Any:
        """The result."""
        self._executor.work()
        return super().result(timeout)
