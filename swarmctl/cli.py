"""The command line: parses, wires, prints; no logic.

What a command needs is imported when it runs, so that ``swarmctl --help`` answers at once.  This
and the commands' modules beside it are the only place that knows both the controller and the stub.
"""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import __version__
from .console import (
    BAD_INPUT,
    DIFFERS,
    REFUSED,
    interruptible,
    plain_errors,
    print_algorithms,
    say,
)
from .fly_cli import fly, load_mission
from .options import (
    PathArgument,
    algorithm_option,
    backend_option,
    connect_option,
    mission_option,
    signing_option,
    timeout_option,
)
from .paper_cli import paper
from .sign_cli import sign
from .study_cli import study
from .tune_cli import tune

if TYPE_CHECKING:
    from .live_cli import Reach
    from .mission.model import Mission


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__)
def main() -> None:
    """Search an area with a swarm of MAVLink vehicles, each with its own planner."""


main.add_command(fly)
main.add_command(paper)
main.add_command(sign)
main.add_command(study)
main.add_command(tune)


@main.command()
@click.argument("run", type=PathArgument)
@algorithm_option
@click.option("--stub", is_flag=True, help="Send the recorded setpoints to fresh stubs and compare tracks.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else, on stdout.")
def replay(run: Path, algorithm: str | None, stub: bool, as_json: bool) -> None:
    """Recompute every recorded decision of RUN, plan and guard, and compare bit for bit."""
    if stub and algorithm:
        raise click.UsageError("--stub sends the recorded setpoints: no --algo can change them")
    with plain_errors():
        from .record import mcap_read
        from .record.folder import RunFolder

        folder = RunFolder.open(run)
        if stub:
            _replay_stub(folder, as_json)
            return
        from .record.replay import replay as recompute

        say("recomputing the recorded decisions")
        result = recompute(mcap_read.read(folder.mcap), algorithm)
        if as_json:
            click.echo(json.dumps(result.as_json(), indent=2, allow_nan=False))
        else:
            click.echo(result.as_text())
        sys.exit(0 if result.same else DIFFERS)


@main.command()
@click.argument("run", type=PathArgument)
@click.argument("order", type=click.Choice(["hold", "resume", "return", "land", "release", "retake"]))
@click.argument("vehicle", metavar="[ID]", type=click.IntRange(1), required=False)
def control(run: Path, order: str, vehicle: int | None) -> None:
    """Speak to the live flight that records into RUN.

    hold, resume, return and land are for everybody; release ID leaves one vehicle to somebody else, and retake
    ID takes back one that was released or taken over.
    """
    from .flight.control import ControlError, send
    from .flight.orders import OF_ONE

    if (order in OF_ONE) != (vehicle is not None):
        raise click.UsageError(f"{order} {'needs the ID of a vehicle' if order in OF_ONE else 'takes no ID'}")
    try:
        click.echo(send(run, [order] if vehicle is None else [order, str(vehicle)]))
    except ControlError as error:
        say(str(error))
        sys.exit(BAD_INPUT)


@main.command()
@mission_option
@click.option("--vehicles", type=click.IntRange(1), help="How many vehicles.")
@connect_option
@timeout_option
@backend_option
@signing_option
def check(
    mission_file: Path | None, vehicles: int | None, urls: tuple[str, ...], connect_timeout: float, backend: str,
    signing_key: Path | None,
) -> None:  # fmt: skip
    """Validate a mission and say what it is; with --connect, probe its vehicles too.  Arms nothing.

    A vehicle that stands where the mission expects it is given the mission's geofence, which is read back.
    """
    with plain_errors():
        from . import live_cli
        from .mission.launch import as_found
        from .mission.scenario import Scenario

        mission = load_mission(mission_file, vehicles=vehicles)
        scenario = Scenario(mission, ideal=False)
        targets = len(scenario.scene(1).targets)
        reach = live_cli.Reach(urls, connect_timeout, backend, signing_key)
        real = live_cli.connects(mission, reach)
        click.echo(
            f"{mission.name}: valid. {len(mission.fleet)} vehicles, {mission.planner.algorithm}, "
            f"{scenario.regions.legal.area / 1e6:.3f} km² to search inside the margin, "
            f"{len(mission.keep_out)} keep-outs, {targets} targets, {mission.duration_s:g} s"
        )
        if real:
            sys.exit(0 if _probe(as_found(mission), reach) else REFUSED)


def _probe(mission: "Mission", reach: "Reach") -> bool:
    """Probe the vehicles; whether all may be armed."""
    from . import live_cli
    from .dashboard import Progress
    from .flight.orders import Orders

    orders, progress = Orders(), Progress()
    with interruptible(orders, lambda text: None, real=True), progress.shown():
        return live_cli.check_connected(mission, reach, orders, progress)


@main.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def algos(as_json: bool) -> None:
    """What can be flown, with its parameters, their defaults and where they come from."""
    with plain_errors():
        print_algorithms(as_json)


@main.command()
@click.argument("run", type=PathArgument)
def report(run: Path) -> None:
    """Draw tracks.png of RUN anew, from its recording."""
    with plain_errors():
        from .record.folder import RunFolder
        from .record.redraw import redraw

        click.echo(str(redraw(RunFolder.open(run))))


def _replay_stub(folder: Any, as_json: bool) -> None:
    from sim_vehicle_stub.configured import configured_fleet

    from .record.stub_replay import replay_stub

    result = replay_stub(folder, configured_fleet)
    if as_json:
        click.echo(json.dumps(result.as_json(), indent=2, allow_nan=False))
    else:
        click.echo(result.as_text())
    sys.exit(0 if result.same else DIFFERS)


if __name__ == "__main__":
    main()
