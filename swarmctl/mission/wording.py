"""Pydantic's findings in this program's words.

Pydantic says where (a tuple that also names members of unions) and what ("Input should be ..."); here the
place is cut down to keys that are in the file, and the text says what the value must be and what it is.
"""

from typing import Any, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from .errors import Finding, KeyPath, nearest, shown
from .model import Mission, Part, VehicleEntry, VehicleGroup

KINDS = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "string_type": "must be text",
    "finite_number": "must be a finite number",
    "tuple_type": "must be a list",
    "model_type": "must be a mapping of keys",
    "dict_type": "must be a mapping of keys",
    "model_attributes_type": "must be a mapping of keys",
    "string_pattern_mismatch": "is not of the right form",
}
TAGGED: dict[str | int, type[Part]] = {"<mapping>": VehicleGroup, "<list>": VehicleEntry}
"""The forms that ``vehicles`` has; no other union of forms has keys of its own."""


def findings(error: ValidationError, data: Any) -> list[Finding]:
    """One finding for each place that is wrong in ``data``."""
    found: dict[KeyPath, Finding] = {}
    for detail in error.errors(include_url=False):
        path = _path(detail, data)
        found.setdefault(path, Finding(path, _message(detail), _hint(detail, path)))
    # A list with wrong items is also found too short: the items are what is wrong.
    return [finding for path, finding in found.items() if not _short(finding, found)]


def _short(finding: Finding, found: dict[KeyPath, Finding]) -> bool:
    return finding.message.startswith("needs at least") and any(
        len(path) > len(finding.path) and path[: len(finding.path)] == finding.path for path in found
    )


def _path(detail: ErrorDetails, data: Any) -> KeyPath:
    """The keys of pydantic's location that are in ``data``, and the name of one that is missing there."""
    path: list[str | int] = []
    for part in detail["loc"]:
        if isinstance(data, dict) and part in data:
            data = data[str(part)]
        elif isinstance(data, (list, tuple)) and isinstance(part, int) and part < len(data):
            data = data[part]
        elif detail["type"] == "missing" and part == detail["loc"][-1] and isinstance(part, str):
            pass
        else:
            continue
        path.append(part)
    return tuple(path)


def _message(detail: ErrorDetails) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    if kind == "extra_forbidden":
        return "unknown key"
    if kind == "missing":
        return "a value is missing" if isinstance(detail["loc"][-1], int) else "missing"
    if kind == "too_short":
        return f"needs at least {context['min_length']} entries, not {context['actual_length']}"
    if kind == "too_long":
        return f"has {context['actual_length']} entries, at most {context['max_length']} are allowed"
    if kind == "value_error":
        return str(context["error"])
    text = KINDS.get(kind) or detail["msg"].replace("Input should be", "must be", 1)
    return f"{text}, not {shown(detail['input'])}"


def _hint(detail: ErrorDetails, path: KeyPath) -> str:
    if detail["type"] == "extra_forbidden":
        return nearest(str(path[-1]), _keys_at(detail["loc"][:-1]))
    if detail["type"] == "string_type":
        return "put it in quotes"
    if path[-1:] == ("connect",):
        return "as udpin://HOST:PORT, udpout://HOST:PORT, tcp://HOST:PORT or serial:///dev/ttyX:BAUD"
    return ""


def _keys_at(location: tuple[str | int, ...]) -> list[str]:
    """The keys that the model at pydantic's ``location`` has."""
    models: list[type[Part]] = [Mission]
    for part in location:
        if part in TAGGED:
            models = [TAGGED[part]]
        elif isinstance(part, str):
            models = [
                inner
                for model in models
                if part in model.model_fields
                for inner in _models(model.model_fields[part].annotation)
            ]
    return [key for model in models for key in model.model_fields]


def _models(annotation: Any) -> list[type[Part]]:
    """The models that an annotation such as ``tuple[KeepOut, ...]`` speaks of."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return [annotation]
    return [model for inner in get_args(annotation) for model in _models(inner)]
