"""``--set KEY=V[,V...]``: which keys of a mission a study varies, and over which values.

Values are YAML, as in the mission file, and what stands between the commas is read as a YAML list, so that commas
in brackets and quotes are the value's own: ``launch=[[100,100],[200,100]],corner`` is two values.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

from swarmctl.mission import yaml_reader
from swarmctl.mission.errors import COMMAND_LINE, MissionError

from .errors import StudyError

ALGORITHM = "planner.algorithm"
HOW = "write KEY=VALUE[,VALUE...], a value that is a list in brackets, one with commas in quotes"
Settings = dict[str, object]


@dataclass(frozen=True, slots=True)
class Axis:
    """A dotted key of the mission, and the values it takes in turn."""

    key: str
    values: tuple[object, ...]


def read_axes(texts: Iterable[str]) -> list[Axis]:
    """The axes as typed.  Raises StudyError for one that cannot be read, or a key given twice."""
    axes: list[Axis] = []
    for text in texts:
        axis = _read_axis(text)
        if axis.key in (other.key for other in axes):
            raise StudyError(f"--set {axis.key}: given twice (put all its values after one --set)")
        axes.append(axis)
    return axes


def grid(axes: Sequence[Axis]) -> list[Settings]:
    """Every combination of the axes' values, the last axis fastest; without axes the one empty setting."""
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, values, strict=True)) for values in product(*(axis.values for axis in axes))]


def shown(settings: Settings) -> str:
    """``key=value`` of each, in a line."""
    return ", ".join(f"{key}={shown_value(value)}" for key, value in settings.items())


def shown_value(value: object) -> str:
    """A value as a person types it."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def _read_axis(text: str) -> Axis:
    key, equals, typed = text.partition("=")
    key = key.strip()
    if not key or not equals:
        raise StudyError(f"--set {text}: {HOW}")
    if key == ALGORITHM:
        raise StudyError(f"--set {text}: algorithms are given by --algo NAME[,NAME...]")
    values = _read_values(text, typed)
    if len({repr(value) for value in values}) < len(values):
        raise StudyError(f"--set {text}: a value is given twice")
    return Axis(key, values)


def _read_values(text: str, typed: str) -> tuple[object, ...]:
    try:
        document = yaml_reader.read(f"[{typed}]".encode(), COMMAND_LINE)
    except MissionError as error:
        raise StudyError(f"--set {text}: {error.problems[0].message} ({HOW})") from None
    if document.problems:
        raise StudyError(f"--set {text}: {document.problems[0].message} ({HOW})")
    if not isinstance(document.data, list) or not document.data:
        raise StudyError(f"--set {text}: no value is given ({HOW})")
    return tuple(document.data)
