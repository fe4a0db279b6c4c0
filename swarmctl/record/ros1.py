"""NumPy record types as ROS 1 message definitions, and back.

A packed little-endian NumPy record holds exactly the bytes that ROS 1 serialises for a message of the same
fixed-size fields.  So the log stores our arrays as they lie in memory, viewers read them as ROS 1 messages,
and we read them back with ``np.frombuffer``, with the type rebuilt from the text stored in the file.
ROS 1 arrays have one dimension: arrays of more are flattened, their shape kept in a comment.
"""

import re
from typing import Any

import numpy as np

Dtype = np.dtype[Any]

PACKAGE = "swarmctl"
SCALARS = {
    "bool": "|b1",
    "int8": "|i1",
    "uint8": "|u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}
NAMES = {np.dtype(code): name for name, code in SCALARS.items()}
RULE = "=" * 80
FIELD = re.compile(r"(?P<type>[\w/]+)(\[(?P<size>\d*)\])? +(?P<name>\w+)( *# shape (?P<shape>[\dx]+))?")
FIELD_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)


def ros1_definition(dtype: Dtype) -> str:
    """The message definition of a packed record type; nested records follow as messages of their own.

    Raises ValueError for what ROS 1 cannot hold: padding, big-endian numbers, text, objects, no fields.
    """
    sections: dict[str, Dtype] = {}
    text = _body(dtype, sections)
    return text + _sections_text(sections)


def rows_definition(dtype: Dtype, header: str) -> str:
    """The definition of a message of ``header`` lines, then ``rows``: any number of records of ``dtype``."""
    sections: dict[str, Dtype] = {}
    text = f"{header}{_type_name(dtype, 'row', sections)}[] rows\n"
    return text + _sections_text(sections)


def dtype_of(definition: str) -> Dtype:
    """The packed record type of a definition; the inverse of :func:`ros1_definition`.

    Raises ValueError for a definition that has no such type.
    """
    main, sections = _split(definition)
    return _record(main, sections)


def rows_dtype(definition: str, header: str) -> Dtype:
    """The type of one row; the inverse of :func:`rows_definition`, and ValueError for other definitions."""
    main, sections = _split(definition)
    found = FIELD.fullmatch(main.removeprefix(header).strip())
    if not main.startswith(header) or found is None or found["size"] != "" or found["name"] != "rows":
        raise ValueError("not a message of rows")
    return _named(found["type"], sections)


def _sections_text(sections: dict[str, Dtype]) -> str:
    """The messages that others refer to; describing one may add more, which are then described too."""
    parts: list[str] = []
    while len(parts) < len(sections):
        name, dtype = list(sections.items())[len(parts)]
        parts.append(f"{RULE}\nMSG: {name}\n{_body(dtype, sections)}")
    return "".join(parts)


def _body(dtype: Dtype, sections: dict[str, Dtype]) -> str:
    """One line a field."""
    if not dtype.names:
        raise ValueError(f"{dtype}: a record type with at least one field is needed")
    lines = []
    end = 0
    for name in dtype.names:
        field, offset = dtype.fields[name][:2]  # type: ignore[index]  # a dtype with names has fields
        if offset != end or not FIELD_NAME.fullmatch(name):
            raise ValueError(f"{name}: fields must be packed, in order, and have plain ASCII names")
        end += field.itemsize
        lines.append(f"{_type_name(field.base, name, sections)}{_array(field.shape, name)}\n")
    if end != dtype.itemsize:
        raise ValueError(f"{dtype}: padding after the last field")
    return "".join(lines)


def _array(shape: tuple[int, ...], name: str) -> str:
    """What follows a field's type: the number of elements, the name, and the shape of more dimensions."""
    if not shape:
        return f" {name}"
    size = int(np.prod(shape))
    if size == 0:
        raise ValueError(f"{name}: an empty array")
    comment = f"  # shape {'x'.join(map(str, shape))}" if len(shape) > 1 else ""
    return f"[{size}] {name}{comment}"


def _type_name(dtype: Dtype, field: str, sections: dict[str, Dtype]) -> str:
    """The name of a scalar, or of a message named after its field, which joins ``sections``."""
    if dtype.names is None:
        if dtype not in NAMES:
            raise ValueError(f"{field}: {dtype} is not a little-endian number")
        return NAMES[dtype]
    plain = "".join(part[:1].upper() + part[1:] for part in field.split("_")) or "Record"
    name, number = f"{PACKAGE}/{plain}", 1
    while name in sections and sections[name] != dtype:
        number += 1
        name = f"{PACKAGE}/{plain}{number}"
    sections[name] = dtype
    return name


def _split(definition: str) -> tuple[str, dict[str, str]]:
    """The main message's lines, and those of the messages that follow, by name."""
    main, *others = definition.split(f"{RULE}\nMSG: ")
    sections = {}
    for other in others:
        name, _, body = other.partition("\n")
        sections[name] = body
    return main, sections


def _record(body: str, sections: dict[str, str]) -> Dtype:
    """The record type of one message's lines."""
    fields: list[tuple[str, Dtype, tuple[int, ...]]] = []
    for line in body.splitlines():
        found = FIELD.fullmatch(line.strip())
        if found is None or found["size"] == "":
            raise ValueError(f"{line!r} is not a field of fixed size")
        size, shape = found["size"], found["shape"]
        dimensions = tuple(map(int, shape.split("x"))) if shape else (int(size),) if size else ()
        fields.append((found["name"], _named(found["type"], sections), dimensions))
    if not fields:
        raise ValueError("a message without fields")
    return np.dtype(fields)


def _named(name: str, sections: dict[str, str]) -> Dtype:
    """A scalar or a message by its name; a message may use only those after it, so that reading ends."""
    if name in SCALARS:
        return np.dtype(SCALARS[name])
    if name not in sections:
        raise ValueError(f"unknown type {name}")
    others = {other: body for other, body in sections.items() if other != name}
    return _record(sections[name], others)
