"""paper.html: every claim with its verdict, every figure and table, in one file that opens from disk.

Plain HTML that needs nothing from elsewhere: pictures are embedded.  Wide tables scroll on a phone; readings of a
claim fold away.
"""

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from .paper_claims import Claim
from .paper_rules import Case, Judgement, Verdict
from .paper_tables import Table

STYLE = """
:root { --ink: #1f2933; --grey: #5b6774; --pale: #d5dae0; --ground: #eef1f4; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 64rem; padding: 1rem; color: var(--ink); background: white;
  font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; overflow-wrap: break-word; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 1rem 0 .5rem; }
h2 { font-size: 1.25rem; margin: 2.5rem 0 .5rem; border-bottom: 1px solid var(--pale); padding-bottom: .25rem; }
h3 { font-size: 1rem; margin: 1.6rem 0 .4rem; }
p, ul { margin: .4rem 0; } ul { padding-left: 1.2rem; }
a { color: #0a5b8f; }
.quiet, figcaption, .note { color: var(--grey); font-size: .9rem; }
figure { margin: 1.5rem 0; break-inside: avoid; } figure img { max-width: 100%; height: auto; display: block; }
figure.single img { max-width: min(100%, 42rem); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; margin: .6rem 0; }
th, td { text-align: left; vertical-align: top; padding: .3rem .7rem .3rem 0; border-bottom: 1px solid var(--pale); }
th { color: var(--grey); font-weight: 600; } tr.printed td { color: var(--grey); font-style: italic; }
.figures td, .figures th { white-space: nowrap; }
.verdict { display: inline-block; border-radius: .25rem; padding: 0 .45rem; font-weight: 600; font-size: .85rem;
  border: 1px solid; white-space: nowrap; }
.holds { color: #00573f; background: #e3f4ee; } .only { color: #7a4a00; background: #fdf3dc; }
.fails { color: #8c2f22; background: #f9e6e2; } .open { color: #46525e; background: var(--ground); }
.claim { border-top: 1px solid var(--pale); padding: .6rem 0 .8rem; break-inside: avoid; }
.claim p.statement { font-size: 1.05rem; margin: .2rem 0; }
details { margin: .3rem 0; } summary { cursor: pointer; color: #0a5b8f; font-size: .9rem; }
@media print { body { max-width: none; font-size: 11px; } a { color: inherit; } }
"""

CLASS = {
    Verdict.HOLDS: "holds", Verdict.ONLY_IF: "only", Verdict.FAILS: "fails", Verdict.OPEN: "open",
}  # fmt: skip


@dataclass(frozen=True)
class Shown:
    """A figure of the page: its name, the words below it and its pictures; without pictures, a table's place."""

    key: str
    title: str
    caption: str
    files: Sequence[Path]
    wide: bool = False


@dataclass(frozen=True)
class Page:
    """All that paper.html says.  ``facts`` are how the runs were made, name by name."""

    judged: Mapping[Claim, Judgement]
    figures: Sequence[Shown]
    tables: Mapping[str, Table]
    facts: Mapping[str, str]


def render(page: Page) -> str:
    """The page as HTML."""
    body = [
        "<h1>What of the paper holds</h1>",
        _introduction(page),
        "<h2>Claims at a glance</h2>",
        _glance(page.judged),
        "<h2>Figures and tables</h2>",
        *_shown(page),
        "<h2>Claims, judged</h2>",
        *(_claim(claim, judgement) for claim, judgement in page.judged.items()),
        "<h2>How the runs were made</h2>",
        _facts(page.facts),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>What of the paper holds</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def _introduction(page: Page) -> str:
    verdicts = [judgement.verdict for judgement in page.judged.values()]
    counted = ", ".join(
        f"{verdicts.count(verdict)} {words}"
        for verdict, words in (
            (Verdict.HOLDS, "hold"),
            (Verdict.ONLY_IF, "hold only under a condition"),
            (Verdict.FAILS, "do not hold"),
            (Verdict.OPEN, "cannot be told from these runs"),
        )
        if verdict in verdicts
    )
    return (
        "<p>Wang et al., “Reconnaissance Mission Conducted by UAV Swarms Based on Distributed PSO Path Planning "
        "Algorithms”, IEEE Access 2019, flown again: its figures and tables from fresh runs beside the printed "
        f"values, and a verdict on each of {len(verdicts)} claims: {counted}.</p>"
        '<p class="quiet">Verdicts are computed from the runs by the rule that stands with each claim. Where the '
        "paper leaves open how something is meant, every reading is flown: “holds” means in all of them, “holds only "
        "if” names those in which it does. Intervals are 95 %.</p>"
    )


def badge(verdict: Verdict) -> str:
    """A verdict, coloured and in words."""
    return f'<span class="verdict {CLASS[verdict]}">{html.escape(verdict.value)}</span>'


def _glance(judged: Mapping[Claim, Judgement]) -> str:
    rows = (
        f'<tr><td>{badge(judgement.verdict)}</td><td><a href="#{claim.key}">{html.escape(claim.statement)}</a>'
        f"{_if(judgement)}</td><td>{html.escape(claim.place)}</td></tr>"
        for claim, judgement in judged.items()
    )
    head = "<tr><th>verdict</th><th>claim</th><th>where</th></tr>"
    return f'<div class="wide"><table>{head}{"".join(rows)}</table></div>'


def _if(judgement: Judgement) -> str:
    if not judgement.condition:
        return ""
    return f'<br><span class="quiet">only if: {html.escape(judgement.condition)}</span>'


def _shown(page: Page) -> Iterable[str]:
    for figure in page.figures:
        if figure.files:
            yield _figure(figure)
        if figure.key in page.tables:
            anchor = "" if figure.files else f' id="{figure.key}"'
            yield f"<div{anchor}>{_table(page.tables[figure.key])}</div>"


def _figure(figure: Shown) -> str:
    pictures = "\n".join(
        f'<img src="{embedded(file)}" alt="{html.escape(figure.title)}">' for file in figure.files
    )
    kind = "plot" if figure.wide else "single"
    return (
        f'<figure id="{figure.key}" class="{kind}"><h3>{html.escape(figure.title)}</h3>\n{pictures}\n'
        f"<figcaption>{html.escape(figure.caption)}</figcaption></figure>"
    )


def embedded(file: Path) -> str:
    """A PNG as a data URL."""
    return f"data:image/png;base64,{base64.b64encode(file.read_bytes()).decode()}"


def _table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in table.heads)
    rows = "".join(
        f"<tr{' class=printed' if number < table.printed else ''}>"
        + "".join(f"<td>{html.escape(cell).replace(chr(10), '<br>')}</td>" for cell in row)
        + "</tr>"
        for number, row in enumerate(table.rows)
    )
    return (
        f"<h3>{html.escape(table.title)}</h3>"
        f'<div class="wide"><table class="figures"><tr>{head}</tr>{rows}</table></div>'
        f'<p class="note">{html.escape(table.note)}</p>'
    )


def _claim(claim: Claim, judgement: Judgement) -> str:
    printed = f" Printed: {html.escape(claim.printed)}." if claim.printed else ""
    main = judgement.main
    reading = _reading(main)
    said = f" ({html.escape(reading)})" if reading else ""
    folded = ""
    if len(judgement.cases) > 1:
        rows = "".join(_case(case) for case in judgement.cases)
        heads = "".join(f"<th>{html.escape(name)}</th>" for name in main.reading)
        folded = (
            f"<details><summary>all {len(judgement.cases)} readings</summary>"
            f'<div class="wide"><table><tr>{heads}<th>verdict</th><th>figures</th></tr>{rows}</table></div></details>'
        )
    return (
        f'<div class="claim" id="{claim.key}">{badge(judgement.verdict)} '
        f'<p class="statement">{html.escape(claim.statement)}{_if(judgement)}</p>'
        f'<p class="quiet"><a href="#{claim.figure}">{html.escape(claim.place)}</a>.{printed} '
        f"Rule: {html.escape(claim.rule)}</p>"
        f"<p>As this program flies{said}: {badge(main.verdict)}</p>{_lines(main.evidence)}{folded}</div>"
    )


def _reading(case: Case) -> str:
    return ", ".join(f"{name} {value}" for name, value in case.reading.items())


def _lines(lines: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{html.escape(line)}</li>' for line in lines)}</ul>"


def _case(case: Case) -> str:
    values = "".join(f"<td>{html.escape(value)}</td>" for value in case.reading.values())
    figures = "<br>".join(html.escape(line) for line in case.evidence)
    return f"<tr>{values}<td>{badge(case.verdict)}</td><td>{figures}</td></tr>"


def _facts(facts: Mapping[str, str]) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>" for name, value in facts.items()
    )
    return f'<div class="wide"><table>{rows}</table></div>'
