"""What can go wrong with a vehicle on purpose: named faults that begin, and end if they can.

A fault is begun through `Faults` of a vehicle, or ordered beforehand for a time of the fleet.  On the
command line an order is [ID:]NAME[=VALUE]@T[+SECONDS]: which vehicle (all unless given), how much, when (in
seconds after boot), and for how long (for good unless given).
"""

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .vehicle import StubVehicle


class FaultKind(NamedTuple):
    """How a fault begins and ends; ``value``: how much, unless said; None where there is no how much."""

    begin: Callable[["StubVehicle", float], None]
    end: Callable[["StubVehicle"], None]
    value: float | None = None
    most: float = 1.0


def _marked(vehicle: "StubVehicle", value: float) -> None:
    """The firmware looks for this fault itself, in `Faults`."""


def _unmarked(vehicle: "StubVehicle") -> None:
    """As `_marked`; or an event, which has no end."""


def _impairment(field: str, value: float, most: float = 1.0) -> FaultKind:
    """A fault of the network: one field of its impairments."""
    return FaultKind(
        lambda vehicle, amount: vehicle.network.impair(**{field: amount}),
        lambda vehicle: vehicle.network.impair(**{field: 0.0}),
        value,
        most,
    )


FAULTS: dict[str, FaultKind] = {
    "arming-refused": FaultKind(_marked, _unmarked),
    "battery-collapse": FaultKind(lambda vehicle, _: vehicle.battery.collapse(), _unmarked),
    "gps-loss": FaultKind(lambda vehicle, _: vehicle.lose_fix(), lambda vehicle: vehicle.regain_fix()),
    "ignored-setpoints": FaultKind(_marked, _unmarked),
    "link-loss": FaultKind(
        lambda vehicle, _: vehicle.network.impair(up_cut=True, down_cut=True),
        lambda vehicle: vehicle.network.impair(up_cut=False, down_cut=False),
    ),
    "motor-failure": FaultKind(
        lambda vehicle, _: vehicle.pilot.break_motors(True),
        lambda vehicle: vehicle.pilot.break_motors(False),
    ),
    "packet-delay": _impairment("delay_s", 0.5, 60.0),
    "packet-duplication": _impairment("duplication", 0.2),
    "packet-loss": _impairment("loss", 0.2),
    "packet-reordering": _impairment("reordering", 0.2),
    "reboot": FaultKind(lambda vehicle, _: vehicle.reboot(), _unmarked),
    "stuck-mode": FaultKind(_marked, _unmarked),
}


class FaultOrder(NamedTuple):
    """A fault that is to come: seconds after boot; ``system`` None: every vehicle."""

    name: str
    at_s: float
    for_s: float = math.inf
    value: float | None = None
    system: int | None = None


class Faults:
    """The faults of one vehicle; ``active`` has the names of those that have begun and not ended."""

    def __init__(self, vehicle: "StubVehicle") -> None:
        self.active: set[str] = set()
        self._vehicle = vehicle

    def begin(self, name: str, value: float | None = None) -> None:
        """Begin a fault; raises KeyError for an unknown one."""
        kind = FAULTS[name]
        self.active.add(name)
        kind.begin(self._vehicle, (kind.value or 0.0) if value is None else value)

    def end(self, name: str) -> None:
        """End a fault; raises KeyError for an unknown one."""
        self.active.discard(name)
        FAULTS[name].end(self._vehicle)


NUMBER = r"[0-9]*\.?[0-9]+"
ORDER = re.compile(rf"(?:(\d+):)?([a-z-]+)(?:=({NUMBER}))?@({NUMBER})(?:\+({NUMBER}))?")


def parse_order(text: str) -> FaultOrder:
    """Read [ID:]NAME[=VALUE]@T[+SECONDS]; raises ValueError that says what is wrong."""
    match = ORDER.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not [ID:]NAME[=VALUE]@T[+SECONDS], as in 2:link-loss@30+10")
    system, name, value, at_s, for_s = match.groups()
    if name not in FAULTS:
        raise ValueError(f"no fault {name!r}: there are {', '.join(FAULTS)}")
    kind = FAULTS[name]
    if value is not None and (kind.value is None or float(value) > kind.most):
        limit = "takes no value" if kind.value is None else f"goes from 0 to {kind.most:g}"
        raise ValueError(f"{text!r}: {name} {limit}")
    return FaultOrder(
        name,
        float(at_s),
        math.inf if for_s is None else float(for_s),
        None if value is None else float(value),
        None if system is None else int(system),
    )
