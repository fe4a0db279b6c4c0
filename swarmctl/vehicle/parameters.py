"""Reading and setting the firmware's parameters: the names it may know them by, and how a value crosses the link.

A quantity is asked for by all its names at once, because firmwares rename their parameters and answer an
unknown name with PARAM_ERROR or not at all.  MAVLink carries every value in a float field: PX4 puts an
integer's bytes there, ArduPilot its number.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

from .commands import AUTOPILOT_COMPONENT

PARAM_VALUE: int = mav.MAVLINK_MSG_ID_PARAM_VALUE
PARAM_ERROR: int = mav.MAVLINK_MSG_ID_PARAM_ERROR
_V1 = 0xFE
_V1_HEADER, _V2_HEADER = 6, 10

# struct formats of the integer types, which begin at the first byte of the field.
_INTEGERS: Mapping[int, str] = {
    mav.MAV_PARAM_TYPE_UINT8: "<B",
    mav.MAV_PARAM_TYPE_INT8: "<b",
    mav.MAV_PARAM_TYPE_UINT16: "<H",
    mav.MAV_PARAM_TYPE_INT16: "<h",
    mav.MAV_PARAM_TYPE_UINT32: "<I",
    mav.MAV_PARAM_TYPE_INT32: "<i",
}


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something a parameter tells, ``name`` with its unit; ``spellings``: parameter → factor to that unit."""

    name: str
    spellings: Mapping[str, float]


class ParameterRead(NamedTuple):
    """Asks for parameters by name."""

    names: tuple[str, ...]

    @property
    def name(self) -> str:
        """For reports."""
        return f"PARAM_REQUEST_READ {' or '.join(self.names)}"

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """One PARAM_REQUEST_READ a name."""
        return tuple(
            mav.MAVLink_param_request_read_message(system, AUTOPILOT_COMPONENT, name.encode(), -1)
            for name in self.names
        )


class Parameters:
    """What the vehicle has told of its parameters."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}  #: by the parameter's own name, in its own unit
        self.types: dict[str, int] = {}  #: MAV_PARAM_TYPE of each
        self.absent: set[str] = set()  #: names that the vehicle says it does not have

    def take(self, frame: Frame, bytewise: bool) -> None:
        """Take in a PARAM_VALUE or PARAM_ERROR; ``bytewise``: how this firmware sends its integers."""
        if frame.message_id == PARAM_VALUE:
            name = _text(frame.fields.param_id)
            self.values[name] = _value(frame, bytewise)
            self.types[name] = frame.fields.param_type
        else:
            self.absent.add(_text(frame.fields.param_id))

    def get(self, quantity: Quantity) -> float | None:
        """The quantity's value, from the first of its spellings that the vehicle told; None if none."""
        for name, factor in quantity.spellings.items():
            if name in self.values:
                return self.values[name] * factor
        return None

    def refusal(self, quantity: Quantity) -> str:
        """Why the quantity cannot be had: the vehicle has no parameter of these names; or nothing."""
        return "the vehicle has no such parameter" if self.absent.issuperset(quantity.spellings) else ""


class ParameterWrite(NamedTuple):
    """Sets a parameter, with the type that the vehicle has told of it."""

    parameter: str
    value: float
    known: Parameters
    bytewise: bool

    @property
    def name(self) -> str:
        """For reports."""
        return f"PARAM_SET {self.parameter} {self.value:g}"

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """PARAM_SET, which is answered with the value that the parameter then has."""
        kind = self.known.types.get(self.parameter, mav.MAV_PARAM_TYPE_REAL32)
        code = _INTEGERS.get(kind)
        value = self.value
        if code is not None and self.bytewise:
            (value,) = struct.unpack("<f", struct.pack(code, round(self.value)).ljust(4, b"\0"))
        name = self.parameter.encode()
        return (mav.MAVLink_param_set_message(system, AUTOPILOT_COMPONENT, name, value, kind),)


def _text(name: str | bytes) -> str:
    """A parameter's name, whichever way the decoder gives it."""
    text = name.decode("ascii", "replace") if isinstance(name, bytes) else name
    return text.rstrip("\0")


def _value(frame: Frame, bytewise: bool) -> float:
    """The value of a PARAM_VALUE.  An integer's bytes are read from the frame: as a float they may be NaN."""
    code = _INTEGERS.get(frame.fields.param_type)
    if code is None or not bytewise:
        return float(frame.fields.param_value)
    start = _V1_HEADER if frame.raw[0] == _V1 else _V2_HEADER
    (value,) = struct.unpack_from(code, frame.raw, start)
    return float(value)
