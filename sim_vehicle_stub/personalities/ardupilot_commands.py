"""The commands that ArduCopter obeys, and what it answers: one function each, and their table."""

import math
from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING

from swarmctl.core.calls import to_local
from swarmctl.mavlink.dialect import mav

from ..commands import Command, whole

if TYPE_CHECKING:
    from .ardupilot import ArduPilot

ACCEPTED: int = mav.MAV_RESULT_ACCEPTED
DENIED: int = mav.MAV_RESULT_DENIED
UNSUPPORTED: int = mav.MAV_RESULT_UNSUPPORTED
FAILED: int = mav.MAV_RESULT_FAILED
FORCE_ARMING, FORCE_DISARMING = 2989, 21196
"""Second parameter of an arming or disarming that asks no questions."""
SEA_LEVEL_FRAMES = frozenset({mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT})


class Mode(IntEnum):
    """custom_mode."""

    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    LAND = 9
    BRAKE = 17
    SMART_RTL = 21


def set_mode(autopilot: "ArduPilot", command: Command) -> int:
    """Change the mode."""
    try:
        mode = Mode(whole(command.p2) or 0)
    except ValueError:
        return FAILED
    return autopilot.order(mode)


def takeoff(autopilot: "ArduPilot", command: Command) -> int:
    """Up to a height above home, armed in GUIDED and on the ground."""
    if not math.isfinite(command.z) or command.z <= 0.0:
        return FAILED
    return autopilot.take_off(command.z)


def land(autopilot: "ArduPilot", command: Command) -> int:
    """Land here."""
    return autopilot.order(Mode.LAND)


def return_home(autopilot: "ArduPilot", command: Command) -> int:
    """Return and land."""
    return autopilot.order(Mode.RTL)


def loiter(autopilot: "ArduPilot", command: Command) -> int:
    """The pilot's LOITER, which sinks while no pilot holds the stick."""
    return autopilot.order(Mode.LOITER)


def reposition(autopilot: "ArduPilot", command: Command) -> int:
    """Go to another place in GUIDED; the altitude is above home unless the frame says sea level."""
    change_mode = (whole(command.p2) or 0) & mav.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
    if autopilot.mode is not Mode.GUIDED and not change_mode:
        return DENIED
    vehicle = autopilot.vehicle
    if not all(math.isfinite(value) for value in (command.x, command.y, command.z)) or vehicle.landed:
        return DENIED
    result = autopilot.order(Mode.GUIDED)
    if result == ACCEPTED:
        base = 0.0 if command.frame in SEA_LEVEL_FRAMES or vehicle.home is None else vehicle.home[2]
        vehicle.pilot.go_to(*to_local(command.x, command.y, *vehicle.fleet_origin))
        vehicle.pilot.height(command.z + base - vehicle.zero_amsl_m)
    return result


def arm_or_disarm(autopilot: "ArduPilot", command: Command) -> int:
    """Arm when the checks pass; disarm on the ground, or in the air by force."""
    vehicle = autopilot.vehicle
    wanted = command.p1 == 1.0
    if wanted == vehicle.armed:
        return ACCEPTED
    if wanted:
        return autopilot.arm(force=command.p2 == FORCE_ARMING)
    if not vehicle.landed and command.p2 != FORCE_DISARMING:
        return FAILED
    vehicle.disarm()
    return ACCEPTED


def reboot(autopilot: "ArduPilot", command: Command) -> int:
    """Start anew, unless armed."""
    if autopilot.vehicle.armed or command.p1 != 1.0:
        return FAILED
    autopilot.vehicle.reboot()
    return ACCEPTED


def enable_fence(autopilot: "ArduPilot", command: Command) -> int:
    """Switch the fence on or off."""
    autopilot.values.set("FENCE_ENABLE", 1 if command.p1 == 1.0 else 0)
    return ACCEPTED


COMMANDS: dict[int, Callable[["ArduPilot", Command], int]] = {
    mav.MAV_CMD_DO_SET_MODE: set_mode,
    mav.MAV_CMD_COMPONENT_ARM_DISARM: arm_or_disarm,
    mav.MAV_CMD_NAV_TAKEOFF: takeoff,
    mav.MAV_CMD_NAV_LAND: land,
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: return_home,
    mav.MAV_CMD_NAV_LOITER_UNLIM: loiter,
    mav.MAV_CMD_DO_REPOSITION: reposition,
    mav.MAV_CMD_DO_FENCE_ENABLE: enable_fence,
    mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: reboot,
}
