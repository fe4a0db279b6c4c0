"""One autopilot over MAVLink, without I/O: bytes and the time go in, bytes and events come out.

Whoever runs a session hands it what arrived (``receive``), lets time pass (``poll``, at the latest at
``next_deadline``), gives orders and setpoints, and sends each item of ``outgoing()`` as one datagram.  All
times are the caller's, in seconds of any monotonic clock; orders happen at the time of the last ``receive``
or ``poll``.  What the session does is a walk through the table in ``phases``; what a firmware wants
differently is in its adapter.

What happens in the air, and what the session does about it:

- The vehicle is silent, sends no heartbeats for longer, or answers nothing: LOST.  No setpoint is sent, so the
  firmware's own failsafe takes over; only a landing that was ordered is still asked for, because a vehicle that
  is not heard may hear.  When the link is back, a vehicle that was being set up is set up again from the start,
  for it may have restarted; one that was flying has the phase that it had, and what telemetry then shows decides.
- Another controller took it off and died: it is FOUND in the air, and ``adopt``ed by order.
- Its mode is not ours: RELEASED.  A pilot or a failsafe flies it and is not fought; ``retake`` is an order.
- It comes with heartbeats but without positions: it is landed, for nobody could keep it inside its fence.
- It disarms, comes down unasked, or its autopilot restarts: FAILED.  On the ground a restarted vehicle is set up again.
- Its battery is low, or it does not fly its setpoints: an event; what to do about it is for the caller to say.
"""

from array import array
from collections.abc import Mapping
from typing import Any

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

from . import procedures
from .events import Event, EventKind
from .link import GROUND_COMPONENT, GROUND_SYSTEM
from .machine import Machine
from .phases import FLYING, SET_UP, TABLE, Phase, Signal
from .preflight import Preflight
from .protection import Protection
from .reading import READERS, read_clock, read_position
from .statistics import NANOSECONDS, Statistics
from .steps import TIME_SLACK_S
from .watch import RESTART_MS

GLOBAL_POSITION_INT: int = mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT
LANDED_STATE: int = mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE
COMMAND_ACK: int = mav.MAVLINK_MSG_ID_COMMAND_ACK
STATUSTEXT: int = mav.MAVLINK_MSG_ID_STATUSTEXT
TIMESYNC: int = mav.MAVLINK_MSG_ID_TIMESYNC

# Metres and metres a second beyond which a setpoint is a mistake, and might not fit its field.
PLAUSIBLE = 1e6


class OrderError(Exception):
    """An order that the session's phase does not allow, or that makes no sense."""


class Session(Machine):
    """The controller's side of one vehicle. ``telemetry`` and ``phase`` are there to be read at any time."""

    # What the caller does

    def receive(self, data: bytes, now: float) -> None:
        """Take in bytes from the link: any part of a frame, or many, of any vehicle."""
        self._now = now
        for frame in self._link.take(data):
            self._heard_at = now
            if frame.message_id == GLOBAL_POSITION_INT:
                booted_ms = self.telemetry.boot_ms
                read_position(self.telemetry, frame.fields, now)
                if self.telemetry.boot_ms < booted_ms - RESTART_MS:
                    self.telemetry.forget_clock()
                    self._restarted()
            else:
                self._read(frame)
        if self._procedure is not None:
            self._advance()

    def poll(self, now: float) -> None:
        """Let time pass: heartbeats, time-outs, retries. Costs nothing before ``next_deadline``."""
        self._now = now
        if now + TIME_SLACK_S < self._wake:
            return
        if now + TIME_SLACK_S >= self._heartbeat_due:
            self._heartbeat_due = now + self._settings.heartbeat_period_s
            self._link.send_heartbeat()
            self._tell_refusals()
            if self.phase is not Phase.CONNECTING:
                self._link.send_message(self._tally.ping(now))
        if now + TIME_SLACK_S >= self._link_deadline():
            self._signal(Signal.LINK_LOST)
        if self._procedure is not None:
            self._advance()
        self._schedule()

    def excuse_silence(self, now: float) -> None:
        """The caller stood still until ``now``: what did not come, or was not done, was not the vehicle's fault."""
        self._now = self._heard_at = self._beat_at = now
        self._answered_at = None if self._answered_at is None else now
        self._watch.forgive()
        if self._procedure is not None:
            self._procedure.begin_step(now)
        self._schedule()

    def check(self, preflight: Preflight) -> None:
        """Order: do this before flight, now and after every restart; READY when done.  Raises OrderError."""
        self._require(Signal.CHECK)
        self._checks.want(preflight)
        self._signal(Signal.CHECK)

    def take_off(self, altitude_m: float) -> None:
        """Order: arm and climb to ``altitude_m`` above home. Raises OrderError outside READY."""
        if not 0 < altitude_m <= PLAUSIBLE:
            raise OrderError(f"vehicle {self.system}: cannot take off to {altitude_m} m")
        self._require(Signal.TAKE_OFF)
        self._altitude_m = altitude_m
        self._signal(Signal.TAKE_OFF)

    def engage(self) -> None:
        """Order: take control, so that setpoints are flown. Raises OrderError outside HOLDING."""
        self._order(Signal.ENGAGE)

    def hold(self) -> None:
        """Order: stop here, in the firmware's own hold; HOLDING when it does.  Raises OrderError.

        Only while ENGAGING or ENGAGED.
        """
        self._require(Signal.HOLD)
        self._altitude_m = self.telemetry.height_m
        self._signal(Signal.HOLD)

    def resume(self) -> None:
        """Order: take control again after ``hold``.  Raises OrderError outside HOLDING."""
        self.engage()

    def land(self) -> None:
        """Order: land here and disarm.  Raises OrderError where there is nothing to land.

        A LOST vehicle that flew is told so too: it may hear although it is not heard.
        """
        if self.phase is Phase.LOST and self._phase_when_lost not in FLYING:
            raise OrderError(
                f"vehicle {self.system}: lost while {self._phase_when_lost.value}, not ours to land"
            )
        self._order(Signal.LAND)

    def release(self) -> None:
        """Order: stop the vehicle in its own hold, then leave it to somebody else.  Raises OrderError.

        A vehicle that is landing goes on with that.
        """
        self._require(Signal.RELEASE)
        self._altitude_m = self.telemetry.height_m
        self.reason = "released by order"
        self._signal(Signal.RELEASE)

    def adopt(self) -> None:
        """Order: take control of a vehicle that was FOUND in the air, at its present height.  Raises OrderError.

        As ``retake``; but only from a mode in which nobody has a hand on the stick.
        """
        self._require(Signal.ADOPT)
        modes, mode = self._known_adapter().modes, self.telemetry.mode
        if mode not in modes.unattended:
            raise OrderError(f"vehicle {self.system}: a pilot flies it in {modes.name(mode)}")
        self._take(Signal.ADOPT)

    def decline(self, reason: str) -> None:
        """Order: leave a vehicle that was FOUND in the air to whoever flies it.  Raises OrderError."""
        self._require(Signal.DECLINE)
        self.reason = reason
        self._signal(Signal.DECLINE)

    def retake(self) -> None:
        """Order: take control of a RELEASED vehicle, at its present height.  Raises OrderError.

        Refused for one that is not flying, or does not say where.
        """
        self._take(Signal.RETAKE)

    def _take(self, signal: Signal) -> None:
        """Take control of a vehicle that is flying and says where."""
        self._require(signal)
        if not self.telemetry.armed or self.telemetry.landed_state == procedures.ON_GROUND:
            raise OrderError(f"vehicle {self.system}: cannot be retaken, it is not flying")
        if self._now - self.telemetry.received_at > self._settings.position_loss_s:
            raise OrderError(f"vehicle {self.system}: cannot be retaken, its position is not known")
        self._altitude_m = self.telemetry.height_m
        self._signal(signal)

    def setpoint(self, v_east: float, v_north: float, altitude_m: float) -> bool:
        """Fly this velocity (m/s) at this height above home (m) until the next setpoint.

        Returns whether it was sent: only while ENGAGED, and never one that is not finite.
        """
        if self.phase is not Phase.ENGAGED:
            return False
        if not abs(v_east) + abs(v_north) + abs(altitude_m) <= PLAUSIBLE:
            self._tally.setpoints_refused += 1
            return False
        self._tally.setpoint(self._now)
        self._send_setpoint(v_east, v_north, altitude_m)
        if self._watch.astray(v_east, v_north, self.telemetry, self._now):
            text = f"vehicle {self.system}: it does not fly its setpoints"
            self._report(EventKind.ASTRAY, text)
        return True

    def _order(self, signal: Signal) -> None:
        """Carry out an order, or refuse it."""
        self._require(signal)
        self._signal(signal)

    def _require(self, signal: Signal) -> None:
        """Raise OrderError if the table has no such order for this phase, or no adapter to carry it out."""
        if (self.phase, signal) not in TABLE or self.adapter is None:
            raise OrderError(
                f"vehicle {self.system}: {signal.value} is not possible while {self.phase.value}"
            )

    # What the caller gets

    @property
    def next_deadline(self) -> float:
        """When ``poll`` has something to do, if nothing arrives before."""
        return self._wake

    def outgoing(self) -> list[bytes]:
        """Frames to send, one a datagram; each is given out once."""
        return self._link.outgoing()

    def traffic(self) -> list[bytes]:
        """Every frame of this vehicle, in and out, in order; each is given out once."""
        return self._link.traffic()

    def events(self) -> list[Event]:
        """What happened; each is given out once."""
        events, self._events = self._events, []
        return events

    def statistics(self) -> Statistics:
        """The figures so far."""
        return self._tally.figures(self._link)

    @property
    def beat_at(self) -> float:
        """When the last heartbeat came, or was excused."""
        return self._beat_at

    @property
    def loss(self) -> float:
        """The share of this vehicle's messages that got lost on the way, so far."""
        return self._link.lost / max(self._link.lost + self._link.received, 1)

    @property
    def round_trip_s(self) -> float | None:
        """The link's last round trip; None before the first."""
        return self._tally.pings_s[-1] if self._tally.pings_s else None

    @property
    def setpoint_intervals_s(self) -> "array[float]":
        """The caller's time between each two setpoints."""
        return self._tally.setpoint_intervals_s

    @property
    def parameters(self) -> Mapping[str, float]:
        """What the preflight read: ``speed_mps`` and so on, by the adapter's quantities."""
        if self.adapter is None:
            return {}
        known = ((q.name, self._checks.parameters.get(q)) for q in self.adapter.quantities)
        return {name: value for name, value in known if value is not None}

    def parameter(self, name: str) -> float | None:
        """A parameter that the preflight read or set, by the firmware's own name and unit."""
        return self._checks.parameters.values.get(name)

    @property
    def protection(self) -> Protection:
        """What the vehicle does by itself when something goes wrong, by what the preflight read."""
        if self.adapter is None:
            return Protection(None, "unknown")
        return self.adapter.protection(self.parameters)

    @property
    def fence_verified(self) -> bool:
        """Whether the vehicle holds the preflight's fence, vertex by vertex."""
        return self._checks.transfer is not None and self._checks.transfer.verified

    # Messages

    def _read(self, frame: Frame) -> None:
        """Take in a message other than the position."""
        was_armed = self.telemetry.armed
        reader = READERS.get(frame.message_id)
        if reader is not None:
            reader(self.telemetry, frame.fields)
        if self.adapter is not None:
            self.adapter.observe(frame.message_id, frame.fields, self.telemetry)
        if frame.message_id == HEARTBEAT:
            self._read_heartbeat(frame.fields, was_armed)
        elif frame.message_id == LANDED_STATE:
            if self.telemetry.landed_state == procedures.ON_GROUND:
                self._signal(Signal.CAME_DOWN)
        elif frame.message_id == COMMAND_ACK:
            self._read_ack(frame.fields)
        elif frame.message_id == STATUSTEXT:
            self._read_text(frame.fields)
        elif frame.message_id == TIMESYNC:
            if self._tally.pong(frame.fields, self._now):
                self._answered_at = self._now
                read_clock(self.telemetry, frame.fields.ts1 / NANOSECONDS, frame.fields.tc1 / NANOSECONDS)
        else:
            self._read_exchange(frame)
        if self._watch.battery_low(self.telemetry):
            percent = self.telemetry.battery_percent
            self._report(EventKind.BATTERY_LOW, f"vehicle {self.system}: {percent} % left")

    def _read_exchange(self, frame: Frame) -> None:
        """A parameter, or a part of the fence."""
        adapter, procedure = self.adapter, self._procedure
        known = adapter is not None and self._checks.take(frame, adapter.integers_bytewise)
        if known and procedure is not None:
            procedure.progressed(self._now)

    def _read_heartbeat(self, fields: Any, was_armed: bool) -> None:
        """The vehicle lives; is it still ours?"""
        self._beat_at = self._now
        self._autopilot = fields.autopilot
        if self.phase is Phase.LOST and self._hears:
            set_up = self._phase_when_lost in SET_UP
            self._signal(Signal.LINK_BACK_IN_SET_UP if set_up else Signal.LINK_BACK_IN_FLIGHT)
        self._signal(Signal.HEARTBEAT)
        if was_armed and not self.telemetry.armed and not self._is_down():
            self._signal(Signal.DISARMED)
        expected = self._expected_modes()
        if expected is not None and self.telemetry.armed and self.telemetry.mode not in expected:
            self._signal(Signal.MODE_TAKEN)
        if self._watch.position_lost(self.telemetry, self._now):
            self._position_lost()
        self._schedule()

    def _is_down(self) -> bool:
        """Whether disarming is what a landing ends with: not while it sinks, high above its home."""
        t = self.telemetry
        high = t.height_m > self._settings.disarm_height_m and t.v_up < -self._settings.climb_tolerance_mps
        return self.phase is Phase.LANDING and not high

    def _position_lost(self) -> None:
        """Heartbeats, but no position."""
        self._watch.streams_gone = True
        if (self.phase, Signal.POSITION_LOST) in TABLE:
            text = f"vehicle {self.system}: no valid position while {self.phase.value}"
            self._report(EventKind.POSITION_LOST, text)
            self._signal(Signal.POSITION_LOST)

    def _restarted(self) -> None:
        """Its clock runs from zero again."""
        self._watch.streams_gone = True
        text = f"vehicle {self.system}: its autopilot restarted while {self.phase.value}"
        self._report(EventKind.RESTARTED, text)
        self._signal(Signal.RESTARTED)

    def _expected_modes(self) -> frozenset[int] | None:
        """The modes that the vehicle may be in now if nobody interferes; None is any."""
        if self.adapter is None:
            return None
        modes = self.adapter.modes
        if self.phase is Phase.ENGAGED:
            return frozenset((modes.engaged,))
        if self.phase is Phase.HOLDING:
            return frozenset((modes.take_off, modes.hold))
        step = self._procedure.step if self._procedure is not None else None
        return step.modes if step is not None else None

    def _read_ack(self, fields: Any) -> None:
        """COMMAND_ACK, unless it answers another ground station."""
        ours = fields.target_system in (0, GROUND_SYSTEM) and fields.target_component in (0, GROUND_COMPONENT)
        if ours and self._procedure is not None:
            self._procedure.acknowledge(fields.command, fields.result, self._now)

    def _read_text(self, fields: Any) -> None:
        """STATUSTEXT."""
        text = self._texts.add(fields.text, fields.id, fields.chunk_seq)
        if text:
            self._report(EventKind.TEXT, text)
            if self._procedure is not None:
                self._procedure.last_text = text
