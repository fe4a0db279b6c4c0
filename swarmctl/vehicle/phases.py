"""The session's state machine: one table, from (phase, signal) to (action, next phase).

Signals are what the outside does to a session: telemetry, finished steps, orders, silence.  Actions are the
methods of ``session.Session`` of that name.  A pair that is not in the table changes nothing.
``mermaid`` draws the table for the documentation.
"""

from enum import Enum
from typing import NamedTuple


class Phase(Enum):
    """Where a session stands."""

    CONNECTING = "connecting"  #: waits for the first heartbeat
    IDENTIFYING = "identifying"  #: which autopilot, which version
    CONFIGURING = "configuring"  #: message rates
    POSITIONING = "positioning"  #: position, origin, home, health
    CHECKING = "checking"  #: parameters, and the vehicle's own fence, if the caller wants
    READY = "ready"  #: on the ground; may take off
    FOUND = "found in the air"  #: set up there, and not ours: its failsafe flies it, or a pilot
    TAKING_OFF = "taking off"
    HOLDING = "holding"  #: at altitude, in the firmware's own hold
    ENGAGING = "engaging"  #: hold setpoints flow, offboard mode is asked for
    ENGAGED = "engaged"  #: flies the caller's setpoints
    STOPPING = "stopping"  #: hold setpoints flow, the firmware's own hold is asked for
    RELEASING = "releasing"  #: the same, to leave the vehicle to somebody else
    LANDING = "landing"
    LANDED = "landed"  #: on the ground, disarmed
    FAILED = "failed"  #: gave up, for a reason
    RELEASED = "released"  #: somebody else flies it, by order or because the mode changed; never fought
    LOST = "lost"  #: no heartbeat


class Signal(Enum):
    """What moves a session."""

    HEARTBEAT = "heartbeat"
    STEPS_DONE = "steps done"
    STEP_FAILED = "step failed"
    CHECKED_IN_FLIGHT = "steps done, in the air"
    CHECKED_LANDED = "steps done, had landed"
    FAILED_IN_FLIGHT = "step failed, in the air"
    CHECK = "order: check"
    TAKE_OFF = "order: take off"
    ADOPT = "order: adopt"
    DECLINE = "order: decline"
    ENGAGE = "order: engage"
    HOLD = "order: hold"
    LAND = "order: land"
    RELEASE = "order: release"
    RETAKE = "order: retake"
    MODE_TAKEN = "mode changed by another"
    DISARMED = "disarmed"
    CAME_DOWN = "on the ground unasked"
    POSITION_LOST = "position lost"
    RESTARTED = "autopilot restarted"
    LINK_LOST = "link lost"
    LINK_BACK_IN_SET_UP = "link back, had been setting up"
    LINK_BACK_IN_FLIGHT = "link back, had been flying"


class Action(Enum):
    """What a session does on the way; each is a method of that name, ``_identify`` and so on."""

    IDENTIFY = "identify"
    CONFIGURE = "configure"
    LOCATE = "locate"
    CHECK = "check"
    TAKE_OFF = "take_off"
    ENGAGE = "engage"
    ADOPT = "adopt"
    RETAKE = "retake"
    STOP = "stop"
    LAND = "land"
    REST = "rest"
    FAIL = "fail"
    RELEASE = "release"
    SUSPEND = "suspend"
    RESUME = "resume"


class Transition(NamedTuple):
    """An action, and the phase after it; None is the phase that the vehicle had when it was lost."""

    action: Action
    phase: Phase | None


SETTING_UP = (Phase.IDENTIFYING, Phase.CONFIGURING, Phase.POSITIONING, Phase.CHECKING)
SET_UP = (*SETTING_UP, Phase.READY, Phase.FOUND)
LOCATED = (
    Phase.POSITIONING,
    Phase.CHECKING,
    Phase.READY,
    Phase.FOUND,
)  # not ours yet, once a position has come
STREAMING = (Phase.ENGAGING, Phase.STOPPING, Phase.RELEASING)
AIRBORNE = (Phase.TAKING_OFF, Phase.HOLDING, Phase.ENGAGED, *STREAMING)
FLYING = (*AIRBORNE, Phase.LANDING)
FAILING = (
    *SETTING_UP,
    Phase.TAKING_OFF,
    Phase.ENGAGING,
    Phase.STOPPING,
    Phase.LANDING,
    Phase.LOST,  # in which a landing goes on
)

Table = dict[tuple[Phase, Signal], Transition]


def _table() -> Table:
    """The rows one by one, then those that several phases share."""
    table: Table = {
        (Phase.CONNECTING, Signal.HEARTBEAT): Transition(Action.IDENTIFY, Phase.IDENTIFYING),
        (Phase.IDENTIFYING, Signal.STEPS_DONE): Transition(Action.CONFIGURE, Phase.CONFIGURING),
        (Phase.CONFIGURING, Signal.STEPS_DONE): Transition(Action.LOCATE, Phase.POSITIONING),
        (Phase.POSITIONING, Signal.STEPS_DONE): Transition(Action.CHECK, Phase.CHECKING),
        (Phase.CHECKING, Signal.STEPS_DONE): Transition(Action.REST, Phase.READY),
        (Phase.CHECKING, Signal.CHECKED_IN_FLIGHT): Transition(Action.REST, Phase.FOUND),
        (Phase.CHECKING, Signal.CHECKED_LANDED): Transition(Action.REST, Phase.LANDED),
        (Phase.FOUND, Signal.ADOPT): Transition(Action.ADOPT, Phase.ENGAGING),
        (Phase.FOUND, Signal.DECLINE): Transition(Action.RELEASE, Phase.RELEASED),
        (Phase.FOUND, Signal.DISARMED): Transition(Action.REST, Phase.LANDED),
        (Phase.READY, Signal.CHECK): Transition(Action.CHECK, Phase.CHECKING),
        (Phase.READY, Signal.TAKE_OFF): Transition(Action.TAKE_OFF, Phase.TAKING_OFF),
        (Phase.TAKING_OFF, Signal.STEPS_DONE): Transition(Action.REST, Phase.HOLDING),
        (Phase.HOLDING, Signal.ENGAGE): Transition(Action.ENGAGE, Phase.ENGAGING),
        (Phase.ENGAGING, Signal.STEPS_DONE): Transition(Action.REST, Phase.ENGAGED),
        (Phase.STOPPING, Signal.STEPS_DONE): Transition(Action.REST, Phase.HOLDING),
        (Phase.RELEASING, Signal.STEPS_DONE): Transition(Action.RELEASE, Phase.RELEASED),
        (Phase.RELEASING, Signal.STEP_FAILED): Transition(Action.RELEASE, Phase.RELEASED),
        (Phase.LANDING, Signal.STEPS_DONE): Transition(Action.REST, Phase.LANDED),
        (Phase.LANDING, Signal.RELEASE): Transition(Action.RELEASE, Phase.RELEASED),
        (Phase.RELEASED, Signal.RETAKE): Transition(Action.RETAKE, Phase.ENGAGING),
        (Phase.LOST, Signal.STEPS_DONE): Transition(Action.REST, Phase.LANDED),
        (Phase.LOST, Signal.LAND): Transition(Action.LAND, Phase.LANDING),
        (Phase.LOST, Signal.LINK_BACK_IN_SET_UP): Transition(Action.IDENTIFY, Phase.IDENTIFYING),
        (Phase.LOST, Signal.LINK_BACK_IN_FLIGHT): Transition(Action.RESUME, None),
    }
    shared: tuple[tuple[tuple[Phase, ...], Signal, Action, Phase], ...] = (
        (FAILING, Signal.STEP_FAILED, Action.FAIL, Phase.FAILED),
        (SETTING_UP, Signal.FAILED_IN_FLIGHT, Action.RELEASE, Phase.RELEASED),
        ((Phase.ENGAGING, Phase.ENGAGED), Signal.HOLD, Action.STOP, Phase.STOPPING),
        ((*AIRBORNE, Phase.FAILED), Signal.LAND, Action.LAND, Phase.LANDING),
        (AIRBORNE, Signal.RELEASE, Action.STOP, Phase.RELEASING),
        (AIRBORNE, Signal.POSITION_LOST, Action.LAND, Phase.LANDING),
        (LOCATED, Signal.POSITION_LOST, Action.IDENTIFY, Phase.IDENTIFYING),
        (SET_UP, Signal.RESTARTED, Action.IDENTIFY, Phase.IDENTIFYING),
        (FLYING, Signal.RESTARTED, Action.FAIL, Phase.FAILED),
        ((Phase.HOLDING, Phase.ENGAGED, *STREAMING), Signal.CAME_DOWN, Action.FAIL, Phase.FAILED),
        (FLYING, Signal.DISARMED, Action.FAIL, Phase.FAILED),
        (FLYING, Signal.MODE_TAKEN, Action.RELEASE, Phase.RELEASED),
        ((*SET_UP, *FLYING, Phase.RELEASED), Signal.LINK_LOST, Action.SUSPEND, Phase.LOST),
    )
    for phases, signal, action, then in shared:
        table.update({(phase, signal): Transition(action, then) for phase in phases})
    return table


TABLE: Table = _table()


def mermaid() -> str:
    """The table as a Mermaid state diagram, one line a transition."""
    lines = ["stateDiagram-v2", "    [*] --> CONNECTING"]
    for (phase, signal), (action, then) in TABLE.items():
        target = then.name if then else "the_phase_it_had"
        lines.append(f"    {phase.name} --> {target}: {signal.value} / {action.value}")
    return "\n".join(lines) + "\n"
