"""MAVProxy flies the stub's PX4, as a user who knows both does.

MAVProxy's `takeoff` and `guided` send altitudes above home, which PX4 takes as above sea level; its `mode`
fails by itself with PX4's modes (1.8.75), so modes are ordered with `long DO_SET_MODE`.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from .mavproxy_rig import ORIGIN, SOON_S, MavProxy, ServedFleet, flown, guided, hear_where_it_hovers

Rig = tuple[ServedFleet, MavProxy]
OFFBOARD, TAKEOFF, LOITER, RTL, LAND = 0x60000, 0x2040000, 0x3040000, 0x5040000, 0x6040000
GROUND_M = ORIGIN[2]
PATIENT_S = 10.0
"""For COM_OF_LOSS_T: MAVProxy's stream has gaps on a busy machine, and a second of wall time is ten of these."""


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    with flown("px4", tmp_path) as both:
        yield both


def order_mode(mavproxy: MavProxy, mode: int) -> None:
    """DO_SET_MODE with PX4's main and sub mode."""
    mavproxy.type(f"long DO_SET_MODE 29 {mode >> 16 & 0xFF} {mode >> 24}")


def take_off(fleet: ServedFleet, mavproxy: MavProxy, height_m: float) -> None:
    """Row "takeoff": NAV_TAKEOFF above sea level, then ARM."""
    mavproxy.type(f"long NAV_TAKEOFF 0 0 0 nan nan nan {GROUND_M + height_m}")
    fleet.until(lambda: fleet.mode == TAKEOFF, SOON_S)
    mavproxy.type("arm throttle")
    fleet.until(lambda: fleet.vehicle.armed, SOON_S)
    fleet.until(lambda: fleet.mode == LOITER and fleet.is_at(0.0, 0.0, height_m)(), 40.0)


def test_taken_off_guided_to_a_place_and_returned(rig: Rig) -> None:
    fleet, mavproxy = rig
    take_off(fleet, mavproxy, 10.0)
    mavproxy.hear("ARMED")

    mavproxy.type(guided(30.0, 40.0, GROUND_M + 20.0))
    fleet.until(fleet.is_at(30.0, 40.0, 20.0), 60.0)
    hear_where_it_hovers(fleet, mavproxy)

    # Row "RTL": at RTL_RETURN_ALT, 30 m, where the cone does not end below; row "after landing": LOITER again.
    order_mode(mavproxy, RTL)
    fleet.until(lambda: fleet.mode == RTL, SOON_S)
    mavproxy.hear("Mode RTL")
    fleet.until(lambda: not fleet.vehicle.armed, 150.0)
    mavproxy.hear("DISARMED")
    assert fleet.is_at(0.0, 0.0, 0.0)()
    assert fleet.highest_m == pytest.approx(30.0, abs=0.3)
    assert fleet.mode == LOITER


def test_altitudes_above_home_are_taken_as_above_sea_level(rig: Rig) -> None:
    """Row "takeoff": a relative altitude never lifts off, and makes one that flies land."""
    fleet, mavproxy = rig
    mavproxy.type("takeoff 10")
    fleet.until(lambda: fleet.mode == TAKEOFF, SOON_S)
    mavproxy.type("arm throttle")
    fleet.until(lambda: fleet.vehicle.armed, SOON_S)
    fleet.until(lambda: not fleet.vehicle.armed, 15.0)
    mavproxy.hear("Disarmed by auto preflight")
    assert fleet.highest_m == 0.0

    take_off(fleet, mavproxy, 10.0)
    mavproxy.type(guided(5.0, 0.0, 20.0))
    fleet.until(lambda: fleet.vehicle.landed and not fleet.vehicle.armed, 60.0)
    assert fleet.highest_m < 10.5


def test_modes_are_refused_and_entered(rig: Rig) -> None:
    fleet, mavproxy = rig
    take_off(fleet, mavproxy, 30.0)
    # Rows "mode change" and "OFFBOARD": the link accepts, the commander refuses without a stream.
    order_mode(mavproxy, OFFBOARD)
    mavproxy.hear(r"DO_SET_MODE: ACCEPTED\s[^$]*DO_SET_MODE: TEMPORARILY_REJECTED")
    mavproxy.type("disarm")
    mavproxy.hear("COMPONENT_ARM_DISARM: TEMPORARILY_REJECTED")
    mavproxy.hear("Disarming denied: not landed")
    assert (fleet.mode, fleet.vehicle.armed) == (LOITER, True)

    mavproxy.type("long NAV_LAND")
    fleet.until(lambda: fleet.mode == LAND and fleet.body["v_up"] < -0.5, SOON_S)
    mavproxy.type("long NAV_LOITER_UNLIM")
    fleet.until(lambda: fleet.mode == LOITER and abs(fleet.body["v_up"]) < 0.05, SOON_S)
    assert fleet.body["up"] > 1.0
    mavproxy.type("disarm force")
    fleet.until(lambda: not fleet.vehicle.armed and fleet.body["up"] == 0.0, SOON_S)


def test_offboard_follows_a_stream_and_returns_without_it(rig: Rig) -> None:
    """Rows "OFFBOARD", "frames" (BODY_NED) and "setpoints stop"; the stream is MAVProxy's `repeat`."""
    fleet, mavproxy = rig
    mavproxy.hear(r"Received \d+ parameters")
    mavproxy.type(f"param set COM_OF_LOSS_T {PATIENT_S}")
    fleet.until(lambda: fleet.vehicle.parameters["COM_OF_LOSS_T"] == PATIENT_S, 60.0)
    take_off(fleet, mavproxy, 10.0)
    mavproxy.type("repeat add 0.02 velocity 3 0 0")
    mavproxy.hear("(?s)(x:3.*){10}")
    order_mode(mavproxy, OFFBOARD)
    fleet.until(lambda: fleet.mode == OFFBOARD and fleet.body["v_north"] > 2.5, 60.0)
    mavproxy.type("repeat clean")
    fleet.until(lambda: fleet.mode == RTL and fleet.body["v_north"] < -1.0, 60.0)


def test_a_fence_holds_it_just_outside(rig: Rig, tmp_path: Path) -> None:
    """Row "fence": GF_ACTION 2 loiters at the fence, about 2 m outside."""
    fleet, mavproxy = rig
    circle = tmp_path / "circle.txt"
    circle.write_text("QGC WPL 110\n0\t0\t0\t5003\t40\t0\t0\t0\t47.3977\t8.5456\t0\t1\n")
    mavproxy.type(f"fence load {circle}")
    fleet.until(lambda: fleet.vehicle.fence is not None, SOON_S)
    take_off(fleet, mavproxy, 10.0)
    mavproxy.type(guided(90.0, 0.0, GROUND_M + 10.0))
    fleet.until(lambda: fleet.furthest_m > 40.0, SOON_S)
    mavproxy.hear("approaching or outside geofence")
    fleet.let_pass(15.0)
    assert fleet.mode == LOITER
    assert fleet.furthest_m < 70.0
    assert fleet.fastest_mps < 5.1
