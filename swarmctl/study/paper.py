"""``swarmctl paper``: fly what the paper flew, draw its figures anew, judge its claims, and write one page.

paper_variants says what is flown, paper_runs flies it, paper_scenes finds the searches for the path figures,
paper_claims is the table of claims, paper_judges and paper_rules judge them; this strings them together.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from swarmctl.core import bind
from swarmctl.record.folder import RunFolder

from . import paper_charts as charts
from . import paper_maps as maps
from . import paper_scenes as scenes
from .execute import Done
from .paper_census import census
from .paper_claims import CLAIMS, Claim
from .paper_judges import SHARE
from .paper_page import Page, Shown, render
from .paper_rules import Judgement
from .paper_runs import OPTIMUM, Evidence, gather, in_region
from .paper_tables import table_2, table_of_figure_20
from .paper_variants import RANDOM, TERMS, compared, counted, duration_s, triangle, variant
from .runs import Job, simulate

PAGE = "paper.html"
OURS_RANDOM, STRONG_RANDOM = 0.05, 0.3
"""The random vectors of the large triangles: the program's own, and that with which Fig. 14 was reproduced."""

Clock = Callable[[], float]
Say = Callable[[str], None]


@dataclass(frozen=True)
class Paper:
    """What came out: the verdicts, the page, and how long it took."""

    evidence: Evidence
    judged: Mapping[Claim, Judgement]
    page: Path
    wall_s: float

    def text(self) -> str:
        """The verdicts, a claim a line, for a terminal or a document."""
        width = max(len(claim.place) for claim in self.judged)
        lines = [
            f"{c.place:<{width}}  {c.statement}\n{'':<{width}}  -> {j.text}" for c, j in self.judged.items()
        ]
        return "\n".join(lines)


def warm_up(first: int, compiling: Say) -> None:
    """Compile, or load, what the runs will call; ``compiling`` is told of each algorithm that takes long."""
    for name in compared():
        if not bind.is_compiled(name, "run_ideal"):
            compiling(name)
        mission = variant(name).mission()
        short = mission.model_copy(update={"duration_s": mission.planner.period_s})
        simulate(Job(short, name, (first,)))
        if name in {flown.algorithm for flown in counted(2)}:
            census(Job(short, name, (first,)))


def make(
    folder: RunFolder, runs: int, first: int, executor: Executor, clock: Clock, done: Done, say: Say
) -> Paper:
    """Fly, draw, judge and write.  Raises RunFolderError where the folder cannot be written."""
    began = clock()
    evidence = Evidence(first, runs)
    gather(evidence, executor, done)
    flown_s = clock() - began
    say(f"{evidence.flown} runs in {flown_s:.1f} s; drawing and judging")
    figures = draw(evidence, folder.path)
    judged = {claim: claim.judged(evidence) for claim in CLAIMS}
    wall_s = clock() - began
    tables = {"table2": table_2(evidence), "fig20": table_of_figure_20(evidence)}
    page = folder.path / PAGE
    folder.write_text(page, render(Page(judged, figures, tables, _facts(evidence, wall_s))))
    return Paper(evidence, judged, page, wall_s)


def _facts(evidence: Evidence, wall_s: float) -> dict[str, str]:
    few = len(evidence.over_triangle(SHARE, TERMS[0], RANDOM[0])[OPTIMUM])
    looked_at = len(next(iter(evidence.counted.values())))
    fresh = evidence.fresh_seeds
    return {
        "command": f"swarmctl paper --runs {evidence.runs} --seed {evidence.first}",
        "mission": "missions/paper.yaml in ideal dynamics: 6 vehicles, 450 targets in 6 clusters drawn anew for "
        f"each seed, {duration_s():g} s",
        "seeds": f"{evidence.first} to {evidence.first + evidence.runs - 1}, the same for every variant",
        "triangle": f"{len(triangle())} points x {len(TERMS)} terms x {len(RANDOM)} random vectors, {few} runs each",
        "contests": f"the claimed point and its rival again on seeds {fresh[0]} to {fresh[-1]}",
        "clusters": f"visits, and who ends together, from {looked_at} runs each",
        "readings": "how the paper's contradictions are read stands in the planners' docstrings, "
        "swarmctl/core/planners",
        "in all": f"{evidence.flown} runs; {wall_s:.0f} s with drawing and judging",
    }


def draw(evidence: Evidence, folder: Path) -> list[Shown]:
    """Draw everything into the folder; the figures in the paper's order."""
    first = evidence.first
    figures = [
        _environment(first, folder),
        *_scenes(folder, scenes.mdc_scenes(first), ("fig12", "fig13"), "MDC"),
        *_triangles(evidence, folder),
        _extremes(evidence, folder),
        Shown("table2", "Table 2", "", ()),
        *_scenes(folder, scenes.fco_scenes(first), ("fig17", "fig18"), "FCO"),
    ]
    nine = scenes.nine_scene(first)
    maps.draw_scene(nine, "FCO, nine vehicles", folder / "fig19.png")
    figures.append(Shown("fig19", "Fig. 19: nine vehicles", nine.caption, (folder / "fig19.png",)))
    charts.draw_times(evidence, compared(), folder / "fig20.png")
    bars = "Printed as bars without figures, with the statement that FCO needs less than 1000 s to 85 %."
    figures.append(Shown("fig20", "Fig. 20: FCO against MDC", bars, (folder / "fig20.png",), wide=True))
    mowing = scenes.ace_scene(first)
    maps.draw_enlarged(mowing, "ACE", folder / "fig21.png")
    figures.append(
        Shown(
            "fig21",
            "Fig. 21: ACE, and its exchange enlarged",
            mowing.caption,
            (folder / "fig21.png",),
            wide=True,
        )
    )
    return figures


def _environment(first: int, folder: Path) -> Shown:
    file = folder / "fig11.png"
    maps.draw_environment(first, file)
    words = (
        f"The area, its forbidden zones as printed, and the clusters of seed {first}; every seed has its own."
    )
    return Shown("fig11", "Fig. 11: environment", words, (file,))


def _scenes(
    folder: Path, pair: tuple[scenes.Scene, scenes.Scene], keys: tuple[str, str], name: str
) -> list[Shown]:
    """Paths without radio, and with it; FCO's with its enlargement."""
    files = [folder / f"{key}.png" for key in keys]
    number = [key.removeprefix("fig") for key in keys]
    maps.draw_scene(pair[0], f"{name} without radio", files[0])
    enlarged = pair[1].silent is not None
    (maps.draw_enlarged if enlarged else maps.draw_scene)(pair[1], f"{name} with radio", files[1])
    more = ", and the turn that radio makes enlarged" if enlarged else ""
    return [
        Shown(keys[0], f"Fig. {number[0]}: {name} without radio", pair[0].caption, (files[0],)),
        Shown(
            keys[1], f"Fig. {number[1]}: {name} with radio{more}", pair[1].caption, (files[1],), wide=enlarged
        ),
    ]


def _triangles(evidence: Evidence, folder: Path) -> list[Shown]:
    """Figs. 14 and 15: two random vectors large, all of them small."""
    shown = []
    region = [point for point in triangle() if in_region(point)]
    for key, field, claimed, what in (
        ("fig14", SHARE, [OPTIMUM], "percentage of targets detected"),
        ("fig15", "in_range", region, "average number of targets in range"),
    ):
        files = [folder / f"{key}.png", folder / f"{key}-strong.png", folder / f"{key}-all.png"]
        charts.draw_triangles(evidence, field, claimed, OURS_RANDOM, files[0])
        charts.draw_triangles(evidence, field, claimed, STRONG_RANDOM, files[1])
        charts.draw_all_triangles(evidence, field, claimed, files[2])
        words = (
            "The triangle w + c_p + c_g = 1 with both terms: with this program's random vector, with a strong one, "
            "and in small with all that were flown."
        )
        shown.append(Shown(key, f"Fig. {key[3:]}: {what}", words, files, wide=True))
    return shown


def _extremes(evidence: Evidence, folder: Path) -> Shown:
    numbers = {flown: told["gathered"] for flown, told in evidence.counted.items()}
    files, captions = [], []
    for number, scene in enumerate(scenes.extreme_scenes(evidence.first, numbers)):
        files.append(folder / ("fig16.png" if number == 0 else "fig16-text.png"))
        maps.draw_scene(
            scene, "MDC, weights as printed" if number == 0 else "MDC, weights as argued", files[-1]
        )
        captions.append(scene.caption)
    return Shown("fig16", "Fig. 16: extreme weights", " ".join(captions), files)
