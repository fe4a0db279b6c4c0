"""MAVLink commands as values, with names that a reader of a failure understands."""

import math
from typing import Any, NamedTuple, Protocol

from swarmctl.mavlink.dialect import mav

AUTOPILOT_COMPONENT: int = mav.MAV_COMP_ID_AUTOPILOT1
CUSTOM_MODE_ENABLED: int = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
ACCEPTED: int = mav.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mav.MAV_RESULT_TEMPORARILY_REJECTED
IN_PROGRESS: int = mav.MAV_RESULT_IN_PROGRESS

Parameters = tuple[float, float, float, float, float, float, float]


class Ask(Protocol):
    """What is sent to bring something about, and sent again until the vehicle shows that it has."""

    @property
    def name(self) -> str:
        """For reports."""

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """The messages to the vehicle ``system``, asked for the (``confirmation`` + 1)th time."""


class Command(NamedTuple):
    """A COMMAND_LONG: its MAV_CMD number, its seven parameters, and a name for reports."""

    number: int
    parameters: Parameters
    name: str

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """The command itself."""
        return (
            mav.MAVLink_command_long_message(
                system, AUTOPILOT_COMPONENT, self.number, min(confirmation, 255), *self.parameters
            ),
        )


class Several(NamedTuple):
    """Asks for several things at once."""

    name: str
    asks: tuple[Ask, ...]

    def messages(self, system: int, confirmation: int) -> tuple[Any, ...]:
        """All their messages."""
        return tuple(message for ask in self.asks for message in ask.messages(system, confirmation))


def command(name: str, number: int, *parameters: float) -> Command:
    """A command; the parameters that are not given are 0."""
    p = (*parameters, *(0.0,) * (7 - len(parameters)))
    return Command(number, (p[0], p[1], p[2], p[3], p[4], p[5], p[6]), name)


def arm() -> Command:
    """Arm, with all the firmware's checks."""
    return command("ARM", mav.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)


def disarm() -> Command:
    """Disarm; refused in the air."""
    return command("DISARM", mav.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)


def take_off(altitude_m: float) -> Command:
    """Take off where the vehicle stands, to an altitude in whatever frame the firmware takes it.

    Pitch, yaw and position are NaN: "as it is".
    """
    nan = math.nan
    return command("NAV_TAKEOFF", mav.MAV_CMD_NAV_TAKEOFF, nan, 0.0, 0.0, nan, nan, nan, altitude_m)


def message_interval(message_id: int, rate_hz: float) -> Command:
    """Ask for a message at a rate; 0 turns it off."""
    interval_us = round(1e6 / rate_hz) if rate_hz > 0 else -1
    name = f"SET_MESSAGE_INTERVAL {message_name(message_id)}"
    return command(name, mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, interval_us)


def request_message(message_id: int) -> Command:
    """Ask for one message now."""
    return command(f"REQUEST_MESSAGE {message_name(message_id)}", mav.MAV_CMD_REQUEST_MESSAGE, message_id)


def message_name(message_id: int) -> str:
    """The MAVLink name of a message."""
    known = mav.mavlink_map.get(message_id)
    return str(known.msgname) if known else f"message {message_id}"


def result_name(result: int) -> str:
    """The MAV_RESULT as MAVLink names it, without its prefix."""
    entry = mav.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry else f"result {result}"
