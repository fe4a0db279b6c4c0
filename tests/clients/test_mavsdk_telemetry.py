"""What MAVSDK knows of the stub: what is streamed and asked for, and what it makes of that.

A test named for a row shows that row of "What a MAVSDK 4.1 client needs from a vehicle".
"""

import math
from collections.abc import Callable
from itertools import pairwise
from statistics import median
from typing import Any

import pytest

from swarmctl.core.calls import to_geodetic
from swarmctl.mavlink.dialect import mav

from .meeting import ORIGIN, Client, Meeting

Meet = Callable[..., Meeting]
ASKED_FOR_UNASKED = {mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION, mav.MAVLINK_MSG_ID_HOME_POSITION}
REQUEST_MESSAGE, SET_INTERVAL = 512, 511
POSITION: int = mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
LATE_S = 2.5
"""By which the client may know later, streams and the wall's delays taken together."""
LANDED_STATE: int = mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE


def set_the_intervals(client: Client, rate_hz: float) -> None:
    """Of 1, 24, 30, 32, 33 and 245, without which ArduPilot tells nothing."""
    telemetry = client.telemetry
    for set_rate in (
        telemetry.set_rate_health,
        telemetry.set_rate_raw_gps,
        telemetry.set_rate_attitude_euler,
        telemetry.set_rate_position_velocity_ned,
        telemetry.set_rate_position,
        telemetry.set_rate_in_air,
    ):
        set_rate(rate_hz)


@pytest.mark.parametrize("autopilot", ["ardupilot"])
def test_row_streams_with_only_heartbeats_health_stays_false_until_intervals_are_set(meet: Meet) -> None:
    """Beside the two messages, the plugin sets the interval of EXTENDED_SYS_STATE by itself."""
    stub, client = meet()
    told: list[Any] = []
    client.telemetry.subscribe_position(lambda position, _: told.append(position))
    stub.run(5.0)
    assert {command.param1 for command in stub.commands(REQUEST_MESSAGE)} == ASKED_FOR_UNASKED
    assert {command.param1 for command in stub.commands(SET_INTERVAL)} == {LANDED_STATE}
    assert not client.telemetry.health_all_ok()
    assert not client.telemetry.health().is_armable
    assert not told
    set_the_intervals(client, 4.0)
    stub.until(client.telemetry.health_all_ok)
    assert client.telemetry.health().is_armable
    stub.until(lambda: len(told) > 0)


@pytest.mark.parametrize("autopilot", ["px4"])
def test_row_streams_px4_tells_all_unasked(meet: Meet) -> None:
    stub, client = meet()
    stub.until(client.telemetry.health_all_ok)
    assert not math.isnan(client.telemetry.position().latitude_deg)


@pytest.mark.parametrize(
    ("autopilot", "home_s", "armable_s", "all_ok_s"),
    [("px4", 3.0, 4.5, 3.0), ("ardupilot", 20.0, 23.0, 41.0)],
)
def test_row_health_comes_with_the_gps_home_and_the_prearm_check(
    meet: Meet, home_s: float, armable_s: float, all_ok_s: float
) -> None:
    stub, client = meet(booted_s=0.0, speed=10.0)
    set_the_intervals(client, 10.0)
    telemetry = client.telemetry
    since: dict[str, float] = {}

    def note() -> bool:
        health = telemetry.health()
        for name, good in {
            "home": health.is_home_position_ok,
            "armable": health.is_armable,
            "all": telemetry.health_all_ok(),
        }.items():
            if good:
                since.setdefault(name, stub.now)
        return len(since) == 3

    stub.until(note, 60.0)
    for name, expected_s in {"home": home_s, "armable": armable_s, "all": all_ok_s}.items():
        assert expected_s <= since[name] < expected_s + LATE_S


def test_row_health_goes_with_the_gps_and_comes_back(meet: Meet) -> None:
    stub, client = meet()
    telemetry = client.telemetry
    set_the_intervals(client, 10.0)
    stub.until(telemetry.health_all_ok)
    stub.do(stub.vehicle.faults.begin, "gps-loss")
    stub.until(lambda: not telemetry.health_all_ok())
    health = telemetry.health()
    assert not health.is_global_position_ok
    assert health.is_gyrometer_calibration_ok
    assert health.is_accelerometer_calibration_ok
    assert health.is_magnetometer_calibration_ok
    assert health.is_home_position_ok
    stub.do(stub.vehicle.faults.end, "gps-loss")
    stub.until(telemetry.health_all_ok)


def test_row_health_armable_is_the_prearm_check_alone(meet: Meet) -> None:
    stub, client = meet()
    set_the_intervals(client, 10.0)
    stub.until(lambda: client.telemetry.health().is_armable)
    stub.do(stub.vehicle.faults.begin, "arming-refused")
    stub.until(lambda: not client.telemetry.health().is_armable)
    assert client.telemetry.health_all_ok()


def test_row_position_and_in_air_are_what_the_vehicle_does(meet: Meet) -> None:
    flight = meet(speed=10.0)
    stub, client = flight
    telemetry = client.telemetry
    set_the_intervals(client, 10.0)
    stub.until(telemetry.health_all_ok)
    assert not telemetry.in_air()
    flight.take_off(5.0)
    lat, lon = to_geodetic(0.0, 20.0, *ORIGIN)
    client.action.goto_location(lat, lon, ORIGIN[2] + 8.0, 0.0)
    stub.until(lambda: stub.velocity[1] > 3.0 and telemetry.velocity_ned().north_m_s > 3.0)
    stub.arrive(0.0, 20.0, 8.0)
    stub.run(1.0)
    east, north, up = stub.place
    lat, lon = to_geodetic(east, north, *ORIGIN)
    position = telemetry.position()
    assert telemetry.in_air()
    assert (position.latitude_deg, position.longitude_deg) == pytest.approx((lat, lon), abs=2e-7)
    assert position.relative_altitude_m == pytest.approx(up, abs=0.02)
    assert position.absolute_altitude_m == pytest.approx(ORIGIN[2] + up, abs=0.02)


def test_a_rate_that_is_set_is_the_rate_that_arrives(meet: Meet) -> None:
    stub, client = meet()
    client.telemetry.set_rate_position(4.0)
    assert stub.vehicle.interval_us(POSITION) == 250_000
    before = len(stub.told(POSITION))
    arrived: list[Any] = []
    client.telemetry.subscribe_position(lambda position, _: arrived.append(position))
    stub.run(5.0)
    sent_ms = [message.time_boot_ms for message in stub.told(POSITION)[before:]]
    assert median(later - earlier for earlier, later in pairwise(sent_ms)) == pytest.approx(250, abs=15)
    stub.until(lambda: len(arrived) >= len(sent_ms), 1.0)
