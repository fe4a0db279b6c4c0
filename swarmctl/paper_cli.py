"""``swarmctl paper``: the paper's figures and tables flown anew, and which of its claims hold."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import click

from .console import plain_errors, say
from .study_cli import executor_of, stopping

MOST_RUNS = 100_000


@click.command()
@click.option(
    "--runs", type=click.IntRange(2, MOST_RUNS), default=1000, show_default=True,
    help="Runs an algorithm in the tables; other figures take parts of it.",
)  # fmt: skip
@click.option(
    "--seed", type=click.IntRange(0, 2**61), default=1, show_default=True,
    help="The first run's seed; the next ones count up.",
)  # fmt: skip
@click.option("--workers", type=click.IntRange(1), help="Threads (default: one a processor).")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Where to write (default: runs/DATE-TIME-paper)."
)
def paper(runs: int, seed: int, workers: int | None, out: Path | None) -> None:
    """Draw every figure and table of the paper from fresh runs, and say which of its claims hold.

    Writes paper.html and the pictures; prints the verdicts.
    """
    with plain_errors(), stopping(), ExitStack() as ending:
        from .flight.clock import wall_s
        from .flight.fly import default_folder
        from .study import paper as whole
        from .study.paper_runs import total

        folder = default_folder(out, "paper")
        ending.callback(folder.remove_if_empty)
        executor = ending.enter_context(executor_of(workers, None))
        whole.warm_up(seed, _compiling)
        say(f"flying the paper: {runs} runs an algorithm, about {total(runs)} in all")
        with _progress(total(runs)) as done:
            made = whole.make(folder, runs, seed, executor, wall_s, done, say)
        click.echo(f"{made.text()}\n\n{made.evidence.flown} runs, {made.wall_s:.0f} s\npage: {made.page}")


def _compiling(name: str) -> None:
    say(f"compiling the kernels of {name}: the first start takes some seconds, later ones do not")


@contextmanager
def _progress(count: int) -> Iterator[Callable[[int], None]]:
    """A bar on a terminal; else nothing."""
    if not sys.stderr.isatty():
        yield lambda runs: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("runs", total=count)
        yield lambda runs: bar.update(task, advance=runs)
