"""The commands that PX4's commander obeys, and what it answers: one function each, and their table."""

import math
from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING

from swarmctl.core.calls import to_local
from swarmctl.mavlink.dialect import mav

from ..commands import Command, whole

if TYPE_CHECKING:
    from .px4 import Px4

ACCEPTED: int = mav.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mav.MAV_RESULT_TEMPORARILY_REJECTED
DENIED: int = mav.MAV_RESULT_DENIED
UNSUPPORTED: int = mav.MAV_RESULT_UNSUPPORTED
FORCE = 21196
"""Second parameter of a disarm that is to be obeyed in the air."""


class Mode(IntEnum):
    """custom_mode: main mode << 16 | sub mode << 24."""

    OFFBOARD = 0x0060000
    TAKEOFF = 0x2040000
    LOITER = 0x3040000
    RTL = 0x5040000
    LAND = 0x6040000


def set_mode(px4: "Px4", command: Command) -> int:
    """The link layer accepts it at once; what this returns is the commander's own word."""
    px4.vehicle.answer(command, ACCEPTED)
    main, sub = whole(command.p2), whole(command.p3) or 0
    try:
        mode = Mode((main or 0) << 16 | sub << 24)
    except ValueError:
        return DENIED
    if mode is Mode.TAKEOFF:
        px4.takeoff_height = px4.default_takeoff_height
    return px4.order(mode)


def takeoff(px4: "Px4", command: Command) -> int:
    """Up to an altitude above sea level, whatever frame the command names."""
    zero = px4.vehicle.zero_amsl_m
    px4.takeoff_height = command.z - zero if math.isfinite(command.z) else px4.default_takeoff_height
    return px4.order(Mode.TAKEOFF)


def land(px4: "Px4", command: Command) -> int:
    """Land here."""
    return px4.order(Mode.LAND)


def return_home(px4: "Px4", command: Command) -> int:
    """Return and land."""
    return px4.order(Mode.RTL)


def loiter(px4: "Px4", command: Command) -> int:
    """Stay here."""
    return px4.order(Mode.LOITER)


def reposition(px4: "Px4", command: Command) -> int:
    """Loiter at another place; the altitude is above sea level. NaN keeps what is."""
    change_mode = (whole(command.p2) or 0) & mav.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
    if px4.mode is not Mode.LOITER and not change_mode:
        return ACCEPTED
    result = px4.order(Mode.LOITER)
    vehicle = px4.vehicle
    if result == ACCEPTED and not vehicle.landed:
        if math.isfinite(command.x) and math.isfinite(command.y):
            vehicle.pilot.go_to(*to_local(command.x, command.y, *vehicle.fleet_origin))
        if math.isfinite(command.z):
            vehicle.pilot.height(command.z - vehicle.zero_amsl_m)
    return result


def arm_or_disarm(px4: "Px4", command: Command) -> int:
    """Arm when ready; disarm on the ground, or in the air by force."""
    vehicle = px4.vehicle
    wanted = command.p1 == 1.0
    if wanted == vehicle.armed:
        return ACCEPTED
    if wanted:
        return px4.arm()
    if not vehicle.landed and command.p2 != FORCE:
        vehicle.say(mav.MAV_SEVERITY_CRITICAL, "Disarming denied: not landed")
        return TEMPORARILY_REJECTED
    vehicle.disarm()
    return ACCEPTED


def reboot(px4: "Px4", command: Command) -> int:
    """Start anew, unless armed."""
    if px4.vehicle.armed or command.p1 != 1.0:
        return DENIED
    px4.vehicle.reboot()
    return ACCEPTED


COMMANDS: dict[int, Callable[["Px4", Command], int]] = {
    mav.MAV_CMD_DO_SET_MODE: set_mode,
    mav.MAV_CMD_COMPONENT_ARM_DISARM: arm_or_disarm,
    mav.MAV_CMD_NAV_TAKEOFF: takeoff,
    mav.MAV_CMD_NAV_LAND: land,
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: return_home,
    mav.MAV_CMD_NAV_LOITER_UNLIM: loiter,
    mav.MAV_CMD_DO_REPOSITION: reposition,
    mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: reboot,
}
