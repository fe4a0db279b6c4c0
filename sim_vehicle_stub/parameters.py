"""The firmware's parameters: typed values, and how they cross the link.

MAVLink carries every parameter in a float field.  PX4 puts an integer's bytes there unchanged; ArduPilot
converts it as C does, and reads back any number whatever type the sender names.
"""

import math
import struct
from collections.abc import Callable, Iterator
from typing import NamedTuple

from swarmctl.mavlink.dialect import mav

REAL32: int = mav.MAV_PARAM_TYPE_REAL32
INT32: int = mav.MAV_PARAM_TYPE_INT32
LARGEST = 2**31 - 1


class Entry(NamedTuple):
    """A parameter as PARAM_VALUE tells it."""

    name: str
    wire_value: float
    wire_type: int
    number: int


class Encoding(NamedTuple):
    """How a firmware's integers cross the link, and whether the type that PARAM_SET names matters."""

    to_wire: Callable[[float], float]
    from_wire: Callable[[float, int], float]
    typed: bool


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


def cast(value: float) -> float:
    """An integer as the float that C makes of it."""
    return float(value)


def uncast(wire_value: float, wire_type: int) -> float:
    """The inverse of `cast`; an integer's fraction goes when it is stored."""
    return wire_value


BYTEWISE = Encoding(to_wire, from_wire, typed=True)
C_CAST = Encoding(cast, uncast, typed=False)


class Parameters:
    """Named values in a fixed order; the type of the initial value is the parameter's type for good."""

    def __init__(self, values: dict[str, float | int], encoding: Encoding = BYTEWISE) -> None:
        self._values = dict(values)
        self._names = list(values)
        self._encoding = encoding

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
        return Entry(name, self._encoding.to_wire(value), wire_type, self._names.index(name))

    def set(self, name: str, value: float) -> None:
        """Set from inside, keeping the type; raises KeyError for an unknown name."""
        self._values[name] = type(self._values[name])(value)

    def set_from_wire(self, name: str, wire_value: float, wire_type: int) -> bool:
        """Set what PARAM_SET carried; False if its type is not the parameter's or it is no number."""
        if self._encoding.typed and wire_type != self.entry(name).wire_type:
            return False
        value = self._encoding.from_wire(wire_value, wire_type)
        if not math.isfinite(value) or (isinstance(self._values[name], int) and abs(value) > LARGEST + 1):
            return False
        self.set(name, value)
        return True
