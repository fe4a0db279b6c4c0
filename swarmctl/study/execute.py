"""Who does the jobs of a study: threads of this process, or a cluster through the same interface.

Kernels let go of the interpreter while they run, so threads are as good as processes, and share what is compiled.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager

import numpy as np

from swarmctl.core.arrays import Records
from swarmctl.mission.model import Mission

from .runs import Job, is_ideal, simulate

CHUNK = 25
"""Runs a job: small enough for a smooth progress bar, large enough to cost nothing."""

Simulate = Callable[[Job], Records]
Done = Callable[[int], None]
"""Called with how many more runs are done."""


def jobs_of(mission: Mission, algorithm: str, seeds: Sequence[int], chunk: int = CHUNK) -> list[Job]:
    """The seeds cut into jobs, in order."""
    parts = [tuple(seeds[k : k + chunk]) for k in range(0, len(seeds), chunk)]
    return [Job(mission, algorithm, part, is_ideal(mission)) for part in parts]


@contextmanager
def local(workers: int | None = None) -> Iterator[Executor]:
    """This process's own threads; None is one a processor."""
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def run_jobs(
    jobs: Sequence[Job], executor: Executor, done: Done = lambda runs: None, run: Simulate | None = None
) -> list[Records]:
    """Each job's records, in the jobs' order, whoever finishes first; a job's error is raised here.

    ``run`` does a job, and its records may be others; None is ``simulate``.
    """
    places: dict[Future[Records], int] = {
        executor.submit(run or simulate, job): k for k, job in enumerate(jobs)
    }
    results: list[Records] = [np.zeros(0)] * len(jobs)
    for future in as_completed(places):
        results[places[future]] = future.result()
        done(len(results[places[future]]))
    return results


def run_seeds(
    mission: Mission, algorithm: str, seeds: Sequence[int], executor: Executor, done: Done = lambda runs: None
) -> Records:
    """RUN records (R,) of one algorithm, in the seeds' order."""
    return np.concatenate(run_jobs(jobs_of(mission, algorithm, seeds), executor, done))
