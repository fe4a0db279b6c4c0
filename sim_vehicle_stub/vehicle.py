"""One stub vehicle without I/O: bytes and the time go in, frames come out.

The vehicle knows its link, its streams, its parameters, whether it is armed and whether it stands on the
ground.  What differs between firmwares (modes, gates, failsafes) is its personality; its body is moved by
the fleet, which then calls `advance`.  All times are seconds of the fleet's clock, given as arguments.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from swarmctl.core.calls import to_geodetic
from swarmctl.mavlink.codec import Decoder, Encoder, Frame
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.messages import Timesync

from . import commands, file_transfer, parameter_link, telemetry
from .battery import Battery
from .faults import Faults
from .fences import Fence, fence_of
from .keyring import Keyring
from .network import Network
from .parameters import Parameters
from .personalities.base import Personality
from .personalities.registry import personality_named
from .pilot import Limits, Pilot
from .plans import Item, Plans
from .streams import Streams
from .wire import Wire

COMPONENT: int = mav.MAV_COMP_ID_AUTOPILOT1
GCS: int = mav.MAV_TYPE_GCS
REBOOT_TAKES_S = 2.0
REGAINED_AFTER_S = 3.0
"""How long it takes to find the own position again once there is a fix."""
AIRBORNE_ABOVE_M = 0.2
TOUCHDOWN_S = 1.0
"""A vehicle that has been at rest on the ground for so long knows that it has landed."""
TEXT_BYTES = 50
Handler = Callable[[Frame], None]


@dataclass(frozen=True)
class Surroundings:
    """What a vehicle flies in and how its sensors read it.

    ``origin``: latitude, longitude (degrees) and altitude (m) of the fleet's frame.  ``altitude_error_m``:
    metres by which altitudes above sea level read too high.  ``start_error_m``: east, north and up from where
    it boots to the origin of its own local frame.  ``seed``: for the network's dice.  ``key``, ``date_s``: to sign
    with, and the date at time zero.
    """

    origin: tuple[float, float, float]
    altitude_error_m: float = 0.0
    start_error_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0
    key: bytes | None = None
    date_s: float = 0.0


class StubVehicle:
    """A vehicle of a fleet; `system` is its MAVLink system id."""

    def __init__(
        self,
        system: int,
        autopilot: str,
        pilot: Pilot,
        limits: Limits | None,
        surroundings: Surroundings,
        now: float,
    ) -> None:
        kind = personality_named(autopilot)
        self.system = system
        self.pilot: Pilot = pilot
        self.limits = limits or kind.LIMITS
        self.encoder = Encoder(system, COMPONENT)
        self.fleet_origin = surroundings.origin
        self.zero_amsl_m = surroundings.origin[2] + surroundings.altitude_error_m
        """The altitude above sea level that this vehicle's sensors give the fleet's height zero."""
        self.parameters = Parameters(kind.parameters(self.limits), kind.ENCODING)
        self.battery: Battery = Battery(self.limits.endurance_s)
        self.network: Network = Network(f"{surroundings.seed} {system}")
        self.faults = Faults(self)
        self.plans = Plans(self)
        self.keyring: Keyring = Keyring(self, surroundings.key, surroundings.date_s)
        self.fence: Fence | None = None
        self._start_error_m = surroundings.start_error_m
        self._kind = kind
        self._any_component = kind.answers_any_component
        self._first_boot = now
        self.now = now
        self._boot(now)

    def _boot(self, now: float) -> None:
        """All that a reboot, which is over at ``now``, makes anew; parameters and plans outlast it."""
        self.booted_at = now
        self.boot_offset_ms = round((now - self._first_boot) * 1000.0)
        self.boot_ms = 0
        self.wire: Wire = (0, 0, 0, 0, 0, 0, 0)
        """What GLOBAL_POSITION_INT tells from `lat` to `vz`, as of the last tick."""
        self.yaw = 0.0
        self.heading_cdeg = 0
        self.local_origin = self._place_of_boot()
        self.home: tuple[float, float, float] | None = None
        self.home_place = (0.0, 0.0)
        self.fixed = False
        self.located = False
        self._located_at = now + self._kind.LOCATED_AFTER_S
        self.armed = False
        self.armed_at = now
        self.landed = True
        self.landed_at = now
        self.flown = False
        self.gcs_at: float | None = None
        """When a ground station's heartbeat came last."""
        self.encoder.sequence = 0
        self._at_rest_since: float | None = now
        self._advanced_at = now
        self.listen_with(self.keyring.decoder())
        self._outbox: list[bytes] = []
        self._texts = 0
        self.personality: Personality = self._kind(self)
        self._streams = Streams(self.personality.INTERVALS_US, round(self.personality.QUIET_FOR_S * 1e6))
        self._handlers = self._handlers_of_messages()
        self._open_handlers = self._handlers_of_open_messages()

    def _place_of_boot(self) -> tuple[float, float, float]:
        """The origin of the local frame, where the vehicle stands now: degrees, degrees, m above sea level."""
        east, north, up = self.pilot.place[:3]
        d_east, d_north, d_up = self._start_error_m
        lat, lon = to_geodetic(east + d_east, north + d_north, *self.fleet_origin)
        return lat, lon, self.zero_amsl_m + up + d_up

    def _handlers_of_messages(self) -> dict[int, Handler]:
        """What is done with each message that has a target."""
        plans = self.plans
        return {
            mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: self.personality.setpoint_local,
            mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: self.personality.setpoint_global,
            mav.MAVLINK_MSG_ID_SETUP_SIGNING: self.keyring.set_up,
            mav.MAVLINK_MSG_ID_COMMAND_LONG: self._command_long,
            mav.MAVLINK_MSG_ID_COMMAND_INT: self._command_int,
            mav.MAVLINK_MSG_ID_PARAM_REQUEST_READ: partial(parameter_link.read, self),
            mav.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: partial(parameter_link.read_all, self),
            mav.MAVLINK_MSG_ID_PARAM_SET: partial(parameter_link.write, self),
            mav.MAVLINK_MSG_ID_REQUEST_DATA_STREAM: self._request_data_stream,
            mav.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: partial(file_transfer.answer, self),
            mav.MAVLINK_MSG_ID_MISSION_COUNT: plans.count,
            mav.MAVLINK_MSG_ID_MISSION_ITEM: plans.item,
            mav.MAVLINK_MSG_ID_MISSION_ITEM_INT: plans.item_int,
            mav.MAVLINK_MSG_ID_MISSION_REQUEST: plans.request,
            mav.MAVLINK_MSG_ID_MISSION_REQUEST_INT: plans.request_int,
            mav.MAVLINK_MSG_ID_MISSION_REQUEST_LIST: plans.request_list,
            mav.MAVLINK_MSG_ID_MISSION_CLEAR_ALL: plans.clear,
        }

    def _handlers_of_open_messages(self) -> dict[int, Handler]:
        """What is done with messages that have no target, or not in the usual two fields."""
        return {
            mav.MAVLINK_MSG_ID_HEARTBEAT: self._heartbeat,
            mav.MAVLINK_MSG_ID_TIMESYNC: self._timesync,
            mav.MAVLINK_MSG_ID_SET_MODE: self._set_mode,
        }

    # Bytes and time

    def listen_with(self, decoder: Decoder) -> None:
        """From now on."""
        self._decoder = decoder

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes off the link; answers are in `outgoing` at once, motion follows at the next tick."""
        self.now = now
        if self.network.perfect:
            self._take(data)
        else:
            for arrived in self.network.up((data,), now):
                self._take(arrived)

    def _take(self, data: bytes) -> None:
        if self.now < self.booted_at:
            return
        for frame in self._decoder.feed(data):
            handler = self._handlers.get(frame.message_id)
            if handler is not None:
                fields = frame.fields
                if fields.target_system in (self.system, 0) and (
                    self._any_component or fields.target_component in (COMPONENT, 0)
                ):
                    handler(frame)
            elif frame.message_id in self._open_handlers:
                self._open_handlers[frame.message_id](frame)

    def advance(self, now: float) -> None:
        """Time has passed and the body has moved: go on with the mode, send what is due."""
        elapsed, self._advanced_at = now - self._advanced_at, now
        self.now = now
        if not self.network.perfect:
            for arrived in self.network.up((), now):
                self._take(arrived)
        if not self.located or self.home is None:
            self._settle()
        self._feel_ground(elapsed)
        if self.plans.upload is not None:
            self.plans.advance()
        self.personality.step()
        for message_id in self._streams.take_due(self._now_us):
            self.send(message_id)

    def outgoing(self) -> list[bytes]:
        """The frames to send, one a datagram; they are given out once."""
        frames, self._outbox = self.keyring.signed(self._outbox), []
        return frames if self.network.perfect else self.network.down(frames, self.now)

    @property
    def since_boot(self) -> float:
        """Seconds since the vehicle was started."""
        return self.now - self.booted_at

    @property
    def _now_us(self) -> int:
        return round((self.now - self.booted_at) * 1e6)

    # Sending

    def encode(self, message: Any) -> bytes:
        """The frame of a message, as the encoder takes it."""
        return self.encoder.encode(message)

    def send_message(self, message: Any) -> None:
        """Send a message, as the encoder takes it."""
        self._outbox.append(self.encoder.encode(message))

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

    def interval_us(self, message_id: int) -> int:
        """Microseconds between two messages of a stream; negative: off."""
        return self._streams.interval_us(message_id)

    def set_interval(self, message_id: int, interval_us: int) -> None:
        """Change a stream: microseconds, 0 for the default, negative for off."""
        self._streams.set_interval(message_id, interval_us, self._now_us)

    def say(self, severity: int, text: str) -> None:
        """Send a STATUSTEXT, in chunks if it is long; some firmware tells only a ground station."""
        personality = self.personality
        if personality.texts_need_gcs and self.gcs_at is None:
            return
        data = f"{text}{personality.TEXT_END}".encode("ascii", "replace")
        chunks = [data[at : at + TEXT_BYTES] for at in range(0, len(data), TEXT_BYTES)]
        self._texts += 1
        number = self._texts & 0xFFFF if len(chunks) > 1 else 0
        for index, chunk in enumerate(chunks):
            self.send_message(mav.MAVLink_statustext_message(severity, chunk, number, index))

    def answer(self, command: commands.Command, result: int) -> None:
        """Acknowledge a command to its sender."""
        self.send_message(
            mav.MAVLink_command_ack_message(
                command.number, result, 0, 0, command.sender_system, command.sender_component
            )
        )

    # Receiving

    def _heartbeat(self, frame: Frame) -> None:
        if frame.fields.type == GCS and self.personality.is_ground_station(frame.system):
            self.gcs_at = self.now

    def _timesync(self, frame: Frame) -> None:
        if frame.fields.tc1 == 0:
            self.send_message(Timesync(self._now_us * 1000, frame.fields.ts1))

    def _set_mode(self, frame: Frame) -> None:
        """SET_MODE, the older message of the command, which answers as that does."""
        if frame.fields.target_system == self.system:
            self._command(commands.from_set_mode(frame, self.personality.split_mode))

    def _request_data_stream(self, frame: Frame) -> None:
        """REQUEST_DATA_STREAM: Hz for a group of messages, of those firmwares that have groups."""
        fields = frame.fields
        rate = fields.req_message_rate if fields.start_stop else 0
        interval = round(1e6 / rate) if rate else -1
        for message_id in self.personality.DATA_STREAMS.get(fields.req_stream_id, ()):
            self.set_interval(message_id, interval)

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

    # State

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

    def reboot(self) -> None:
        """Start anew, motors off and deaf for a while: streams, mode, home and sequence numbers are gone."""
        self.pilot.power(False)
        self._boot(self.now + REBOOT_TAKES_S)
        if "gps-loss" in self.faults.active:
            self.lose_fix()

    def start(self, now: float) -> None:
        """Boot now, as firmware that has waited for its first client does."""
        self.now = now
        self._boot(now)

    def build_fence(self, items: list[Item]) -> None:
        """Hold the fence that these items describe, or none."""
        self.fence = fence_of(items, self.fleet_origin) if items else None
        self.personality.fence_changed()

    def lose_fix(self) -> None:
        """No satellite is seen any more."""
        self.fixed = self.located = False
        self._located_at = math.inf

    def regain_fix(self) -> None:
        """Satellites are seen again."""
        self._located_at = self.now + REGAINED_AFTER_S

    def _set_home(self) -> None:
        """Home is here."""
        lat, lon, alt = self.wire[:3]
        self.home = (lat * 1e-7, lon * 1e-7, alt * 1e-3)
        self.home_place = self.pilot.place[:2]

    def _settle(self) -> None:
        """After boot: find the own position, and take it as home."""
        fixable = self._located_at < math.inf
        if fixable and self.home is None and self.since_boot >= self._kind.HOME_AFTER_S:
            self.fixed = True
            self._set_home()
        if not self.located and self.now >= self._located_at:
            self.fixed = self.located = True
            if self.personality.announces_origin:
                self.send(mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)

    def _feel_ground(self, elapsed: float) -> None:
        """Tell standing from flying."""
        up = self.pilot.place[2]
        if up > 0.0:
            self._at_rest_since = None
            self.battery.drain(elapsed)
            if self.battery.empty:
                self.pilot.break_motors(True)
            if self.landed and up > AIRBORNE_ABOVE_M:
                self.landed = False
                self.flown = True
        elif self._at_rest_since is None:
            self._at_rest_since = self.now
        elif not self.landed and self.now - self._at_rest_since >= TOUCHDOWN_S:
            self.landed = True
            self.landed_at = self.now
