"""The firmware's parameters: typed values, and how they cross the link.

MAVLink carries every parameter in a float field.  PX4 puts an integer's bytes there unchanged.
"""

import struct
from collections.abc import Iterator
from typing import NamedTuple

from swarmctl.mavlink.dialect import mav

REAL32: int = mav.MAV_PARAM_TYPE_REAL32
INT32: int = mav.MAV_PARAM_TYPE_INT32


class Entry(NamedTuple):
    """A parameter as PARAM_VALUE tells it."""

    name: str
    wire_value: float
    wire_type: int
    number: int


def to_wire(value: float) -> float:
    """An integer's bytes read as a float; a float stays itself."""
    if isinstance(value, int):
        (as_float,) = struct.unpack("<f", struct.pack("<i", value))
        return float(as_float)
    return value


def from_wire(wire_value: float, wire_type: int) -> float | int:
    """The inverse of `to_wire`."""
    if wire_type == INT32:
        (as_integer,) = struct.unpack("<i", struct.pack("<f", wire_value))
        return int(as_integer)
    return wire_value


class Parameters:
    """Named values in a fixed order; the type of the initial value is the parameter's type for good."""

    def __init__(self, values: dict[str, float | int]) -> None:
        self._values = dict(values)
        self._names = list(values)

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[Entry]:
        return (self.entry(name) for name in self._names)

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def name_at(self, index: int) -> str | None:
        """The name of the parameter with this index, if there is one."""
        return self._names[index] if 0 <= index < len(self._names) else None

    def entry(self, name: str) -> Entry:
        """The parameter as the link carries it; raises KeyError for an unknown name."""
        value = self._values[name]
        wire_type = INT32 if isinstance(value, int) else REAL32
        return Entry(name, to_wire(value), wire_type, self._names.index(name))

    def set(self, name: str, value: float) -> None:
        """Set from inside, keeping the type; raises KeyError for an unknown name."""
        self._values[name] = type(self._values[name])(value)

    def set_from_wire(self, name: str, wire_value: float, wire_type: int) -> bool:
        """Set what PARAM_SET carried; False if its type is not the parameter's or it is no number."""
        if wire_type != self.entry(name).wire_type:
            return False
        value = from_wire(wire_value, wire_type)
        if value != value or value in (float("inf"), float("-inf")):
            return False
        self._values[name] = value
        return True
