"""``swarmctl study``: many runs of several algorithms on the same layouts, told in tables, charts and study.json."""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import ABORTED, INTERRUPTIONS, plain_errors, say
from .core.planners import MODULES

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from .record.folder import RunFolder
    from .study.plan import Cell, Plan
    from .study.study import Study

MOST_RUNS = 1_000_000
PathArgument = click.Path(path_type=Path)
Check = Callable[[], None]
"""Raises KeyboardInterrupt if somebody asked to stop."""


class AlgorithmsType(click.ParamType):  # type: ignore[type-arg]
    """Names with commas between them."""

    name = "algorithms"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        """Read them; one that is unknown, or none, is a bad command line."""
        if isinstance(value, tuple):
            return value
        names = tuple(dict.fromkeys(name.strip() for name in value.split(",")))
        unknown = [name for name in names if name not in MODULES]
        if unknown:
            self.fail(f"{unknown[0]!r} is not one of {', '.join(MODULES)}", param, ctx)
        return names


@click.command()
@click.option(
    "--mission", "mission_file", type=PathArgument, help="Mission file (default: the packaged paper.yaml)."
)
@click.option(
    "--algo", "algorithms", type=AlgorithmsType(), default=tuple(MODULES), metavar="NAME[,NAME...]",
    help="What is compared (default: all).",
)  # fmt: skip
@click.option(
    "--runs", type=click.IntRange(1, MOST_RUNS), default=1000, show_default=True, help="Runs an algorithm."
)
@click.option(
    "--seed", type=click.IntRange(0, 2**61), default=1, show_default=True,
    help="The first run's seed; the next ones count up, for every algorithm.",
)  # fmt: skip
@click.option("--workers", type=click.IntRange(1), help="Threads here (default: one a processor).")
@click.option("--cluster", "address", metavar="ADDRESS", help="A Dask scheduler that does the runs instead.")
@click.option("--vehicles", type=click.IntRange(1), help="How many vehicles.")
@click.option(
    "--constant-density", is_flag=True,
    help="Area, clusters and targets grow with the vehicles, which start spread over the area.",
)  # fmt: skip
@click.option("--duration", type=float, help="Length of the search in seconds.")
@click.option(
    "--set", "sets", multiple=True, metavar="KEY=V[,V...]",
    help="A mission key, e.g. planner.inertia=0.2,0.4; may be given again: several keys make a grid.",
)  # fmt: skip
@click.option("--out", type=PathArgument, help="The study's folder (default: runs/DATE-TIME-study).")
@click.option("--json", "as_json", is_flag=True, help="Print study.json, and nothing else, on stdout.")
def study(
    mission_file: Path | None, algorithms: tuple[str, ...], runs: int, seed: int, workers: int | None,
    address: str | None, vehicles: int | None, constant_density: bool, duration: float | None,
    sets: tuple[str, ...], out: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Fly a mission many times over with each of several algorithms, and compare them.

    Run k of every algorithm has the same layout.  A mission without dynamics is flown in ideal dynamics.
    """
    with plain_errors(), stopping() as check, ExitStack() as ending:
        from .flight.fly import default_folder
        from .study.plan import make_plan
        from .study.study import Study

        flags = {"vehicles.count": vehicles, "duration_s": duration}
        given: dict[str, object] = {key: value for key, value in flags.items() if value is not None}
        seeds = range(seed, seed + runs)
        under_way = Study(make_plan(mission_file, algorithms, seeds, given, sets, constant_density))
        folder = default_folder(out, "study")
        ending.callback(folder.remove_if_empty)
        executor = ending.enter_context(executor_of(workers, address))
        try:
            _warm_up(under_way, executor, address is None)
            _fly(under_way, executor, check)
        except KeyboardInterrupt:
            say("stopping; press Ctrl-C again to stop at once")
            raise
        finally:  # whatever ended it, what is finished is kept
            _keep(under_way, folder, as_json)


def executor_of(workers: int | None, address: str | None) -> "AbstractContextManager[Executor]":
    """Threads here, or a cluster."""
    if address is None:
        from .study.execute import local

        return local(workers)
    if workers is not None:
        raise click.UsageError("--cluster has workers of its own: no --workers can be given")
    from .study.cluster import cluster

    return cluster(address, say)


@contextmanager
def stopping() -> Iterator[Check]:
    """Ctrl-C (SIGTERM, or a closed terminal) once: KeyboardInterrupt, and exit 4 after it; twice: exit 4 at once.

    The first may fall into a destructor, which no exception leaves; so what is given is to be called now and then,
    and stops what missed it.
    """
    asked: list[int] = []

    def stop(number: int, frame: object) -> None:
        asked.append(number)
        if len(asked) > 1:
            os._exit(ABORTED)  # threads that are in the middle of a run can be ended in no other way
        raise KeyboardInterrupt

    def check() -> None:
        if asked:
            raise KeyboardInterrupt

    before: dict[int, Any] = {number: signal.signal(number, stop) for number in INTERRUPTIONS}
    try:
        yield check
    except KeyboardInterrupt:
        say("stopped")
        sys.exit(ABORTED)
    finally:
        if not asked:  # else a second one still ends what is left to do
            for number, handler in before.items():
                signal.signal(number, handler)


def compiling(name: str) -> None:
    """Say why nothing happens yet."""
    say(f"compiling the kernels of {name}: the first start takes some seconds, later ones do not")


def _warm_up(under_way: "Study", executor: "Executor", here: bool) -> None:
    """Have everything compiled before the clock starts."""
    if not here:
        say("the workers load their kernels, or compile them: a first start takes some seconds an algorithm")
        under_way.warm_up_elsewhere(executor)
        return
    under_way.warm_up(compiling)


def _fly(under_way: "Study", executor: "Executor", check: Check) -> None:
    """Do the runs, and show how far they are."""
    from .flight.clock import wall_s

    plan = under_way.plan
    say(_intention(plan))
    with _progress(plan, check) as (done, finished):
        under_way.fly(executor, wall_s, done, finished)
    steps = under_way.steps_per_s
    say(f"{plan.runs} runs in {under_way.wall_s:.1f} s: {steps / 1e6:.2f} million vehicle-steps a second")


def _intention(plan: "Plan") -> str:
    cell, seeds = plan.cells[0], plan.seeds
    grid = f" x {len(plan.cells)} settings" if plan.varied else ""
    return (
        f"studying {', '.join(plan.algorithms)} on {cell.mission.name}: {len(seeds)} runs each{grid}, "
        f"{len(cell.mission.fleet)} vehicles, {cell.dynamics} dynamics, seeds {seeds[0]} to {seeds[-1]}"
    )


@contextmanager
def _progress(
    plan: "Plan", check: Check
) -> "Iterator[tuple[Callable[[int], None], Callable[[Cell, str], None]]]":
    """A bar on a terminal, a line for each algorithm that is finished elsewhere; on stderr."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("runs", total=plan.runs)

        def done(runs: int) -> None:
            check()
            bar.update(task, advance=runs)

        def finished(cell: "Cell", name: str) -> None:
            console.print(_finished(plan, cell, name), markup=False, highlight=False, soft_wrap=True)

        yield done, finished


def _finished(plan: "Plan", cell: "Cell", name: str) -> str:
    from .study.settings import shown

    where = f", {shown(cell.settings)}" if plan.varied else ""
    return f"{name}{where}: {len(plan.seeds)} runs done"


def _keep(under_way: "Study", folder: "RunFolder", as_json: bool) -> None:
    """Write what is finished, and print it."""
    from .study.report import figures_of_study, text, write

    cells = figures_of_study(under_way)
    if not cells:
        say("nothing was finished, nothing is kept")
        return
    content = write(under_way, cells, folder)
    if not under_way.complete:
        say(f"kept the {under_way.finished} of {under_way.plan.runs} runs whose algorithms were finished")
    if as_json:
        click.echo(json.dumps(content, indent=2, allow_nan=False))
    else:
        click.echo(f"{text(under_way, cells)}\n\nrun: {folder.path}")
