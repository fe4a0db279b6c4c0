"""What the session's steps ask for, done by MAVSDK's plugins.

| asked for | plugin |
|---|---|
| arm, disarm, take off, land, hold | Action |
| offboard control | Offboard |
| the fence up and down | MissionRaw |
| parameters | Param |
| any other command | MavlinkDirect, which sends it again until it is acknowledged |

MAVSDK says "denied" both where a firmware refuses and where it says "not yet": either is asked for again, for as
long as the step has patience.
"""

import json
from contextlib import suppress
from enum import IntEnum
from functools import partial
from typing import Any

from mavsdk.plugins.action import ActionError
from mavsdk.plugins.mavlink_direct import MavlinkDirectResult, MavlinkMessage
from mavsdk.plugins.mission_raw import MissionItem
from mavsdk.plugins.param import ParamError, ParamResult

from swarmctl.mavlink.dialect import mav

from .autopilots.adapter import Adapter
from .commands import ACCEPTED, AUTOPILOT_COMPONENT, TEMPORARILY_REJECTED, Ask, Command, arm, disarm
from .fence import FenceReading, FenceTransfer, FenceUpload
from .link import GROUND_COMPONENT, GROUND_SYSTEM
from .mavsdk_client import Deed, Done, Plugins
from .parameters import ParameterRead, ParameterWrite

REALS = (mav.MAV_PARAM_TYPE_REAL32, mav.MAV_PARAM_TYPE_REAL64)
NAV_TAKEOFF: int = mav.MAV_CMD_NAV_TAKEOFF
RESULTS: dict[str, int | None] = {
    "SUCCESS": ACCEPTED,
    "UNSUPPORTED": mav.MAV_RESULT_UNSUPPORTED,
    "FAILED": mav.MAV_RESULT_FAILED,
    "TIMEOUT": None,
    "NO_SYSTEM": None,
    "CONNECTION_ERROR": None,
    "UNKNOWN": None,
}
_NOT_HERE = (ParamResult.DOES_NOT_EXIST, ParamResult.TIMEOUT)


def deed_of(ask: Ask, adapter: Adapter, system: int, altitude_m: float, steering: bool) -> Deed:
    """How MAVSDK does what is asked for.  Raises TypeError for what it has no way to do.

    ``altitude_m``: above home, for a take-off.  ``steering``: setpoints flow, so that the mode for them is meant.
    """
    if isinstance(ask, Command):
        return _command(ask, adapter, system, altitude_m, steering)
    if isinstance(ask, ParameterRead):
        return partial(_read, ask.names)
    if isinstance(ask, ParameterWrite):
        return partial(_write, ask)
    if isinstance(ask, FenceUpload):
        return partial(_upload, ask.transfer)
    if isinstance(ask, FenceReading):
        return _download
    raise TypeError(f"MAVSDK has no way to do {ask.name}")


def _command(ask: Command, adapter: Adapter, system: int, altitude_m: float, steering: bool) -> Deed:
    modes = adapter.modes
    if ask.number == NAV_TAKEOFF:
        return partial(_take_off, altitude_m)
    if steering and ask == adapter.set_mode(modes.engaged):
        return lambda plugins, done: plugins.offboard.start_async(_told(done))
    calls = {
        arm(): "arm_async",
        disarm(): "disarm_async",
        adapter.set_mode(modes.land): "land_async",
        adapter.set_mode(modes.hold): "hold_async",
    }
    name = calls.get(ask)
    if name is not None:
        return lambda plugins, done: getattr(plugins.action, name)(_told(done))
    return partial(_send, ask, system)


def _told(done: Done) -> Any:
    """MAVSDK's callback for an action that has only a result."""
    return lambda result, _: done(_mav_result(result))


def _mav_result(result: IntEnum) -> int | None:
    """The MAV_RESULT that MAVSDK's own result comes from; None where there was no answer."""
    return RESULTS.get(result.name, TEMPORARILY_REJECTED)


def _take_off(altitude_m: float, plugins: Plugins, done: Done) -> None:
    """MAVSDK keeps the altitude itself for ArduPilot; it writes PX4's MIS_TAKEOFF_ALT, and waits for that."""

    def take_off() -> None:
        try:
            plugins.action.set_takeoff_altitude(altitude_m)
        except ActionError as error:
            done(_mav_result(error.result))
        else:
            plugins.action.takeoff_async(_told(done))

    plugins.blocking.submit(take_off)


def _send(command: Command, system: int, plugins: Plugins, done: Done) -> None:
    """A COMMAND_LONG that no plugin has a call for."""
    to = {"target_system": system, "target_component": AUTOPILOT_COMPONENT}
    parameters = {f"param{k}": value for k, value in enumerate(command.parameters, 1)}
    fields = json.dumps({**to, "command": command.number, "confirmation": 0, **parameters}, allow_nan=False)
    message = MavlinkMessage(
        "COMMAND_LONG", GROUND_SYSTEM, GROUND_COMPONENT, system, AUTOPILOT_COMPONENT, fields
    )

    def acknowledged(result: MavlinkDirectResult, ack: MavlinkMessage, _: Any) -> None:
        known = result is MavlinkDirectResult.SUCCESS
        done(json.loads(ack.fields_json)["result"] if known else None)

    plugins.direct.send_command_async(message, acknowledged)


def _read(names: tuple[str, ...], plugins: Plugins, done: Done) -> None:
    """Ask for a parameter by its first name, then, if that is unknown, by the others.

    MAVSDK waits for each, 3 s where nothing answers.  An integer is no float, but its value has come.
    """

    def read() -> None:
        try:
            plugins.param.get_param_float(names[0])
        except ParamError as error:
            if error.result in _NOT_HERE and names[1:]:
                _read(names[1:], plugins, done)
                return
        done(None)

    with suppress(RuntimeError):  # MAVSDK is being closed
        plugins.blocking.submit(read)


def _write(ask: ParameterWrite, plugins: Plugins, done: Done) -> None:
    """Set a parameter; whether it took the value, the vehicle tells."""
    real = ask.known.types.get(ask.parameter, mav.MAV_PARAM_TYPE_REAL32) in REALS

    def write() -> None:
        with suppress(ParamError):
            if real:
                plugins.param.set_param_float(ask.parameter, ask.value)
            else:
                plugins.param.set_param_int(ask.parameter, round(ask.value))
        done(None)

    plugins.blocking.submit(write)


def _upload(transfer: FenceTransfer, plugins: Plugins, done: Done) -> None:
    items = [
        MissionItem(
            m.seq, m.frame, m.command, m.current, m.autocontinue, m.param1, m.param2, m.param3, m.param4,
            m.x, m.y, m.z, m.mission_type,
        )
        for m in transfer.items()
    ]  # fmt: skip
    plugins.mission_raw.upload_geofence_async(items, _told(done))


def _download(plugins: Plugins, done: Done) -> None:
    plugins.mission_raw.download_geofence_async(lambda result, items, _: done(_mav_result(result)))
