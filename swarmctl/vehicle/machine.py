"""The session's table at work: signals go in, and the steps of each phase go out to the vehicle.

``Machine`` knows how to walk the table and how to do each action; ``session.Session`` knows the messages and
the orders that its signals come from.
"""

import math

from . import procedures
from .autopilots.adapter import Adapter
from .autopilots.registry import ADAPTERS, adapter_for, autopilot_name
from .commands import Ask
from .events import Event, EventKind, TextAssembler
from .link import Link
from .phases import SETTING_UP, STREAMING, TABLE, Action, Phase, Signal
from .preflight import Checks, Preflight
from .settings import SessionSettings
from .statistics import Tally
from .steps import TIME_SLACK_S, Procedure, Step
from .telemetry import Telemetry
from .watch import Watch

# A few heartbeats, of one a second, may be dropped by a bad link while everything else says that it lives.
BEATS_LOST = 3


class Machine:
    """One vehicle's walk through the table.  Its times are the caller's, its durations on the caller's clock.

    ``adopts``: another controller took the vehicle off, and it may be in the air: it is set up as it is found.
    """

    def __init__(
        self, system: int, *, settings: SessionSettings, now: float, preflight: Preflight | None = None,
        adopts: bool = False,
    ) -> None:  # fmt: skip
        self.system = system
        self.phase = Phase.CONNECTING
        self.reason = ""  #: why it FAILED or was RELEASED
        self.failed_while: Phase | None = None  #: the phase in which it last failed
        self.telemetry = Telemetry()
        self.adapter: Adapter | None = None
        self._adopts = adopts
        self._settings = settings.on_clock()
        self._now = now
        self._link = Link(system)
        self._checks = Checks(preflight or Preflight(), self._link, self._settings)
        self._watch = Watch(self._settings)
        self._tally = Tally()
        self._events: list[Event] = []
        self._texts = TextAssembler()
        self._procedure: Procedure | None = None
        self._phase_when_lost = Phase.CONNECTING
        self._autopilot = 0
        self._altitude_m = 0.0
        self._heartbeat_due = now
        self._hold_due = math.inf
        self._heard_at = now
        self._beat_at = now
        self._answered_at: float | None = None  # a ping; None: it never has
        self._lost_at = now
        self._set_ups = 0
        self._actions = {action: getattr(self, f"_{action.value}") for action in Action}
        self._schedule()

    # The table at work

    def _signal(self, signal: Signal) -> None:
        """Walk the table: enter the next phase, then do its action."""
        transition = TABLE.get((self.phase, signal))
        if transition is None:
            return
        if transition.action is Action.SUSPEND:
            self._phase_when_lost = self.phase
        elif transition.action is Action.FAIL:
            self.failed_while = self.phase
        self._explain(signal)
        self.phase = transition.phase or self._phase_when_lost
        self._hold_due = self._now if self.phase in STREAMING else math.inf
        self._report(EventKind.PHASE, self.phase.value)
        self._actions[transition.action]()
        self._schedule()

    def _explain(self, signal: Signal) -> None:
        """Keep the reason of what is about to happen, told from the phase in which it does."""
        if signal is Signal.DISARMED:
            self.reason = f"it disarmed while {self.phase.value}"
        elif signal is Signal.CAME_DOWN:
            self.reason = f"it came down while {self.phase.value}"
        elif signal is Signal.RESTARTED:
            self.reason = f"its autopilot restarted while {self.phase.value}"
        elif signal is Signal.MODE_TAKEN and self.adapter is not None:
            mode = self.adapter.modes.name(self.telemetry.mode)
            self.reason = f"its mode became {mode} while {self.phase.value}"

    def _begin(self, steps: tuple[Step, ...]) -> None:
        """Start a procedure in place of any other."""
        self._procedure = Procedure(
            steps, self._settings, self._now, self._ask, self._tally.round_trips_s.append
        )
        self._advance()

    def _advance(self) -> None:
        """Let the procedure do what is due, and pass on how it ended.

        A hold setpoint that is due goes first: the stream must reach the vehicle before the mode change.
        """
        procedure = self._procedure
        if procedure is None or self._suspended:
            return
        if self._now + TIME_SLACK_S >= self._hold_due:
            self._send_hold()
        over = procedure.advance(self.telemetry, self._now)
        for warning in procedure.warnings:
            self._report(EventKind.WARNING, warning)
        procedure.warnings.clear()
        if over:
            self._procedure = None
            if procedure.failure:
                self.reason = procedure.failure
            self._signal(self._failed() if procedure.failure else self._done())
        self._schedule()

    def _failed(self) -> Signal:
        """A phase has failed; to set up a vehicle that another controller took off may do so in the air."""
        in_flight = self._adopts and self.phase in SETTING_UP and self.telemetry.armed
        return Signal.FAILED_IN_FLIGHT if in_flight else Signal.STEP_FAILED

    def _done(self) -> Signal:
        """A phase's steps are done; of a vehicle that another controller took off, in the air or after landing."""
        if not self._adopts or self.phase is not Phase.CHECKING:
            return Signal.STEPS_DONE
        return Signal.CHECKED_IN_FLIGHT if self.telemetry.armed else Signal.CHECKED_LANDED

    @property
    def _suspended(self) -> bool:
        """Whether the procedure waits for the link.  A landing does not."""
        return self.phase is Phase.LOST and self._phase_when_lost is not Phase.LANDING

    # Actions, by the names that the table gives them

    def _identify(self) -> None:
        self.telemetry.forget()
        self._checks.forget()
        self._watch.begin()
        self._set_ups += 1
        self.adapter = adapter_for(self._autopilot)
        if self.adapter is None:
            known = ", ".join(autopilot_name(number) for number in ADAPTERS)
            self.reason = f"its autopilot is {autopilot_name(self._autopilot)}; can fly: {known}"
            self._signal(self._failed())
        elif self._set_ups > self._settings.set_up_attempts:
            self.reason = f"its set-up was broken off {self._set_ups - 1} times"
            self._signal(self._failed())
        else:
            self._begin(procedures.identifying(self._settings))

    def _configure(self) -> None:
        self._begin(procedures.configuring(self._known_adapter(), self._settings))

    def _locate(self) -> None:
        steps = procedures.finding if self._adopts else procedures.positioning
        self._begin(steps(self._known_adapter(), self._settings))

    def _check(self) -> None:
        self._begin(self._checks.begin(self._known_adapter()))

    def _take_off(self) -> None:
        adapter = self._known_adapter()
        self._begin(procedures.taking_off(adapter, self.telemetry, self._altitude_m, self._settings))

    def _engage(self) -> None:
        modes = self._known_adapter().modes
        ours = frozenset((modes.take_off, modes.hold, modes.engaged))
        self._begin(procedures.engaging(self._known_adapter(), self._settings, ours))

    def _adopt(self) -> None:
        adapter = self._known_adapter()
        self._begin(procedures.engaging(adapter, self._settings, adapter.modes.unattended))

    def _retake(self) -> None:
        self._begin(procedures.engaging(self._known_adapter(), self._settings, None))

    def _stop(self) -> None:
        self._begin(procedures.stopping(self._known_adapter(), self._settings))

    def _land(self) -> None:
        ask_rates = self._watch.streams_gone
        self._begin(procedures.landing(self._known_adapter(), self.telemetry, self._settings, ask_rates))

    def _rest(self) -> None:
        """Nothing to do until the next order."""
        self._set_ups = 0

    def _fail(self) -> None:
        self._procedure = None
        self.reason = f"vehicle {self.system}: {self.reason}"
        self._report(EventKind.FAILED, self.reason)

    def _release(self) -> None:
        self._procedure = None
        self.reason = f"vehicle {self.system}: {self.reason}"
        self._report(EventKind.RELEASED, self.reason)

    def _suspend(self) -> None:
        deaf = self._now + TIME_SLACK_S < self._beat_deadline()
        self._lost_at = self._now
        self._link.expect_any()
        self._watch.forgive()
        seconds = (self._settings.deaf_s if deaf else self._settings.link_loss_s) * self._settings.time_scale
        what = f"{'no answer' if deaf else 'no heartbeat'} for {seconds:g} s"
        self._report(EventKind.LOST, f"vehicle {self.system}: {what} while {self._phase_when_lost.value}")

    def _resume(self) -> None:
        self._report(EventKind.REGAINED, f"vehicle {self.system}: heartbeat again")
        if self.phase is Phase.LANDING:
            self._watch.streams_gone = True
            self._land()
        elif self._procedure is not None:
            self._procedure.begin_step(self._now)

    # Sending

    def _known_adapter(self) -> Adapter:
        """The adapter, which every phase after IDENTIFYING has."""
        assert self.adapter is not None
        return self.adapter

    def _ask(self, ask: Ask, confirmation: int) -> None:
        for message in ask.messages(self.system, confirmation):
            self._link.send_message(message)

    def _send_hold(self) -> None:
        """Stand still: only while offboard mode is being entered or left."""
        self._hold_due = self._now + 1.0 / (self._settings.setpoint_rate_hz * self._settings.time_scale)
        self._send_setpoint(0.0, 0.0, self._altitude_m)

    def _send_setpoint(self, v_east: float, v_north: float, altitude_m: float) -> None:
        frame = self._known_adapter().setpoint(
            self._link.encoder, self.system, self.telemetry, (v_east, v_north), altitude_m
        )
        self._link.send(frame)

    # Time

    @property
    def _hears(self) -> bool:
        """Whether a vehicle that was lost has answered since, if it is one that answers."""
        return self._answered_at is None or self._answered_at >= self._lost_at

    def _link_deadline(self) -> float:
        """When the link counts as lost, in the phases that can lose it."""
        if (self.phase, Signal.LINK_LOST) not in TABLE:
            return math.inf
        answered_at = math.inf if self._answered_at is None else self._answered_at
        return min(self._beat_deadline(), answered_at + self._settings.deaf_s)

    def _beat_deadline(self) -> float:
        """When the vehicle has been silent for too long, or has sent no heartbeat for longer."""
        silence_s = self._settings.link_loss_s
        return min(self._heard_at + silence_s, self._beat_at + BEATS_LOST * silence_s)

    def _schedule(self) -> None:
        """Work out when ``poll`` is next needed."""
        procedure = self._procedure.deadline if self._procedure and not self._suspended else math.inf
        self._wake = min(self._heartbeat_due, self._hold_due, self._link_deadline(), procedure)

    def _report(self, kind: EventKind, text: str) -> None:
        self._events.append(Event(self._now, self.system, kind, text))
