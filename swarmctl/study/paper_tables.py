"""Table 2 and the table of Fig. 20: our figures beside the printed ones, with the baselines in every table."""

from collections.abc import Sequence
from dataclasses import dataclass

from .paper_claims import TABLE_2
from .paper_judges import MEASURES
from .paper_rules import bracket, told_mean, told_time
from .paper_runs import Evidence
from .paper_variants import LEVELS_PRINTED, compared, variant
from .statistics import compare, summarise

LEVEL = 85


@dataclass(frozen=True)
class Table:
    """A table as text, cell by cell, which may have several lines; the first column names the row.

    The first ``printed`` rows are the paper's own.
    """

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str
    printed: int = 0


def table_2(evidence: Evidence) -> Table:
    """The printed rows first, then ours."""
    heads = ["", "in range", "when any", *(f"{percent} %" for percent in LEVELS_PRINTED)]
    printed = [
        [f"{name}, printed", f"{average:g}", "", *(f"{time:g} s" for time in times)]
        for name, (average, *times) in TABLE_2.items()
    ]
    rows = [
        [
            name,
            *(_lines(told_mean(evidence.figure(variant(name), f), 1)) for f in MEASURES.values()),
            *(_lines(told_time(evidence.times(variant(name), percent))) for percent in LEVELS_PRINTED),
        ]
        for name in compared()
    ]
    note = (
        "Mean ± standard deviation of the runs that got there, 95 % interval of the mean in brackets, and how many "
        "never got there. In range: targets in a vehicle's range, averaged over all steps; when any: over the steps "
        "in which there were any."
    )
    title = "Table 2: MDC against DPSO-U, and the baselines"
    return Table(title, heads, [*printed, *rows], note, len(printed))


def table_of_figure_20(evidence: Evidence) -> Table:
    """Times of every algorithm, and who is before FCO and before MDC."""
    heads = [
        "",
        *(f"{percent} %" for percent in LEVELS_PRINTED),
        "median to 85 %",
        "before mdc",
        "before fco",
    ]
    rows = []
    for name in compared():
        times = evidence.times(variant(name), LEVEL)
        median = summarise(times).median
        rows.append(
            [
                name,
                *(_lines(told_time(evidence.times(variant(name), percent))) for percent in LEVELS_PRINTED),
                "never" if median is None else f"{median:.0f} s",
                *("" if name == other else _before(evidence, name, other) for other in ("mdc", "fco")),
            ]
        )
    note = (
        "Times as in Table 2; the paper's figure has bars without figures. Median of all runs, never being latest. "
        f"Before: in how many of 100 pairs of runs with one seed {LEVEL} % is reached first, with its 95 % interval."
    )
    return Table("Fig. 20 in figures", heads, rows, note)


def _before(evidence: Evidence, name: str, other: str) -> str:
    pair = compare(evidence.times(variant(name), LEVEL), evidence.times(variant(other), LEVEL))
    return _lines(f"{100 * pair.wins:.1f} %{bracket(pair.wins_ci95, 1, 100)}")


def _lines(told: str) -> str:
    """A figure, its interval and what is missing, on lines of their own."""
    return told.replace(" [", "\n[").replace(" (", "\n(")
