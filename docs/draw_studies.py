"""A table and a picture of one study beside another of the same seeds: what docs/studies.md shows.

    python docs/draw_studies.py REFERENCE STUDY PICTURE.png

REFERENCE and STUDY are folders of `swarmctl study`.  The table goes to the terminal, in Markdown: mean time ± standard
deviation of the runs that got there and how many never did, the mean time to 85 % if a run that never got there counts
as the whole search, how much that is later than in the reference (with the 95 % interval of the paired mean), and in
how many pairs the study's run is the earlier one.
"""

import json
import sys
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from swarmctl.core.arrays import Floats
from swarmctl.record.drawing import GREY, INK, PALE, new_figure, plain, save
from swarmctl.study.charts import colour_of
from swarmctl.study.statistics import compare

LEVEL = "85"
HEADS = (
    "", "50 %", "85 %", "85 %, late", "reference, late", "later by", "earlier in", "found in the end", "in range",
)  # fmt: skip


def read(folder: Path) -> dict[str, Any]:
    """A study's study.json."""
    content: dict[str, Any] = json.loads((folder / "study.json").read_text())
    return content


def late(study: dict[str, Any], name: str) -> Floats:
    """Seconds to 85 % of each run (R,), the search's length for one that never got there."""
    times = study["algorithms"][name]["per_run"][LEVEL]
    return np.array([study["duration_s"] if time is None else time for time in times])


def row(reference: dict[str, Any], study: dict[str, Any], name: str) -> list[str]:
    """One algorithm's line of the table."""
    told = study["algorithms"][name]
    before, after = late(reference, name), late(study, name)
    off = after - before
    half = 1.96 * off.std(ddof=1) / sqrt(len(off))
    pairs = compare(
        *(
            [np.inf if t is None else t for t in s["algorithms"][name]["per_run"][LEVEL]]
            for s in (study, reference)
        )
    )
    return [
        name,
        *(_time(told["time_to_s"][level]) for level in ("50", LEVEL)),
        f"{after.mean():.0f}",
        f"{before.mean():.0f}",
        f"{off.mean():+.0f} ± {half:.0f}",
        f"{100 * pairs.wins:.0f} %",
        f"{100 * told['final_fraction']['mean']:.1f} %",
        f"{told['mean_targets_in_range']['mean']:.2f}",
    ]


def _time(told: dict[str, Any]) -> str:
    return f"{told['mean']:.0f} ± {told['std']:.0f} ({told['missing']})"


def table(reference: dict[str, Any], study: dict[str, Any]) -> str:
    """All algorithms, the earliest first."""
    names = sorted(study["algorithms"], key=lambda name: float(late(study, name).mean()))
    lines = [list(HEADS), ["---"] * len(HEADS), *(row(reference, study, name) for name in names)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def draw(reference: dict[str, Any], study: dict[str, Any], path: Path) -> None:
    """The mean share found over time of each algorithm, the reference dashed."""
    names = list(study["algorithms"])
    figure = new_figure(11.0, 5.0)
    panels: Any = figure.subplots(2, (len(names) + 1) // 2, sharex=True, sharey=True)
    for panel, name in zip(panels.flat, names, strict=False):
        for told, dashes, colour in ((reference, (0, (4, 2)), INK), (study, "-", colour_of(name))):
            curve = told["algorithms"][name]["curve"]
            share = 100.0 * np.array(curve["fraction"])
            panel.plot(curve["t_s"], share, linestyle=dashes, color=colour, linewidth=1.6)
        panel.set_title(name, loc="left", fontsize=11, color=INK)
        panel.set_xlim(0, study["duration_s"])
        panel.set_ylim(0, 100)
        panel.grid(color=PALE, linewidth=0.6)
        plain(panel)
    figure.supylabel("targets found, %", color=GREY, fontsize=10)
    figure.supxlabel("time since the search began (s)", color=GREY, fontsize=10)
    figure.suptitle(
        f"{study['mission']} (coloured) and {reference['mission']} (dashed), mean of {study['runs']} runs",
        color=INK,
    )
    save(figure, path)


if __name__ == "__main__":
    told_reference, told_study = (read(Path(folder)) for folder in sys.argv[1:3])
    print(table(told_reference, told_study))
    draw(told_reference, told_study, Path(sys.argv[3]))
