"""``swarmctl tune``: an algorithm's best setting, found on training seeds and told on fresh ones."""

import json
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .console import ABORTED, BAD_INPUT, INTERRUPTIONS, plain_errors, say
from .core.planners import MODULES

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from .study.tune import Question, Told
    from .study.tuned import Answer

METRICS = ("t25", "t50", "t75", "t85", "t95", "final", "in_range")
MOST_SEED, MOST_RUNS = 999_999, 1_000_000  # training and fresh seeds never meet
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
@click.option(
    "--mission", "mission_file", type=click.Path(path_type=Path), help="Mission file (default: paper.yaml)."
)
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="A mission key; may be repeated.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
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
    with plain_errors():
        from .mission.load import load
        from .study.tune import Question

        mission = load(mission_file, {**_settings(settings), "planner.algorithm": algorithm})
        question = Question(mission, algorithm, metric, runs, seed)
        folder = _folder(out, algorithm)
        with (
            stoppable(f"go on with: --out {folder}"),
            _locked(folder),
            _workers(workers, address) as executor,
        ):
            found = _tune(question, trials, fresh, folder, executor)
        _write(found, folder)
        if as_json:
            click.echo(json.dumps(found.as_json(), indent=2, allow_nan=False))
        else:
            click.echo(text(found), nl=False)


def _settings(given: Sequence[str]) -> dict[str, object]:
    """Dotted keys and their values, read as a mission file's."""
    from .mission import yaml_reader

    pairs: dict[str, object] = {}
    for setting in given:
        key, equals, value = setting.partition("=")
        if not key or not equals:
            raise click.UsageError(f"--set {setting}: write KEY=VALUE")
        pairs[key] = yaml_reader.read(value.encode(), "command line").data
    return pairs


def _folder(out: Path | None, algorithm: str) -> Path:
    """The folder of the trials: a new one, or ``out`` if it has trials."""
    from .flight.fly import default_folder

    if out is not None and (out / TRIALS).is_file():
        return out
    return default_folder(out, f"tune-{algorithm}").path


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep another tuning out of the folder."""
    import fcntl

    with (folder / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say(f"{folder}: another tuning is at work there")
            sys.exit(BAD_INPUT)
        yield


def _workers(workers: int | None, address: str | None) -> "AbstractContextManager[Executor]":
    """Threads here, or a cluster."""
    if address is None:
        from .study.execute import local

        return local(workers)
    if workers is not None:
        raise click.UsageError("--cluster has workers of its own: no --workers can be given")
    from .study.cluster import cluster

    return cluster(address, say)


@contextmanager
def stoppable(how_on: str) -> Iterator[None]:
    """Ctrl-C (SIGTERM, or a closed terminal): stop, say how to go on, and exit as aborted."""

    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    before: dict[int, Any] = {n: signal.signal(n, stop) for n in INTERRUPTIONS}
    try:
        yield
    except KeyboardInterrupt:
        say(f"stopped; what was finished is kept: {how_on}")
        sys.exit(ABORTED)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _tune(question: "Question", trials: int, fresh: int, folder: Path, executor: "Executor") -> "Answer":
    from .study import tune as tuning
    from .study.tuned import answer

    study = tuning.open_trials(question, folder / TRIALS)
    before = len(tuning.finished(study))
    say(
        f"tuning {question.algorithm} by {question.metric}: {trials} trials of {question.runs} runs, into {folder}"
        + (f" ({before} of them are there already)" if before else "")
    )
    with _progress(question, trials) as told:
        tuning.tune(question, trials, study, executor, told)
    return answer(question, study, fresh, executor, say)


@contextmanager
def _progress(question: "Question", trials: int) -> "Iterator[Told]":
    """A bar on a terminal; else nothing, the command says what it begins and ends with."""
    from rich.console import Console
    from rich.progress import Progress

    from .study.tune import best_of

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("trials", total=trials)

        def told(done: Any) -> None:
            number, score = best_of(question, done)
            bar.update(task, completed=len(done), description=f"best: trial {number}, {score:.5g}")

        yield told


def _write(found: "Answer", folder: Path) -> None:
    from .record.folder import write_whole

    write_whole(folder / YAML, text(found).encode())
    write_whole(folder / ANSWER, (json.dumps(found.as_json(), indent=2, allow_nan=False) + "\n").encode())


def text(found: "Answer") -> str:
    """The answer as a mission with nothing but its planner; what it is worth stands in comments above."""
    return "".join(f"# {line}\n" for line in found.lines()) + found.mission_yaml()
