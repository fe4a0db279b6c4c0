"""ArduCopter, as observed on 4.8 and with the parameter names of older ones.

It streams nothing but heartbeats until it is asked, and says "ready" in a mode from which it then cannot be
flown: it is put into GUIDED first, and counts as ready when its estimator has an absolute position, its
local position has come and its pre-arm checks pass.  Take-off is GUIDED, ARM, NAV_TAKEOFF with an altitude
above home; a velocity setpoint during the climb would cancel it, so none is sent before it has ended.
A velocity is flown only if all its three axes are given: the altitude loop is closed here.
"""

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.commands import (
    AUTOPILOT_COMPONENT,
    CUSTOM_MODE_ENABLED,
    Command,
    arm,
    command,
)
from swarmctl.vehicle.parameters import Quantity
from swarmctl.vehicle.protection import Protection, Remedy, Told
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.steps import Step
from swarmctl.vehicle.telemetry import Telemetry

from .adapter import Limits, Modes

GUIDED, SMART_RTL = 4, 21
# LOITER without a radio control sinks: BRAKE holds.  In LAND it cannot be armed.
MODES = Modes(
    take_off=GUIDED,
    hold=17,
    engaged=GUIDED,
    land=9,
    comeback=6,
    parked=9,
    names={
        0: "STABILIZE",
        1: "ACRO",
        2: "ALT_HOLD",
        3: "AUTO",
        GUIDED: "GUIDED",
        5: "LOITER",
        6: "RTL",
        7: "CIRCLE",
        9: "LAND",
        16: "POSHOLD",
        17: "BRAKE",
        18: "THROW",
        20: "GUIDED_NOGPS",
        SMART_RTL: "SMART_RTL",
    },
    failsafes=(SMART_RTL,),
)

LIMITS = Limits(braking_mps2=2.0, latency_s=0.3)  # it stops from 8 m/s within 16 m

# Older names count centimetres.
QUANTITIES: tuple[Quantity, ...] = (
    Quantity("speed_mps", {"WP_SPD": 1.0, "WPNAV_SPEED": 0.01}),
    Quantity("acceleration_mps2", {"WP_ACC": 1.0, "WPNAV_ACCEL": 0.01}),
    Quantity("climb_mps", {"WP_SPD_UP": 1.0, "WPNAV_SPEED_UP": 0.01}),
    Quantity("descent_mps", {"WP_SPD_DN": 1.0, "WPNAV_SPEED_DN": 0.01}),
    Quantity("fence_enabled", {"FENCE_ENABLE": 1.0}),
    Quantity("fence_action", {"FENCE_ACTION": 1.0}),
    Quantity("fence_types", {"FENCE_TYPE": 1.0}),
    Quantity("fence_ceiling_m", {"FENCE_ALT_MAX": 1.0}),
    Quantity("fence_radius_m", {"FENCE_RADIUS": 1.0}),
    Quantity("avoidance", {"AVOID_ENABLE": 1.0}),
    Quantity("setpoint_loss_s", {"GUID_TIMEOUT": 1.0}),
    Quantity("ground_station_loss_action", {"FS_GCS_ENABLE": 1.0}),
    Quantity("return_height_m", {"RTL_ALT_M": 1.0, "RTL_ALT": 0.01}),
)

RETURN = 1  # of FENCE_ACTION
CEILING, RADIUS, POLYGONS = 1, 2, 4  # of FENCE_TYPE
AVOID_FENCE = 1  # of AVOID_ENABLE
_FENCE_ACTIONS = {
    0: "only warns", RETURN: "returns", 2: "lands", 3: "returns", 4: "brakes", 5: "returns or lands",
}  # fmt: skip
_BRINGS_BACK = (RETURN, 3, 5)
_SILENCE_ACTIONS = {0: "hovers", 5: "lands", 7: "brakes"}

PREARM_CHECK: int = mav.MAV_SYS_STATUS_PREARM_CHECK
ABSOLUTE_POSITION: int = mav.EKF_POS_HORIZ_ABS
LOCAL_NED: int = mav.MAV_FRAME_LOCAL_NED
ON_GROUND: int = mav.MAV_LANDED_STATE_ON_GROUND
# Ignored: the position, the accelerations and the yaw rate.  Flown: vx, vy, vz and the yaw, 0, which is north.
VELOCITY = 1 | 2 | 4 | 64 | 128 | 256 | 2048

_SLOW_HZ = 1.0
_EXTRA_RATES: Mapping[int, float] = MappingProxyType(
    {
        mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT: _SLOW_HZ,
        mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _SLOW_HZ,
    }
)

# The altitude loop: proportional near the altitude, and never faster than it can still stop in time.
_GAIN_PER_S = 1.0
_VERTICAL_BRAKING_MPS2 = 1.0
_CLIMB_MPS, _DESCENT_MPS = 2.5, 1.5


def climb_rate(error_m: float) -> float:
    """The vertical speed (m/s, up) with which to make good an altitude error (m, positive: too low)."""
    linear_m = _VERTICAL_BRAKING_MPS2 / (_GAIN_PER_S * _GAIN_PER_S)
    distance_m = abs(error_m)
    if distance_m <= linear_m:
        return _GAIN_PER_S * error_m
    speed = math.sqrt(2.0 * _VERTICAL_BRAKING_MPS2 * (distance_m - 0.5 * linear_m))
    return min(speed, _CLIMB_MPS) if error_m > 0.0 else -min(speed, _DESCENT_MPS)


def _take_off(altitude_m: float) -> Command:
    """NAV_TAKEOFF to an altitude above home; it looks at nothing else."""
    return command("NAV_TAKEOFF", mav.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, altitude_m)


def _remedies(told: Told, enabled: bool, types: int, does: str) -> Iterator[Remedy]:
    """A fence that is switched on here is the mission's alone: the firmware's own circle is 300 m by default."""
    if told.get("fence_action") is not None and int(told["fence_action"]) not in _BRINGS_BACK:
        yield Remedy("FENCE_ACTION", RETURN, f"leaving its fence {does}, and should return")
    if "fence_enabled" not in told or "fence_types" not in told:
        return
    if not enabled:
        yield Remedy("FENCE_TYPE", POLYGONS, "the mission's fence, without a circle and a ceiling of its own")
        yield Remedy("FENCE_ENABLE", 1, "its fence is switched off")
    elif not types & POLYGONS:
        yield Remedy("FENCE_TYPE", types | POLYGONS, "its fence does not heed polygons")
    avoids = int(told.get("avoidance", 0.0))
    if avoids & AVOID_FENCE:
        yield Remedy("AVOID_ENABLE", avoids & ~AVOID_FENCE, "it slows down before its fence by itself")


class ArduPilot:
    """The adapter for ArduCopter."""

    name = "ardupilot"
    modes = MODES
    limits = LIMITS
    unwanted_messages: tuple[int, ...] = ()
    quantities = QUANTITIES
    integers_bytewise = False
    extra_rates = _EXTRA_RATES
    needs_origin = False

    def __init__(self) -> None:
        self._mode = -1
        self._prearm = self._estimate = self._local = False

    def protection(self, told: Told) -> Protection:
        """Its fence counts only while FENCE_ENABLE is set; a controller is missed only with FS_GCS_ENABLE."""
        enabled, types = bool(told.get("fence_enabled", 0.0)), int(told.get("fence_types", POLYGONS))
        action, silence = told.get("fence_action"), int(told.get("ground_station_loss_action", 0.0))
        does = "unknown" if action is None else _FENCE_ACTIONS.get(int(action), f"action {action:g}")
        return Protection(
            fence_action=None if action is None else does if enabled and types & POLYGONS else "does nothing",
            on_silence=_SILENCE_ACTIONS.get(silence, "returns"),
            remedies=tuple(_remedies(told, enabled, types, does)),
            ceiling_m=told.get("fence_ceiling_m") if enabled and types & CEILING else None,
            radius_m=told.get("fence_radius_m") if enabled and types & RADIUS else None,
            unattended=silence == 0,
            setpoint_loss_s=told.get("setpoint_loss_s"),
        )

    def set_mode(self, mode: int) -> Command:
        """DO_SET_MODE takes the mode's number whole."""
        return command(f"DO_SET_MODE {MODES.name(mode)}", mav.MAV_CMD_DO_SET_MODE, CUSTOM_MODE_ENABLED, mode)

    def prepare(self, settings: SessionSettings) -> tuple[Step, ...]:
        """GUIDED, but never of a vehicle that somebody has armed."""
        patience = settings.ready_patience_s
        return (
            Step("standing disarmed", patience, confirmed=lambda t: not t.armed),
            Step(
                "guided mode",
                patience,
                command=self.set_mode(GUIDED),
                confirmed=lambda t: t.mode == GUIDED,
                insists=True,
            ),
        )

    def take_off(
        self, telemetry: Telemetry, altitude_m: float, settings: SessionSettings
    ) -> tuple[Step, ...]:
        """GUIDED, ARM, NAV_TAKEOFF.

        It says FAILED where others say "not yet", so arming insists.  A second NAV_TAKEOFF in the air would
        be refused, so leaving the ground is enough to confirm the first.
        """
        patience = settings.command_patience_s
        guided = frozenset((GUIDED,))
        return (
            Step(
                "guided mode", patience, command=self.set_mode(GUIDED), confirmed=lambda t: t.mode == GUIDED,
                insists=True,
            ),
            Step(
                "arming", patience, command=arm(), confirmed=lambda t: t.armed, insists=True, modes=guided
            ),
            Step(
                "take-off", patience, command=_take_off(altitude_m),
                confirmed=lambda t: t.landed_state not in (0, ON_GROUND), insists=True, modes=guided,
            ),
        )  # fmt: skip

    def setpoint(
        self,
        encoder: Encoder,
        system: int,
        telemetry: Telemetry,
        velocity_en: tuple[float, float],
        height_m: float,
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED: vx, vy, and the vz that leads to the height."""
        v_east, v_north = velocity_en
        v_down = -climb_rate(height_m - telemetry.height_m)
        return encoder.set_position_target_local_ned(
            telemetry.boot_ms, system, AUTOPILOT_COMPONENT, LOCAL_NED, VELOCITY,
            0.0, 0.0, 0.0, v_north, v_east, v_down, 0.0, 0.0, 0.0, 0.0, 0.0,
        )  # fmt: skip

    def observe(self, message_id: int, fields: Any, telemetry: Telemetry) -> None:
        """The gates before arming.  What the pre-arm checks said in another mode does not count."""
        if message_id == mav.MAVLINK_MSG_ID_HEARTBEAT and fields.custom_mode != self._mode:
            self._mode = fields.custom_mode
            self._prearm = False
        elif message_id == mav.MAVLINK_MSG_ID_SYS_STATUS:
            self._prearm = bool(fields.onboard_control_sensors_health & PREARM_CHECK)
        elif message_id == mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT:
            self._estimate = bool(fields.flags & ABSOLUTE_POSITION)
        elif message_id == mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED:
            self._local = True
        telemetry.healthy = self._mode == GUIDED and self._prearm and self._estimate and self._local
