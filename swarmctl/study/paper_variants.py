"""What the paper's simulations are flown as: variants of the reference mission, and how many runs of each.

A :class:`Variant` says what differs from missions/paper.yaml.  Every variant starts at the same first seed, so runs
of any two pair up seed by seed, as far as the shorter goes.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

from swarmctl.core import planners
from swarmctl.mission.load import load
from swarmctl.mission.model import Mission

TERMS = ("unit", "metric")
"""The two readings of the velocity rules (ALGORITHMS, core/planners/common.py)."""

RANDOM = (0.02, 0.05, 0.1, 0.25, 0.3)
"""Sizes φ of the random vector that are tried: the paper gives none."""

LEVELS_PRINTED = (25, 50, 75, 85)
"""Percent of the targets, as Table 2 and Fig. 20 have them."""

STEPS = 10
"""The parameter triangle's sides are cut into so many steps: of 0.1, as the paper's."""

SPACINGS_M = (100.0, 200.0, 300.0, 400.0)
"""Distances of ACE's lanes that are tried: the paper gives none."""

NEVER_S = 1e6
"""Put in for a waiting time, it switches a mechanism off."""

MANY_VEHICLES = 9


@dataclass(frozen=True, slots=True)
class Variant:
    """The reference mission flown by ``algorithm`` with some of its parameters, terms, radio or number changed."""

    algorithm: str
    terms: str = "unit"
    parameters: tuple[tuple[str, float], ...] = ()
    radio_m: float | None = None
    vehicles: int | None = None

    def mission(self) -> Mission:
        """The mission to fly."""
        base = _base(self.algorithm, self.terms, self.radio_m, self.vehicles)
        planner = base.planner.model_copy(update={"parameters": {self.algorithm: dict(self.parameters)}})
        return base.model_copy(update={"planner": planner})


def variant(
    algorithm: str, terms: str = "unit", parameters: Mapping[str, float] = MappingProxyType({}), *,
    radio_m: float | None = None, vehicles: int | None = None,
) -> Variant:  # fmt: skip
    """A variant; parameters at their default are left out, so that what flies alike is one variant."""
    defaults = {p.name: p.default for p in planners.module(algorithm).PARAMETERS}
    changed = {name: value for name, value in parameters.items() if value != defaults[name]}
    return Variant(algorithm, terms, tuple(sorted(changed.items())), radio_m, vehicles)


@cache
def _base(algorithm: str, terms: str, radio_m: float | None, vehicles: int | None) -> Mission:
    given = {
        "planner.algorithm": algorithm,
        "planner.terms": terms,
        "radio.range_m": radio_m,
        "vehicles.count": vehicles,
    }
    return load(None, {key: value for key, value in given.items() if value is not None})


def duration_s() -> float:
    """How long a search is."""
    return mdc().mission().duration_s


def mdc(terms: str = "unit", random: float = 0.05) -> Variant:
    """MDC with that random vector."""
    return variant("mdc", terms, {"random": random})


def fco(terms: str = "unit", random: float = 0.05) -> Variant:
    """FCO with that random vector."""
    return variant("fco", terms, {"random": random})


def dpso_u(terms: str = "unit", random: float = 0.0) -> Variant:
    """DPSO-U, which has no random vector: ``random`` is the other's, whom it is compared with."""
    return variant("dpso-u", terms)


def silent(flown: Variant) -> Variant:
    """The same without any radio."""
    return Variant(flown.algorithm, flown.terms, flown.parameters, 0.0, flown.vehicles)


def without_revisit(terms: str = "unit") -> Variant:
    """FCO that never flies back."""
    return variant("fco", terms, {"revisit_s": NEVER_S})


def without_jump_out(terms: str = "unit") -> Variant:
    """MDC that stays wherever nothing better turns up."""
    return variant("mdc", terms, {"jump_out_s": NEVER_S})


def many(terms: str = "unit") -> Variant:
    """FCO with nine vehicles."""
    return variant("fco", terms, vehicles=MANY_VEHICLES)


def ace(spacing_m: float = 300.0) -> Variant:
    """ACE with lanes so far apart."""
    return variant("ace", parameters={"spacing_m": spacing_m})


Weights = tuple[int, int, int]
"""w, c_p, c_g in steps of the triangle: they add up to STEPS."""


def triangle() -> list[Weights]:
    """Every point of w + c_p + c_g = 1."""
    return [(w, p, STEPS - w - p) for w in range(STEPS + 1) for p in range(STEPS + 1 - w)]


def weighted(weights: Weights, terms: str, random: float) -> Variant:
    """MDC at a point of the triangle."""
    w, p, g = (value / STEPS for value in weights)
    return variant("mdc", terms, {"random": random, "inertia": w, "personal": p, "global": g})


def readings() -> Iterator[tuple[str, float]]:
    """Every terms with every size of the random vector."""
    return ((terms, random) for terms in TERMS for random in RANDOM)


def compared() -> list[str]:
    """The algorithms of every table: the paper's, the baselines, and ours where this program has it."""
    names = ("mdc", "dpso-u", "fco", "ace", "bounce", "sweep", "belief")
    return [name for name in names if name in planners.MODULES]


EXTREME = {
    "w = 1, c_p = 0, c_g = 0, as printed": (1.0, 0.0, 0.0),
    "w = 0, c_p = 0, c_g = 1, as the text argues": (0.0, 0.0, 1.0),
}
"""The weights that Fig. 16 may mean."""


def extreme(weights: tuple[float, float, float], jump_out: bool) -> Variant:
    """MDC at extreme weights, with or without the jump-out."""
    w, p, g = weights
    changed = {"inertia": w, "personal": p, "global": g}
    return variant("mdc", parameters=changed if jump_out else {**changed, "jump_out_s": NEVER_S})


def wanted(runs: int) -> dict[Variant, int]:
    """How many runs each variant is flown, if the tables are to have ``runs``."""
    half, few = max(2, runs // 2), max(2, runs // 20)
    whole = [variant(name) for name in compared()]
    whole += [make(terms, random) for terms, random in readings() for make in (mdc, fco)]
    for terms in TERMS:
        whole += [dpso_u(terms), without_revisit(terms), without_jump_out(terms)]
        whole += [silent(mdc(terms)), silent(fco(terms)), many(terms)]
    whole.append(silent(ace()))
    parts = [
        ([weighted(point, *reading) for reading in readings() for point in triangle()], few),
        ([ace(spacing) for spacing in SPACINGS_M], half),
        (whole, runs),
    ]
    return {each: count for variants, count in parts for each in variants}


def counted(runs: int) -> dict[Variant, int]:
    """How many runs of each are looked at step by step (paper_census.py)."""
    tenth = max(2, runs // 10)
    found = [*(ace(spacing) for spacing in SPACINGS_M), mdc(), fco()]
    gathered = [extreme(weights, jump) for weights in EXTREME.values() for jump in (True, False)]
    return dict.fromkeys([*found, *gathered], tenth)
