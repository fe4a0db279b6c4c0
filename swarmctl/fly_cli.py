"""``swarmctl fly``: stub vehicles in lockstep, or live ones."""

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .console import BAD_INPUT, interruptible, plain_errors, print_summary, say
from .options import (
    PathArgument,
    SpeedType,
    algorithm_option,
    backend_option,
    connect_option,
    mission_option,
    signing_option,
    timeout_option,
)

if TYPE_CHECKING:
    from .core.world import World
    from .flight.lockstep import Vehicles
    from .flight.results import Outcome
    from .mission.model import Mission
    from .record.folder import RunFolder

LEAST_MARGIN_M = 2.0
MOST_SYSTEMS = 254  # MAVLink system ids, less the ground station's


@click.command()
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
@backend_option
@signing_option
@click.option(
    "--autopilot",
    type=click.Choice(["auto", "px4", "ardupilot"]),
    help="What stub vehicles play, and vehicles by --connect must be (auto: whatever they are).",
)
@click.option("--out", type=PathArgument, help="The run's folder (default: runs/DATE-TIME-ALGO).")
@click.option("--json", "as_json", is_flag=True, help="Print summary.json, and nothing else, on stdout.")
@click.option(
    "--adapt",
    is_flag=True,
    help="Lower what the mission asks to what its vehicles can do, and set their parameters.",
)
@click.option("--yes", is_flag=True, help="Do not ask (stub vehicles are never asked about).")
@click.option(
    "--resume",
    "resumed",
    type=PathArgument,
    metavar="RUN",
    help="Fly on where the controller of RUN died: find its vehicles, take them back, search on.",
)
@click.pass_context
def fly(
    ctx: click.Context, mission_file: Path | None, algorithm: str | None, vehicles: int | None, seed: int,
    duration: float | None, speed: float | None, urls: tuple[str, ...], connect_timeout: float, backend: str,
    signing_key: Path | None, autopilot: str | None, out: Path | None, as_json: bool, adapt: bool, yes: bool,
    resumed: Path | None,
) -> None:  # fmt: skip
    """Fly a mission and record it: stub vehicles in lockstep, or live with --speed or --connect."""
    if resumed is not None:
        from .resume_cli import fly_on

        fly_on(resumed, ctx)
        return
    with plain_errors(), ExitStack() as ending:
        from . import live_cli
        from .dashboard import Progress
        from .flight import fly as flight
        from .flight.orders import Orders
        from .mission.launch import as_found

        mission = load_mission(mission_file, algorithm, vehicles, duration, autopilot)
        reach = live_cli.Reach(urls, connect_timeout, backend, signing_key)
        real = live_cli.connects(mission, reach)
        if backend != "mavlink" and not real and speed is None:
            raise click.UsageError(
                "lockstep has no MAVSDK: --backend mavsdk needs --connect or --speed FACTOR"
            )
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
            warm_up_kernels(mission, name)
            what = "vehicles" if real else "stub vehicles"
            say(f"flying {len(mission.fleet)} {what} with {name}, seed {seed}, into {folder.path}")
            with progress.shown():
                if real:
                    outcome = live_cli.fly_connected(
                        mission,
                        seed,
                        folder,
                        reach,
                        orders,
                        progress,
                        speed=speed or 1.0,
                        sure=yes,
                        adapt=adapt,
                    )
                elif speed is not None:
                    outcome = live_cli.fly_with_stubs(
                        mission, seed, folder, speed, orders, progress, live_cli.backend(reach)
                    )
                else:
                    outcome = flight.fly(mission, seed, folder, _make_stubs, orders, progress.flying)
            conclude(outcome, folder, as_json)


def conclude(outcome: "Outcome", folder: "RunFolder", as_json: bool) -> None:
    """Write down and print what a flight came to, and exit."""
    from .flight.fly import write_results

    summary = write_results(outcome, folder)
    if as_json:
        click.echo(json.dumps(summary, indent=2, allow_nan=False))
    else:
        print_summary(summary)
    for line in outcome.complaints():
        say(line)
    sys.exit(outcome.exit_code())


def load_mission(
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


def warm_up_kernels(mission: "Mission", name: str) -> None:
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
