"""A study under way: the plan's runs done by an executor, and what is finished of them.

All jobs are given to the executor at once and taken back in order, so that nobody waits between two algorithms,
and whatever was finished when somebody stops the study can be told: whole algorithms only, since pairs need the
same seeds.  How runs are cut into jobs shows in nothing but the progress.
"""

import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future

import numpy as np

from swarmctl.core import bind
from swarmctl.core.arrays import Records
from swarmctl.mission.model import Mission

from .execute import CHUNK, Done, jobs_of
from .plan import Cell, Plan
from .runs import Job, is_ideal, simulate

JOB_STEPS = 240_000
"""Vehicle-steps a job, at most: so large a job is stopped, and shows progress, in a fraction of a second."""

MULTICOPTER_COST = 10
"""About what a step in multicopter dynamics costs, ideal ones being 1."""

JOBS_A_THREAD = 4
"""At least so many, if there are runs enough: the last ones to finish leave nobody idle for long."""

Finished = Callable[[Cell, str], None]
Batch = tuple[int, str, list[Future[Records]]]


def steps_of(mission: Mission) -> int:
    """Vehicle-steps of one run: vehicles times planner periods."""
    return len(mission.fleet) * round(mission.duration_s / mission.planner.period_s)


def chunk_of(mission: Mission, runs: int, threads: int) -> int:
    """How many runs make a job."""
    cost = steps_of(mission) * (1 if is_ideal(mission) else MULTICOPTER_COST)
    most = min(CHUNK, -(-runs // (JOBS_A_THREAD * threads)))
    return max(1, min(most, JOB_STEPS // max(cost, 1)))


def threads_of(executor: Executor) -> int:
    """How many runs an executor does at once; one that does not tell counts as this machine's processors."""
    told = getattr(executor, "threads", None) or getattr(executor, "_max_workers", None)
    return int(told or os.cpu_count() or 1)


class Study:
    """``runs`` holds, for each of the plan's cells, the RUN records (R,) of every algorithm that is finished."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.runs: list[dict[str, Records]] = [{} for _ in plan.cells]
        self.wall_s = 0.0
        self.threads = 1

    @property
    def complete(self) -> bool:
        """Whether everything planned is finished."""
        return self.finished == self.plan.runs

    @property
    def finished(self) -> int:
        """Runs of algorithms that are finished."""
        return sum(len(records) for runs in self.runs for records in runs.values())

    @property
    def cells(self) -> list[tuple[Cell, dict[str, Records]]]:
        """The cells of which anything is finished, with what is."""
        return [(cell, runs) for cell, runs in zip(self.plan.cells, self.runs, strict=True) if runs]

    @property
    def steps_per_s(self) -> float:
        """Vehicle-steps a second of wall time, of what is finished."""
        steps = sum(
            steps_of(cell.missions[name]) * len(r) for cell, runs in self.cells for name, r in runs.items()
        )
        return steps / self.wall_s if self.wall_s > 0.0 else 0.0

    def warm_up(self, compiling: Callable[[str], None] = lambda name: None) -> None:
        """Compile, or load, what the runs will call; ``compiling`` is told of each algorithm that takes long."""
        for job in self._first_steps():
            if not bind.is_compiled(job.algorithm, "run_ideal" if job.ideal else "run_multicopter"):
                compiling(job.algorithm)
            simulate(job)

    def warm_up_elsewhere(self, executor: Executor) -> None:
        """Have it compiled by the workers of a cluster: as many jobs of each kind as they have threads."""
        for job in self._first_steps():
            for future in [executor.submit(simulate, job) for _ in range(threads_of(executor))]:
                future.result()

    def _first_steps(self) -> list[Job]:
        """A run of a single step for each kind of run that has kernels of its own."""
        kinds = {
            (name, is_ideal(mission), mission.observations): mission
            for cell in self.plan.cells
            for name, mission in cell.missions.items()
        }
        seeds = (self.plan.seeds[0],)
        return [
            Job(mission.model_copy(update={"duration_s": mission.planner.period_s}), name, seeds, ideal)
            for (name, ideal, _), mission in kinds.items()
        ]

    def fly(
        self, executor: Executor, wall_s: Callable[[], float], done: Done = lambda runs: None,
        finished: Finished = lambda cell, name: None,
    ) -> None:  # fmt: skip
        """Do all runs; interrupted, leave what is not begun undone.

        ``done`` is told how many more runs are done, ``finished`` of every algorithm that is.
        """
        self.threads = threads_of(executor)
        began = wall_s()
        batches = deque(self._submitted(executor))
        try:
            while batches:
                place, name, futures = batches[0]
                self.runs[place][name] = _taken(futures, done)
                self.wall_s = wall_s() - began
                batches.popleft()
                finished(self.plan.cells[place], name)
        finally:
            for _, _, futures in batches:
                for future in futures:
                    future.cancel()

    def _submitted(self, executor: Executor) -> list[Batch]:
        return [
            (place, name, [executor.submit(simulate, job) for job in self._jobs(name, mission)])
            for place, cell in enumerate(self.plan.cells)
            for name, mission in cell.missions.items()
        ]

    def _jobs(self, name: str, mission: Mission) -> list[Job]:
        seeds = self.plan.seeds
        return jobs_of(mission, name, seeds, chunk_of(mission, len(seeds), self.threads))


def _taken(futures: Sequence[Future[Records]], done: Done) -> Records:
    parts = []
    for future in futures:
        parts.append(future.result())
        done(len(parts[-1]))
    return np.concatenate(parts)
