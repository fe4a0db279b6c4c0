"""PX4, as a multicopter of v1.17 was seen to behave on its onboard link.

A mode is a row of `MODES`: its number on the wire, what it does when it is entered and as time passes.  The
firmware remembers beside the mode it is in (which a failsafe may have chosen) the one to fall back to on
the ground.  Commands are in px4_commands.py, setpoints and what they mean in px4_setpoints.py.
"""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import CURRENT_MODE, mav

from ..commands import Command
from ..parameters import BYTEWISE
from ..pilot import Limits
from . import px4_defaults
from .projection import project
from .px4_commands import ACCEPTED, COMMANDS, TEMPORARILY_REJECTED, UNSUPPORTED, Mode
from .px4_failsafes import Failsafes
from .px4_return import ALTITUDE_ACCEPTED_M, Return
from .px4_setpoints import Setpoints

if TYPE_CHECKING:
    from ..vehicle import StubVehicle

READY_AFTER_S = 4.5
BOUND_LIMITS = {"MPC_XY_VEL_MAX": ("speed",), "MPC_ACC_HOR": ("acceleration", "braking", "approach")}
"""The limits of the body that a parameter sets."""
SPOOL_UP_S = 3.0
GIMBAL_COMMANDS: dict[int, tuple[float, ...]] = {
    mav.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: (-3.0, -3.0, -1.0, -1.0, 0.0, 0.0, 0.0),
    mav.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: (math.nan, math.nan, math.nan, math.nan, 2.0, 0.0, 0.0),
}
"""What it sends itself when it begins to return or to land."""
AUTO_BASE_MODE: int = (
    mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    | mav.MAV_MODE_FLAG_AUTO_ENABLED
    | mav.MAV_MODE_FLAG_STABILIZE_ENABLED
    | mav.MAV_MODE_FLAG_GUIDED_ENABLED
)


PASSING = frozenset({Mode.TAKEOFF, Mode.RTL, Mode.LAND})
"""Modes that end by themselves: a vehicle on the ground falls back to the one before."""


class Px4:
    """One vehicle's PX4."""

    autopilot: int = mav.MAV_AUTOPILOT_PX4
    version = 0x011100FF  # 1.17.0, release
    capabilities: int = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    base_mode = AUTO_BASE_MODE
    LIMITS = Limits(velocity_share=0.85)
    ENCODING = BYTEWISE
    DATA_STREAMS: ClassVar[Mapping[int, tuple[int, ...]]] = {}
    LOCATED_AFTER_S, HOME_AFTER_S, QUIET_FOR_S = 2.0, 3.0, 0.0
    TEXT_END = "\t"
    texts_need_gcs = True
    requests_integers = True
    answers_any_component = False
    TAKES_KEYS = False
    tells_parameter_errors = True
    shows_prearm = False
    no_such_message: int = mav.MAV_RESULT_DENIED
    announces_origin = True
    fence_bits = (0, 0, 0)

    INTERVALS_US: ClassVar[Mapping[int, int]] = px4_defaults.INTERVALS_US

    @staticmethod
    def parameters(limits: Limits) -> dict[str, float]:
        """The parameters at boot; an int is an INT32 for good, a float a REAL32."""
        return px4_defaults.parameters(limits)

    @staticmethod
    def split_mode(number: int) -> tuple[float, float]:
        """Main and sub mode."""
        return float(number >> 16 & 0xFF), float(number >> 24)

    def __init__(self, vehicle: "StubVehicle") -> None:
        self.vehicle = vehicle
        self._pilot = vehicle.pilot
        self._parameters = vehicle.parameters
        self._setpoints = Setpoints(vehicle)
        self.mode = Mode.LOITER
        self._resting_mode = Mode.LOITER
        self._failsafe = False
        self._resumes = False
        self._failsafes = Failsafes(self)
        self._step: Callable[[Px4], None] = MODES[self.mode].step
        self._return = Return(vehicle, self._begin_land)
        self.takeoff_height = 0.0
        self._lift_off_at: float | None = None
        for name in ("MPC_XY_VEL_MAX", "MPC_ACC_HOR"):
            self.parameter_changed(name)
        self._parameters.set("MAV_SYS_ID", vehicle.system)
        self._pilot.limit("climb_acceleration", vehicle.limits.climb_acceleration_mps2)
        self._pilot.limit("lag", vehicle.limits.lag_s)
        self._pilot.limit("airspeed", vehicle.limits.airspeed)
        self._pilot.limit("share", vehicle.limits.velocity_share)

    # What telemetry tells

    @property
    def custom_mode(self) -> int:
        """The mode's number."""
        return int(self.mode)

    @property
    def system_status(self) -> int:
        """Critical in a failsafe, else active while armed; on the ground one that misses setpoints is not set up."""
        if self._failsafe:
            return int(mav.MAV_STATE_CRITICAL)
        if self.vehicle.armed:
            return int(mav.MAV_STATE_ACTIVE)
        waits = self.mode is Mode.OFFBOARD and self._setpoints.lost
        return int(mav.MAV_STATE_UNINIT if waits else mav.MAV_STATE_STANDBY)

    @property
    def landed_state(self) -> int:
        """Landing and taking off are told by the mode, standing and flying by the body."""
        if self.vehicle.landed:
            return int(mav.MAV_LANDED_STATE_ON_GROUND)
        if self.mode is Mode.TAKEOFF:
            return int(mav.MAV_LANDED_STATE_TAKEOFF)
        if self.mode is Mode.LAND or (self.mode is Mode.RTL and self._return.landing):
            return int(mav.MAV_LANDED_STATE_LANDING)
        return int(mav.MAV_LANDED_STATE_IN_AIR)

    @property
    def ready(self) -> bool:
        """Whether it could be armed: a while after boot, and in OFFBOARD only with setpoints."""
        return (
            self.vehicle.since_boot >= READY_AFTER_S
            and (self.mode is not Mode.OFFBOARD or not self._setpoints.lost)
            and self.vehicle.located
            and "arming-refused" not in self.vehicle.faults.active
            and not self._failsafes.misses_ground_station
        )

    def unsure_position(self) -> None:
        """Nothing is told of a position that is not known."""

    def is_ground_station(self, system: int) -> bool:
        """Any will do."""
        return True

    def local_ned(self) -> tuple[float, float, float]:
        """North, east, down (m) from the vehicle's own origin, in PX4's projection."""
        vehicle = self.vehicle
        origin_lat, origin_lon, origin_alt = vehicle.local_origin
        lat, lon, alt = vehicle.wire[:3]
        north, east = project(lat * 1e-7, lon * 1e-7, origin_lat, origin_lon)
        return north, east, origin_alt - alt * 1e-3

    @property
    def default_takeoff_height(self) -> float:
        """Height (m) of a take-off from here whose altitude is not given."""
        return self._pilot.place[2] + self._parameters["MIS_TAKEOFF_ALT"]

    # Time

    def step(self) -> None:
        """Watch the disarm timers, then go on with the mode."""
        vehicle = self.vehicle
        if not vehicle.armed:
            return
        if vehicle.landed and self._disarm_is_due():
            vehicle.say(
                mav.MAV_SEVERITY_INFO, "Disarmed by " + ("landing" if vehicle.flown else "auto preflight")
            )
            vehicle.disarm()
        else:
            self._failsafes.watch()
            self._step(self)

    def _disarm_is_due(self) -> bool:
        """On the ground: a while after landing, or after arming without taking off."""
        vehicle = self.vehicle
        if vehicle.flown:
            return vehicle.now - vehicle.landed_at >= self._parameters["COM_DISARM_LAND"]
        return vehicle.now - vehicle.armed_at >= self._parameters["COM_DISARM_PRFLT"]

    # Modes

    def _enter(self, mode: Mode) -> None:
        """Change the mode, and begin it if the motors run; CURRENT_MODE tells at once, HEARTBEAT later."""
        if mode is not self.mode and self.vehicle.interval_us(CURRENT_MODE) > 0:
            self.mode = mode
            self.vehicle.send(CURRENT_MODE)
        self.mode = mode
        self._step = MODES[mode].step
        if mode not in PASSING:
            self._resting_mode = mode
        self._pace()
        if self.vehicle.armed:
            MODES[mode].begin(self)

    def _pace(self) -> None:
        """Tell the pilot how fast this mode may go."""
        p = self._parameters
        speed = p["MPC_XY_VEL_MAX" if self.mode is Mode.OFFBOARD else "MPC_XY_CRUISE"]
        climb = p["MPC_TKO_SPEED" if self.mode is Mode.TAKEOFF else "MPC_Z_VEL_MAX_UP"]
        self._pilot.pace(speed, climb, p["MPC_Z_VEL_MAX_DN"], p["MPC_LAND_SPEED"])

    def _begin_loiter(self) -> None:
        if self.vehicle.landed:
            self._pilot.power(True)
        else:
            self._pilot.hold()

    def _begin_takeoff(self) -> None:
        vehicle = self.vehicle
        vehicle.armed_at = vehicle.now
        self._lift_off_at = vehicle.now + (SPOOL_UP_S if vehicle.landed else 0.0)

    def _step_takeoff(self) -> None:
        """Straight up once the motors are fast enough, then loiter there."""
        if self._lift_off_at is None:
            if abs(self._pilot.place[2] - self.takeoff_height) <= ALTITUDE_ACCEPTED_M:
                self._enter(Mode.LOITER)
                self._pilot.height(self.takeoff_height)
        elif self.vehicle.now >= self._lift_off_at:
            self._lift_off_at = None
            self._pilot.hold()
            self._pilot.height(self.takeoff_height)

    def _begin_land(self) -> None:
        self._center_gimbal()
        if self.vehicle.located:
            self._pilot.hold()
        else:
            self._pilot.drift()
        self._pilot.descend()

    def _begin_rtl(self) -> None:
        self._center_gimbal()
        self._return.begin()

    def _center_gimbal(self) -> None:
        """Commands to itself, for a gimbal, that everybody on the link hears."""
        system = self.vehicle.system
        for number, parameters in GIMBAL_COMMANDS.items():
            self.vehicle.send_message(mav.MAVLink_command_long_message(system, 0, number, 0, *parameters))

    def _step_rtl(self) -> None:
        self._return.step()

    def _begin_offboard(self) -> None:
        self._setpoints.fly_last()

    def _step_offboard(self) -> None:
        if self._setpoints.missed:
            self.vehicle.say(mav.MAV_SEVERITY_CRITICAL, "Failsafe activated")
            self.fail_into(Mode.RTL)
            self._resumes = True

    def _nothing(self) -> None:
        """A mode in which time alone changes nothing."""

    # Setpoints

    def setpoint_local(self, frame: Frame) -> None:
        """Follow it in OFFBOARD; a stream that comes back ends its failsafe."""
        if self._setpoints.take_local(frame.fields):
            self._follow()

    def setpoint_global(self, frame: Frame) -> None:
        """As `setpoint_local`."""
        if self._setpoints.take_global(frame.fields):
            self._follow()

    def _follow(self) -> None:
        if not self.vehicle.armed or "ignored-setpoints" in self.vehicle.faults.active:
            return
        if self.mode is Mode.OFFBOARD:
            self._setpoints.fly_last()
        elif self._resumes:
            self._end_failsafe()
            self._enter(Mode.OFFBOARD)

    # Commands

    def command(self, command: Command) -> None:
        """Obey and answer."""
        handler = COMMANDS.get(command.number)
        self.vehicle.answer(command, handler(self, command) if handler else UNSUPPORTED)

    def order(self, mode: Mode) -> int:
        """A mode asked for by a command: the result."""
        if mode is not Mode.OFFBOARD and self.vehicle.home is None:
            return TEMPORARILY_REJECTED
        if self.vehicle.armed and not self.vehicle.located and mode is not Mode.LAND:
            return TEMPORARILY_REJECTED
        if mode is Mode.OFFBOARD and self.vehicle.armed and self._setpoints.lost:
            self.vehicle.say(
                mav.MAV_SEVERITY_CRITICAL, "Switching to mode 'Offboard' is currently not possible"
            )
            return TEMPORARILY_REJECTED
        if "stuck-mode" not in self.vehicle.faults.active:
            self._end_failsafe()
            self._enter(mode)
        return ACCEPTED

    def fail_into(self, mode: Mode) -> None:
        """A failsafe chooses the mode, until one is ordered."""
        self._enter(mode)
        self._failsafe, self._resumes = True, False

    def _end_failsafe(self) -> None:
        self._failsafe = self._resumes = False
        self._failsafes.cancel()

    def arm(self) -> int:
        """Arm, if ready, and begin the mode that it is in: the result."""
        if not self.ready:
            self.vehicle.say(mav.MAV_SEVERITY_CRITICAL, "Arming denied: Resolve system health failures first")
            return TEMPORARILY_REJECTED
        self.vehicle.arm()
        self._failsafes.forget()
        self._enter(self.mode)
        return ACCEPTED

    # Called by the vehicle

    def parameter_changed(self, name: str) -> None:
        """Limits take effect at once."""
        for limit in BOUND_LIMITS.get(name, ()):
            self._pilot.limit(limit, self._parameters[name])
        self._failsafes.parameter_changed()
        self._pace()

    def fence_changed(self) -> None:
        """It may not do."""
        self._failsafes.fence_changed()

    def disarmed(self) -> None:
        """Back to the mode before landing, which may be OFFBOARD."""
        self._end_failsafe()
        self._enter(self._resting_mode)


class ModeRow(NamedTuple):
    """What a mode does when it begins, motors running, and at every tick."""

    begin: Callable[[Px4], None]
    step: Callable[[Px4], None]


MODES = {
    Mode.LOITER: ModeRow(Px4._begin_loiter, Px4._nothing),
    Mode.TAKEOFF: ModeRow(Px4._begin_takeoff, Px4._step_takeoff),
    Mode.OFFBOARD: ModeRow(Px4._begin_offboard, Px4._step_offboard),
    Mode.RTL: ModeRow(Px4._begin_rtl, Px4._step_rtl),
    Mode.LAND: ModeRow(Px4._begin_land, Px4._nothing),
}
