"""One stub vehicle without I/O: bytes and the time go in, frames come out.

The vehicle knows its link, its streams, its parameters, whether it is armed and whether it stands on the
ground.  What differs between firmwares (modes, gates, failsafes) is its personality; its body is moved by
the fleet, which then calls `advance`.  All times are seconds of the fleet's clock, given as arguments.
"""

import math
from collections.abc import Callable
from typing import Any

from swarmctl.mavlink.codec import Decoder, Encoder, Frame
from swarmctl.mavlink.dialect import mav

from . import commands, telemetry
from .parameters import Entry, Parameters
from .personalities.base import Personality
from .personalities.registry import personality_named
from .pilot import Limits, Pilot
from .streams import Streams

COMPONENT: int = mav.MAV_COMP_ID_AUTOPILOT1
GCS: int = mav.MAV_TYPE_GCS
LOCATED_AFTER_S, HOME_AFTER_S = 2.0, 3.0
AIRBORNE_ABOVE_M = 0.2
TOUCHDOWN_S = 1.0
"""A vehicle that has been at rest on the ground for so long knows that it has landed."""
TEXT_BYTES = 50


class StubVehicle:
    """A vehicle of a fleet; `system` is its MAVLink system id, `place` where it stands (degrees, m)."""

    def __init__(
        self,
        system: int,
        autopilot: str,
        pilot: Pilot,
        limits: Limits,
        place: tuple[float, float, float],
        origin: tuple[float, float, float],
        now: float,
    ) -> None:
        self.system = system
        self.pilot = pilot
        self.limits = limits
        self.encoder = Encoder(system, COMPONENT)
        self.now = now
        self.boot_ms = 0
        self.wire = (0, 0, 0, 0, 0, 0, 0)
        """What GLOBAL_POSITION_INT tells from `lat` to `vz`, as of the last tick."""
        self.yaw = 0.0
        self.heading_cdeg = 0
        self.fleet_origin = origin
        self.local_origin = place
        self.home: tuple[float, float, float] | None = None
        self.home_place = (0.0, 0.0)
        self.located = False
        self.armed = False
        self.armed_at = now
        self.landed = True
        self.landed_at = now
        self.flown = False
        self._at_rest_since: float | None = now
        self._airborne_s = 0.0
        self._boot = now
        self._advanced_at = now
        self._decoder = Decoder()
        self._outbox: list[bytes] = []
        self._gcs_heard = False
        self._texts = 0
        personality = personality_named(autopilot)
        self.parameters = Parameters(personality.parameters(limits))
        self.personality: Personality = personality(self)
        self._streams = Streams(personality.INTERVALS_US, 0)
        self._handlers = self._handlers_of_messages()

    def _handlers_of_messages(self) -> dict[int, Callable[[Frame], None]]:
        """What is done with each message that has a target."""
        return {
            mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: self.personality.setpoint_local,
            mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: self.personality.setpoint_global,
            mav.MAVLINK_MSG_ID_COMMAND_LONG: self._command_long,
            mav.MAVLINK_MSG_ID_COMMAND_INT: self._command_int,
            mav.MAVLINK_MSG_ID_PARAM_REQUEST_READ: self._parameter_read,
            mav.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: self._parameter_list,
            mav.MAVLINK_MSG_ID_PARAM_SET: self._parameter_set,
        }

    # Bytes and time

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes off the link; answers are in `outgoing` at once, motion follows at the next tick."""
        self.now = now
        for frame in self._decoder.feed(data):
            handler = self._handlers.get(frame.message_id)
            if handler is not None:
                fields = frame.fields
                if fields.target_system in (self.system, 0) and fields.target_component in (COMPONENT, 0):
                    handler(frame)
            elif frame.message_id == mav.MAVLINK_MSG_ID_HEARTBEAT and frame.fields.type == GCS:
                self._gcs_heard = True

    def advance(self, now: float) -> None:
        """Time has passed and the body has moved: go on with the mode, send what is due."""
        elapsed, self._advanced_at = now - self._advanced_at, now
        self.now = now
        if not self.located or self.home is None:
            self._settle(now - self._boot)
        self._feel_ground(elapsed)
        self.personality.step()
        for message_id in self._streams.take_due(self._now_us):
            self.send(message_id)

    def outgoing(self) -> list[bytes]:
        """The frames to send, one a datagram; they are given out once."""
        frames, self._outbox = self._outbox, []
        return frames

    @property
    def since_boot(self) -> float:
        """Seconds since the vehicle was started."""
        return self.now - self._boot

    @property
    def _now_us(self) -> int:
        return round((self.now - self._boot) * 1e6)

    # Sending

    def encode(self, message: Any) -> bytes:
        """The frame of a pymavlink message."""
        return self.encoder.encode(message)

    def can_send(self, message_id: int) -> bool:
        """Whether this message exists here."""
        return message_id in telemetry.BUILDERS

    def send(self, message_id: int) -> bool:
        """Send one telemetry message; False if it does not exist or its content is not known yet."""
        build = telemetry.BUILDERS.get(message_id)
        frame = build(self) if build else None
        if frame is None:
            return False
        self._outbox.append(frame)
        return True

    def set_interval(self, message_id: int, interval_us: int) -> None:
        """Change a stream: microseconds, 0 for the default, negative for off."""
        self._streams.set_interval(message_id, interval_us, self._now_us)

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT in chunks, the last ending in a tab; only a ground station is told anything."""
        if not self._gcs_heard:
            return
        data = f"{text}\t".encode("ascii", "replace")
        chunks = [data[at : at + TEXT_BYTES] for at in range(0, len(data), TEXT_BYTES)]
        self._texts += 1
        number = self._texts & 0xFFFF if len(chunks) > 1 else 0
        for index, chunk in enumerate(chunks):
            self._outbox.append(self.encode(mav.MAVLink_statustext_message(severity, chunk, number, index)))

    def answer(self, command: commands.Command, result: int) -> None:
        """Acknowledge a command to its sender."""
        self._outbox.append(
            self.encode(
                mav.MAVLink_command_ack_message(
                    command.number, result, 0, 0, command.sender_system, command.sender_component
                )
            )
        )

    # Receiving

    def _command_long(self, frame: Frame) -> None:
        self._command(commands.from_long(frame))

    def _command_int(self, frame: Frame) -> None:
        self._command(commands.from_int(frame))

    def _command(self, command: commands.Command) -> None:
        on_link = commands.LINK_COMMANDS.get(command.number)
        if on_link is None:
            self.personality.command(command)
            return
        # A message that is asked for comes before the ACK, as PX4 sends it.
        self.answer(command, on_link(self, command))

    def _parameter_read(self, frame: Frame) -> None:
        fields = frame.fields
        index = fields.param_index
        name = fields.param_id if index < 0 else self.parameters.name_at(index)
        if name is None or name not in self.parameters:
            self._parameter_error(frame, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        else:
            self._parameter_value(self.parameters.entry(name))

    def _parameter_list(self, frame: Frame) -> None:
        for entry in self.parameters:
            self._parameter_value(entry)

    def _parameter_set(self, frame: Frame) -> None:
        fields = frame.fields
        name = fields.param_id
        if name not in self.parameters:
            self._parameter_error(frame, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        elif not self.parameters.set_from_wire(name, fields.param_value, fields.param_type):
            self._parameter_error(frame, mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
        else:
            self.personality.parameter_changed(name)
            self._parameter_value(self.parameters.entry(name))

    def _parameter_value(self, entry: Entry) -> None:
        message = mav.MAVLink_param_value_message(
            entry.name.encode(), entry.wire_value, entry.wire_type, len(self.parameters), entry.number
        )
        self._outbox.append(self.encode(message))

    def _parameter_error(self, frame: Frame, error: int) -> None:
        fields = frame.fields
        index = getattr(fields, "param_index", -1)
        name = fields.param_id.encode("ascii", "replace")
        message = mav.MAVLink_param_error_message(frame.system, frame.component, name, index, error)
        self._outbox.append(self.encode(message))

    # State

    @property
    def battery_percent(self) -> float:
        """What is left in the battery."""
        endurance = self.limits.endurance_s
        return 100.0 if endurance is None else max(0.0, 100.0 - 100.0 * self._airborne_s / endurance)

    def face(self, yaw: float) -> None:
        """Turn to this heading (rad, clockwise from north)."""
        if yaw != self.yaw:
            self.yaw = yaw
            self.heading_cdeg = round(math.degrees(yaw) * 100.0) % 36000

    def arm(self) -> None:
        """Start the motors; home is where the vehicle stands."""
        self.armed = True
        self.armed_at = self.now
        self.flown = False
        self._set_home()
        self.pilot.power(True)

    def disarm(self) -> None:
        """Stop the motors, wherever the vehicle is."""
        self.armed = False
        self.pilot.power(False)
        self.personality.disarmed()

    def _set_home(self) -> None:
        """Home is here."""
        lat, lon, alt = self.wire[:3]
        self.home = (lat * 1e-7, lon * 1e-7, alt * 1e-3)
        self.home_place = self.pilot.place[:2]

    def _settle(self, since_boot: float) -> None:
        """After boot: find the own position, then take it as home."""
        if not self.located and since_boot >= LOCATED_AFTER_S:
            self.located = True
            self.send(mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
        if self.home is None and since_boot >= HOME_AFTER_S:
            self._set_home()

    def _feel_ground(self, elapsed: float) -> None:
        """Tell standing from flying."""
        up = self.pilot.place[2]
        if up > 0.0:
            self._at_rest_since = None
            self._airborne_s += elapsed
            if self.landed and up > AIRBORNE_ABOVE_M:
                self.landed = False
                self.flown = True
        elif self._at_rest_since is None:
            self._at_rest_since = self.now
        elif not self.landed and self.now - self._at_rest_since >= TOUCHDOWN_S:
            self.landed = True
            self.landed_at = self.now
