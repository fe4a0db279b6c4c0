"""Which adapter belongs to which autopilot, by HEARTBEAT.autopilot."""

from collections.abc import Callable, Mapping

from swarmctl.mavlink.dialect import mav

from .adapter import Adapter
from .ardupilot import ArduPilot
from .px4 import Px4

ADAPTERS: Mapping[int, Callable[[], Adapter]] = {
    mav.MAV_AUTOPILOT_PX4: Px4,
    mav.MAV_AUTOPILOT_ARDUPILOTMEGA: ArduPilot,
}


def adapter_for(autopilot: int) -> Adapter | None:
    """A new adapter for one vehicle of this MAV_AUTOPILOT; None for a firmware that we cannot fly."""
    make = ADAPTERS.get(autopilot)
    return make() if make else None


def autopilot_name(autopilot: int) -> str:
    """The MAV_AUTOPILOT as MAVLink names it, without its prefix."""
    entry = mav.enums["MAV_AUTOPILOT"].get(autopilot)
    return entry.name.removeprefix("MAV_AUTOPILOT_") if entry else f"autopilot {autopilot}"
