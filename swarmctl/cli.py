"""The command line: parses, wires, prints; no logic.

What a command needs is imported when it runs, so that ``swarmctl --help`` answers at once.  This is the only
place that knows both the controller and the stub.
"""

import json
import sys
from contextlib import ExitStack
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
    print_summary,
    say,
)
from .core.planners import MODULES
from .paper_cli import paper
from .study_cli import study
from .tune_cli import tune

if TYPE_CHECKING:
    from .core.world import World
    from .flight.lockstep import Vehicles
    from .mission.model import Mission

LEAST_MARGIN_M = 2.0
MOST_SYSTEMS = 254  # MAVLink system ids, less the ground station's
FASTEST = 100.0
PathArgument = click.Path(path_type=Path)


class SpeedType(click.ParamType):  # type: ignore[type-arg]
    """``max``, which becomes None, or a factor."""

    name = "speed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        """Read it; anything else is a bad command line."""
        if value in (None, "max"):
            return None
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not 0.0 < factor <= FASTEST:
            self.fail(f"{value!r} is neither max nor a factor up to {FASTEST:g}", param, ctx)
        return factor


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__)
def main() -> None:
    """Search an area with a swarm of MAVLink vehicles, each with its own planner."""


main.add_command(paper)
main.add_command(study)
main.add_command(tune)

algorithm_option = click.option(
    "--algo", "algorithm", type=click.Choice(list(MODULES)), help="Planner, in place of the mission's."
)
mission_option = click.option(
    "--mission", "mission_file", type=PathArgument, help="Mission file (default: the packaged paper.yaml)."
)

connect_option = click.option(
    "--connect",
    "urls",
    multiple=True,
    metavar="URL",
    help="The vehicles there, e.g. udpin://0.0.0.0:14540-14545; may be given again.",
)
timeout_option = click.option(
    "--connect-timeout",
    type=click.FloatRange(0.1),
    default=20.0,
    show_default=True,
    help="Seconds to wait for them.",
)


@main.command()
@mission_option
@algorithm_option
@click.option("--vehicles", type=click.IntRange(1), help="How many vehicles fly.")
@click.option(
    "--seed", type=click.IntRange(0, 2**62), default=1, show_default=True, help="Targets, headings, planners."
)
@click.option("--duration", type=float, help="Length of the search in seconds.")
@click.option(
    "--speed",
    type=SpeedType(),
    metavar="max|FACTOR",
    help="max: lockstep, as fast as it goes (default without --connect); a factor: live, so many times real time.",
)
@connect_option
@timeout_option
@click.option(
    "--autopilot",
    type=click.Choice(["auto", "px4", "ardupilot"]),
    help="What stub vehicles play, and vehicles by --connect must be (auto: whatever they are).",
)
@click.option("--out", type=PathArgument, help="The run's folder (default: runs/DATE-TIME-ALGO).")
@click.option("--json", "as_json", is_flag=True, help="Print summary.json, and nothing else, on stdout.")
@click.option("--yes", is_flag=True, help="Do not ask (stub vehicles are never asked about).")
def fly(
    mission_file: Path | None, algorithm: str | None, vehicles: int | None, seed: int, duration: float | None,
    speed: float | None, urls: tuple[str, ...], connect_timeout: float, autopilot: str | None, out: Path | None,
    as_json: bool, yes: bool,
) -> None:  # fmt: skip
    """Fly a mission and record it: stub vehicles in lockstep, or live with --speed or --connect."""
    with plain_errors(), ExitStack() as ending:
        from . import live_cli
        from .dashboard import Progress
        from .flight import fly as flight
        from .flight.orders import Orders
        from .mission.launch import as_found

        mission = _load(mission_file, algorithm, vehicles, duration, autopilot)
        real = live_cli.connects(mission, urls)
        if real:
            mission = as_found(mission)
        else:
            _refuse_what_stubs_cannot(mission)
        name = mission.planner.algorithm
        folder = flight.default_folder(out, name)
        orders = Orders()
        ending.callback(folder.remove_if_empty)
        progress = Progress()
        with interruptible(orders, progress.say, real):
            _warm_up(mission, name)
            what = "vehicles" if real else "stub vehicles"
            say(f"flying {len(mission.fleet)} {what} with {name}, seed {seed}, into {folder.path}")
            with progress.shown():
                if real:
                    outcome = live_cli.fly_connected(
                        mission, seed, folder, urls, speed or 1.0, connect_timeout, yes, orders, progress
                    )
                elif speed is not None:
                    outcome = live_cli.fly_with_stubs(mission, seed, folder, speed, orders, progress)
                else:
                    outcome = flight.fly(mission, seed, folder, _make_stubs, orders, progress.flying)
            summary = flight.write_results(outcome, folder)
        if as_json:
            click.echo(json.dumps(summary, indent=2, allow_nan=False))
        else:
            print_summary(summary)
        for line in outcome.complaints():
            say(line)
        sys.exit(outcome.exit_code())


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
def check(
    mission_file: Path | None, vehicles: int | None, urls: tuple[str, ...], connect_timeout: float
) -> None:
    """Validate a mission and say what it is; with --connect, probe its vehicles too.  Arms nothing.

    A vehicle that stands where the mission expects it is given the mission's geofence, which is read back.
    """
    with plain_errors():
        from . import live_cli
        from .mission.launch import as_found
        from .mission.scenario import Scenario

        mission = _load(mission_file, vehicles=vehicles)
        scenario = Scenario(mission, ideal=False)
        targets = len(scenario.scene(1).targets)
        real = live_cli.connects(mission, urls)
        click.echo(
            f"{mission.name}: valid. {len(mission.fleet)} vehicles, {mission.planner.algorithm}, "
            f"{scenario.regions.legal.area / 1e6:.3f} km² to search inside the margin, "
            f"{len(mission.keep_out)} keep-outs, {targets} targets, {mission.duration_s:g} s"
        )
        if real:
            sys.exit(0 if _probe(as_found(mission), urls, connect_timeout) else REFUSED)


def _probe(mission: "Mission", urls: tuple[str, ...], timeout_s: float) -> bool:
    """Probe the vehicles; whether all may be armed."""
    from . import live_cli
    from .dashboard import Progress
    from .flight.orders import Orders

    orders, progress = Orders(), Progress()
    with interruptible(orders, lambda text: None, real=True), progress.shown():
        return live_cli.check_connected(mission, urls, timeout_s, orders, progress)


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


def _load(
    mission_file: Path | None, algorithm: str | None = None, vehicles: int | None = None,
    duration: float | None = None, autopilot: str | None = None,
) -> "Mission":  # fmt: skip
    """The mission with what the command line says over it."""
    from .mission.launch import flown_by
    from .mission.load import load

    given = {"planner.algorithm": algorithm, "vehicles.count": vehicles, "duration_s": duration}
    mission = load(mission_file, {key: value for key, value in given.items() if value is not None})
    return mission if autopilot is None else flown_by(mission, autopilot)


def _refuse_what_stubs_cannot(mission: "Mission") -> None:
    """Say plainly what a stub does not simulate yet, or a flight never does."""
    complaints = []
    if mission.dynamics == "ideal":
        complaints.append(
            "dynamics: fly flies multicopters, not ideal points (leave the key out, or study it)"
        )
    if mission.safety.fence_margin_m < LEAST_MARGIN_M:
        complaints.append(
            f"safety.fence_margin_m: a flight needs {LEAST_MARGIN_M:g} m for the guard (raise it)"
        )
    if len(mission.fleet) > MOST_SYSTEMS:
        complaints.append(f"vehicles: MAVLink tells {MOST_SYSTEMS} vehicles apart (fly fewer, or study more)")
    if mission.launch == "as_found":
        complaints += _stub_pads(mission)
    if complaints:
        say("\n".join(complaints))
        sys.exit(BAD_INPUT)


def _stub_pads(mission: "Mission") -> list[str]:
    """What is wrong with the corner grid that stubs stand in where a mission takes vehicles as found."""
    from .mission.scenario import Scenario

    try:
        Scenario(mission, ideal=False).starts  # noqa: B018 - tried, not used
    except ValueError as error:
        return [f"vehicles.launch: as_found: {error} (stubs stand in a corner grid; name their pads instead)"]
    if mission.spacing_m < mission.safety.separation_m:
        return [
            "vehicles.spacing_m: less than safety.separation_m (stubs stand in a grid; put them further apart)"
        ]
    return []


def _warm_up(mission: "Mission", name: str) -> None:
    from .core import bind
    from .flight.fly import warm_up

    if not bind.is_compiled(name):
        say(f"compiling the kernels of {name}: the first start takes some seconds, later ones do not")
    warm_up(mission, name)


def _make_stubs(mission: "Mission", world: "World") -> "Vehicles":
    """Stub vehicles that fly as the mission says, standing on its pads."""
    from sim_vehicle_stub.configured import configured_fleet

    from .flight.fly import autopilots, endurance_s

    endurance = endurance_s(mission)
    origin = (mission.origin.lat, mission.origin.lon, mission.origin.alt_m)
    interval = 1.0 / mission.setpoints.rate_hz
    return configured_fleet(
        world.fleet,
        origin,
        endurance,
        interval,
        autopilots=autopilots(mission),
        wind_mps=mission.stub.wind_mps,
    )


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
