"""Whether the algorithms that a mission names exist, and take the parameters that it gives them.

What exists is handed in, so that this package needs to know no planner.
"""

from collections.abc import Iterable, Mapping

from .errors import Finding, KeyPath, nearest, shown
from .model import Mission

Known = Mapping[str, Mapping[str, float | str]]


Limits = Mapping[str, Mapping[str, tuple[float, float]]]
Choices = Mapping[str, Mapping[str, tuple[str, ...]]]


def check_parameters(
    mission: Mission, known: Known, limits: Limits | None = None, choices: Choices | None = None
) -> list[Finding]:
    """What is wrong with the algorithms named and their parameters.

    ``known`` holds each algorithm's parameters with their defaults: a parameter is text where its default is.
    ``limits`` holds the least and the greatest value of those that are numbers, ``choices`` the words of the others.
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
            path_to = (*path, name)
            wrong = _parameter(path_to, known[algorithm], algorithm, name, value)
            found += wrong or [
                *_range(path_to, (limits or {}).get(algorithm, {}).get(name), value),
                *_choice(path_to, (choices or {}).get(algorithm, {}).get(name), value),
            ]
    return found


def _choice(path: KeyPath, words: tuple[str, ...] | None, value: float | str) -> list[Finding]:
    if words is None or value in words:
        return []
    return [Finding(path, f"must be {' or '.join(words)}, not {shown(value)}", nearest(str(value), words))]


def _range(path: KeyPath, limits: tuple[float, float] | None, value: float | str) -> list[Finding]:
    if limits is None or isinstance(value, str) or limits[0] <= value <= limits[1]:
        return []
    return [
        Finding(path, f"must be from {limits[0]:g} to {limits[1]:g}, not {value:g}", "see swarmctl algos")
    ]


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
