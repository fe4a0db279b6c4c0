"""Commands carried through to their effect, one after the other.

A ``Procedure`` works off a list of ``Step``s.  A step sends its command, sends it again when no COMMAND_ACK
comes or when the vehicle says "not yet", and is over when telemetry shows the effect.  The ACK alone is not
believed where telemetry can tell: PX4 acknowledges a mode change twice, and only the second is the truth.
It gives up when the command is refused, unanswered too often, or the step's patience is over.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto

from .commands import ACCEPTED, IN_PROGRESS, TEMPORARILY_REJECTED, Ask, Command, result_name
from .settings import SessionSettings
from .telemetry import Telemetry

TIME_SLACK_S = 1e-6  #: a deadline that sums of rounded seconds missed by less than this is met

Condition = Callable[[Telemetry], bool]


class OnFailure(Enum):
    """What the failure of a step does to its procedure."""

    FAIL = auto()  # ends it
    WARN = auto()  # is reported
    IGNORE = auto()  # was to be expected


@dataclass(frozen=True, slots=True)
class Step:
    """One thing to bring about.

    ``command``: what is sent, a COMMAND_LONG or other messages; None just waits.  ``confirmed``: what
    telemetry shows when it is done; None believes the ACK, or without a command the passing of ``wait_s``.
    ``wait_s``: how long the effect may come by itself before the command is sent.  ``needs_ack``: telemetry
    alone is not enough, because it may look the same from an earlier command.  ``insists``: refused or
    unanswered, it is asked again until patience ends.  ``answer_s``: how long an answer may take before it
    is asked again, if not as long as any command's.  ``failed``: says why the effect cannot come any more,
    or nothing.  ``modes``: the modes in which the vehicle may show itself meanwhile; another one means that
    somebody else changed it.
    """

    name: str
    patience_s: float
    command: Ask | None = None
    confirmed: Condition | None = None
    wait_s: float = 0.0
    needs_ack: bool = False
    insists: bool = False
    answer_s: float | None = None
    failed: Callable[[], str] | None = None
    on_failure: OnFailure = OnFailure.FAIL
    modes: frozenset[int] | None = None


class Stage(Enum):
    """How far the current step's command is."""

    WAITING = auto()  # not sent yet
    ASKED = auto()  # sent, no answer yet
    ACCEPTED = auto()  # accepted, not confirmed yet
    PAUSED = auto()  # rejected for now


class Procedure:
    """Works off ``steps`` in order.  ``deadline`` is when ``advance`` is next due; ``failure`` says why it
    gave up; ``warnings`` collects what optional steps ran into.

    ``send(command, confirmation)`` transmits; ``answered(seconds)`` learns of round trips.
    """

    def __init__(
        self,
        steps: Sequence[Step],
        settings: SessionSettings,
        now: float,
        send: Callable[[Ask, int], None],
        answered: Callable[[float], None],
    ) -> None:
        self.failure: str | None = None
        self.warnings: list[str] = []
        self.last_text = ""
        self._steps = steps
        self._settings = settings
        self._send = send
        self._answered = answered
        self._index = 0
        self.begin_step(now)

    @property
    def step(self) -> Step | None:
        """The step at work; None when all are done."""
        return self._steps[self._index] if self._index < len(self._steps) else None

    def begin_step(self, now: float) -> None:
        """Take the current step from its beginning, with all its time and attempts."""
        self._stage = Stage.WAITING
        self._sent = 0
        self._acknowledged = False
        self._result = ""
        self.last_text = ""
        step = self.step
        self._due = now + step.wait_s if step else math.inf
        self._ends = now + step.patience_s if step else math.inf

    @property
    def deadline(self) -> float:
        """When ``advance`` has something to do at the latest, in the caller's time."""
        return min(self._due, self._ends)

    def acknowledge(self, number: int, result: int, now: float) -> None:
        """Take in a COMMAND_ACK; one for a command that is not at work here is ignored."""
        step = self.step
        if step is None or not isinstance(step.command, Command) or step.command.number != number:
            return
        if self._stage is Stage.WAITING:
            return
        if self._stage is Stage.ASKED and self._sent == 1:
            self._answered(now - self._asked_at)
        self._result = result_name(result)
        if result == ACCEPTED:
            self._acknowledged = True
            self._enter(Stage.ACCEPTED, now + self._settings.confirm_timeout_s)
        elif result == IN_PROGRESS:
            self._enter(Stage.ASKED, now + self._settings.confirm_timeout_s)
        elif result == TEMPORARILY_REJECTED or step.insists:
            self._acknowledged = False
            self._enter(Stage.PAUSED, now + self._settings.retry_pause_s)
        else:
            self._give_up(f"{step.command.name} was refused: {self._result}{self._quote()}", now)

    def progressed(self, now: float) -> None:
        """The vehicle takes part in the step's exchange: its time for an answer begins anew."""
        step = self.step
        exchange = step is not None and not isinstance(step.command, Command)
        if step is not None and exchange and self._stage is Stage.ASKED:
            self._sent = 1
            self._due = now + (step.answer_s or self._settings.ack_timeout_s)

    def advance(self, telemetry: Telemetry, now: float) -> bool:
        """Do what is due; True when every step is done or one failed."""
        while self.failure is None:
            step = self.step
            if step is None:
                return True
            if self._done(step, telemetry, now):
                self._index += 1
                self.begin_step(now)
            elif step.failed is not None and step.failed():
                self._give_up(f"{step.name}: {step.failed()}{self._quote()}", now)
            elif now + TIME_SLACK_S >= self._ends:
                self._give_up(self._impatience(step), now)
            elif now + TIME_SLACK_S >= self._due:
                self._act(step, now)
            else:
                return False
        return True

    def _done(self, step: Step, telemetry: Telemetry, now: float) -> bool:
        """Whether the step has had its effect."""
        if step.confirmed is not None:
            return step.confirmed(telemetry) and (self._acknowledged or not step.needs_ack)
        if step.command is not None:
            return self._acknowledged
        return now + TIME_SLACK_S >= self._due

    def _act(self, step: Step, now: float) -> None:
        """The time for the current stage is over: send the command, again if need be."""
        if step.command is None:
            self._due = math.inf
        elif self._stage is Stage.ASKED and self._sent >= self._settings.attempts and not step.insists:
            tries = f"{self._sent} tries{self._quote()}"
            self._give_up(f"{step.command.name} was not answered in {tries}", now)
        else:
            if self._stage is not Stage.ASKED:
                self._sent = 0
            self._send(step.command, self._sent)
            self._sent += 1
            self._asked_at = now
            self._enter(Stage.ASKED, now + (step.answer_s or self._settings.ack_timeout_s))

    def _enter(self, stage: Stage, due: float) -> None:
        self._stage = stage
        self._due = due

    def _give_up(self, reason: str, now: float) -> None:
        """Fail, or go on where the step is optional."""
        step = self.step
        if step is None or step.on_failure is OnFailure.FAIL:
            self.failure = reason
            return
        if step.on_failure is OnFailure.WARN:
            self.warnings.append(reason)
        self._index += 1
        self.begin_step(now)

    def _impatience(self, step: Step) -> str:
        """What to say of a step that took too long."""
        seconds = round(step.patience_s * self._settings.time_scale, 1)
        if not isinstance(step.command, Command):
            return f"{step.name}: not reached in {seconds:g} s{self._quote()}"
        last = f"; last answer {self._result}" if self._result else "; never answered"
        return f"{step.name}: {step.command.name} had no effect in {seconds:g} s{last}{self._quote()}"

    def _quote(self) -> str:
        """The vehicle's own last words since the step began."""
        return f' (the vehicle says: "{self.last_text}")' if self.last_text else ""
