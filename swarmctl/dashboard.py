"""What a person sees while a flight is under way: a live table on a terminal, plain lines elsewhere.

Both also tell what happens to a vehicle when it happens.  A terminal that has gone away never disturbs a
flight.
"""

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from .core import stages

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table

    from .core.world import World
    from .flight.swarm import Swarm
    from .vehicle.session import Session

COLUMNS = ("id", "autopilot", "phase", "found", "height", "speed", "lost", "delay", "battery")
MOST_ROWS = 40
"""More vehicles than this would not fit a screen: those with something wrong come first."""


class Progress:
    """Shows a flight's progress on stderr; ``flying`` and ``preparing`` are called now and then."""

    def __init__(self) -> None:
        self._live: Live | None = None
        self._shown = ""
        self._told: list[int] = []

    @contextmanager
    def shown(self) -> Iterator["Progress"]:
        """On a terminal, keep the table in place meanwhile."""
        if not sys.stderr.isatty():
            yield self
            return
        from rich.console import Console
        from rich.live import Live

        with Live(console=Console(stderr=True), auto_refresh=False) as self._live:
            yield self

    def say(self, text: str) -> None:
        """One line that stays."""
        with contextlib.suppress(OSError):
            if self._live is not None:
                self._live.console.print(text, markup=False, highlight=False)
            else:
                click.echo(text, err=True)

    def preparing(self, now: float, sessions: Sequence["Session"]) -> None:
        """Vehicles are being connected and set up."""
        if sessions:
            phases = [s.phase.value for s in sessions]
            kinds = list(dict.fromkeys(phases))
            line = "preparing: " + ", ".join(f"{phases.count(kind)} {kind}" for kind in kinds)
            key = " ".join(sorted(kinds))
            self._show(line, lambda: self._table(f"preparing, {now:.0f} s", sessions, None), key)
        else:
            self._show("waiting for vehicles", None)

    def flying(self, now: float, swarm: "Swarm", world: "World") -> None:
        """The flight is under way."""
        share = 100.0 * float((world.found >= 0).mean()) if len(world.found) else 0.0
        part = "holding" if swarm.held else swarm.part.value
        self._tell_news(swarm)
        line = f"{now:7.0f} s  {part:<12} found {share:5.1f} %"
        self._show(line, lambda: self._table(line, swarm.sessions, swarm), key=part)

    def _tell_news(self, swarm: "Swarm") -> None:
        """What happened to vehicles since the last time."""
        self._told = self._told or [0] * len(swarm.sessions)
        for i, (session, messages) in enumerate(zip(swarm.sessions, swarm.roster.messages, strict=True)):
            for message in messages[self._told[i] :]:
                self.say(f"vehicle {session.system}: {message}")
            self._told[i] = len(messages)

    def _show(self, line: str, table: "Callable[[], Table] | None", key: str | None = None) -> None:
        """Renew the table; without one, print the line if it (or its ``key``) is new."""
        with contextlib.suppress(OSError):
            if self._live is not None:
                self._live.update(table() if table else line, refresh=True)
            elif (key or line) != self._shown:
                click.echo(line, err=True)
            self._shown = key or line

    def _table(self, title: str, sessions: Sequence["Session"], swarm: "Swarm | None") -> "Table":
        from rich.table import Table

        table = Table(title=title, title_justify="left", expand=False)
        for name in COLUMNS:
            table.add_column(
                name, justify="left" if name in ("autopilot", "phase") else "right", no_wrap=True
            )
        rows = range(len(sessions))
        for i in sorted(rows, key=lambda i: swarm is None or swarm.roster.dropped[i] is None)[:MOST_ROWS]:
            table.add_row(*_cells(i, sessions[i], swarm))
        if len(sessions) > MOST_ROWS:
            table.add_row("...", "", f"{len(sessions) - MOST_ROWS} more")
        return table


def _cells(i: int, session: "Session", swarm: "Swarm | None") -> tuple[str, ...]:
    """One vehicle's row."""
    t = session.telemetry
    trip, percent = session.round_trip_s, t.battery_percent
    return (
        str(session.system),
        session.adapter.name if session.adapter else "?",
        _phase(i, session, swarm),
        "" if swarm is None else str(int(swarm.seen[i].sum())),
        f"{t.height_m:.0f} m",
        f"{(t.v_east**2 + t.v_north**2) ** 0.5:.0f} m/s",
        f"{100.0 * session.loss:.1f} %",
        "?" if trip is None else f"{1000.0 * trip:.0f} ms",
        "?" if percent is None else f"{percent} %",
    )


def _phase(i: int, session: "Session", swarm: "Swarm | None") -> str:
    """The session's phase, or, under our setpoints, the flight's stage."""
    if swarm is None or session.phase.value != "engaged":
        return session.phase.value
    return stages.NAMES[swarm.stage(i)]


def findings_table(title: str, rows: Sequence[tuple[int, str, Sequence[Any]]]) -> str:
    """What an inspection found, as text: (system id, where, findings) a vehicle, and what is wrong below."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    items = list(dict.fromkeys(finding.item for _, _, findings in rows for finding in findings))
    for name in ("id", "heard on", *items, ""):
        table.add_column(name, overflow="fold")
    for system, where, findings in rows:
        found = {finding.item: finding for finding in findings}
        cells = [_marked(found[item]) if item in found else "" for item in items]
        verdict = "refused" if any(f.refuses for f in findings) else "ok"
        table.add_row(str(system), where, *cells, verdict)
    console = Console(width=None if sys.stdout.isatty() else 200, no_color=not sys.stdout.isatty())
    with console.capture() as capture:
        console.print(table)
    return capture.get().rstrip()


def _marked(finding: Any) -> str:
    return f"{finding.value} !" if finding.trouble else str(finding.value)
