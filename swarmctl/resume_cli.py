"""``swarmctl fly --resume RUN``: fly on where another controller died."""

from contextlib import ExitStack
from pathlib import Path

import click
from click.core import ParameterSource

from .console import interruptible, plain_errors, say

FROM_THE_RUN = {
    "mission_file": "--mission",
    "algorithm": "--algo",
    "vehicles": "--vehicles",
    "seed": "--seed",
    "duration": "--duration",
    "autopilot": "--autopilot",
}
AT_THE_START = {"adapt": "--adapt", "backend": "--backend"}


def fly_on(run: Path, ctx: click.Context) -> None:
    """Find the vehicles of ``run``, take them back and search on; ``ctx`` has the other options of ``fly``."""
    _refuse_others(ctx)
    given = ctx.params
    with plain_errors(), ExitStack() as ending:
        from . import live_cli
        from .dashboard import Progress
        from .flight import fly as flight
        from .flight import resumption
        from .flight.orders import Orders
        from .fly_cli import conclude, warm_up_kernels

        before = resumption.read(run)
        mission = before.mission
        name = mission.planner.algorithm
        reach = live_cli.Reach(given["urls"], given["connect_timeout"], signing_key=given["signing_key"])
        folder = flight.default_folder(given["out"], name)
        orders, progress = Orders(), Progress()
        ending.callback(folder.remove_if_empty)
        with interruptible(orders, progress.say, real=not before.own_stubs):
            warm_up_kernels(mission, name)
            searched_s = before.restored.ticks * mission.planner.period_s
            say(f"flying {run} on from {searched_s:g} s of its search, into {folder.path}")
            if not before.restored.exact:
                say("another processor or version flew it: what is remembered may differ in the last digit")
            with progress.shown():
                outcome = live_cli.fly_on(
                    before, folder, reach, orders, progress, speed=given["speed"], sure=given["yes"]
                )
            conclude(outcome, folder, given["as_json"])


def _refuse_others(ctx: click.Context) -> None:
    """Raise UsageError for an option that a flight which goes on cannot obey."""
    said = {name for name in ctx.params if ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE}
    for name, option in FROM_THE_RUN.items():
        if name in said:
            raise click.UsageError(f"{option} cannot be changed in flight: --resume takes it from the run")
    for name, option in AT_THE_START.items():
        if name in said:
            raise click.UsageError(f"{option} cannot be used with --resume: its vehicles are in the air")
    if "speed" in said and ctx.params["speed"] is None:
        raise click.UsageError("--speed max is for lockstep: a flight that goes on is live")
