"""From a mission file and the command line to a checked Mission, or to everything that is wrong with them.

Read the YAML, lay the command line's settings over it, check each key (pydantic), read the files it names,
check the keys together.  Keys found wrong are taken out and the rest is checked all the same, so that one
call reports all problems.
"""

import copy
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from . import checks, overrides, wording, yaml_reader
from .errors import Finding, KeyPath, MissionError, Problem
from .inline import FileError, inline, named_by, read_limited
from .model import Mission
from .parameters import check_parameters

DEFAULT = "paper.yaml"
REPAIRS = 8


def load(path: Path | str | None = None, settings: Mapping[str, object] | None = None) -> Mission:
    """The mission in a file, checked, with the files it names read into it.

    ``path`` None is the packaged missions/paper.yaml; ``paper`` or ``missions/sitl.yaml`` name packaged
    missions where there is no such file.  ``settings`` are dotted keys with values that replace the file's
    (see overrides.py).  Raises MissionError, and nothing else, with all problems at once.
    """
    name, file = _find(path)
    try:
        content = read_limited(file, yaml_reader.MAX_BYTES)
    except FileError as fault:
        hint = f"packaged missions: {', '.join(packaged())}"
        raise MissionError([Problem(name, None, None, "", str(fault), hint)]) from None
    document = yaml_reader.read(content, name)
    overrides.apply(document, settings or {})
    mission, findings = _judge(document.data, file.parent)
    known = {problem.key for problem in document.problems}
    problems = [document.problem(finding) for finding in findings]
    problems = document.problems + [problem for problem in problems if problem.key not in known]
    if problems or mission is None:
        raise MissionError(sorted(problems, key=lambda p: (p.line is None, p.line or 0, p.column or 0)))
    return mission


def packaged() -> list[str]:
    """The names of the missions that come with the program."""
    return sorted(
        item.name.removesuffix(".yaml") for item in _folder().iterdir() if item.name.endswith(".yaml")
    )


def _folder() -> Path:
    return Path(str(resources.files("missions")))


def _find(path: Path | str | None) -> tuple[str, Path]:
    """The name that messages call the file by, and the file."""
    if path is None:
        return f"missions/{DEFAULT}", _folder() / DEFAULT
    given = Path(path)
    ours = _folder() / f"{given.name.removesuffix('.yaml')}.yaml"
    if not _exists(given) and str(given.parent) in (".", "missions") and _exists(ours):
        return f"missions/{ours.name}", ours
    return str(given), given


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _judge(data: Any, folder: Path) -> tuple[Mission | None, list[Finding]]:
    """The mission in ``data``, as far as there is one, and everything that is wrong with it."""
    written, findings = _validate(data)
    if written is None:
        return None, findings
    mission, faults = inline(written, folder)
    findings += faults
    together = checks.find(mission, [finding.path for finding in findings])
    findings += [found._replace(path=named_by(found.path, written)) for found in together]
    return mission, findings + _parameters(mission, findings)


def _validate(data: Any) -> tuple[Mission | None, list[Finding]]:
    """The mission after taking out what is wrong with single keys; None if nothing sensible remains."""
    findings: list[Finding] = []
    for _ in range(REPAIRS):
        try:
            return Mission.model_validate(data), findings
        except ValidationError as error:
            new = wording.findings(error, data)
        # What a repair itself leaves wrong (a key gone that was needed) is no news.
        findings += [finding for finding in new if not _below(finding.path, findings)]
        data = _without(data, [finding.path for finding in new])
    return None, findings


def _below(path: KeyPath, findings: Iterable[Finding]) -> bool:
    return any(finding.path[: len(path)] == path for finding in findings)


def _without(data: Any, paths: Iterable[KeyPath]) -> Any:
    """A copy of the data less each path's last named key: whole lists, so that places keep their numbers."""
    data = copy.deepcopy(data)
    for path in paths:
        if not path:
            return {}
        holder, victim = data, None
        for part in path:
            if isinstance(holder, dict) and part in holder:
                victim = (holder, part)
            elif not (isinstance(holder, (list, tuple)) and isinstance(part, int) and part < len(holder)):
                break
            holder = holder[part]
        if victim is not None:
            victim[0].pop(victim[1])
    return data


def _parameters(mission: Mission, findings: Iterable[Finding]) -> list[Finding]:
    # Here, because planners bring the compiler with them, which a mission with a fault need not wait for.
    from swarmctl.core.planners import catalogue, choices, limits

    found = check_parameters(mission, catalogue(), limits(), choices())
    wrong = {finding.path for finding in findings}
    return [finding for finding in found if finding.path not in wrong]
