"""What a vehicle does by itself when something goes wrong, as its parameters say, and what would make that better.

Firmwares say it in parameters of their own, which their adapters translate.  Nothing is changed on a vehicle
unasked: a `Remedy` is carried out only where the operator wants vehicles adapted to the mission.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

Told = Mapping[str, float]
"""What was read of a vehicle's parameters, by the adapter's quantities."""


class Remedy(NamedTuple):
    """A parameter that should have another value, and why."""

    parameter: str
    value: float
    why: str


@dataclass(frozen=True, slots=True)
class Protection:
    """A vehicle's own fence and failsafes, in words for people and figures for checks.

    ``fence_action`` says what leaving the fence does, None if that cannot be read.  ``ceiling_m`` (above home)
    and ``radius_m`` (about home) are limits besides the mission's fence, at which the same happens; None
    without.  ``on_silence`` says what a vehicle does whose controller is gone; ``fatal`` why it must not fly.
    """

    fence_action: str | None
    on_silence: str
    remedies: tuple[Remedy, ...] = ()
    ceiling_m: float | None = None
    radius_m: float | None = None
    unattended: bool = False  #: nothing brings it down when its controller is gone
    setpoint_loss_s: float | None = None
    fatal: str = ""
