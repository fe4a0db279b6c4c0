"""A study's tables on the terminal, for eyes: times by level, what else was seen, and who was before whom.

Rows are algorithms in the order asked for, pairs those with the clearest lead first.  Every table fits eighty
columns for missions of some thousand seconds, those of multicopters a hundred.
"""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from .figures import LEVELS, CellFigures, Figures
from .settings import shown_value
from .statistics import Paired, Summary

LEVEL = "85"
"""The level at which pairs are told; study.json has all."""

WIDE = 240
"""No table is so wide."""

NONE = "-"
STAYS = "\u00a0"
"""A space that is not cut off at a cell's end."""

SMALLEST_P = 1e-99


@dataclass(frozen=True)
class Block:
    """A table under its title, with a note below."""

    title: str
    table: Table
    note: str = ""


def render(blocks: Iterable[Block]) -> str:
    """The tables as text.  A terminal that is too narrow breaks lines, rather than have figures cut off."""
    console = Console(width=WIDE, no_color=not sys.stdout.isatty(), highlight=False)
    with console.capture() as capture:
        for block in blocks:
            console.print(block.title, style="bold", markup=False)
            console.print(block.table)
            console.print(f"{block.note}\n" if block.note else "", markup=False)
    return "\n".join(line.rstrip() for line in capture.get().replace(STAYS, " ").rstrip().splitlines())


def of_cell(figures: CellFigures, runs: int) -> list[Block]:
    """All tables of one combination of settings."""
    told = figures.algorithms
    tables = [
        _by_level("Seconds to a share of the targets: mean±std (how many never found it)",
                  told, _mean),
        _by_level(f"Median of all {runs} runs, never being latest (s)", told, _median),
        _by_level("95 % interval of the mean (s)", told, _interval),
        _others(told, figures.cell.dynamics),
    ]  # fmt: skip
    return [*tables, _pairs(figures.paired)] if figures.paired else tables


def of_grid(cells: Sequence[CellFigures]) -> list[Block]:
    """One table an algorithm: a row for each combination of settings."""
    names = list(dict.fromkeys(name for cell in cells for name in cell.algorithms))
    return [
        _settings(name, [(cell, cell.algorithms[name]) for cell in cells if name in cell.algorithms])
        for name in names
    ]


def _table(*heads: str, names: int = 1) -> Table:
    """An empty table: the first columns are names, the others figures."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 0, 0, 1))
    for number, head in enumerate(heads):
        table.add_column(head, justify="left" if number < names else "right", no_wrap=True)
    return table


def _by_level(title: str, told: Mapping[str, Figures], cell: Callable[[Summary], str]) -> Block:
    table = _table("", *(f"{level} %" for level in LEVELS))
    columns = [_aligned([cell(figures.time_to_s[level]) for figures in told.values()]) for level in LEVELS]
    for name, *cells in zip(told, *columns, strict=True):
        table.add_row(name, *cells)
    return Block(title, table)


def _aligned(cells: Sequence[str]) -> list[str]:
    """Cells filled up on the right, so that what is in brackets stands clear of the column's figures."""
    tails = [len(cell) - cell.index("(") + 1 if "(" in cell else 0 for cell in cells]
    return [cell + (max(tails) - tail) * STAYS for cell, tail in zip(cells, tails, strict=True)]


def _mean(summary: Summary) -> str:
    never = f" ({summary.missing})" if summary.missing else ""
    if summary.mean is None:
        return f"never{never}"
    spread = "" if summary.std is None else f"±{summary.std:.0f}"
    return f"{summary.mean:.0f}{spread}{never}"


def _median(summary: Summary) -> str:
    return "never" if summary.median is None else f"{summary.median:.0f}"


def _interval(summary: Summary) -> str:
    return NONE if summary.ci95 is None else "{:.0f} to {:.0f}".format(*summary.ci95)


def _others(told: Mapping[str, Figures], dynamics: str) -> Block:
    """Shares, targets in range and nearness; flights' own figures where there is a flight."""
    flown = dynamics == "multicopter"
    heads = ["", "found in the end", "never 85 %", "in range", "when any", "nearest two"]
    if flown:
        heads += ["outside", "standing", "not down", "flight"]
    table = _table(*heads)
    for name, figures in told.items():
        other = figures.other
        share = other["final_fraction"]
        cells = [
            f"{_number(share.mean, 100, 1)} % ± {_number(share.std, 100, 1)}",
            str(figures.time_to_s[LEVEL].missing),
            _number(other["mean_targets_in_range"].mean, 1, 2),
            _number(other["mean_targets_in_range_when_any"].mean, 1, 1),
            _nearest(figures),
        ]
        table.add_row(name, *cells, *(_flight(figures) if flown else []))
    return Block(f"Over the whole search, in {dynamics} dynamics", table, FLIGHT if flown else "")


FLIGHT = "outside: vehicle-ticks beyond the fence; not down: vehicles that never landed; both over all runs"


def _nearest(figures: Figures) -> str:
    """The least of all runs; none with a single vehicle."""
    least = float(figures.runs["min_separation_m"].min())
    return f"{least:.1f} m" if np.isfinite(least) else NONE


def _flight(figures: Figures) -> list[str]:
    runs, other = figures.runs, figures.other
    return [
        str(int(runs["outside"].sum())),
        f"{_number(other['standing_share'].mean, 100, 1)} %",
        str(int(runs["not_down"].sum())),
        f"{_number(other['flight_s'].mean, 1, 0)} s",
    ]


def _number(value: float | None, scale: float, decimals: int) -> str:
    return NONE if value is None else f"{scale * value:.{decimals}f}"


def _pairs(paired: Mapping[tuple[str, str, str], Paired]) -> Block:
    """Each pair once, who is earlier first, the clearest leads first."""
    title = f"Who is earlier at {LEVEL} %, seed by seed (two that never get there: half each)"
    table = _table("", "earlier", "95 % interval", "ties", "median lead", "p")
    rows = [_led(a, b, pair) for (a, b, level), pair in paired.items() if level == LEVEL]
    for first, second, wins, (low, high), pair, lead in sorted(rows, key=lambda row: -row[2]):
        table.add_row(
            f"{first} before {second}", f"{100 * wins:.1f} %", f"{100 * low:.1f} - {100 * high:.1f} %",
            str(pair.tied), NONE if lead is None else f"{lead:.0f} s", _p(pair.p),
        )  # fmt: skip
    return Block(title, table)


def _led(a: str, b: str, pair: Paired) -> tuple[str, str, float, tuple[float, float], Paired, float | None]:
    """The pair from the side of who is earlier more often; the lead is positive where that is so."""
    lead = pair.median_difference_s
    if pair.wins >= 0.5:
        return a, b, pair.wins, pair.wins_ci95, pair, None if lead is None else -lead + 0.0
    low, high = pair.wins_ci95
    return b, a, 1.0 - pair.wins, (1.0 - high, 1.0 - low), pair, lead


def _p(p: float) -> str:
    if p < SMALLEST_P:
        return f"< {SMALLEST_P:.0e}"
    return f"{p:.1e}" if p < 0.001 else f"{p:.3f}"


def _settings(name: str, rows: Sequence[tuple[CellFigures, Figures]]) -> Block:
    """One algorithm over the settings: a row for each."""
    keys = list(rows[0][0].cell.settings)
    heads = (*map(short, keys), "50 %", f"{LEVEL} %", "late", "found in the end", "in range")
    table = _table(*heads, names=len(keys))
    best = min(figures.late_s[LEVEL] for _, figures in rows)
    half, most = (_aligned([_mean(f.time_to_s[level]) for _, f in rows]) for level in ("50", LEVEL))
    for (cell, figures), *times in zip(rows, half, most, strict=True):
        late, share = figures.late_s[LEVEL], figures.other["final_fraction"]
        table.add_row(
            *map(shown_value, cell.cell.settings.values()), *times,
            f"{late:.0f}" + ("*" if late == best else STAYS), f"{_number(share.mean, 100, 1)} %",
            _number(figures.other["mean_targets_in_range"].mean, 1, 2),
        )  # fmt: skip
    return Block(f"{name}: seconds to a share (how many never)", table, LATE)


LATE = f"late: mean time to {LEVEL} % if a run that never got there counts as the whole search; * the best"


def short(key: str) -> str:
    """The last word of a dotted key."""
    return key.rsplit(".", 1)[-1]
