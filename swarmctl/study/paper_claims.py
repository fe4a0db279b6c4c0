"""The claims of Wang et al. (IEEE Access 2019), in our words: what is said, where, and who judges it.

A table of data: the verdicts come out of the judges (paper_judges.py) and the runs alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from . import paper_judges as judges
from .paper_judges import SHARE, Pairing, read_as
from .paper_rules import Case, Judgement, judge
from .paper_runs import Evidence
from .paper_variants import (
    TERMS,
    Variant,
    ace,
    dpso_u,
    fco,
    many,
    mdc,
    readings,
    silent,
    variant,
    without_jump_out,
    without_revisit,
)

TABLE_2 = {"mdc": (27.0, 183.0, 345.0, 637.0, 1128.0), "dpso-u": (27.0, 195.0, 361.0, 656.0, 1161.0)}
"""Table 2 as printed: targets in range, then seconds to 25, 50, 75 and 85 % of them."""

Make = Callable[[str, float], Variant]
MakeOne = Callable[[str], Variant]


@dataclass(frozen=True)
class Claim:
    """Something the paper says: ``statement`` in our words, ``place`` where, ``printed`` its figures if it has any.

    ``figure`` is the key of the figure or table of the page that shows it.
    """

    key: str
    statement: str
    place: str
    printed: str
    figure: str
    judge: "partial[list[Case]]"

    @property
    def rule(self) -> str:
        """How it is judged, in words: the judge's docstring."""
        return " ".join((self.judge.func.__doc__ or "").split())

    def judged(self, evidence: Evidence) -> Judgement:
        """The verdict, from the runs."""
        return judge(self.judge(evidence))


def _all(a: Make, b: Make) -> list[Pairing]:
    """Two makes in every reading of terms and random vector."""
    return [Pairing(read_as(*reading), a(*reading), b(*reading)) for reading in readings()]


def _each_terms(a: MakeOne, b: MakeOne) -> list[Pairing]:
    return [Pairing({"terms": terms}, a(terms), b(terms)) for terms in TERMS]


def _later_than_ace() -> Sequence[Pairing]:
    return [Pairing({"compared with": name}, one, ace()) for name, one in (("MDC", mdc()), ("FCO", fco()))]


AVERAGES = ("MDC", "DPSO-U")
CLAIMS = (
    Claim(
        "mdc-before-dpso-u",
        "MDC finds 25, 50, 75 and 85 % of the targets before DPSO-U does: its random vector helps it explore.",
        "Table 2", "183, 345, 637, 1128 s against 195, 361, 656, 1161 s", "table2",
        partial(judges.is_earlier, pairings=_all(mdc, dpso_u), names=AVERAGES),
    ),
    Claim(
        "averages-alike",
        "With MDC and with DPSO-U a vehicle has the same number of targets in range on average.",
        "Table 2", "27 and 27", "table2",
        partial(judges.are_alike, pairings=_all(mdc, dpso_u), names=AVERAGES, half=0.5),
    ),
    Claim(
        "averages-27",
        "That average is 27 targets, with both.",
        "Table 2", "27 and 27", "table2",
        partial(judges.both_are, pairings=_all(mdc, dpso_u), names=AVERAGES, value=27.0, half=0.5),
    ),
    Claim(
        "mdc-drawn-together",
        "Exchange draws MDC's vehicles to where others saw most: with radio more targets are in range than without.",
        "Figs. 12, 13", "", "fig13",
        partial(
            judges.is_more, pairings=_each_terms(mdc, lambda terms: silent(mdc(terms))),
            names=("with radio", "without"), field="in_range", what="targets in range",
        ),
    ),
    Claim(
        "jump-out",
        "The jump-out raises the swarm's overall performance: with it more of the targets are found.",
        "section VII-B, Fig. 12", "", "fig12",
        partial(
            judges.is_more, pairings=_each_terms(mdc, without_jump_out), names=("with jump-out", "without"),
            field=SHARE, what="targets found",
        ),
    ),
    Claim(
        "optimum",
        "Most targets are detected at w = 0.9, c_p = 0.1, c_g = 0.",
        "Fig. 14", "the maximum of the triangle", "fig14",
        partial(judges.wins_contest, contest=lambda evidence: evidence.optimum, field=SHARE, what="targets found"),
    ),
    Claim(
        "inertia",
        "The inertia weight governs directly how many targets are detected: the less of it, the fewer.",
        "Fig. 14", "", "fig14", partial(judges.rises_with_inertia),
    ),
    Claim(
        "region",
        "Vehicles have most targets in range where c_p and c_g lie between 0.3 and 0.6.",
        "Fig. 15", "0.3 to 0.6", "fig15",
        partial(judges.wins_contest, contest=lambda evidence: evidence.region, field="in_range",
                what="targets in range"),
    ),
    Claim(
        "one-cluster",
        "At the extreme weights of Fig. 16 all vehicles are drawn to the swarm's best place and end at one cluster.",
        "Fig. 16", "w = 1, c_p = 0, c_g = 0", "fig16",
        partial(judges.all_gather, vehicles=6),
    ),
    Claim(
        "fco-before-mdc",
        "FCO finds 25, 50, 75 and 85 % of the targets before MDC does.",
        "Fig. 20", "", "fig20",
        partial(judges.is_earlier, pairings=_all(fco, mdc), names=("FCO", "MDC")),
    ),
    Claim(
        "fco-steadier",
        "FCO's times have a lower standard deviation than MDC's.",
        "Fig. 20", "", "fig20",
        partial(judges.is_steadier, pairings=_all(fco, mdc), names=("FCO", "MDC")),
    ),
    Claim(
        "fco-1000",
        "FCO detects 85 % of the targets in less than 1000 s.",
        "Fig. 20", "< 1000 s", "fig20",
        partial(judges.is_below, pairings=_all(fco, fco), percent=85, bar_s=1000.0),
    ),
    Claim(
        "fco-exchange",
        "FCO's exchange is effective: with radio the targets are found before they are without.",
        "Figs. 17, 18", "", "fig18",
        partial(
            judges.is_earlier_at, pairings=_each_terms(fco, lambda terms: silent(fco(terms))),
            names=("with radio", "without"),
        ),
    ),
    Claim(
        "revisit",
        "Revisiting brings more: with it more of the targets are found.",
        "section VII-C, Figs. 18, 19", "", "fig19",
        partial(
            judges.is_more, pairings=_each_terms(fco, without_revisit), names=("with revisits", "without"),
            field=SHARE, what="targets found",
        ),
    ),
    Claim(
        "nine",
        "FCO extends to nine vehicles: nine find 25, 50, 75 and 85 % before six do.",
        "Fig. 19", "", "fig19",
        partial(judges.is_earlier, pairings=_each_terms(many, fco), names=("nine", "six")),
    ),
    Claim(
        "ace-complete",
        "ACE covers the clusters that it visits completely: it finds all of their targets.",
        "section VI, Fig. 21", "", "fig21", partial(judges.covers_whole),
    ),
    Claim(
        "ace-most-accurate",
        "Of the three algorithms ACE is the most accurate: of the clusters visited it finds more than MDC and FCO.",
        "section VI", "", "fig21", partial(judges.covers_most),
    ),
    Claim(
        "ace-slower",
        "ACE costs more time than MDC and FCO.",
        "section VI", "", "fig21",
        partial(judges.is_earlier, pairings=_later_than_ace(), names=("the other", "ACE")),
    ),
    Claim(
        "ace-exchange",
        "ACE's exchange, after which the vehicle that found fewer leaves, makes exploring more effective.",
        "Fig. 21", "", "fig21",
        partial(judges.is_earlier_at, pairings=[Pairing({}, variant("ace"), silent(ace()))],
                names=("with radio", "without")),
    ),
)  # fmt: skip
