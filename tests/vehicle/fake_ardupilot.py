"""A scripted ArduCopter: what AUTOPILOTS says of it, as far as a session can notice."""

from typing import Any

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.ardupilot import GUIDED, MODES

from .fake_memory import FakeMemory
from .fake_px4 import ACCEPTED, ARM_DISARM, INTERVAL, REQUEST, SET_MODE, TAKEOFF, FakePx4

FAILED = mav.MAV_RESULT_FAILED
STABILIZE, BRAKE, LAND = 0, 17, 9
SETPOINT_TIMEOUT_S, AUTO_DISARM_S = 3.1, 10.0
POSITION, STATE, STATUS, EKF, LOCAL = (
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    mav.MAVLINK_MSG_ID_SYS_STATUS,
    mav.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
)


class FakeArduPilot(FakePx4):
    """Its gates open ``home_at``, ``prearm_at`` and ``estimate_at`` seconds after boot."""

    def __init__(self, system: int) -> None:
        super().__init__(system)
        self.autopilot = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
        self.mode = STABILIZE
        self.home_at, self.prearm_at, self.estimate_at = 20.0, 23.0, 41.0
        self.memory = FakeMemory(self.send, bytewise=False)
        self.memory.old_request = True
        self.memory.unknown_answered = False
        self.now = 0.0
        self.intervals: dict[int, float] = {}
        self.due: dict[int, float] = {}
        self.climbing = False
        self.armed_at = self.setpoint_at = 0.0

    @property
    def uptime(self) -> float:
        return self.now - self.booted_at

    @property
    def estimated(self) -> bool:
        return self.uptime >= self.estimate_at

    def reboot(self) -> None:
        """Everything that was asked for is forgotten."""
        self.booted_at, self.mode, self.armed = self.now, STABILIZE, False
        self.intervals.clear()
        self.encoder.sequence = 0

    def verdict(self, fields: Any) -> int:
        grounded = self.height_m == 0.0
        refused = {
            ARM_DISARM: fields.param1 == 1.0 and (self.mode != GUIDED or not self.estimated),
            TAKEOFF: not (self.armed and self.mode == GUIDED and grounded),
            REQUEST: int(fields.param1) == mav.MAVLINK_MSG_ID_HOME_POSITION and self.uptime < self.home_at,
            SET_MODE: fields.param2 not in MODES.names or (self.armed and not self.estimated),
        }
        if refused.get(fields.command, False):
            self.say(f"refused {fields.command}")
            return int(FAILED)
        return int(ACCEPTED)

    def obey(self, fields: Any) -> None:
        if fields.command == SET_MODE:
            self.mode, self.climbing = int(fields.param2), False
            self.velocity_en, self.v_up = (0.0, 0.0), 0.0
        elif fields.command == TAKEOFF:
            self.climbing, self.target_m = True, fields.param7
        elif fields.command == INTERVAL:
            self.intervals[int(fields.param1)] = fields.param2 / 1e6
        else:
            self.armed_at = self.now
            super().obey(fields)

    def fly(self, fields: Any) -> None:
        """Velocity, all three axes or none; one during the climb cancels it."""
        self.climbing = False
        ignored = fields.type_mask & 0b111000
        if self.mode == GUIDED and fields.coordinate_frame == 1 and not ignored and self.height_m > 0.0:
            self.setpoint_at = self.now
            self.velocity_en, self.v_up = (fields.vy, fields.vx), -fields.vz

    def advance(self, now: float, dt: float) -> None:
        self.now = now
        self.move(dt)
        self.memory.advance(now)
        if now + 1e-9 >= self._next["heartbeat"]:
            self._next["heartbeat"] = now + 1.0
            self.heartbeat()
        for message_id, period in self.intervals.items():
            if period > 0 and now + 1e-9 >= self.due.get(message_id, 0.0):
                self.due[message_id] = now + period
                self.stream(message_id)

    def stream(self, message_id: int) -> None:
        if message_id == POSITION:
            self.fixed = self.uptime >= self.home_at
            self.position(self.now)
        elif message_id == STATE:
            landed = mav.MAV_LANDED_STATE_ON_GROUND
            if self.height_m > 0.0:
                landed = mav.MAV_LANDED_STATE_TAKEOFF if self.climbing else mav.MAV_LANDED_STATE_IN_AIR
            self.send(mav.MAVLink_extended_sys_state_message(0, self.landed_state or landed))
        elif message_id == STATUS:
            ready = self.uptime >= (self.estimate_at if self.mode == GUIDED else self.prearm_at)
            health = mav.MAV_SYS_STATUS_PREARM_CHECK if ready and self.healthy else 0
            message = mav.MAVLink_sys_status_message(0, 0, health, 0, 0, -1, self.battery, 0, 0, 0, 0, 0, 0)
            self.send(message)
        elif message_id == EKF:
            self.send(mav.MAVLink_ekf_status_report_message(0x33F if self.estimated else 0x7, 0, 0, 0, 0, 0))
        elif message_id == LOCAL and self.estimated:
            self.send(mav.MAVLink_local_position_ned_message(1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))

    def move(self, dt: float) -> None:
        if self.climbing:
            self.v_up = min(2.5, max(0.0, self.target_m - self.height_m))
            self.climbing = self.target_m - self.height_m > 0.1
        elif self.mode == LAND:
            self.v_up = -0.5 if self.height_m < 10.0 else -1.5
        elif self.mode == BRAKE or self.now - self.setpoint_at > SETPOINT_TIMEOUT_S:
            self.velocity_en, self.v_up = (0.0, 0.0), 0.0
        self.height_m = max(0.0, self.height_m + self.v_up * dt) if self.armed else self.height_m
        self.position_en[0] += self.velocity_en[0] * dt
        self.position_en[1] += self.velocity_en[1] * dt
        idle = self.height_m == 0.0 and not self.climbing
        waited = self.mode == LAND or self.now - self.armed_at > AUTO_DISARM_S
        if self.armed and idle and waited and self.auto_disarm:
            self.armed = False
