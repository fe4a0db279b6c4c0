"""How each telemetry message is made from a vehicle's state.

A builder returns the frame, or None while the vehicle cannot know what the message tells.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmctl.mavlink import messages
from swarmctl.mavlink.dialect import CURRENT_MODE, CurrentMode, mav

from . import chatter

if TYPE_CHECKING:
    from .vehicle import StubVehicle

HEADING_UNKNOWN = 65535
SENSORS: int = (
    mav.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mav.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mav.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mav.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mav.MAV_SYS_STATUS_SENSOR_GPS
)
PREARM: int = mav.MAV_SYS_STATUS_PREARM_CHECK
BATTERY_FULL_MV, BATTERY_EMPTY_MV = 16200, 14000
CAPABILITIES: int = (
    mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mav.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
)
EKF_LOCATED, EKF_UNLOCATED = 0x33F, 0x0A7
NO_FIX = (0, 0, 0, 0, 0, 0, 0)
Builder = Callable[["StubVehicle"], bytes | None]


def heartbeat(vehicle: "StubVehicle") -> bytes:
    """HEARTBEAT."""
    personality = vehicle.personality
    base_mode = personality.base_mode | (mav.MAV_MODE_FLAG_SAFETY_ARMED if vehicle.armed else 0)
    return vehicle.encoder.heartbeat(
        mav.MAV_TYPE_QUADROTOR,
        personality.autopilot,
        base_mode,
        personality.custom_mode,
        personality.system_status,
    )


def sys_status(vehicle: "StubVehicle") -> bytes:
    """SYS_STATUS; PX4 sets the pre-arm bit in the health alone."""
    percent = vehicle.battery.percent
    present, enabled, healthy = vehicle.personality.fence_bits
    shown = SENSORS | PREARM if vehicle.personality.shows_prearm else SENSORS
    health = healthy | (SENSORS if vehicle.fixed else SENSORS & ~mav.MAV_SYS_STATUS_SENSOR_GPS)
    if vehicle.personality.ready:
        health |= PREARM
    return vehicle.encoder.sys_status(
        shown | present, shown | enabled, health,
        300, _battery_mv(percent), -1, int(percent), 0, 0, 0, 0, 0, 0,
    )  # fmt: skip


def _battery_mv(percent: float) -> int:
    """Voltage of a battery this full."""
    return round(BATTERY_EMPTY_MV + (BATTERY_FULL_MV - BATTERY_EMPTY_MV) * percent / 100.0)


def battery_status(vehicle: "StubVehicle") -> bytes:
    """BATTERY_STATUS."""
    percent = vehicle.battery.percent
    cells = [_battery_mv(percent) // 4] * 4 + [0xFFFF] * 6
    return vehicle.encode(messages.BatteryStatus(-1, -1, 0x7FFF, cells, -1, 0, 0, 0, int(percent)))


def global_position_int(vehicle: "StubVehicle") -> bytes | None:
    """GLOBAL_POSITION_INT: what the body's place and speed are at this tick."""
    wire = vehicle.wire if vehicle.located else vehicle.personality.unsure_position()
    if wire is None:
        return None
    return vehicle.encoder.global_position_int(vehicle.boot_ms, *wire, vehicle.heading_cdeg)


def local_position_ned(vehicle: "StubVehicle") -> bytes | None:
    """LOCAL_POSITION_NED, in the vehicle's own frame and projection."""
    if not vehicle.located:
        return None
    north, east, down = vehicle.personality.local_ned()
    _, _, _, v_east, v_north, v_up = vehicle.pilot.place
    return vehicle.encoder.local_position_ned(vehicle.boot_ms, north, east, down, v_north, v_east, -v_up)


def attitude(vehicle: "StubVehicle") -> bytes:
    """ATTITUDE: level, towards the heading."""
    return vehicle.encoder.attitude(vehicle.boot_ms, 0.0, 0.0, vehicle.yaw, 0.0, 0.0, 0.0)


def extended_sys_state(vehicle: "StubVehicle") -> bytes:
    """EXTENDED_SYS_STATE."""
    return vehicle.encoder.extended_sys_state(0, vehicle.personality.landed_state)


def home_position(vehicle: "StubVehicle") -> bytes | None:
    """HOME_POSITION; latitude and longitude lie on float32's grid, about 0.4 m, as PX4's do."""
    if vehicle.home is None:
        return None
    lat, lon, alt = vehicle.home
    lat_e7, lon_e7 = (round(float(np.float32(degrees)) * 1e7) for degrees in (lat, lon))
    level = [1.0, 0.0, 0.0, 0.0]
    return vehicle.encode(
        messages.HomePosition(
            lat_e7, lon_e7, round(alt * 1000.0), 0.0, 0.0, 0.0, level, math.nan, math.nan, math.nan,
            vehicle.boot_ms * 1000,
        )
    )  # fmt: skip


def gps_global_origin(vehicle: "StubVehicle") -> bytes | None:
    """GPS_GLOBAL_ORIGIN of the vehicle's own local frame."""
    if not vehicle.located:
        return None
    lat, lon, alt = vehicle.local_origin
    return vehicle.encode(
        mav.MAVLink_gps_global_origin_message(
            round(lat * 1e7), round(lon * 1e7), round(alt * 1000.0), vehicle.boot_ms * 1000
        )
    )


def autopilot_version(vehicle: "StubVehicle") -> bytes:
    """AUTOPILOT_VERSION."""
    personality = vehicle.personality
    return vehicle.encode(
        mav.MAVLink_autopilot_version_message(
            CAPABILITIES | personality.capabilities, personality.version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8,
            0, 0, vehicle.system,
        )
    )  # fmt: skip


def gps_raw_int(vehicle: "StubVehicle") -> bytes:
    """GPS_RAW_INT: what the receiver says, before any estimate."""
    lat, lon, alt, _, v_north, v_east, _ = vehicle.wire if vehicle.fixed else NO_FIX
    fix = mav.GPS_FIX_TYPE_3D_FIX if vehicle.fixed else mav.GPS_FIX_TYPE_NO_FIX
    speed = round(math.sqrt(v_north * v_north + v_east * v_east))
    return vehicle.encode(
        mav.MAVLink_gps_raw_int_message(
            vehicle.boot_ms * 1000, fix, lat, lon, alt, 80, 80, speed, 0xFFFF, 12 if vehicle.fixed else 0
        )
    )


def vfr_hud(vehicle: "StubVehicle") -> bytes:
    """VFR_HUD."""
    _, _, up, v_east, v_north, v_up = vehicle.pilot.place
    speed = math.sqrt(v_east * v_east + v_north * v_north)
    heading = vehicle.heading_cdeg // 100
    throttle = 50 if vehicle.pilot.powered else 0
    return vehicle.encode(
        mav.MAVLink_vfr_hud_message(speed, speed, heading, throttle, vehicle.zero_amsl_m + up, v_up)
    )


def ekf_status_report(vehicle: "StubVehicle") -> bytes:
    """EKF_STATUS_REPORT: with a position estimate or without one."""
    flags = EKF_LOCATED if vehicle.located else EKF_UNLOCATED
    return vehicle.encode(mav.MAVLink_ekf_status_report_message(flags, 0.05, 0.05, 0.05, 0.05, 0.0))


def timesync(vehicle: "StubVehicle") -> bytes:
    """TIMESYNC, as a question."""
    return vehicle.encode(messages.Timesync(0, vehicle.boot_ms * 1_000_000))


def current_mode(vehicle: "StubVehicle") -> bytes:
    """CURRENT_MODE: the mode, which nobody intends to be another."""
    mode = vehicle.personality.custom_mode
    return vehicle.encode(CurrentMode(0, mode, mode))


def _encoded(make: Callable[["StubVehicle"], Any | None]) -> Builder:
    """The builder of the frame of a message that ``make`` makes."""

    def build(vehicle: "StubVehicle") -> bytes | None:
        message = make(vehicle)
        return None if message is None else vehicle.encode(message)

    return build


BUILDERS: dict[int, Builder] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
    mav.MAVLINK_MSG_ID_SYS_STATUS: sys_status,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: global_position_int,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    mav.MAVLINK_MSG_ID_ATTITUDE: attitude,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    mav.MAVLINK_MSG_ID_HOME_POSITION: home_position,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: gps_global_origin,
    mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION: autopilot_version,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: gps_raw_int,
    mav.MAVLINK_MSG_ID_VFR_HUD: vfr_hud,
    mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT: ekf_status_report,
    mav.MAVLINK_MSG_ID_TIMESYNC: timesync,
    CURRENT_MODE: current_mode,
    **{message_id: _encoded(make) for message_id, make in chatter.MESSAGES.items()},
}
