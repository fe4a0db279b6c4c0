"""COMMAND_LONG and COMMAND_INT as one thing, and those commands that every autopilot answers alike."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

if TYPE_CHECKING:
    from .vehicle import StubVehicle

NO_PLACE = 0x7FFFFFFF
"""What COMMAND_INT carries for a latitude or longitude that is not given."""
DEGREE_FRAMES = frozenset(
    getattr(mav, f"MAV_FRAME_GLOBAL{suffix}")
    for suffix in ("", "_INT", "_RELATIVE_ALT", "_RELATIVE_ALT_INT", "_TERRAIN_ALT", "_TERRAIN_ALT_INT")
)


class Command(NamedTuple):
    """A command; parameters that are not used may be NaN. ``x``, ``y``: latitude, longitude in degrees."""

    number: int
    p1: float
    p2: float
    p3: float
    p4: float
    x: float
    y: float
    z: float
    sender_system: int
    sender_component: int
    frame: int = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT


def from_long(frame: Frame) -> Command:
    """Read a COMMAND_LONG."""
    f = frame.fields
    return Command(
        f.command, f.param1, f.param2, f.param3, f.param4, f.param5, f.param6, f.param7,
        frame.system, frame.component,
    )  # fmt: skip


def from_int(frame: Frame) -> Command:
    """Read a COMMAND_INT."""
    f = frame.fields
    scale = 1e-7 if f.frame in DEGREE_FRAMES else 1.0
    x, y = (math.nan if value == NO_PLACE else value * scale for value in (f.x, f.y))
    return Command(
        f.command, f.param1, f.param2, f.param3, f.param4, x, y, f.z, frame.system, frame.component, f.frame
    )  # fmt: skip


def from_set_mode(frame: Frame, split_mode: Callable[[int], tuple[float, float]]) -> Command:
    """Read a SET_MODE as a DO_SET_MODE, whose parameters hold the mode's number in the firmware's way."""
    f = frame.fields
    main, sub = split_mode(f.custom_mode)
    none = math.nan
    return Command(
        mav.MAV_CMD_DO_SET_MODE, f.base_mode, main, sub, none, none, none, none, frame.system, frame.component
    )  # fmt: skip


def whole(value: float) -> int | None:
    """A parameter that should be a whole number; None if it is not one."""
    return int(value) if math.isfinite(value) and value == int(value) else None


def set_message_interval(vehicle: "StubVehicle", command: Command) -> int:
    """MAV_CMD_SET_MESSAGE_INTERVAL: the answer's MAV_RESULT."""
    message_id, interval = whole(command.p1), whole(command.p2)
    if message_id is None or interval is None or not vehicle.can_send(message_id):
        return int(mav.MAV_RESULT_FAILED)
    vehicle.set_interval(message_id, interval)
    return int(mav.MAV_RESULT_ACCEPTED)


def request_message(vehicle: "StubVehicle", command: Command) -> int:
    """MAV_CMD_REQUEST_MESSAGE: the answer's MAV_RESULT."""
    return _tell(vehicle, whole(command.p1))


def get_message_interval(vehicle: "StubVehicle", command: Command) -> int:
    """MAV_CMD_GET_MESSAGE_INTERVAL: the answer's MAV_RESULT."""
    message_id = whole(command.p1)
    if message_id is None or not 0 <= message_id <= 0xFFFF:
        return int(mav.MAV_RESULT_FAILED)
    interval = vehicle.interval_us(message_id)
    vehicle.send_message(mav.MAVLink_message_interval_message(message_id, interval))
    return int(mav.MAV_RESULT_ACCEPTED)


def tell_version(vehicle: "StubVehicle", command: Command) -> int:
    """MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, the older way to ask for AUTOPILOT_VERSION."""
    return _tell(vehicle, mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)


def tell_home(vehicle: "StubVehicle", command: Command) -> int:
    """MAV_CMD_GET_HOME_POSITION, the older way to ask for HOME_POSITION."""
    return _tell(vehicle, mav.MAVLINK_MSG_ID_HOME_POSITION)


def _tell(vehicle: "StubVehicle", message_id: int | None) -> int:
    """Send a message that was asked for: the answer's MAV_RESULT."""
    sent = message_id is not None and vehicle.send(message_id)
    return int(mav.MAV_RESULT_ACCEPTED) if sent else vehicle.personality.no_such_message


LINK_COMMANDS: dict[int, Any] = {
    mav.MAV_CMD_SET_MESSAGE_INTERVAL: set_message_interval,
    mav.MAV_CMD_GET_MESSAGE_INTERVAL: get_message_interval,
    mav.MAV_CMD_REQUEST_MESSAGE: request_message,
    mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: tell_version,
    mav.MAV_CMD_GET_HOME_POSITION: tell_home,
}
