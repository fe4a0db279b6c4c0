"""What the commands say, and how they are stopped: errors, progress, summaries, Ctrl-C."""

import json
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from .core.planners import MODULES

if TYPE_CHECKING:
    from .core.world import World
    from .flight.fly import Orders, Report
    from .mission.model import Mission

BAD_INPUT, FAILED, REFUSED, ABORTED, DIFFERS = 2, 1, 3, 4, 5


def say(text: str) -> None:
    """Progress and errors go to stderr; results alone to stdout."""
    click.echo(text, err=True)


@contextmanager
def plain_errors() -> Iterator[None]:
    """Turn what bad input raises into a message and an exit code; nobody sees a traceback for it."""
    from .flight.fly import StoppedError
    from .flight.swarm import FlightError, RefusedError
    from .mission.errors import MissionError
    from .record.errors import RecordError
    from .vehicle.addresses import AddressError

    try:
        yield
    except (MissionError, RecordError, AddressError) as error:
        say(str(error))
        sys.exit(BAD_INPUT)
    except StoppedError as error:
        say(str(error))
        sys.exit(ABORTED)
    except RefusedError as error:
        say(f"refused: {error}")
        sys.exit(REFUSED)
    except FlightError as error:
        say(f"the flight failed: {error}")
        sys.exit(FAILED)
    except OSError as error:
        say(f"cannot write: {error.strerror or error}")
        with suppress(OSError):
            sys.stdout.close()  # or the interpreter would try again to write what is left
        sys.exit(BAD_INPUT)


@contextmanager
def interruptible(orders: "Orders") -> Iterator[None]:
    """Ctrl-C (or SIGTERM) once: all return; twice: all land; a third time: stop at once."""

    def obey(number: int, frame: FrameType | None) -> None:
        orders.interrupt()
        words = (
            "",
            "returning; press Ctrl-C again to land now",
            "landing now; again to stop at once",
            "stopping",
        )
        say(words[min(orders.level, 3)])

    before: dict[int, Any] = {n: signal.signal(n, obey) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def progress(mission: "Mission") -> "Report":
    """A line for each part of the flight; on a terminal, one that moves."""
    from .flight.swarm import Swarm

    shown: list[str] = [""]
    moving = sys.stderr.isatty()

    def report(now: float, swarm: Swarm, world: "World") -> None:
        share = float((world.found >= 0).mean()) if len(world.found) else 0.0
        line = f"{now:7.0f} s  {swarm.part.value:<12} found {100 * share:5.1f} %"
        if moving:
            click.echo(f"\r{line}", err=True, nl=False)
            if swarm.part.value == "over":
                say("")
        elif swarm.part.value != shown[0]:
            say(line)
        shown[0] = swarm.part.value

    return report


def print_summary(summary: dict[str, Any]) -> None:
    """The figures a person looks for first."""
    reached = ", ".join(
        f"{k} % at {v:.0f} s" if v is not None else f"{k} % never" for k, v in summary["time_to_s"].items()
    )
    close = summary["min_separation_m"]
    landed = sum(v["outcome"] == "landed" for v in summary["per_vehicle"])
    lines = (
        f"{summary['algorithm']}: {summary['detected']} of {summary['targets']} targets found; {reached}",
        f"{landed} of {summary['vehicles']} vehicles landed; closest approach "
        + ("none" if close is None else f"{close:.1f} m")
        + f"; {summary['geofence_violations']} fence violations",
        f"{summary['wall_s']:.1f} s of wall time, {summary['real_time_factor']:.0f} x real time",
        f"run: {summary['run']}",
    )
    click.echo("\n".join(lines))
    for vehicle in summary["per_vehicle"]:
        for event in vehicle["events"]:
            click.echo(f"  vehicle {vehicle['id']}: {event}")


def print_algorithms(as_json: bool) -> None:
    from .core import planners

    table = {name: planners.module(name) for name in MODULES}
    if as_json:
        rows = {
            name: {"title": m.TITLE, "parameters": [p._asdict() for p in m.PARAMETERS]}
            for name, m in table.items()
        }
        click.echo(json.dumps(rows, indent=2, ensure_ascii=False))
        return
    for name, module in table.items():
        click.echo(f"{name}: {module.TITLE}")
        for p in module.PARAMETERS:
            click.echo(f"    {p.name:<18}{p.default:>8g}  {p.meaning}  [{p.source}]")
