"""``swarmctl tune``: an algorithm's best setting, found on training seeds and told on fresh ones."""

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .console import BAD_INPUT, plain_errors, say
from .core.planners import MODULES
from .study_cli import MOST_RUNS, Check, PathArgument, compiling, executor_of, stopping

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from .record.folder import RunFolder
    from .study.plan import Plan
    from .study.tune import Question, Told, Trials
    from .study.tuned import Answer

METRICS = ("t25", "t50", "t75", "t85", "t95", "final", "in_range")
MOST_SEED = 999_999  # up to this and MOST_RUNS, training and fresh seeds never meet
TRIALS, ANSWER, YAML = "trials.db", "tune.json", "planner.yaml"


@click.command()
@click.option("--algo", "algorithm", type=click.Choice(list(MODULES)), required=True, help="What is tuned.")
@click.option(
    "--metric",
    type=click.Choice(METRICS),
    default="t85",
    show_default=True,
    help="Mean time to a level (a run that never got there counts as the search's length), the share found "
    "(final), or targets in range.",
)
@click.option(
    "--trials", type=click.IntRange(1), default=60, show_default=True, help="Settings tried, in all."
)
@click.option(
    "--runs", type=click.IntRange(1, MOST_RUNS), default=200, show_default=True, help="Training runs a trial."
)
@click.option(
    "--fresh", type=click.IntRange(1, MOST_RUNS), default=1000, show_default=True,
    help="Runs on fresh seeds that the answer is told on.",
)  # fmt: skip
@click.option(
    "--seed", type=click.IntRange(0, MOST_SEED), default=1, show_default=True, help="Which seeds and trials."
)
@click.option("--workers", type=click.IntRange(1), help="Threads here (default: one a processor).")
@click.option("--cluster", "address", metavar="ADDRESS", help="A Dask scheduler that does the runs instead.")
@click.option("--mission", "mission_file", type=PathArgument, help="Mission file (default: paper.yaml).")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="A mission key; may be repeated.")
@click.option(
    "--out",
    type=PathArgument,
    help="Folder of the trials; one that has some goes on with them.",
)
@click.option("--json", "as_json", is_flag=True, help="Print tune.json, and nothing else, on stdout.")
def tune(
    algorithm: str, metric: str, trials: int, runs: int, fresh: int, seed: int, workers: int | None,
    address: str | None, mission_file: Path | None, settings: tuple[str, ...], out: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Find the best setting of an algorithm's parameters, and say how it does on fresh seeds.

    Prints the planner section of a mission.  Parameters that the mission or --set gives are held.
    """
    with plain_errors(), stopping() as check, ExitStack() as ending:
        from .study.tune import Question

        plan = _plan(mission_file, algorithm, settings)
        question = Question(plan.cells[0].missions[algorithm], algorithm, metric, runs, seed)
        folder = _folder(out, algorithm)
        ending.callback(folder.remove_if_empty)
        try:
            with _alone(folder), executor_of(workers, address) as executor:
                if address is None:
                    _warm_up(plan)
                found = _tune(question, trials, fresh, folder, executor, check)
        except KeyboardInterrupt:
            say(f"what was finished is kept: go on with --out {folder.path}")
            raise
        _write(found, folder)
        if as_json:
            click.echo(json.dumps(found.as_json(), indent=2, allow_nan=False))
        else:
            click.echo(text(found), nl=False)


def _plan(mission_file: Path | None, algorithm: str, sets: Sequence[str]) -> "Plan":
    """A study of the one algorithm, in which no key varies."""
    from .study.errors import StudyError
    from .study.plan import make_plan

    plan = make_plan(mission_file, [algorithm], range(1), {}, sets)
    if plan.varied:
        raise StudyError(f"--set {plan.varied[0].key}: tuning is for one mission (give one value)")
    return plan


def _warm_up(plan: "Plan") -> None:
    from .study.study import Study

    Study(plan).warm_up(compiling)


def _folder(out: Path | None, algorithm: str) -> "RunFolder":
    """The folder of the trials: a new one, or ``out`` if it has trials."""
    from .flight.fly import default_folder
    from .record.folder import RunFolder

    if out is not None and (out / TRIALS).is_file():
        return RunFolder(out)
    return default_folder(out, f"tune-{algorithm}")


@contextmanager
def _alone(folder: "RunFolder") -> Iterator[None]:
    """Keep another tuning out of the folder."""
    import fcntl

    lock = os.open(folder.path, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        say(f"{folder.path}: another tuning is at work there")
        sys.exit(BAD_INPUT)
    finally:
        os.close(lock)


def _tune(
    question: "Question", wanted: int, fresh: int, folder: "RunFolder", executor: "Executor", check: Check
) -> "Answer":
    from .study.tune import Trials
    from .study.tune import tune as make_trials
    from .study.tuned import answer

    trials = Trials(question, folder.path / TRIALS)
    before = f" ({len(trials.done)} of them are there already)" if trials.done else ""
    say(
        f"tuning {question.algorithm} by {question.metric}: {wanted} trials of {question.runs} runs, "
        f"into {folder.path}{before}"
    )
    with _progress(wanted, check) as told:
        make_trials(trials, wanted, executor, told)
    say(f"flying the default and the best setting on {fresh} fresh seeds")
    return answer(trials, fresh, executor)


@contextmanager
def _progress(wanted: int, check: Check) -> "Iterator[Told]":
    """A bar on a terminal; else nothing, the command says what it begins and ends with."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("trials", total=wanted)

        def told(trials: "Trials") -> None:
            check()
            best = trials.best
            bar.update(
                task, completed=len(trials.done), description=f"best: trial {best}, {trials.score(best):.5g}"
            )

        yield told


def _write(found: "Answer", folder: "RunFolder") -> None:
    folder.write_text(folder.path / YAML, text(found))
    folder.write_json(folder.path / ANSWER, found.as_json())


def text(found: "Answer") -> str:
    """The answer as a mission with nothing but its planner; what it is worth stands in comments above."""
    return "".join(f"# {line}\n" for line in found.lines()) + found.mission_yaml()
