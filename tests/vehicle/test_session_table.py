"""Every row of the session's table, walked by what causes it in flight."""

from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle import phases
from swarmctl.vehicle.autopilots.px4 import MODES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import AIRBORNE, SET_UP, TABLE, Phase, Signal
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import OrderError

FAILED = (Signal.STEP_FAILED, Signal.FAILED_IN_FLIGHT)
IN_FLIGHT = (Signal.CHECKED_IN_FLIGHT, Signal.FAILED_IN_FLIGHT)
DENIED = [mav.MAV_RESULT_DENIED]
POSCTL = 3 << 16
PREFLIGHT = Preflight(fence=Fence([[(47.39, 8.54), (47.39, 8.55), (47.40, 8.55)]]))


def hear(rig: Any) -> None:
    rig.run(1.2)


def take_up(rig: Any) -> None:
    """Another controller has taken the vehicle off, and died."""
    rig.vehicle.armed, rig.vehicle.mode = True, MODES.comeback
    rig.vehicle.height_m = rig.vehicle.target_m = 20.0


def finish(rig: Any) -> None:
    before = rig.session.phase
    rig.until(lambda: rig.session.phase is not before)


def break_off(rig: Any) -> None:
    """Make the next command fail for good."""
    before = rig.session.phase
    if rig.session.phase is Phase.POSITIONING:
        rig.vehicle.healthy = rig.vehicle.home_known = False
    rig.vehicle.memory.result = mav.MAV_MISSION_DENIED
    for number in (mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAV_CMD_DO_SET_MODE, mav.MAV_CMD_NAV_TAKEOFF):
        rig.vehicle.results[number] = [DENIED] * 200
    rig.vehicle.out.clear()
    rig.until(lambda: rig.session.phase is not before)


def steal(rig: Any) -> None:
    rig.until(lambda: rig.vehicle.height_m > 1.0)
    if rig.session.phase is Phase.LANDING:
        rig.until(lambda: rig.session.telemetry.mode == MODES.land)
    rig.vehicle.mode = POSCTL
    rig.vehicle.deaf.add(mav.MAV_CMD_DO_SET_MODE)
    rig.run(2.0)


def disarm(rig: Any) -> None:
    rig.until(lambda: rig.session.telemetry.armed)
    if rig.session.phase is Phase.LANDING:
        rig.run(2.0)
    rig.vehicle.armed = False
    rig.run(1.2)


def blind(rig: Any) -> None:
    """The position goes; on the ground, what comes next does not come meanwhile."""
    if rig.session.phase is Phase.POSITIONING:
        rig.until(lambda: rig.session.telemetry.positioned)
    rig.vehicle.memory.receive = lambda message_id, fields: None
    rig.vehicle.fixed = False
    rig.vehicle.deaf.add(mav.MAV_CMD_DO_SET_MODE)
    rig.run(5.0)


def come_down(rig: Any) -> None:
    rig.vehicle.landed_state = mav.MAV_LANDED_STATE_ON_GROUND
    rig.vehicle.deaf.add(mav.MAV_CMD_DO_SET_MODE)
    rig.run(1.0)


def restart(rig: Any) -> None:
    """The vehicle's clock runs backwards."""
    rig.vehicle.out.clear()
    rig.vehicle.position(rig.now + 100.0)
    rig.vehicle.position(rig.now)
    rig.tick()


def hush(rig: Any) -> None:
    rig.vehicle.silent = True
    rig.vehicle.out.clear()
    rig.run(4.5)


def come_back(rig: Any) -> None:
    rig.vehicle.silent = False
    rig.vehicle.heartbeat()
    rig.tick()


CAUSES: dict[Signal, Callable[[Any], None]] = {
    Signal.HEARTBEAT: hear,
    Signal.STEPS_DONE: finish,
    Signal.STEP_FAILED: break_off,
    Signal.CHECKED_IN_FLIGHT: finish,
    Signal.CHECKED_LANDED: finish,
    Signal.FAILED_IN_FLIGHT: break_off,
    Signal.CHECK: lambda rig: rig.session.check(Preflight(read_parameters=True)),
    Signal.TAKE_OFF: lambda rig: rig.session.take_off(20.0),
    Signal.ADOPT: lambda rig: rig.session.adopt(),
    Signal.DECLINE: lambda rig: rig.session.decline("it is outside the fence"),
    Signal.ENGAGE: lambda rig: rig.session.engage(),
    Signal.HOLD: lambda rig: rig.session.hold(),
    Signal.LAND: lambda rig: rig.session.land(),
    Signal.RELEASE: lambda rig: rig.session.release(),
    Signal.RETAKE: lambda rig: rig.session.retake(),
    Signal.CAME_DOWN: come_down,
    Signal.POSITION_LOST: blind,
    Signal.RESTARTED: restart,
    Signal.MODE_TAKEN: steal,
    Signal.DISARMED: disarm,
    Signal.LINK_LOST: hush,
    Signal.LINK_BACK_IN_SET_UP: come_back,
    Signal.LINK_BACK_IN_FLIGHT: come_back,
}


def entered(rig: Any) -> list[str]:
    """The phases entered, from the event log."""
    return rig.texts(EventKind.PHASE)


def prepare(rig: Any, phase: Phase, signal: Signal) -> None:
    """Bring the session to ``phase``, by a way on which ``signal`` can come next."""
    if signal in IN_FLIGHT or phase is Phase.FOUND:
        take_up(rig)
    if signal in FAILED and phase is Phase.IDENTIFYING:
        rig.vehicle.autopilot = mav.MAV_AUTOPILOT_SMACCMPILOT
    elif phase is Phase.FAILED:
        rig.reach(Phase.HOLDING)
        rig.session.engage()
        break_off(rig)
        rig.vehicle.results.clear()
    elif phase is Phase.RELEASED:
        rig.reach(Phase.HOLDING)
        steal(rig)
    elif phase is Phase.LOST and signal is Signal.STEPS_DONE:
        rig.reach(Phase.LANDING)
        rig.until(lambda: not rig.vehicle.armed)
        rig.vehicle.deaf.add(mav.MAV_CMD_DO_SET_MODE)
        rig.run(1.0)
        hush(rig)
    elif phase is Phase.LOST and signal is Signal.STEP_FAILED:
        rig.reach(Phase.LANDING)
        hush(rig)
    elif phase is Phase.LOST:
        rig.reach(Phase.READY if signal is Signal.LINK_BACK_IN_SET_UP else Phase.HOLDING)
        hush(rig)
    else:
        rig.vehicle.healthy = (phase, signal) != (Phase.POSITIONING, Signal.POSITION_LOST)
        rig.reach(phase)


@pytest.mark.parametrize(("phase", "signal"), TABLE, ids=lambda value: value.name)
def test_row(make_rig: Any, phase: Phase, signal: Signal) -> None:
    adopts = phase is Phase.FOUND or signal in (*IN_FLIGHT, Signal.CHECKED_LANDED)
    rig = make_rig(preflight=PREFLIGHT if phase is Phase.CHECKING else None, adopts=adopts)
    prepare(rig, phase, signal)
    rig.events += rig.session.events()
    seen = len(entered(rig))
    if phase is Phase.IDENTIFYING and signal in FAILED:
        hear(rig)
        seen = 1
    else:
        CAUSES[signal](rig)
    rig.events += rig.session.events()
    then = TABLE[phase, signal].phase or Phase.HOLDING
    assert entered(rig)[seen] == then.value
    assert phase is Phase.CONNECTING or entered(rig)[seen - 1] == phase.value


def test_every_phase_can_be_entered_and_every_action_is_used() -> None:
    assert {row.phase for row in TABLE.values()} | {Phase.CONNECTING} >= set(Phase)
    assert {row.action for row in TABLE.values()} == set(phases.Action)


@pytest.mark.parametrize("phase", [*SET_UP, Phase.CONNECTING, Phase.HOLDING, Phase.ENGAGED, Phase.LANDED])
def test_an_order_out_of_place_is_refused_and_changes_nothing(make_rig: Any, phase: Phase) -> None:
    found = phase is Phase.FOUND
    rig = make_rig(preflight=PREFLIGHT if phase is Phase.CHECKING else None, adopts=found)
    if found:
        take_up(rig)
    rig.reach(Phase.LANDING if phase is Phase.LANDED else phase)
    rig.until_phase(phase)
    orders = {
        Signal.CHECK: lambda: rig.session.check(PREFLIGHT),
        Signal.TAKE_OFF: lambda: rig.session.take_off(20.0),
        Signal.ADOPT: rig.session.adopt,
        Signal.DECLINE: lambda: rig.session.decline("it is outside the fence"),
        Signal.ENGAGE: rig.session.engage,
        Signal.HOLD: rig.session.hold,
        Signal.LAND: rig.session.land,
        Signal.RELEASE: rig.session.release,
        Signal.RETAKE: rig.session.retake,
    }
    for signal, order in orders.items():
        if (phase, signal) not in TABLE:
            with pytest.raises(OrderError, match=f"vehicle 1: {signal.value}.*{phase.value}"):
                order()
            assert rig.session.phase is phase


@pytest.mark.parametrize("altitude_m", [0.0, -5.0, float("nan"), float("inf")])
def test_a_senseless_take_off_is_refused(rig: Any, altitude_m: float) -> None:
    rig.reach(Phase.READY)
    with pytest.raises(OrderError, match="vehicle 1: cannot take off to"):
        rig.session.take_off(altitude_m)
    assert rig.session.phase is Phase.READY


def test_the_diagram_shows_every_row() -> None:
    lines = phases.mermaid().splitlines()
    assert len(lines) == len(TABLE) + 2
    assert "    READY --> TAKING_OFF: order: take off / take_off" in lines
    assert "    LOST --> the_phase_it_had: link back, had been flying / resume" in lines


def test_airborne_phases_can_land_and_be_released() -> None:
    for phase in AIRBORNE:
        assert (phase, Signal.LAND) in TABLE
        assert (phase, Signal.MODE_TAKEN) in TABLE
