"""ArduPilot, as a Copter of 4.8 was seen to behave, and one of 4.6 with its older parameter names.

A mode is a row of `MODES`: whether it can be entered without a position, whether it can be armed in, and
what it does when it begins and as time passes.  It streams nearly nothing unasked and starts slowly: the
checks of STABILIZE pass long before there is the position that GUIDED needs.  Commands, setpoints,
failsafes, the return and parameters are in the files beside this one.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

from ..commands import Command
from ..parameter_link import tell_value
from ..parameters import C_CAST
from ..pilot import Limits
from ..wire import Wire
from . import ardupilot_parameters
from .ardupilot_commands import ACCEPTED, COMMANDS, FAILED, UNSUPPORTED, Mode
from .ardupilot_failsafes import Failsafes
from .ardupilot_return import Return
from .ardupilot_setpoints import Setpoints
from .projection import to_flat

if TYPE_CHECKING:
    from ..vehicle import StubVehicle

CHECKED_AFTER_S = 23.0
SPOOL_UP_S = 1.0
HEIGHT_ACCEPTED_M = 0.25
APPROACH = 2.0
"""A place is approached with so many times the braking that the vehicle has when it is just told to stop."""
BASE_MODE: int = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mav.MAV_MODE_FLAG_STABILIZE_ENABLED


class ArduPilot:
    """One vehicle's ArduCopter."""

    autopilot: int = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    version = 0x04080000  # 4.8.0, development
    capabilities: int = mav.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    LIMITS = Limits(
        speed_mps=10.0, acceleration_mps2=2.5, braking_mps2=2.0, climb_mps=2.5, descent_mps=1.5, lag_s=0.4,
        climb_acceleration_mps2=2.5,
    )  # fmt: skip
    ENCODING = C_CAST
    INTERVALS_US: ClassVar[Mapping[int, int]] = {
        mav.MAVLINK_MSG_ID_HEARTBEAT: 1_000_000,
        mav.MAVLINK_MSG_ID_TIMESYNC: 10_000_000,
    }
    DATA_STREAMS: ClassVar[Mapping[int, tuple[int, ...]]] = {
        mav.MAV_DATA_STREAM_ALL: (1, 24, 30, 32, 33, 74, 147, 193),
        mav.MAV_DATA_STREAM_EXTENDED_STATUS: (1, 24),
        mav.MAV_DATA_STREAM_POSITION: (32, 33),
        mav.MAV_DATA_STREAM_EXTRA1: (30,),
        mav.MAV_DATA_STREAM_EXTRA2: (74,),
        mav.MAV_DATA_STREAM_EXTRA3: (147, 193),
    }
    LOCATED_AFTER_S, HOME_AFTER_S, QUIET_FOR_S = 41.0, 20.0, 1.0
    TEXT_END = ""
    texts_need_gcs = False
    requests_integers = False
    answers_any_component = True
    TAKES_KEYS = True
    tells_parameter_errors = False
    shows_prearm = True
    no_such_message: int = FAILED
    announces_origin = False
    OLD_NAMES = False

    @staticmethod
    def parameters(limits: Limits) -> dict[str, float]:
        """The parameters at boot; an int is an INT32 for good, a float a REAL32."""
        return ardupilot_parameters.at_boot(limits)

    @staticmethod
    def split_mode(number: int) -> tuple[float, float]:
        """The number is one parameter."""
        return float(number), 0.0

    def __init__(self, vehicle: "StubVehicle") -> None:
        self.vehicle = vehicle
        self.values = ardupilot_parameters.Reader(vehicle.parameters, self.OLD_NAMES)
        self.mode = Mode.STABILIZE
        self._pilot = vehicle.pilot
        self._setpoints = Setpoints(vehicle, self.values)
        self._failsafes = Failsafes(self)
        self._return = Return(self)
        self._failsafe = False
        self._takeoff_height: float | None = None
        self._lift_off_at: float | None = None
        self._greeted = False
        self._known: Wire = (0, 0, 0, 0, 0, 0, 0)
        limits = vehicle.limits
        self._pilot.limit("braking", limits.braking)
        self._pilot.limit("approach", APPROACH * limits.braking)
        self._pilot.limit("climb_acceleration", limits.climb_acceleration_mps2)
        self._pilot.limit("lag", limits.lag_s)
        self._pilot.limit("airspeed", limits.airspeed)
        self._pilot.limit("share", limits.velocity_share)
        self.values.set("MAV_SYSID", vehicle.system)
        self.parameter_changed("WP_SPD")

    # What telemetry tells

    @property
    def custom_mode(self) -> int:
        """The mode's number."""
        return int(self.mode)

    @property
    def base_mode(self) -> int:
        """Guided is told of all modes that fly by themselves."""
        alone = self.mode not in (Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER)
        return BASE_MODE | (int(mav.MAV_MODE_FLAG_GUIDED_ENABLED) if alone else 0)

    @property
    def system_status(self) -> int:
        """Critical in a failsafe, active in the air."""
        if self._failsafe:
            return int(mav.MAV_STATE_CRITICAL)
        return int(mav.MAV_STATE_STANDBY if self.vehicle.landed else mav.MAV_STATE_ACTIVE)

    @property
    def landed_state(self) -> int:
        """Landing and taking off are told by the mode, standing and flying by the body."""
        if self.vehicle.landed:
            return int(mav.MAV_LANDED_STATE_ON_GROUND)
        if self._takeoff_height is not None:
            return int(mav.MAV_LANDED_STATE_TAKEOFF)
        landing = self.mode is Mode.LAND or (MODES[self.mode].returns and self._return.landing)
        return int(mav.MAV_LANDED_STATE_LANDING if landing else mav.MAV_LANDED_STATE_IN_AIR)

    @property
    def ready(self) -> bool:
        """Whether the pre-arm checks of the present mode pass."""
        return self._refusal() is None

    @property
    def fence_bits(self) -> tuple[int, int, int]:
        """A fence that is switched off, or only reports, is present; it is healthy until it is broken."""
        values, bit = self.values, int(mav.MAV_SYS_STATUS_GEOFENCE)
        present = bit if values["FENCE_TYPE"] else 0
        enabled = present if values["FENCE_ENABLE"] and values["FENCE_ACTION"] else 0
        return present, enabled, 0 if self._failsafes.outside_fence else bit

    def unsure_position(self) -> Wire:
        """Zero latitude and longitude before the first fix; the last known ones without an estimate."""
        wire = self.vehicle.wire
        lat, lon = wire[:2] if self.vehicle.fixed else self._known[:2]
        return (lat, lon, *wire[2:])

    def local_ned(self) -> tuple[float, float, float]:
        """North, east, down (m) from the vehicle's own origin, as ArduPilot reckons."""
        origin_lat, origin_lon, origin_alt = self.vehicle.local_origin
        lat, lon, alt = self.vehicle.wire[:3]
        north, east = to_flat(lat * 1e-7, lon * 1e-7, origin_lat, origin_lon)
        return north, east, origin_alt - alt * 1e-3

    def is_ground_station(self, system: int) -> bool:
        """Only the one that the parameter names."""
        return system == self.values["MAV_GCS_SYSID"]

    # Time

    def step(self) -> None:
        """Watch the disarm timer and the failsafes, then go on with the mode."""
        vehicle = self.vehicle
        if vehicle.located:
            self._known = vehicle.wire
        if not self._greeted and vehicle.since_boot >= self.QUIET_FOR_S:
            self._greet()
        if not vehicle.armed:
            return
        if vehicle.landed and self._disarm_is_due():
            vehicle.disarm()
        else:
            self._failsafes.watch()
            MODES[self.mode].step(self)

    def _greet(self) -> None:
        """What it says unasked, once."""
        self._greeted = True
        vehicle = self.vehicle
        vehicle.say(mav.MAV_SEVERITY_INFO, f"ArduCopter V{self.version >> 24}.{self.version >> 16 & 0xFF}")
        for name in ardupilot_parameters.TOLD_AT_BOOT:
            tell_value(vehicle, vehicle.parameters.entry(name))

    def _disarm_is_due(self) -> bool:
        """On the ground: at once where a landing was meant, else after DISARM_DELAY."""
        vehicle = self.vehicle
        if not vehicle.flown:
            return vehicle.now - vehicle.armed_at >= self.values["DISARM_DELAY"]
        meant = self.mode is Mode.LAND or MODES[self.mode].returns
        return meant or vehicle.now - vehicle.landed_at >= self.values["DISARM_DELAY"]

    # Modes

    def _enter(self, mode: Mode) -> None:
        """Change the mode, and begin it if the motors run."""
        self.mode = mode
        self._takeoff_height = self._lift_off_at = None
        self._pace()
        if self.vehicle.armed:
            MODES[mode].begin(self)

    def _pace(self) -> None:
        """Tell the pilot how fast this mode may go."""
        v = self.values
        sinks = MODES[self.mode].begin is ArduPilot._begin_unattended
        descent = v["PILOT_SPD_DN" if sinks else "WP_SPD_DN"]
        self._pilot.pace(v["WP_SPD"], v["WP_SPD_UP"], descent, v["LAND_SPD_MS"])

    def _begin_stop(self) -> None:
        self._setpoints.stop()

    def _begin_unattended(self) -> None:
        """A pilot's mode: without his hand on the stick it sinks."""
        self._setpoints.stop()
        if not self.vehicle.landed:
            self._pilot.climb_rate(-self.values["PILOT_SPD_DN"])

    def _begin_land(self) -> None:
        self._setpoints.stop()
        if not self.vehicle.located:
            self._pilot.drift()

    def step_landing(self) -> None:
        """Down, slowly near the ground."""
        high = self._pilot.place[2] > self.values["LAND_ALT_LOW_M"]
        self._pilot.climb_rate(-self.values["WP_SPD_DN" if high else "LAND_SPD_MS"])

    def _begin_return(self) -> None:
        self._setpoints.stop()
        self._return.begin()

    def _step_return(self) -> None:
        self._return.step()

    def _step_guided(self) -> None:
        """Take off, or fly what the setpoints say."""
        if self._takeoff_height is None:
            self._setpoints.step()
        elif self._lift_off_at is not None:
            if self.vehicle.now >= self._lift_off_at:
                self._lift_off_at = None
                self._pilot.height(self._takeoff_height)
        elif abs(self._pilot.place[2] - self._takeoff_height) <= HEIGHT_ACCEPTED_M:
            self._takeoff_height = None

    def _nothing(self) -> None:
        """A mode in which time alone changes nothing."""

    # Setpoints

    def setpoint_local(self, frame: Frame) -> None:
        """Follow it in GUIDED."""
        if self._heeds_setpoints():
            self._setpoints.fly_local(frame.fields)

    def setpoint_global(self, frame: Frame) -> None:
        """As `setpoint_local`."""
        if self._heeds_setpoints():
            self._setpoints.fly_global(frame.fields)

    def _heeds_setpoints(self) -> bool:
        """Whether a setpoint is flown.  None lifts off; but any ends a take-off where it is, silently."""
        vehicle = self.vehicle
        if self.mode is not Mode.GUIDED or not vehicle.armed or "ignored-setpoints" in vehicle.faults.active:
            return False
        self._takeoff_height = self._lift_off_at = None
        if vehicle.landed:
            self._setpoints.stop()
        return not vehicle.landed

    # Commands

    def command(self, command: Command) -> None:
        """Obey and answer."""
        handler = COMMANDS.get(command.number)
        self.vehicle.answer(command, handler(self, command) if handler else UNSUPPORTED)

    def order(self, mode: Mode) -> int:
        """A mode asked for by a command: the result."""
        reason = self._obstacle(mode)
        if reason is not None:
            self.vehicle.say(mav.MAV_SEVERITY_WARNING, f"Mode change to {mode.name} failed: {reason}")
            return FAILED
        if "stuck-mode" not in self.vehicle.faults.active:
            self._failsafe = False
            self._enter(mode)
        return ACCEPTED

    def _obstacle(self, mode: Mode) -> str | None:
        """Why a mode cannot be entered now."""
        if mode is Mode.AUTO:
            return "missing mission"
        if self.vehicle.armed and MODES[mode].needs_position and not self.vehicle.located:
            return "requires position"
        return None

    def take_off(self, height: float) -> int:
        """Climb to ``height`` (m) above home: the result."""
        vehicle = self.vehicle
        if not (vehicle.armed and vehicle.landed and self.mode is Mode.GUIDED and vehicle.home):
            return FAILED
        vehicle.armed_at = vehicle.now
        self._setpoints.stop()
        self._takeoff_height = vehicle.home[2] + height - vehicle.zero_amsl_m
        self._lift_off_at = vehicle.now + SPOOL_UP_S
        return ACCEPTED

    def arm(self, force: bool) -> int:
        """Arm, if the checks pass or by force, and begin the mode that it is in: the result."""
        reason = self._refusal()
        if reason is not None and not force:
            self.vehicle.say(mav.MAV_SEVERITY_CRITICAL, f"Arm: {reason}")
            return FAILED
        self.vehicle.arm()
        self._failsafes.forget()
        self._enter(self.mode)
        return ACCEPTED

    def _refusal(self) -> str | None:
        """Why it cannot be armed now."""
        vehicle, row = self.vehicle, MODES[self.mode]
        if vehicle.since_boot < CHECKED_AFTER_S:
            return "AHRS not healthy"
        if "arming-refused" in vehicle.faults.active:
            return "Compass not calibrated"
        if not row.arms:
            return f"{self.mode.name} mode not armable"
        if row.needs_position and not vehicle.located:
            return "Need Position Estimate"
        if self._failsafes.misses_fence:
            return "Fences enabled, but none selected"
        return "Vehicle breaching fence" if self._failsafes.outside_fence else None

    def fail_into(self, mode: Mode) -> None:
        """A failsafe chooses the mode, or LAND where that mode needs a position that is lost."""
        self._enter(mode if self._obstacle(mode) is None else Mode.LAND)
        self._failsafe = True

    # Called by the vehicle

    def parameter_changed(self, name: str) -> None:
        """Limits take effect at once."""
        self._pilot.limit("speed", self.values["WP_SPD"])
        self._pilot.limit("acceleration", self.values["WP_ACC"])
        self._pace()

    def fence_changed(self) -> None:
        """It will do."""

    def disarmed(self) -> None:
        """The mode stays; a failsafe is over."""
        self._failsafe = False
        self._takeoff_height = self._lift_off_at = None


class ArduPilot46(ArduPilot):
    """ArduCopter 4.6: the same, with the older parameters."""

    version = 0x040603FF  # 4.6.3, release
    OLD_NAMES = True

    @staticmethod
    def parameters(limits: Limits) -> dict[str, float]:
        """The parameters at boot; an int is an INT32 for good, a float a REAL32."""
        return ardupilot_parameters.at_boot_of_old(limits)


class ModeRow(NamedTuple):
    """What a mode needs, and does when it begins, motors running, and at every tick."""

    begin: Callable[[ArduPilot], None]
    step: Callable[[ArduPilot], None]
    needs_position: bool
    arms: bool = False
    returns: bool = False


MODES = {
    Mode.STABILIZE: ModeRow(ArduPilot._begin_unattended, ArduPilot._nothing, False, arms=True),
    Mode.ALT_HOLD: ModeRow(ArduPilot._begin_unattended, ArduPilot._nothing, False, arms=True),
    Mode.AUTO: ModeRow(ArduPilot._begin_stop, ArduPilot._nothing, True),
    Mode.GUIDED: ModeRow(ArduPilot._begin_stop, ArduPilot._step_guided, True, arms=True),
    Mode.LOITER: ModeRow(ArduPilot._begin_unattended, ArduPilot._nothing, True, arms=True),
    Mode.RTL: ModeRow(ArduPilot._begin_return, ArduPilot._step_return, True, returns=True),
    Mode.LAND: ModeRow(ArduPilot._begin_land, ArduPilot.step_landing, False),
    Mode.BRAKE: ModeRow(ArduPilot._begin_stop, ArduPilot._nothing, True),
    Mode.SMART_RTL: ModeRow(ArduPilot._begin_return, ArduPilot._step_return, True, returns=True),
}
