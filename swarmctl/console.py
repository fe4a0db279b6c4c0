"""What the commands say, and how they are stopped: errors, progress, summaries, Ctrl-C."""

import json
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import click

from .core.planners import MODULES

if TYPE_CHECKING:
    from .flight.orders import Orders

INTERRUPTIONS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
BAD_INPUT, FAILED, REFUSED, ABORTED, DIFFERS = 2, 1, 3, 4, 5


def say(text: str) -> None:
    """Progress and errors go to stderr; results alone to stdout."""
    click.echo(text, err=True)


@contextmanager
def plain_errors() -> Iterator[None]:
    """Turn what bad input raises into a message and an exit code; nobody sees a traceback for it."""
    from .flight.errors import FlightError, RefusedError, StoppedError
    from .mission.errors import MissionError
    from .record.errors import RecordError
    from .study.errors import StudyError
    from .vehicle.addresses import AddressError
    from .vehicle.keys import SigningKeyError

    try:
        yield
    except (MissionError, RecordError, StudyError, AddressError, SigningKeyError) as error:
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


LEVELS = (
    "returning; press Ctrl-C again to land now",
    "landing now; again to stop at once",
    "stopping",
)
LEVELS_OF_REAL_VEHICLES = (
    "returning; press Ctrl-C again to land now",
    "landing now, everybody where it is",
    "still landing: vehicles are not left in the air (to abandon them to their own failsafes, kill this process)",
)


@contextmanager
def interruptible(orders: "Orders", tell: Callable[[str], None], real: bool) -> Iterator[None]:
    """Ctrl-C (SIGTERM, or a closed terminal) once: all return; twice: all land; then stop, unless ``real``."""
    words = LEVELS_OF_REAL_VEHICLES if real else LEVELS
    orders.told = lambda level: tell(words[min(level, len(words)) - 1])
    before: dict[int, Any] = {n: signal.signal(n, lambda *_: orders.interrupt()) for n in INTERRUPTIONS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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
            default = p.default if p.choices else f"{p.default:g}"
            meaning = f"{p.meaning} ({' or '.join(p.choices)})" if p.choices else p.meaning
            click.echo(f"    {p.name:<18}{default:>8}  {meaning}  [{p.source}]")
