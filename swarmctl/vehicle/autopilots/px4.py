"""PX4, as observed on v1.17: see the adapter for what each part is for.

The altitude of NAV_TAKEOFF is above mean sea level whatever the frame says, and it comes before arming.
Velocity is flown with a z position, because a pure velocity setpoint drifts in altitude; z counts down from
the vehicle's own local origin, so both origin and home must be known.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from swarmctl.core.wire import down_of
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import CURRENT_MODE, mav
from swarmctl.vehicle.commands import (
    AUTOPILOT_COMPONENT,
    CUSTOM_MODE_ENABLED,
    Command,
    arm,
    command,
    take_off,
)
from swarmctl.vehicle.parameters import Quantity
from swarmctl.vehicle.protection import Protection, Remedy, Told
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.steps import Step
from swarmctl.vehicle.telemetry import Telemetry

from .adapter import Limits, Modes


def _mode(main: int, sub: int = 0) -> int:
    """A custom mode number as HEARTBEAT carries it."""
    return main << 16 | sub << 24


_AUTO = 4
MODES = Modes(
    take_off=_mode(_AUTO, 2),
    hold=_mode(_AUTO, 3),
    engaged=_mode(6),
    land=_mode(_AUTO, 6),
    comeback=_mode(_AUTO, 5),
    parked=_mode(_AUTO, 3),
    names={
        _mode(1): "MANUAL",
        _mode(2): "ALTCTL",
        _mode(3): "POSCTL",
        _mode(5): "ACRO",
        _mode(6): "OFFBOARD",
        _mode(7): "STABILIZED",
        _mode(_AUTO, 1): "AUTO.READY",
        _mode(_AUTO, 2): "AUTO.TAKEOFF",
        _mode(_AUTO, 3): "AUTO.LOITER",
        _mode(_AUTO, 4): "AUTO.MISSION",
        _mode(_AUTO, 5): "AUTO.RTL",
        _mode(_AUTO, 6): "AUTO.LAND",
    },
)

# Measured on v1.17 (benchmarks/stopping.py): its velocity controller heeds no acceleration but what its tilt allows,
# follows with a lag, and what its integrator has gathered against the drag lets it creep on for seconds.
LIMITS = Limits(braking_mps2=8.0, latency_s=0.4, lag_s=1.3, unsure_s=0.5, acceleration_mps2=8.0)

QUANTITIES: tuple[Quantity, ...] = (
    Quantity("speed_mps", {"MPC_XY_VEL_MAX": 1.0}),
    Quantity("acceleration_mps2", {"MPC_ACC_HOR": 1.0}),
    Quantity("climb_mps", {"MPC_Z_VEL_MAX_UP": 1.0}),
    Quantity("descent_mps", {"MPC_Z_VEL_MAX_DN": 1.0}),
    Quantity("fence_action", {"GF_ACTION": 1.0}),
    Quantity("fence_ceiling_m", {"GF_MAX_VER_DIST": 1.0}),
    Quantity("fence_radius_m", {"GF_MAX_HOR_DIST": 1.0}),
    Quantity("setpoint_loss_s", {"COM_OF_LOSS_T": 1.0}),
    Quantity("setpoint_loss_action", {"COM_OBL_RC_ACT": 1.0}),
    Quantity("ground_station_loss_action", {"NAV_DLL_ACT": 1.0}),
    Quantity("return_height_m", {"RTL_RETURN_ALT": 1.0}),
)

RETURN = 3  # of GF_ACTION and COM_OBL_RC_ACT
_FENCE_ACTIONS = {
    0: "does nothing",
    1: "only warns",
    2: "holds",
    RETURN: "returns",
    4: "cuts its motors",
    5: "lands",
}
# A pilot's modes, without a radio control, become a return.
_LOSS_ACTIONS = {0: "returns", 1: "returns", 2: "returns", RETURN: "returns", 4: "lands", 5: "holds"}
_STOPS_MOTORS = (6, 7)

# What the onboard link carries often, or at every change of mode, without being asked, and what a thin link feels.
UNWANTED_MESSAGES: tuple[int, ...] = (
    mav.MAVLINK_MSG_ID_ATTITUDE,
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    mav.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
    mav.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
    mav.MAVLINK_MSG_ID_RC_CHANNELS,
    mav.MAVLINK_MSG_ID_VFR_HUD,
    mav.MAVLINK_MSG_ID_GPS_RAW_INT,
    mav.MAVLINK_MSG_ID_ATTITUDE_TARGET,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT,
    mav.MAVLINK_MSG_ID_HIGHRES_IMU,
    mav.MAVLINK_MSG_ID_ALTITUDE,
    mav.MAVLINK_MSG_ID_ODOMETRY,
    mav.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS,
    mav.MAVLINK_MSG_ID_VIBRATION,
    mav.MAVLINK_MSG_ID_SYSTEM_TIME,
    CURRENT_MODE,
)

PREARM_CHECK: int = mav.MAV_SYS_STATUS_PREARM_CHECK
LOCAL_NED: int = mav.MAV_FRAME_LOCAL_NED
# Ignored: x, y, vz, the accelerations and the yaw rate. Flown: z, vx, vy and the yaw, 0, which is north.
VELOCITY_AT_ALTITUDE = 1 | 2 | 32 | 64 | 128 | 256 | 2048


def _word(words: Mapping[int, str], action: float | None) -> str:
    """What an action does, or its number."""
    return "unknown" if action is None else words.get(int(action), f"action {action:g}")


class Px4:
    """The adapter for PX4."""

    name = "px4"
    modes = MODES
    limits = LIMITS
    unwanted_messages = UNWANTED_MESSAGES
    quantities = QUANTITIES
    integers_bytewise = True
    extra_rates: Mapping[int, float] = MappingProxyType({})
    needs_origin = True

    def protection(self, told: Told) -> Protection:
        """GF_ACTION and COM_OBL_RC_ACT; a limit of 0 is none."""
        fence, loss = told.get("fence_action"), int(told.get("setpoint_loss_action", 0.0))
        back = Remedy(
            "GF_ACTION", RETURN, f"leaving its fence {_word(_FENCE_ACTIONS, fence)}, and should return"
        )
        return Protection(
            fence_action=None if fence is None else _word(_FENCE_ACTIONS, fence),
            on_silence=_word(_LOSS_ACTIONS, loss),
            remedies=(back,) if fence is not None and fence != RETURN else (),
            ceiling_m=told.get("fence_ceiling_m") or None,
            radius_m=told.get("fence_radius_m") or None,
            setpoint_loss_s=told.get("setpoint_loss_s"),
            fatal=f"COM_OBL_RC_ACT {loss} stops its motors when setpoints stop"
            if loss in _STOPS_MOTORS
            else "",
        )

    def prepare(self, settings: SessionSettings) -> tuple[Step, ...]:
        """Out of OFFBOARD, but never of a vehicle that somebody has armed.

        PX4 falls back to it after a flight; without setpoints it then never says that it is ready.
        """
        patience = settings.ready_patience_s
        return (
            Step("standing disarmed", patience, confirmed=lambda t: not t.armed),
            Step(
                "loiter mode",
                patience,
                command=self.set_mode(MODES.parked),
                confirmed=lambda t: t.mode != MODES.engaged,
                insists=True,
            ),
        )

    def set_mode(self, mode: int) -> Command:
        """DO_SET_MODE takes the main and the sub mode apart."""
        main, sub = mode >> 16 & 0xFF, mode >> 24 & 0xFF
        return command(
            f"DO_SET_MODE {MODES.name(mode)}", mav.MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, main, sub
        )

    def take_off(
        self, telemetry: Telemetry, altitude_m: float, settings: SessionSettings
    ) -> tuple[Step, ...]:
        """NAV_TAKEOFF, then ARM.  Needs the home position.

        The mode may be that of an earlier take-off to another altitude, so the ACK is needed too.
        """
        if telemetry.home is None:
            raise ValueError("take-off needs the home position")
        patience = settings.command_patience_s
        return (
            Step(
                "take-off mode",
                patience,
                command=take_off(telemetry.home.alt_amsl_m + altitude_m),
                confirmed=lambda t: t.mode == MODES.take_off,
                needs_ack=True,
            ),
            Step("arming", patience, command=arm(), confirmed=lambda t: t.armed),
        )

    def setpoint(
        self,
        encoder: Encoder,
        system: int,
        telemetry: Telemetry,
        velocity_en: tuple[float, float],
        height_m: float,
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED: z position and vx, vy.  Needs origin and home."""
        home, origin = telemetry.home, telemetry.origin
        if home is None or origin is None:
            raise ValueError("a setpoint needs the home position and the local origin")
        down = down_of(height_m, origin[2], home[2])
        v_east, v_north = velocity_en
        return encoder.set_position_target_local_ned(
            telemetry.boot_ms, system, AUTOPILOT_COMPONENT, LOCAL_NED, VELOCITY_AT_ALTITUDE,
            0.0, 0.0, down, v_north, v_east, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        )  # fmt: skip

    def observe(self, message_id: int, fields: Any, telemetry: Telemetry) -> None:
        """SYS_STATUS's health bit says ready, although present and enabled never show it."""
        if message_id == mav.MAVLINK_MSG_ID_SYS_STATUS:
            telemetry.healthy = bool(fields.onboard_control_sensors_health & PREARM_CHECK)
