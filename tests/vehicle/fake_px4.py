"""A scripted PX4 that does as it is told.

Unlike the stub, it can be told to misbehave: each attribute of ``FakePx4`` is one way to.
"""

from typing import Any

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES

from .fake_memory import FakeMemory

HOME_ALT_M, ORIGIN_ALT_M = 488.0, 487.4
ACCEPTED = mav.MAV_RESULT_ACCEPTED
INTERVAL, REQUEST = mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAV_CMD_REQUEST_MESSAGE
ARM_DISARM, SET_MODE, TAKEOFF = (
    mav.MAV_CMD_COMPONENT_ARM_DISARM,
    mav.MAV_CMD_DO_SET_MODE,
    mav.MAV_CMD_NAV_TAKEOFF,
)


class FakePx4:
    """Enough of PX4 to answer a session, with a switch for each thing that can go wrong."""

    def __init__(self, system: int) -> None:
        self.system = system
        self.encoder = Encoder(system, 1)
        self.decoder = Decoder()
        self.autopilot: int = mav.MAV_AUTOPILOT_PX4
        self.silent = False  # sends nothing
        self.deaf: set[int] = set()  # commands that never arrive
        self.mute: set[int] = set()  # commands that are done, but whose ACK is lost
        self.results: dict[int, list[list[int]]] = {}  # command → the ACKs of each time it comes
        self.idle: set[int] = set()  # commands that are accepted and have no effect
        self.healthy = True
        self.fixed = True
        self.home_known = True
        self.auto_disarm = True
        self.mode_after_disarm: int | None = None
        self.landed_state: int | None = None  # said instead of the truth
        self.mode = MODES.hold
        self.armed = False
        self.height_m = 0.0
        self.v_up = 0.0
        self.target_m = 0.0
        self.position_en = [0.0, 0.0]
        self.velocity_en = (0.0, 0.0)
        self.asked: list[Any] = []
        self.setpoints: list[Any] = []
        self.ground_heartbeats = 0
        self.out: list[bytes] = []
        self.booted_at = 0.0
        self.battery = 87
        self.memory = FakeMemory(self.send, bytewise=True)
        self._next = {"heartbeat": 0.0, "position": 0.0, "status": 0.0}

    def asked_for(self, command: int) -> list[Any]:
        return [message for message in self.asked if message.command == command]

    def send(self, message: Any) -> None:
        if not self.silent:
            self.out.append(self.encoder.encode(message))

    def say(self, text: str) -> None:
        self.send(mav.MAVLink_statustext_message(mav.MAV_SEVERITY_WARNING, text.encode()))

    def heartbeat(self) -> None:
        base = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mav.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0)
        kind = mav.MAV_TYPE_QUADROTOR
        self.send(
            mav.MAVLink_heartbeat_message(kind, self.autopilot, base, self.mode, mav.MAV_STATE_ACTIVE, 3)
        )

    def receive(self, data: bytes) -> None:
        for frame in self.decoder.feed(data):
            fields = frame.fields
            if frame.message_id == mav.MAVLINK_MSG_ID_HEARTBEAT:
                self.ground_heartbeats += 1
            elif frame.message_id == mav.MAVLINK_MSG_ID_TIMESYNC or fields.target_system != self.system:
                continue
            elif frame.message_id == mav.MAVLINK_MSG_ID_COMMAND_LONG:
                self.command(fields)
            elif frame.message_id == mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
                self.setpoints.append(fields)
                self.fly(fields)
            else:
                self.memory.receive(frame.message_id, fields)

    def fly(self, fields: Any) -> None:
        """A setpoint."""
        if self.mode == MODES.engaged:
            self.velocity_en = (fields.vy, fields.vx)
            self.target_m = ORIGIN_ALT_M - fields.z - HOME_ALT_M

    def verdict(self, fields: Any) -> int:
        """The answer to a command for which no test has scripted one."""
        return int(ACCEPTED)

    def command(self, fields: Any) -> None:
        self.asked.append(fields)
        if fields.command in self.deaf:
            return
        script = self.results.get(fields.command, [])
        results = script.pop(0) if script else [self.verdict(fields)]
        if fields.command not in self.mute:
            for result in results:
                self.send(mav.MAVLink_command_ack_message(fields.command, result, 0, 0, 255, 190))
        if results == [ACCEPTED] and fields.command not in self.idle:
            self.obey(fields)

    def obey(self, fields: Any) -> None:
        if fields.command == REQUEST:
            self.answer(int(fields.param1))
        elif fields.command == SET_MODE:
            self.mode = int(fields.param2) << 16 | int(fields.param3) << 24
            self.velocity_en = (0.0, 0.0)
        elif fields.command == TAKEOFF:
            self.mode, self.target_m = MODES.take_off, fields.param7 - HOME_ALT_M
        elif fields.command == ARM_DISARM:
            self.armed = fields.param1 == 1.0

    def answer(self, message_id: int) -> None:
        if message_id == mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN:
            alt = round(ORIGIN_ALT_M * 1000)
            self.send(mav.MAVLink_gps_global_origin_message(473977420, 85455940, alt))
        elif message_id == mav.MAVLINK_MSG_ID_HOME_POSITION and self.home_known:
            alt = round(HOME_ALT_M * 1000)
            q = [1.0, 0.0, 0.0, 0.0]
            self.send(mav.MAVLink_home_position_message(473977420, 85455940, alt, 0, 0, 0, q, 0, 0, 0))
        elif message_id == mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            empty = [0] * 8
            version = 1 << 24 | 17 << 16
            self.send(
                mav.MAVLink_autopilot_version_message(0, version, 0, 0, 0, empty, empty, empty, 0, 0, 0)
            )

    def advance(self, now: float, dt: float) -> None:
        self.move(dt)
        self.memory.advance(now)
        for stream, period, emit in (
            ("heartbeat", 1.0, self.heartbeat),
            ("position", 0.1, lambda: self.position(now)),
            ("status", 0.5, self.status),
        ):
            if now + 1e-9 >= self._next[stream]:
                self._next[stream] = now + period
                emit()

    def move(self, dt: float) -> None:
        climb = {MODES.land: -1.0 if self.height_m > 0 else 0.0}.get(self.mode, self.target_m - self.height_m)
        self.v_up = max(-2.5, min(2.5, climb)) if self.armed else -5.0 * (self.height_m > 0)
        self.height_m = max(0.0, self.height_m + self.v_up * dt)
        self.position_en[0] += self.velocity_en[0] * dt
        self.position_en[1] += self.velocity_en[1] * dt
        if self.mode == MODES.take_off and self.armed and abs(self.target_m - self.height_m) < 0.2:
            self.mode = MODES.hold
        if self.mode == MODES.land and self.height_m == 0.0 and self.auto_disarm:
            self.mode = self.mode_after_disarm or self.mode if self.armed else self.mode
            self.armed = False

    def position(self, now: float) -> None:
        lat = 473977420 + round(self.position_en[1] * 90) if self.fixed else 0
        lon = 85455940 + round(self.position_en[0] * 133) if self.fixed else 0
        alt = round((HOME_ALT_M + self.height_m) * 1000)
        v_east, v_north = (round(v * 100) for v in self.velocity_en)
        up = round(self.v_up * 100)
        relative = round(self.height_m * 1000)
        message = mav.MAVLink_global_position_int_message(
            round((now - self.booted_at) * 1000), lat, lon, alt, relative, v_north, v_east, -up, 0
        )
        self.send(message)

    def status(self) -> None:
        landed = mav.MAV_LANDED_STATE_IN_AIR if self.height_m > 0.1 else mav.MAV_LANDED_STATE_ON_GROUND
        self.send(mav.MAVLink_extended_sys_state_message(0, self.landed_state or landed))
        health = mav.MAV_SYS_STATUS_PREARM_CHECK if self.healthy else 0
        self.send(mav.MAVLink_sys_status_message(0, 0, health, 0, 0, -1, self.battery, 0, 0, 0, 0, 0, 0))
