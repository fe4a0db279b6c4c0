"""What is done with a vehicle on the ground before it may fly: parameters read, its own fence set.

``Preflight`` is what the caller wants; ``Checks`` carries it out for one vehicle and keeps what was found.
"""

from dataclasses import dataclass

from swarmctl.mavlink.codec import Frame

from .autopilots.adapter import Adapter
from .fence import FENCE_MESSAGES, Fence, FenceReading, FenceTransfer, FenceUpload
from .link import GROUND_COMPONENT, GROUND_SYSTEM, Link
from .parameters import (
    PARAM_ERROR,
    PARAM_VALUE,
    ParameterRead,
    Parameters,
    ParameterWrite,
    Quantity,
)
from .protection import Remedy
from .settings import SessionSettings
from .steps import OnFailure, Step


@dataclass(frozen=True, slots=True)
class Preflight:
    """What to do before READY.  The fence is the firmware's own; None leaves it as it is.

    ``remedies``: parameters to set, of those that were read before.
    ``upload``: set the fence; else it must be on board already, as in the air, where nobody changes it.
    """

    read_parameters: bool = False
    fence: Fence | None = None
    remedies: tuple[Remedy, ...] = ()
    upload: bool = True


class Checks:
    """One vehicle's preflight: makes the steps, takes in what answers them."""

    def __init__(self, preflight: Preflight, link: Link, settings: SessionSettings) -> None:
        self.parameters = Parameters()
        self.transfer: FenceTransfer | None = None
        self._preflight = preflight
        self._link = link
        self._settings = settings

    def want(self, preflight: Preflight) -> None:
        """From now on this is to be done."""
        self._preflight = preflight

    def forget(self) -> None:
        """The vehicle may have restarted: nothing is known of it."""
        self.parameters = Parameters()
        self.transfer = None

    def begin(self, adapter: Adapter) -> tuple[Step, ...]:
        """The steps: the parameters that are not known yet, those to be set, then the fence."""
        steps: list[Step] = []
        if self._preflight.read_parameters:
            unknown = (q for q in adapter.quantities if self.parameters.get(q) is None)
            steps += [self._reading(quantity) for quantity in unknown]
        steps += [self._setting(remedy, adapter.integers_bytewise) for remedy in self._preflight.remedies]
        if self._preflight.fence is not None:
            steps += self._fencing(self._preflight.fence)
        return tuple(steps)

    def _reading(self, quantity: Quantity) -> Step:
        """One quantity by all its names; a vehicle without it can still be flown."""
        return Step(
            quantity.name,
            self._settings.parameter_patience_s,
            command=ParameterRead(tuple(quantity.spellings)),
            confirmed=lambda t: self.parameters.get(quantity) is not None,
            failed=lambda: self.parameters.refusal(quantity),
            insists=True,
            on_failure=OnFailure.WARN,
        )

    def _setting(self, remedy: Remedy, bytewise: bool) -> Step:
        """One parameter set, by the vehicle's own word."""
        name, value = remedy.parameter, remedy.value
        return Step(
            f"{name} {value:g}",
            self._settings.parameter_patience_s,
            command=ParameterWrite(name, value, self.parameters, bytewise),
            confirmed=lambda t: self.parameters.values.get(name) == value,
            insists=True,
        )

    def _fencing(self, fence: Fence) -> tuple[Step, ...]:
        """Upload, read back, compare; each may take the time of all its messages."""
        transfer = self.transfer = FenceTransfer(fence, self._link.system)
        wait = self._settings.transfer_timeout_s
        patience = (len(transfer.vertices) + 20) * wait
        upload = Step(
            "fence upload", patience, command=FenceUpload(transfer), confirmed=lambda t: transfer.stored,
            failed=lambda: transfer.refusal, insists=True, answer_s=wait,
        )  # fmt: skip
        reading = Step(
            "fence read back", patience, command=FenceReading(transfer), confirmed=lambda t: transfer.verified,
            failed=transfer.difference, insists=True,
        )  # fmt: skip
        return (upload, reading) if self._preflight.upload else (reading,)

    def take(self, frame: Frame, bytewise: bool) -> bool:
        """Take in a message of these exchanges and reply; whether it was one."""
        if frame.message_id in (PARAM_VALUE, PARAM_ERROR):
            self.parameters.take(frame, bytewise)
            return True
        if frame.message_id not in FENCE_MESSAGES or self.transfer is None:
            return False
        to = (frame.fields.target_system, frame.fields.target_component)
        if to[0] not in (0, GROUND_SYSTEM) or to[1] not in (0, GROUND_COMPONENT):
            return False
        for reply in self.transfer.take(frame.message_id, frame.fields):
            self._link.send_message(reply)
        return True
