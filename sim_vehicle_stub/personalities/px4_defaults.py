"""What PX4 is like before anybody asks for something else: its parameters, and what it streams unasked."""

from swarmctl.mavlink.dialect import CURRENT_MODE, mav

from ..pilot import Limits

INTERVALS_US: dict[int, int] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: 1_000_000,
    mav.MAVLINK_MSG_ID_SYS_STATUS: 200_000,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 200_000,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS: 2_000_000,
    mav.MAVLINK_MSG_ID_HOME_POSITION: 1_000_000,
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 20_000,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 33_333,
    mav.MAVLINK_MSG_ID_ATTITUDE: 10_000,
    CURRENT_MODE: 2_000_000,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: 125_000,
    mav.MAVLINK_MSG_ID_VFR_HUD: 100_000,
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 20_000,
    mav.MAVLINK_MSG_ID_HIGHRES_IMU: 20_000,
    mav.MAVLINK_MSG_ID_ODOMETRY: 33_333,
    mav.MAVLINK_MSG_ID_ALTITUDE: 100_000,
    mav.MAVLINK_MSG_ID_ATTITUDE_TARGET: 100_000,
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 100_000,
    mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT: 100_000,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 100_000,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: 100_000,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: 1_000_000,
    mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1_000_000,
    mav.MAVLINK_MSG_ID_VIBRATION: 2_000_000,
}
"""Message id: microseconds.  404 messages a second in all, as many as the real one's onboard link carries."""


def parameters(limits: Limits) -> dict[str, float]:
    """The parameters at boot, by what the vehicle can do."""
    return {
        "BAT_CRIT_THR": 0.07,
        "BAT_EMERGEN_THR": 0.05,
        "BAT_LOW_THR": 0.15,
        "COM_DISARM_LAND": 2.0,
        "COM_DISARM_PRFLT": 10.0,
        "COM_DL_LOSS_T": 10,
        "COM_FAIL_ACT_T": 5.0,
        "COM_LOW_BAT_ACT": 0,
        "COM_OBL_RC_ACT": 0,
        "COM_OF_LOSS_T": 1.0,
        "GF_ACTION": 2,
        "GF_MAX_HOR_DIST": 0.0,
        "GF_MAX_VER_DIST": 0.0,
        "MAV_SYS_ID": 1,
        "MIS_TAKEOFF_ALT": 2.5,
        "MPC_ACC_HOR": limits.acceleration_mps2,
        "MPC_LAND_SPEED": min(0.7, limits.descent_mps),
        "MPC_TKO_SPEED": min(1.5, limits.climb_mps),
        "MPC_XY_CRUISE": min(5.0, limits.speed_mps),
        "MPC_XY_VEL_MAX": limits.speed_mps,
        "MPC_Z_VEL_MAX_DN": limits.descent_mps,
        "MPC_Z_VEL_MAX_UP": limits.climb_mps,
        "NAV_DLL_ACT": 0,
        "RTL_CONE_ANG": 45,
        "RTL_RETURN_ALT": 30.0,
    }
