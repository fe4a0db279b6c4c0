"""Whether the algorithms that a mission names exist, and take the parameters that it gives them.

What exists is handed in, so that this package needs to know no planner.
"""

from collections.abc import Iterable, Mapping

from .errors import Finding, KeyPath, nearest, shown
from .model import Mission

Known = Mapping[str, Mapping[str, float | str]]


def check_parameters(mission: Mission, known: Known) -> list[Finding]:
    """What is wrong with the algorithms named and their parameters.

    ``known`` holds each algorithm's parameters with their defaults: a parameter is text where its default is.
    """
    planner = mission.planner
    found = []
    if planner.algorithm not in known:
        found.append(_unknown(("planner", "algorithm"), "algorithm", planner.algorithm, known))
    for algorithm, given in planner.parameters.items():
        path = ("planner", "parameters", algorithm)
        if algorithm not in known:
            if algorithm != planner.algorithm:
                found.append(_unknown(path, "algorithm", algorithm, known))
            continue
        for name, value in given.items():
            found += _parameter((*path, name), known[algorithm], algorithm, name, value)
    return found


def _parameter(
    path: KeyPath, known: Mapping[str, float | str], algorithm: str, name: str, value: float | str
) -> list[Finding]:
    if name not in known:
        return [_unknown(path, f"parameter of {algorithm}", name, known)]
    if isinstance(value, str) != isinstance(known[name], str):
        kind = "text" if isinstance(known[name], str) else "a number"
        return [Finding(path, f"must be {kind}, not {shown(value)}", f"its default is {known[name]}")]
    return []


def _unknown(path: KeyPath, kind: str, word: str, known: Iterable[str]) -> Finding:
    return Finding(path, f"{shown(word)} is no {kind}", nearest(word, known))
