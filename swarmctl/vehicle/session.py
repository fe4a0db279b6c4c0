"""One autopilot over MAVLink, without I/O: bytes and the time go in, bytes and events come out.

Whoever runs a session hands it what arrived (``receive``), lets time pass (``poll``, at the latest at
``next_deadline``), gives orders and setpoints, and sends each item of ``outgoing()`` as one datagram.  All
times are the caller's, in seconds of any monotonic clock; orders happen at the time of the last ``receive``
or ``poll``.  What the session does is a walk through the table in ``phases``; what a firmware wants
differently is in its adapter.

When the vehicle's heartbeat is missing the phase is LOST: no setpoint is sent, so the firmware's own
failsafe takes over.  When it is back, a vehicle that was being set up is set up again from the start, for it
may have restarted; one that was flying has the phase that it had, and what telemetry then shows decides: in
the mode it had, it goes on; in another (the failsafe's), it is RELEASED; disarmed, it FAILED.
"""

import math
from array import array
from typing import Any

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

from . import procedures
from .autopilots.adapter import Adapter
from .autopilots.registry import ADAPTERS, adapter_for, autopilot_name
from .commands import Command
from .events import Event, EventKind, TextAssembler
from .link import AUTOPILOT_COMPONENT, GROUND_COMPONENT, GROUND_SYSTEM, Link
from .phases import SET_UP, TABLE, Action, Phase, Signal
from .reading import READERS, read_position
from .settings import SessionSettings
from .statistics import Statistics, spread
from .steps import TIME_SLACK_S, Procedure, Step
from .telemetry import Telemetry

GLOBAL_POSITION_INT: int = mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT
COMMAND_ACK: int = mav.MAVLINK_MSG_ID_COMMAND_ACK
STATUSTEXT: int = mav.MAVLINK_MSG_ID_STATUSTEXT

# Metres and metres a second beyond which a setpoint is a mistake, and might not fit its field.
PLAUSIBLE = 1e6


class OrderError(Exception):
    """An order that the session's phase does not allow, or that makes no sense."""


class Session:
    """The controller's side of one vehicle. ``telemetry`` and ``phase`` are there to be read at any time."""

    def __init__(self, system: int, *, settings: SessionSettings, now: float) -> None:
        self.system = system
        self.phase = Phase.CONNECTING
        self.reason = ""  #: why it FAILED or was RELEASED
        self.telemetry = Telemetry()
        self.adapter: Adapter | None = None
        self.setpoint_intervals_s: array[float] = array("d")
        self._settings = settings.on_clock()
        self._now = now
        self._link = Link(system)
        self._events: list[Event] = []
        self._texts = TextAssembler()
        self._procedure: Procedure | None = None
        self._phase_when_lost = Phase.CONNECTING
        self._autopilot = 0
        self._altitude_m = 0.0
        self._heartbeat_due = now
        self._hold_due = math.inf
        self._heard_at = now
        self._setpoint_at = math.nan
        self._setpoints_sent = 0
        self._setpoints_refused = 0
        self._round_trips_s: array[float] = array("d")
        self._actions = {action: getattr(self, f"_{action.value}") for action in Action}
        self._schedule()

    # What the caller does

    def receive(self, data: bytes, now: float) -> None:
        """Take in bytes from the link: any part of a frame, or many, of any vehicle."""
        self._now = now
        for frame in self._link.take(data):
            if frame.message_id == GLOBAL_POSITION_INT:
                read_position(self.telemetry, frame.fields, now)
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
            self._send_heartbeat()
        if now + TIME_SLACK_S >= self._link_deadline():
            self._signal(Signal.LINK_LOST)
        if self._procedure is not None:
            self._advance()
        self._schedule()

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

    def land(self) -> None:
        """Order: land here and disarm. Raises OrderError where there is nothing to land."""
        self._order(Signal.LAND)

    def setpoint(self, v_east: float, v_north: float, altitude_m: float) -> bool:
        """Fly this velocity (m/s) at this height above home (m) until the next setpoint.

        Returns whether it was sent: only while ENGAGED, and never one that is not finite.
        """
        if self.phase is not Phase.ENGAGED:
            return False
        if not abs(v_east) + abs(v_north) + abs(altitude_m) <= PLAUSIBLE:
            self._setpoints_refused += 1
            return False
        if self._setpoints_sent:
            self.setpoint_intervals_s.append(self._now - self._setpoint_at)
        self._setpoint_at = self._now
        self._setpoints_sent += 1
        self._send_setpoint(v_east, v_north, altitude_m)
        return True

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
        return Statistics(
            messages_received=self._link.received,
            messages_lost=self._link.lost,
            messages_bad=self._link.bad,
            messages_late=self._link.late,
            setpoints_sent=self._setpoints_sent,
            setpoints_refused=self._setpoints_refused,
            setpoint_interval=spread(self.setpoint_intervals_s),
            command_round_trip=spread(self._round_trips_s),
        )

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
        elif frame.message_id == COMMAND_ACK:
            self._read_ack(frame.fields)
        elif frame.message_id == STATUSTEXT:
            self._read_text(frame.fields)

    def _read_heartbeat(self, fields: Any, was_armed: bool) -> None:
        """The vehicle lives; is it still ours?"""
        self._heard_at = self._now
        self._autopilot = fields.autopilot
        if self.phase is Phase.LOST:
            set_up = self._phase_when_lost in SET_UP
            self._signal(Signal.LINK_BACK_IN_SET_UP if set_up else Signal.LINK_BACK_IN_FLIGHT)
        self._signal(Signal.HEARTBEAT)
        if was_armed and not self.telemetry.armed:
            self._signal(Signal.DISARMED)
        expected = self._expected_modes()
        if expected is not None and self.telemetry.armed and self.telemetry.mode not in expected:
            self._signal(Signal.MODE_TAKEN)
        self._schedule()

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

    # The table at work

    def _signal(self, signal: Signal) -> None:
        """Walk the table: enter the next phase, then do its action."""
        transition = TABLE.get((self.phase, signal))
        if transition is None:
            return
        if transition.action is Action.SUSPEND:
            self._phase_when_lost = self.phase
        self._explain(signal)
        self.phase = transition.phase or self._phase_when_lost
        self._hold_due = self._now if self.phase is Phase.ENGAGING else math.inf
        self._report(EventKind.PHASE, self.phase.value)
        self._actions[transition.action]()
        self._schedule()

    def _explain(self, signal: Signal) -> None:
        """Keep the reason of what is about to happen, told from the phase in which it does."""
        if signal is Signal.DISARMED:
            self.reason = f"it disarmed while {self.phase.value}"
        elif signal is Signal.MODE_TAKEN and self.adapter is not None:
            mode = self.adapter.modes.name(self.telemetry.mode)
            self.reason = f"its mode became {mode} while {self.phase.value}"

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

    def _begin(self, steps: tuple[Step, ...]) -> None:
        """Start a procedure in place of any other."""
        self._procedure = Procedure(
            steps, self._settings, self._now, self._send_command, self._round_trips_s.append
        )
        self._advance()

    def _advance(self) -> None:
        """Let the procedure do what is due, and pass on how it ended.

        A hold setpoint that is due goes first: the stream must reach the vehicle before the mode change.
        """
        procedure = self._procedure
        if procedure is None or self.phase is Phase.LOST:
            return
        if self._now + TIME_SLACK_S >= self._hold_due:
            self._send_hold()
        over = procedure.advance(self.telemetry, self._now)
        for warning in procedure.warnings:
            self._report(EventKind.WARNING, warning)
        procedure.warnings.clear()
        if over:
            self._procedure = None
            self.reason = procedure.failure or ""
            self._signal(Signal.STEP_FAILED if procedure.failure else Signal.STEPS_DONE)
        self._schedule()

    # Actions, by the names that the table gives them

    def _identify(self) -> None:
        self.telemetry.forget()
        self.adapter = adapter_for(self._autopilot)
        if self.adapter is None:
            known = ", ".join(autopilot_name(number) for number in ADAPTERS)
            self.reason = f"its autopilot is {autopilot_name(self._autopilot)}; can fly: {known}"
            self._signal(Signal.STEP_FAILED)
        else:
            self._begin(procedures.identifying(self._settings))

    def _configure(self) -> None:
        self._begin(procedures.configuring(self._known_adapter(), self._settings))

    def _locate(self) -> None:
        self._begin(procedures.positioning(self._settings))

    def _take_off(self) -> None:
        adapter = self._known_adapter()
        self._begin(procedures.taking_off(adapter, self.telemetry, self._altitude_m, self._settings))

    def _engage(self) -> None:
        self._begin(procedures.engaging(self._known_adapter(), self._settings))

    def _land(self) -> None:
        self._begin(procedures.landing(self._known_adapter(), self.telemetry, self._settings))

    def _rest(self) -> None:
        """Nothing to do until the next order."""

    def _fail(self) -> None:
        self._procedure = None
        self.reason = f"vehicle {self.system}: {self.reason}"
        self._report(EventKind.FAILED, self.reason)

    def _release(self) -> None:
        self._procedure = None
        self.reason = f"vehicle {self.system}: {self.reason}"
        self._report(EventKind.RELEASED, self.reason)

    def _suspend(self) -> None:
        seconds = self._settings.link_loss_s * self._settings.time_scale
        self._link.expect_any()
        was = self._phase_when_lost.value
        self._report(EventKind.LOST, f"vehicle {self.system}: no heartbeat for {seconds:g} s while {was}")

    def _resume(self) -> None:
        self._report(EventKind.REGAINED, f"vehicle {self.system}: heartbeat again")
        if self._procedure is not None:
            self._procedure.begin_step(self._now)

    # Sending

    def _known_adapter(self) -> Adapter:
        """The adapter, which every phase after IDENTIFYING has."""
        assert self.adapter is not None
        return self.adapter

    def _send_heartbeat(self) -> None:
        self._heartbeat_due = self._now + self._settings.heartbeat_period_s
        self._link.send(
            self._link.encoder.heartbeat(
                mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE
            )
        )

    def _send_command(self, command: Command, confirmation: int) -> None:
        message = mav.MAVLink_command_long_message(
            self.system, AUTOPILOT_COMPONENT, command.number, confirmation, *command.parameters
        )
        self._link.send(self._link.encoder.encode(message))

    def _send_hold(self) -> None:
        """Stand still at the take-off altitude: only while offboard mode is being entered."""
        self._hold_due = self._now + 1.0 / (self._settings.setpoint_rate_hz * self._settings.time_scale)
        self._send_setpoint(0.0, 0.0, self._altitude_m)

    def _send_setpoint(self, v_east: float, v_north: float, altitude_m: float) -> None:
        frame = self._known_adapter().setpoint(
            self._link.encoder, self.system, self.telemetry, (v_east, v_north), altitude_m
        )
        self._link.send(frame)

    # Time

    def _link_deadline(self) -> float:
        """When the link counts as lost, in the phases that can lose it."""
        can_lose = (self.phase, Signal.LINK_LOST) in TABLE
        return self._heard_at + self._settings.link_loss_s if can_lose else math.inf

    def _schedule(self) -> None:
        """Work out when ``poll`` is next needed."""
        procedure = self._procedure.deadline if self._procedure and self.phase is not Phase.LOST else math.inf
        self._wake = min(self._heartbeat_due, self._hold_due, self._link_deadline(), procedure)

    def _report(self, kind: EventKind, text: str) -> None:
        self._events.append(Event(self._now, self.system, kind, text))
