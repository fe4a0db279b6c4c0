"""What the command line says over what the file says: dotted keys, each replacing one value.

``vehicles.count`` is a path of keys; on a list a number picks an entry and a word goes to every entry.
``planner.X``, where X is no key of the planner, is the parameter X of the algorithm that is flown.
Settings change the data before they are validated, so that they are checked as the file is; their marks
say "command line".
"""

from collections.abc import Iterator, Mapping
from typing import Any

from .errors import COMMAND_LINE, KeyPath, Problem
from .model import Planner
from .yaml_reader import Document, Mark


def apply(document: Document, settings: Mapping[str, object]) -> None:
    """Write ``settings`` into the document's data and marks; what has no place is left in ``problems``."""
    if not isinstance(document.data, dict):
        return
    for typed, value in settings.items():
        path = _full_path(typed, document.data, settings)
        try:
            for place in _places(path, document.data):
                _put(document, place, value, typed)
        except LookupError as error:
            document.problems.append(Problem(COMMAND_LINE, None, None, typed, str(error.args[0])))


def _full_path(typed: str, data: Mapping[str, Any], settings: Mapping[str, object]) -> tuple[str, ...]:
    parts = tuple(typed.split("."))
    if len(parts) == 2 and parts[0] == "planner" and parts[1] not in Planner.model_fields:
        return ("planner", "parameters", _algorithm(data, settings), parts[1])
    return parts


def _algorithm(data: Mapping[str, Any], settings: Mapping[str, object]) -> str:
    planner = data.get("planner")
    written = planner.get("algorithm") if isinstance(planner, dict) else None
    return str(settings.get("planner.algorithm") or written or Planner().algorithm)


def _places(path: tuple[str, ...], data: Any) -> Iterator[KeyPath]:
    """The paths in ``data`` that a dotted path means: one, or one an entry where it meets a list."""
    if not path:
        yield ()
        return
    key, rest = path[0], path[1:]
    if isinstance(data, list):
        yield from _in_list(key, rest, data)
    elif isinstance(data, dict):
        inner = data.get(key)
        if inner is None:
            yield path
        else:
            yield from ((key, *place) for place in _places(rest, inner))
    else:
        raise LookupError(f"cannot be set: there are no keys below {data!r:.40}")


def _in_list(key: str, rest: tuple[str, ...], data: list[Any]) -> Iterator[KeyPath]:
    if key == "count":
        raise LookupError(f"cannot be set: the mission lists its {len(data)} vehicles one by one")
    if not key.isdecimal():
        for k, entry in enumerate(data):
            yield from ((k, *place) for place in _places((key, *rest), entry))
    elif int(key) < len(data):
        yield from ((int(key), *place) for place in _places(rest, data[int(key)]))
    else:
        raise LookupError(f"cannot be set: the list has {len(data)} entries, from 0")


def _put(document: Document, path: KeyPath, value: object, typed: str) -> None:
    holder: Any = document.data
    for part in path[:-1]:
        if isinstance(holder, dict) and holder.get(str(part)) is None:
            holder[part] = {}
        holder = holder[part]
    holder[path[-1]] = value
    for old in [other for other in document.marks if other[: len(path)] == path]:
        del document.marks[old]
    document.marks[path] = Mark(None, None, typed)
