"""What a firmware adds to a body and a link; each autopilot is one class of this shape."""

from typing import TYPE_CHECKING, ClassVar, Protocol

from swarmctl.mavlink.codec import Frame

from ..commands import Command
from ..pilot import Limits

if TYPE_CHECKING:
    from ..vehicle import StubVehicle


class Personality(Protocol):
    """One vehicle's firmware: its modes, gates, failsafes and habits."""

    autopilot: int
    version: int
    capabilities: int
    INTERVALS_US: ClassVar[dict[int, int]]
    """Microseconds between two messages of each kind that streams unasked."""

    @staticmethod
    def parameters(limits: Limits) -> dict[str, float]:
        """The parameters at boot; an int is an INT32 for good, a float a REAL32."""

    def __init__(self, vehicle: "StubVehicle") -> None: ...

    @property
    def custom_mode(self) -> int:
        """The mode, as HEARTBEAT tells it."""

    @property
    def base_mode(self) -> int:
        """MAV_MODE_FLAG bits of the mode, without the armed one."""

    @property
    def system_status(self) -> int:
        """MAV_STATE."""

    @property
    def landed_state(self) -> int:
        """MAV_LANDED_STATE."""

    @property
    def ready(self) -> bool:
        """Whether it could be armed."""

    def local_ned(self) -> tuple[float, float, float]:
        """North, east, down (m) in the vehicle's own local frame."""

    def step(self) -> None:
        """Time has passed: go on with the mode, watch the failsafes."""

    def command(self, command: Command) -> None:
        """A command for this vehicle, other than those of the link; must be answered."""

    def setpoint_local(self, frame: Frame) -> None:
        """A SET_POSITION_TARGET_LOCAL_NED for this vehicle."""

    def setpoint_global(self, frame: Frame) -> None:
        """A SET_POSITION_TARGET_GLOBAL_INT for this vehicle."""

    def parameter_changed(self, name: str) -> None:
        """A parameter has a new value."""

    def disarmed(self) -> None:
        """The vehicle has just been disarmed."""
