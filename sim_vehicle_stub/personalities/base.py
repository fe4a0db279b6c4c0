"""What a firmware adds to a body and a link; each autopilot is one class of this shape."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Protocol

from swarmctl.mavlink.codec import Frame

from ..commands import Command
from ..parameters import Encoding
from ..pilot import Limits
from ..wire import Wire

if TYPE_CHECKING:
    from ..vehicle import StubVehicle


class Personality(Protocol):
    """One vehicle's firmware: its modes, gates, failsafes and habits."""

    autopilot: int
    version: int
    capabilities: int
    LIMITS: Limits
    """What a vehicle can do unless told otherwise."""
    ENCODING: Encoding
    """How integer parameters cross the link."""
    INTERVALS_US: ClassVar[Mapping[int, int]]
    """Microseconds between two messages of each kind that streams unasked."""
    DATA_STREAMS: ClassVar[Mapping[int, tuple[int, ...]]]
    """The groups of messages that REQUEST_DATA_STREAM knows."""
    LOCATED_AFTER_S: float
    HOME_AFTER_S: float
    QUIET_FOR_S: float
    """After boot: until the own position is known, home is set, and the first heartbeat is sent."""
    TEXT_END: str
    """What ends a STATUSTEXT."""
    texts_need_gcs: bool
    requests_integers: bool
    """Whether a plan is asked for with MISSION_REQUEST_INT."""
    answers_any_component: bool
    TAKES_KEYS: bool
    """Whether SETUP_SIGNING is understood."""
    tells_parameter_errors: bool
    shows_prearm: bool
    """Whether SYS_STATUS has the pre-arm check among the sensors present and enabled."""
    no_such_message: int
    """MAV_RESULT of a request for a message that it does not have, or not yet."""
    announces_origin: bool
    """Whether GPS_GLOBAL_ORIGIN is sent, once, when the position is found."""

    @staticmethod
    def parameters(limits: Limits) -> dict[str, float]:
        """The parameters at boot; an int is an INT32 for good, a float a REAL32."""

    @staticmethod
    def split_mode(number: int) -> tuple[float, float]:
        """DO_SET_MODE's second and third parameter for a custom mode."""

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
        """Whether it could be armed, as SYS_STATUS tells."""

    @property
    def fence_bits(self) -> tuple[int, int, int]:
        """MAV_SYS_STATUS_GEOFENCE or 0, as SYS_STATUS tells the fence: present, enabled, healthy."""

    def unsure_position(self) -> Wire | None:
        """GLOBAL_POSITION_INT from `lat` to `vz` while the position is not known; None: not sent."""

    def local_ned(self) -> tuple[float, float, float]:
        """North, east, down (m) in the vehicle's own local frame."""

    def is_ground_station(self, system: int) -> bool:
        """Whether a ground station with this system id counts for the loss of its link."""

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

    def fence_changed(self) -> None:
        """Another fence is on board, or none."""

    def disarmed(self) -> None:
        """The vehicle has just been disarmed."""
