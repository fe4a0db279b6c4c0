"""What the session must know of a firmware, and nothing else of the program ever asks.

Firmwares differ in mode numbers, in the order and the altitude frame of take-off, in which setpoints they
fly, in when they can be armed and in what their parameters are called.  An adapter holds all of that; it
belongs to one vehicle, because some gates are a matter of several messages.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from swarmctl.mavlink.codec import Encoder
from swarmctl.vehicle.commands import Command
from swarmctl.vehicle.parameters import Quantity
from swarmctl.vehicle.protection import Protection, Told
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.steps import Step
from swarmctl.vehicle.telemetry import Telemetry


@dataclass(frozen=True, slots=True)
class Modes:
    """HEARTBEAT.custom_mode of the modes that the session uses, and names for those it may meet.

    ``take_off`` is what the vehicle shows while it climbs, ``engaged`` while it flies our setpoints,
    ``comeback`` is the firmware's own return, ``parked`` is left behind after landing: arming is harmless.
    ``failsafes`` are others that a failsafe may choose.
    """

    take_off: int
    hold: int
    engaged: int
    land: int
    comeback: int
    parked: int
    names: Mapping[int, str]
    failsafes: tuple[int, ...] = ()

    @property
    def unattended(self) -> frozenset[int]:
        """In which nobody has a hand on the stick: ours, and those that a failsafe chooses."""
        return frozenset((self.take_off, self.hold, self.engaged, self.land, self.comeback, *self.failsafes))

    def name(self, mode: int) -> str:
        """The mode's name, or its number."""
        return self.names.get(mode, f"mode {mode:#x}")


@dataclass(frozen=True, slots=True)
class Limits:
    """How the vehicle comes from its speed to standstill, for the guard, which must never be too hopeful.

    After ``latency_s`` it follows a velocity with a first-order lag of ``lag_s``, and gets slower by
    ``braking_mps2`` at most (core/motion.py).
    """

    braking_mps2: float
    latency_s: float
    lag_s: float = 0.0


class Adapter(Protocol):
    """One firmware's ways, for one vehicle."""

    @property
    def name(self) -> str:
        """As in ``--autopilot``: px4, ardupilot."""

    @property
    def modes(self) -> Modes:
        """Its mode numbers."""

    @property
    def limits(self) -> Limits:
        """Its braking."""

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The parameters that bound its motion and say what its failsafes do."""

    def protection(self, told: Told) -> Protection:
        """What its parameters make of its fence and its failsafes."""

    @property
    def integers_bytewise(self) -> bool:
        """Whether PARAM_VALUE carries an integer's bytes, or its number as a float."""

    @property
    def extra_rates(self) -> Mapping[int, float]:
        """Message id → Hz of what ``observe`` needs, besides what every session asks for."""

    @property
    def needs_origin(self) -> bool:
        """Whether setpoints are counted from the vehicle's own local origin."""

    @property
    def unwanted_messages(self) -> tuple[int, ...]:
        """The ids of messages that it sends unasked, often, and that nobody here reads."""

    def set_mode(self, mode: int) -> Command:
        """The command that changes to one of ``modes``."""

    def prepare(self, settings: SessionSettings) -> tuple[Step, ...]:
        """The steps without which a vehicle that stands disarmed never says that it is ready to arm."""

    def take_off(
        self, telemetry: Telemetry, altitude_m: float, settings: SessionSettings
    ) -> tuple[Step, ...]:
        """The steps from standing disarmed to climbing, for ``altitude_m`` above home."""

    def setpoint(
        self,
        encoder: Encoder,
        system: int,
        telemetry: Telemetry,
        velocity_en: tuple[float, float],
        height_m: float,
    ) -> bytes:
        """The frame that asks for an east-north velocity (m/s) at a height above home (m)."""

    def observe(self, message_id: int, fields: Any, telemetry: Telemetry) -> None:
        """Take in any message, after ``telemetry`` has; sets ``telemetry.healthy`` once the vehicle can be armed."""
