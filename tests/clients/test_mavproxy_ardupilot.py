"""MAVProxy flies the stub's ArduPilot: typed commands on one side, what the vehicle does on the other."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from .mavproxy_rig import SOON_S, MavProxy, ServedFleet, flown, guided, hear_where_it_hovers

Rig = tuple[ServedFleet, MavProxy]
STABILIZE, GUIDED, LOITER, RTL, LAND, BRAKE = 0, 4, 5, 6, 9, 17


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    with flown("ardupilot", tmp_path) as both:
        yield both


def take_off(fleet: ServedFleet, mavproxy: MavProxy, height_m: float) -> None:
    """Row "takeoff": GUIDED, arm, NAV_TAKEOFF with altitude above home."""
    mavproxy.type("mode guided")
    fleet.until(lambda: fleet.mode == GUIDED, SOON_S)
    mavproxy.type("arm throttle", f"takeoff {height_m}")
    fleet.until(lambda: fleet.vehicle.armed, SOON_S)
    fleet.until(fleet.is_at(0.0, 0.0, height_m), 60.0)


def test_armed_taken_off_guided_to_a_place_and_returned(rig: Rig) -> None:
    fleet, mavproxy = rig
    take_off(fleet, mavproxy, 10.0)
    mavproxy.hear("ARMED")

    mavproxy.type(guided(30.0, 40.0, 12.0))
    fleet.until(fleet.is_at(30.0, 40.0, 12.0), 60.0)
    hear_where_it_hovers(fleet, mavproxy)
    assert fleet.highest_m < 12.5

    # Row "RTL": RTL_ALT_M 15, loiter 5 s, land; and the mode stays.
    mavproxy.type("rtl")
    fleet.until(lambda: fleet.mode == RTL, SOON_S)
    mavproxy.hear("Mode RTL")
    fleet.until(lambda: not fleet.vehicle.armed, 120.0)
    mavproxy.hear("DISARMED")
    assert fleet.is_at(0.0, 0.0, 0.0)()
    assert fleet.highest_m == pytest.approx(15.0, abs=0.3)
    assert fleet.mode == RTL


def test_modes_are_entered_and_refused_and_do_what_they_are_for(rig: Rig) -> None:
    fleet, mavproxy = rig
    body = fleet.body
    mavproxy.type("takeoff 10")
    mavproxy.hear("NAV_TAKEOFF: FAILED")
    assert not fleet.vehicle.armed
    take_off(fleet, mavproxy, 40.0)

    mavproxy.type("mode loiter")  # row "stopping": without RC it sinks
    fleet.until(lambda: fleet.mode == LOITER and body["v_up"] < -2.4, SOON_S)
    mavproxy.type("mode brake")
    fleet.until(lambda: fleet.mode == BRAKE and abs(body["v_up"]) < 0.05, SOON_S)
    mavproxy.type("mode 99")  # row "modes": a wrong one is ACKed 4
    mavproxy.hear("DO_SET_MODE: FAILED")
    mavproxy.type("disarm")
    mavproxy.hear("COMPONENT_ARM_DISARM: FAILED")
    assert (fleet.mode, fleet.vehicle.armed) == (BRAKE, True)

    # Rows "setpoints stop" and "frames": one velocity, in the body's frame, is flown for 3 s.
    mavproxy.type("mode guided")
    fleet.until(lambda: fleet.mode == GUIDED, SOON_S)
    mavproxy.type("velocity 5 0 0")
    fleet.until(lambda: body["v_north"] > 4.0, SOON_S)
    fleet.until(lambda: body["v_north"] < 0.05, 10.0)
    assert 10.0 < body["north"] < 60.0
    assert abs(body["east"]) < 0.1

    mavproxy.type("mode land")
    fleet.until(lambda: fleet.mode == LAND, SOON_S)
    fleet.until(lambda: not fleet.vehicle.armed, 150.0)
    assert body["up"] == 0.0
    assert 10.0 < body["north"] < 70.0


def test_a_fence_that_is_broken_sends_it_home(rig: Rig, tmp_path: Path) -> None:
    """Row "fence": switched on by its command; FENCE_ACTION 1 returns."""
    fleet, mavproxy = rig
    circle = tmp_path / "circle.txt"
    circle.write_text("QGC WPL 110\n0\t0\t0\t5003\t40\t0\t0\t0\t47.3977\t8.5456\t0\t1\n")
    mavproxy.type(f"fence load {circle}", "fence enable")
    fleet.until(lambda: fleet.vehicle.fence is not None, SOON_S)
    fleet.until(lambda: fleet.vehicle.parameters["FENCE_ENABLE"] == 1, SOON_S)
    take_off(fleet, mavproxy, 10.0)
    mavproxy.type(guided(90.0, 0.0, 10.0))
    fleet.until(lambda: fleet.mode == RTL, SOON_S)
    mavproxy.hear("fence breach")
    mavproxy.type("disarm force")
    fleet.until(lambda: not fleet.vehicle.armed and fleet.body["up"] == 0.0, SOON_S)
    assert 40.0 < fleet.furthest_m < 70.0


def test_a_speed_that_is_set_is_flown(rig: Rig) -> None:
    """Row "velocity limits": WP_SPD."""
    fleet, mavproxy = rig
    mavproxy.hear(r"Received \d+ parameters")
    mavproxy.type("param set WP_SPD 4")
    fleet.until(lambda: fleet.vehicle.parameters["WP_SPD"] == 4.0, 60.0)
    take_off(fleet, mavproxy, 10.0)
    mavproxy.type(guided(40.0, 0.0, 10.0))
    fleet.until(fleet.is_at(40.0, 0.0, 10.0), 60.0)
    assert fleet.fastest_mps == pytest.approx(4.0, abs=0.05)
