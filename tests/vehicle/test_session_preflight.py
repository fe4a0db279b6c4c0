"""Before flight: parameters by all their names, and the vehicle's fence uploaded, read back and compared."""

import copy
import random
from collections.abc import Callable
from typing import Any

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import QUANTITIES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import EXCLUSION, INCLUSION, Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight

from .fake_ardupilot import FakeArduPilot

KEEP_IN = [(47.39, 8.54), (47.39, 8.56), (47.41, 8.56), (47.41, 8.54)]
KEEP_OUT = [(47.40, 8.55), (47.40, 8.5512345), (47.4012345, 8.55)]
FENCE = Preflight(fence=Fence([KEEP_IN], [KEEP_OUT]))
READ = Preflight(read_parameters=True)
PX4 = {"MPC_XY_VEL_MAX": 12.0, "MPC_ACC_HOR": 3.0, "GF_ACTION": 2, "NAV_DLL_ACT": -1}


def test_px4s_integers_are_bytes(make_rig: Any) -> None:
    rig = make_rig(preflight=READ)
    rig.vehicle.memory.parameters = PX4
    rig.until_phase(Phase.READY)
    assert rig.session.parameters == {
        "speed_mps": 12.0,
        "acceleration_mps2": 3.0,
        "fence_action": 2.0,
        "ground_station_loss_action": -1.0,
    }
    assert "climb_mps: the vehicle has no such parameter" in rig.texts(EventKind.WARNING)


@pytest.mark.parametrize(
    "known",
    [
        {"WP_SPD": 10.0, "FENCE_ENABLE": 1, "RTL_ALT_M": 15.0},
        {"WPNAV_SPEED": 1000.0, "FENCE_ENABLE": 1, "RTL_ALT": 1500},
    ],
)
def test_ardupilots_integers_are_numbers_and_its_old_names_centimetres(make_rig: Any, known: Any) -> None:
    rig = make_rig(FakeArduPilot, READ)
    rig.vehicle.memory.parameters = known
    rig.until_phase(Phase.READY, 200.0)
    assert rig.session.parameters == {"speed_mps": 10.0, "fence_enabled": 1.0, "return_height_m": 15.0}


def test_an_unknown_parameter_costs_no_time_when_it_is_said_and_little_when_not(make_rig: Any) -> None:
    took = []
    for answered in (True, False):
        rig = make_rig(preflight=READ, parameter_patience_s=6.0)
        rig.vehicle.memory.unknown_answered = answered
        rig.reach(Phase.CHECKING)
        began = rig.now
        rig.until_phase(Phase.READY)
        took.append(rig.now - began)
        assert len(rig.texts(EventKind.WARNING)) == len(QUANTITIES) and rig.session.parameters == {}
    assert took[0] < 2.0 and took[1] == pytest.approx(len(QUANTITIES) * 6.0, abs=1.0)


@pytest.mark.parametrize("seed", range(3))
def test_parameters_over_a_bad_link(make_rig: Any, make_noise: Any, seed: int) -> None:
    rig = make_rig(preflight=READ, link_loss_s=15.0)
    rig.vehicle.memory.parameters = dict.fromkeys(("MPC_XY_VEL_MAX", "MPC_ACC_HOR"), 7.0)
    rig.up, rig.down = make_noise(seed, 0.4), make_noise(seed + 100, 0.4)
    rig.until_phase(Phase.READY, 300.0)
    assert rig.session.parameters["speed_mps"] == rig.session.parameters["acceleration_mps2"] == 7.0


def test_nothing_is_asked_when_nothing_is_wanted(rig: Any) -> None:
    rig.reach(Phase.LANDING)
    rig.until_phase(Phase.LANDED)
    ours = {frame[7] for frame in rig.session.traffic() if frame[5] == 255}
    assert ours == {
        mav.MAVLINK_MSG_ID_HEARTBEAT,
        mav.MAVLINK_MSG_ID_COMMAND_LONG,
        mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
        mav.MAVLINK_MSG_ID_TIMESYNC,
    }
    assert rig.session.parameters == {} and not rig.session.fence_verified


@pytest.mark.parametrize("old_request", [False, True])
def test_the_fence_is_stored_and_verified(make_rig: Any, old_request: bool) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.old_request = old_request
    rig.until_phase(Phase.READY)
    stored = [(f.command, f.param1, f.x, f.y) for f in rig.vehicle.memory.fence]
    assert stored[:2] == [(INCLUSION, 4.0, 473900000, 85400000), (INCLUSION, 4.0, 473900000, 85600000)]
    assert stored[5] == (EXCLUSION, 3.0, 474000000, 85512345)
    assert len(stored) == 7 and rig.session.fence_verified
    assert rig.vehicle.memory.uploads == 1


def shifted(items: list[Any], number: int, **changes: float) -> list[Any]:
    items = [copy.copy(item) for item in items]
    for name, change in changes.items():
        setattr(items[number], name, getattr(items[number], name) + change)
    return items


@pytest.mark.parametrize(
    ("keep", "told"),
    [
        (lambda items: items[:-1], "the vehicle holds 6 vertices, not 7"),
        (lambda items: [], "the vehicle holds 0 vertices, not 7"),
        (lambda items: shifted(items, 6, x=3), "vertex 6 is exclusion of 3, 47.4012348, 8.5500000, not"),
        (lambda items: shifted(items, 0, y=-3), "vertex 0 is inclusion of 4, 47.3900000, 8.5399997, not"),
        (lambda items: shifted(items, 2, param1=1), "vertex 2 is inclusion of 5"),
        (lambda items: shifted(items, 1, command=1), "vertex 1 is exclusion of 4"),
    ],
)
def test_a_fence_that_reads_back_differently_grounds_the_vehicle(
    make_rig: Any, keep: Callable[[list[Any]], list[Any]], told: str
) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.keep = keep
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason.startswith(f"vehicle 1: fence read back: {told}")
    assert not rig.session.fence_verified


def test_rounding_by_the_vehicle_is_no_difference(make_rig: Any) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.keep = lambda items: shifted(items, 3, x=1, y=-1)
    rig.until_phase(Phase.READY)
    assert rig.session.fence_verified


def test_a_refused_fence_is_told(make_rig: Any) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.result = mav.MAV_MISSION_NO_SPACE
    rig.until_phase(Phase.FAILED)
    assert rig.session.reason == "vehicle 1: fence upload: refused: NO_SPACE"


def test_a_vehicle_without_fences_is_told_in_bounded_time(make_rig: Any) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.receive = lambda message_id, fields: None
    rig.until_phase(Phase.FAILED, 200.0)
    assert rig.session.reason == "vehicle 1: fence upload: not reached in 135 s"


def test_other_missions_and_other_ground_stations_do_not_matter(make_rig: Any) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.result = mav.MAV_MISSION_OPERATION_CANCELLED
    rig.reach(Phase.CHECKING)
    accepted = mav.MAV_MISSION_ACCEPTED
    rig.vehicle.send(mav.MAVLink_mission_ack_message(245, 190, accepted, mav.MAV_MISSION_TYPE_FENCE))
    rig.vehicle.send(mav.MAVLink_mission_ack_message(255, 190, accepted, mav.MAV_MISSION_TYPE_MISSION))
    rig.run(2.0)
    assert rig.session.phase is Phase.CHECKING
    rig.vehicle.memory.result = accepted
    rig.until_phase(Phase.READY)


@pytest.mark.parametrize("seed", range(4))
def test_a_fence_over_a_link_that_loses_and_repeats(make_rig: Any, make_noise: Any, seed: int) -> None:
    rig = make_rig(preflight=FENCE, link_loss_s=15.0)
    rig.up, rig.down = make_noise(seed, 0.3, 0.2, 0.2), make_noise(seed + 100, 0.3, 0.2, 0.2)
    rig.until_phase(Phase.READY, 300.0)
    assert rig.session.fence_verified


def test_a_fence_over_a_link_that_delays_by_two_seconds(make_rig: Any) -> None:
    rig = make_rig(preflight=FENCE)
    noise = random.Random(1)
    ways: list[list[tuple[float, bytes]]] = [[], []]

    def late(way: int) -> Callable[[list[bytes]], list[bytes]]:
        def carry(frames: list[bytes]) -> list[bytes]:
            ways[way] += [(rig.now + noise.uniform(1.8, 2.0), frame) for frame in frames]
            arrived = [frame for due, frame in ways[way] if due <= rig.now]
            ways[way] = [(due, frame) for due, frame in ways[way] if due > rig.now]
            return arrived

        return carry

    rig.up, rig.down = late(0), late(1)
    rig.until_phase(Phase.READY, 400.0)
    assert rig.session.fence_verified


@pytest.mark.parametrize("polygons", [[], [[(47.0, 8.0), (47.1, 8.0)]]])
def test_a_fence_that_encloses_nothing_is_refused(polygons: Any) -> None:
    with pytest.raises(ValueError, match="a fence needs polygons of three vertices or more"):
        Fence(polygons)


def test_garbage_in_a_vertex_does_not_stop_the_session(make_rig: Any) -> None:
    rig = make_rig(preflight=FENCE)
    rig.vehicle.memory.keep = lambda items: shifted(items, 0, param1=float("nan"))
    rig.until_phase(Phase.FAILED)
    assert "vertex 0 is inclusion of 0" in rig.session.reason


def test_a_fence_ordered_later_is_set_and_parameters_are_not_read_again(make_rig: Any) -> None:
    rig = make_rig(preflight=READ)
    rig.vehicle.memory.parameters = {"MPC_XY_VEL_MAX": 12.0, "MPC_ACC_HOR": 3.0}
    rig.vehicle.memory.unknown_answered = True
    rig.until_phase(Phase.READY)
    rig.session.traffic()
    rig.session.check(Preflight(read_parameters=True, fence=FENCE.fence))
    rig.until_phase(Phase.READY)
    asked = [f for f in rig.session.traffic() if f[5] == 255 and b"MPC_XY_VEL_MAX" in f]
    assert rig.session.fence_verified and rig.session.parameters["speed_mps"] == 12.0 and not asked


def test_after_a_restart_all_that_was_ordered_is_done_again(make_rig: Any) -> None:
    rig = make_rig()
    rig.vehicle.memory.parameters = PX4
    rig.until_phase(Phase.READY)
    rig.session.check(Preflight(read_parameters=True, fence=FENCE.fence))
    rig.until_phase(Phase.READY)
    rig.vehicle.memory.parameters = {**PX4, "MPC_XY_VEL_MAX": 9.0}
    rig.vehicle.out.clear()
    rig.vehicle.position(rig.now + 100.0)
    rig.vehicle.position(rig.now)
    rig.tick()
    assert rig.session.phase is Phase.IDENTIFYING and not rig.session.fence_verified
    rig.until_phase(Phase.READY)
    assert rig.session.fence_verified and rig.session.parameters["speed_mps"] == 9.0
    assert rig.vehicle.memory.uploads == 2
