"""Orders in the air, and the answers to what goes wrong there."""

import itertools
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import OrderError

SET_MODE = mav.MAV_CMD_DO_SET_MODE
INTERVAL = mav.MAV_CMD_SET_MESSAGE_INTERVAL
POSCTL = 3 << 16


def search(rig: Any, seconds: float = 3.0) -> None:
    """Fly setpoints: eastwards at 30 m, though take-off was to 20 m."""
    rig.reach(Phase.ENGAGED)
    rig.each_tick = lambda: rig.session.setpoint(3.0, 0.0, 30.0)
    rig.run(seconds)


def test_hold_is_the_firmwares_own_and_resume_flies_on(rig: Any) -> None:
    search(rig, 10.0)
    rig.session.hold()
    rig.until_phase(Phase.HOLDING)
    assert rig.vehicle.mode == MODES.hold and rig.vehicle.velocity_en == (0.0, 0.0)
    rig.run(20.0)
    assert rig.session.phase is Phase.HOLDING
    rig.vehicle.setpoints.clear()
    rig.session.resume()
    rig.until_phase(Phase.ENGAGED)
    rig.run(1.0)
    assert rig.vehicle.velocity_en == (3.0, 0.0)


def test_while_stopping_hold_setpoints_flow_at_the_height_it_has(rig: Any) -> None:
    search(rig, 15.0)
    rig.vehicle.deaf.add(SET_MODE)
    rig.vehicle.setpoints.clear()
    rig.session.hold()
    times = []
    rig.vehicle.fly = lambda fields: times.append(rig.now)
    rig.run(3.0)
    assert rig.session.phase is Phase.STOPPING
    assert max(b - a for a, b in itertools.pairwise(times)) < 0.11
    setpoint = rig.vehicle.setpoints[-1]
    assert (setpoint.vx, setpoint.vy) == (0.0, 0.0)
    assert setpoint.z == pytest.approx(-(30.0 + 488.0 - 487.4), abs=0.2)


def test_after_hold_the_vehicle_is_retaken_at_that_height(rig: Any) -> None:
    search(rig, 15.0)
    rig.session.hold()
    rig.until_phase(Phase.HOLDING)
    rig.each_tick = lambda: None
    rig.vehicle.setpoints.clear()
    rig.session.engage()
    rig.until_phase(Phase.ENGAGED)
    assert {round(s.z, 0) for s in rig.vehicle.setpoints} == {-31.0}


def test_a_vehicle_that_will_not_stop_fails(rig: Any) -> None:
    search(rig)
    rig.vehicle.deaf.add(SET_MODE)
    rig.session.hold()
    rig.until_phase(Phase.FAILED, 25.0)
    assert "hold mode: DO_SET_MODE AUTO.LOITER had no effect in 20 s" in rig.session.reason


def test_release_stops_it_first_and_then_leaves_it_alone(rig: Any) -> None:
    search(rig)
    rig.session.release()
    rig.until_phase(Phase.RELEASED)
    assert rig.vehicle.mode == MODES.hold
    assert rig.texts(EventKind.RELEASED) == ["vehicle 1: released by order"]
    asked, flown = len(rig.vehicle.asked), len(rig.vehicle.setpoints)
    rig.vehicle.mode = POSCTL
    rig.run(20.0)
    assert (len(rig.vehicle.asked), len(rig.vehicle.setpoints)) == (asked, flown)
    assert rig.session.phase is Phase.RELEASED


def test_release_while_landing_lets_it_land(rig: Any) -> None:
    rig.reach(Phase.LANDING)
    rig.until(lambda: rig.vehicle.mode == MODES.land)
    asked = len(rig.vehicle.asked)
    rig.session.release()
    assert rig.session.phase is Phase.RELEASED
    rig.until(lambda: not rig.vehicle.armed)
    assert len(rig.vehicle.asked) == asked


def test_a_released_vehicle_is_retaken_only_by_order(rig: Any) -> None:
    search(rig)
    rig.vehicle.mode = POSCTL
    rig.until_phase(Phase.RELEASED)
    rig.run(5.0)
    rig.vehicle.mode = MODES.engaged
    rig.run(5.0)
    assert rig.session.phase is Phase.RELEASED
    rig.vehicle.mode = MODES.comeback
    rig.run(2.0)
    rig.session.retake()
    rig.vehicle.heartbeat()
    rig.until_phase(Phase.ENGAGED)
    rig.run(1.0)
    assert rig.vehicle.mode == MODES.engaged and rig.vehicle.velocity_en == (3.0, 0.0)


def test_what_does_not_fly_is_not_retaken(rig: Any) -> None:
    search(rig)
    rig.vehicle.mode = POSCTL
    rig.until_phase(Phase.RELEASED)
    rig.vehicle.fixed = False
    rig.run(3.0)
    with pytest.raises(OrderError, match="position is not known"):
        rig.session.retake()
    rig.vehicle.fixed = True
    rig.vehicle.mode = MODES.land
    rig.run(40.0)
    with pytest.raises(OrderError, match="not flying"):
        rig.session.retake()
    assert rig.session.phase is Phase.RELEASED


def test_a_lost_position_lands_the_vehicle_and_is_told(rig: Any) -> None:
    search(rig)
    rig.vehicle.fixed = False
    lost_at = rig.now
    rig.until_phase(Phase.LANDING, 5.0)
    assert rig.now - lost_at >= 2.0
    assert rig.texts(EventKind.POSITION_LOST) == ["vehicle 1: no valid position while engaged"]
    rig.until_phase(Phase.LANDED)


def test_a_position_that_comes_back_in_time_is_not_lost(rig: Any) -> None:
    search(rig)
    rig.vehicle.fixed = False
    rig.run(1.8)
    rig.vehicle.fixed = True
    rig.run(5.0)
    assert rig.session.phase is Phase.ENGAGED and rig.texts(EventKind.POSITION_LOST) == []


@pytest.mark.parametrize("silence_s", [2.5, 6.0])
def test_a_silent_link_is_no_lost_position(rig: Any, silence_s: float) -> None:
    """The first frame after the silence may be a heartbeat."""
    search(rig)
    rig.vehicle.silent = True
    rig.run(silence_s)
    rig.vehicle.silent = False
    rig.vehicle.heartbeat()
    rig.run(5.0)
    assert rig.session.phase is Phase.ENGAGED
    assert rig.texts(EventKind.POSITION_LOST) == []


def test_the_position_time_out_is_in_the_vehicles_time(make_rig: Any) -> None:
    took = []
    for position_loss_s in (2.0, 10.0):
        rig = make_rig(time_scale=2.0, position_loss_s=position_loss_s, link_loss_s=30.0)
        rig.reach(Phase.HOLDING)
        began = rig.now
        rig.vehicle.fixed = False
        rig.until_phase(Phase.LANDING)
        took.append(rig.now - began)
    assert took == pytest.approx([2.0, 5.0], abs=1.01)


def test_a_low_battery_is_told_once(make_rig: Any) -> None:
    rig = make_rig(battery_low_percent=25.0)
    search(rig)
    rig.vehicle.battery = 25
    rig.run(5.0)
    rig.vehicle.battery = 20
    rig.run(5.0)
    assert rig.texts(EventKind.BATTERY_LOW) == ["vehicle 1: 25 % left"]
    assert rig.session.phase is Phase.ENGAGED


@pytest.mark.parametrize(("battery", "limit"), [(-1, 25.0), (26, 25.0), (3, None)])
def test_an_unknown_battery_is_not_low_nor_one_that_nobody_asks_about(
    make_rig: Any, battery: int, limit: float | None
) -> None:
    rig = make_rig(battery_low_percent=limit)
    search(rig)
    rig.vehicle.battery = battery
    rig.run(5.0)
    assert rig.texts(EventKind.BATTERY_LOW) == []


def reboot(rig: Any) -> None:
    """As PX4 does: its streams come unasked again, and its clock begins anew."""
    rig.vehicle.booted_at = rig.now
    rig.vehicle.armed = False
    rig.vehicle.mode = MODES.hold
    rig.vehicle.encoder.sequence = 0


def test_a_restart_on_the_ground_is_a_new_set_up(rig: Any) -> None:
    rig.reach(Phase.READY)
    rig.run(10.0)
    asked = len(rig.vehicle.asked_for(INTERVAL))
    reboot(rig)
    rig.until_phase(Phase.IDENTIFYING, 2.0)
    assert rig.texts(EventKind.RESTARTED) == ["vehicle 1: its autopilot restarted while ready"]
    rig.until_phase(Phase.READY)
    assert len(rig.vehicle.asked_for(INTERVAL)) == 2 * asked


def test_a_restart_in_the_air_fails_and_a_landing_asks_for_the_streams_again(rig: Any) -> None:
    search(rig, 10.0)
    reboot(rig)
    rig.until_phase(Phase.FAILED, 2.0)
    assert rig.session.reason == "vehicle 1: its autopilot restarted while engaged"
    rig.run(10.0)
    asked = len(rig.vehicle.asked_for(INTERVAL))
    rig.session.land()
    rig.until_phase(Phase.LANDED)
    assert len(rig.vehicle.asked_for(INTERVAL)) == asked + 3


def test_frames_that_overtake_one_another_are_no_restart(make_rig: Any, make_noise: Any) -> None:
    rig = make_rig(link_loss_s=10.0)
    rig.reach(Phase.ENGAGED)
    rig.down = make_noise(5, repeat=0.3, overtake=0.5)
    rig.run(30.0)
    assert rig.session.phase is Phase.ENGAGED and rig.texts(EventKind.RESTARTED) == []


def test_six_broken_set_ups_are_enough(rig: Any) -> None:
    for _ in range(6):
        rig.until_phase(Phase.CONFIGURING)
        rig.run(6.0 if rig.now == 0.0 else 0.3)
        rig.vehicle.position(rig.now + 100.0)
        rig.vehicle.position(rig.now)
        rig.tick()
    rig.until_phase(Phase.FAILED, 2.0)
    assert rig.session.reason == "vehicle 1: its set-up was broken off 6 times"


def test_disarmed_high_up_while_landing_is_a_failure(rig: Any) -> None:
    rig.reach(Phase.LANDING)
    rig.run(3.0)
    rig.vehicle.armed = False
    rig.until_phase(Phase.FAILED, 3.0)
    assert rig.session.reason == "vehicle 1: it disarmed while landing"


def test_a_landing_ordered_while_nothing_is_heard_is_carried_out(rig: Any) -> None:
    search(rig)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    rig.session.land()
    rig.until(lambda: rig.vehicle.mode == MODES.land, 3.0)
    rig.until(lambda: not rig.vehicle.armed, 60.0)
    assert rig.session.phase is Phase.LOST
    rig.vehicle.silent = False
    rig.until_phase(Phase.LANDED, 10.0)


def test_a_landing_that_is_never_heard_of_is_given_up_in_the_end(rig: Any) -> None:
    rig.reach(Phase.LANDING)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST, 5.0)
    rig.until_phase(Phase.FAILED, 120.0)
    assert "land mode" in rig.session.reason


@pytest.mark.parametrize("phase", [Phase.READY, Phase.RELEASED])
def test_a_lost_vehicle_that_was_not_ours_in_the_air_is_not_landed(rig: Any, phase: Phase) -> None:
    if phase is Phase.RELEASED:
        search(rig)
        rig.vehicle.mode = POSCTL
    rig.until_phase(phase)
    rig.vehicle.silent = True
    rig.until_phase(Phase.LOST)
    with pytest.raises(OrderError, match=f"lost while {phase.value}"):
        rig.session.land()
    assert rig.session.phase is Phase.LOST


def test_a_landing_asks_for_the_streams_only_if_they_may_be_gone(rig: Any) -> None:
    search(rig)
    asked = len(rig.vehicle.asked_for(INTERVAL))
    rig.session.land()
    rig.until_phase(Phase.LANDED)
    assert len(rig.vehicle.asked_for(INTERVAL)) == asked


def test_land_mode_is_asked_for_through_refusals(rig: Any) -> None:
    search(rig)
    rig.vehicle.results[SET_MODE] = [[mav.MAV_RESULT_DENIED]] * 10
    rig.session.land()
    rig.until_phase(Phase.LANDED)
