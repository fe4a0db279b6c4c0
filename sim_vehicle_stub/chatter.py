"""What PX4 streams unasked and hardly anybody reads: more than half of the 404 messages a second on its link.

A controller that does not turn these down pays for them, so the stub sends them too.  They tell of the same
body as the rest of the telemetry, as far as it has such things; what it has not is zero or not a number.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from swarmctl.mavlink import messages
from swarmctl.mavlink.dialect import mav

if TYPE_CHECKING:
    from .vehicle import StubVehicle

GRAVITY = 9.81
IMU_FIELDS = 0x1FFF
HOVER_PWM, IDLE_PWM = 1500, 900
ALL_BUT_YAW = 0x0DFF
"""The type mask of a target that has nothing but a yaw."""
ESTIMATES_ALL = 0x33F
Quaternion = tuple[float, float, float, float]


def _turned(vehicle: "StubVehicle") -> Quaternion:
    """The attitude: level, towards the heading."""
    return math.cos(vehicle.yaw / 2.0), 0.0, 0.0, math.sin(vehicle.yaw / 2.0)


def _local(vehicle: "StubVehicle") -> tuple[float, float, float, float, float, float]:
    """Place and velocity, north, east, down, in the vehicle's own frame (m, m/s)."""
    _, _, _, v_east, v_north, v_up = vehicle.pilot.place
    return (*vehicle.personality.local_ned(), v_north, v_east, -v_up)


def attitude_quaternion(vehicle: "StubVehicle") -> Any:
    """ATTITUDE_QUATERNION."""
    return mav.MAVLink_attitude_quaternion_message(vehicle.boot_ms, *_turned(vehicle), 0.0, 0.0, 0.0)


def highres_imu(vehicle: "StubVehicle") -> Any:
    """HIGHRES_IMU."""
    return mav.MAVLink_highres_imu_message(
        vehicle.boot_ms * 1000, 0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0, 0.2, 0.0, 0.4, 950.0, 0.0,
        vehicle.wire[2] * 1e-3, 25.0, IMU_FIELDS,
    )  # fmt: skip


def odometry(vehicle: "StubVehicle") -> Any | None:
    """ODOMETRY."""
    if not vehicle.located:
        return None
    frames = (mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_BODY_FRD)
    x, y, z, v_north, v_east, v_down = _local(vehicle)
    sine, cosine = math.sin(vehicle.yaw), math.cos(vehicle.yaw)
    forward, right = cosine * v_north + sine * v_east, cosine * v_east - sine * v_north
    unknown = [math.nan] * 21
    return mav.MAVLink_odometry_message(
        vehicle.boot_ms * 1000, *frames, x, y, z, _turned(vehicle), forward, right, v_down, 0.0, 0.0, 0.0,
        unknown, unknown,
    )  # fmt: skip


def altitude(vehicle: "StubVehicle") -> Any:
    """ALTITUDE."""
    amsl, up = vehicle.wire[2] * 1e-3, vehicle.wire[3] * 1e-3
    return mav.MAVLink_altitude_message(vehicle.boot_ms * 1000, amsl, amsl, up, up, math.nan, math.nan)


def attitude_target(vehicle: "StubVehicle") -> Any:
    """ATTITUDE_TARGET."""
    thrust = 0.5 if vehicle.pilot.powered else 0.0
    return mav.MAVLink_attitude_target_message(vehicle.boot_ms, 0, _turned(vehicle), 0.0, 0.0, 0.0, thrust)


def servo_output_raw(vehicle: "StubVehicle") -> Any:
    """SERVO_OUTPUT_RAW."""
    pulse = HOVER_PWM if vehicle.pilot.powered else IDLE_PWM
    motors = [pulse] * 4 + [0] * 4
    return mav.MAVLink_servo_output_raw_message(vehicle.boot_ms * 1000 & 0xFFFFFFFF, 0, *motors)


def nav_controller_output(vehicle: "StubVehicle") -> Any:
    """NAV_CONTROLLER_OUTPUT."""
    heading = vehicle.heading_cdeg // 100
    return mav.MAVLink_nav_controller_output_message(0.0, 0.0, heading, heading, 0, 0.0, 0.0, 0.0)


def position_target_local_ned(vehicle: "StubVehicle") -> Any:
    """POSITION_TARGET_LOCAL_NED."""
    nothing = [0.0] * 9
    return mav.MAVLink_position_target_local_ned_message(
        vehicle.boot_ms, mav.MAV_FRAME_LOCAL_NED, ALL_BUT_YAW, *nothing, vehicle.yaw, 0.0
    )


def position_target_global_int(vehicle: "StubVehicle") -> Any:
    """POSITION_TARGET_GLOBAL_INT."""
    nothing = [0.0] * 6
    return mav.MAVLink_position_target_global_int_message(
        vehicle.boot_ms, mav.MAV_FRAME_GLOBAL_INT, ALL_BUT_YAW, 0, 0, 0.0, *nothing, vehicle.yaw, 0.0
    )


def system_time(vehicle: "StubVehicle") -> Any:
    """SYSTEM_TIME."""
    return messages.SystemTime(0, vehicle.boot_ms)


def estimator_status(vehicle: "StubVehicle") -> Any:
    """ESTIMATOR_STATUS."""
    flags = ESTIMATES_ALL if vehicle.located else 0
    fit, accuracy_m = 0.05, 0.3
    return messages.EstimatorStatus(
        vehicle.boot_ms * 1000, fit, fit, fit, fit, fit, fit, accuracy_m, accuracy_m, flags
    )


def vibration(vehicle: "StubVehicle") -> Any:
    """VIBRATION."""
    return messages.Vibration(vehicle.boot_ms * 1000, 0.0, 0.0, 0.0, 0, 0, 0)


MESSAGES: dict[int, Callable[["StubVehicle"], Any | None]] = {
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: attitude_quaternion,
    mav.MAVLINK_MSG_ID_HIGHRES_IMU: highres_imu,
    mav.MAVLINK_MSG_ID_ODOMETRY: odometry,
    mav.MAVLINK_MSG_ID_ALTITUDE: altitude,
    mav.MAVLINK_MSG_ID_ATTITUDE_TARGET: attitude_target,
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: servo_output_raw,
    mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: nav_controller_output,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: position_target_local_ned,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: position_target_global_int,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: system_time,
    mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS: estimator_status,
    mav.MAVLINK_MSG_ID_VIBRATION: vibration,
}
"""By message id: what makes the message, or None while its content is not known."""
