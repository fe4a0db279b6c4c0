"""What can be made to go wrong: faults, failsafes, wind, batteries, sensors that disagree."""

import math
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from sim_vehicle_stub.configured import configured_fleet
from sim_vehicle_stub.faults import FAULTS, FaultOrder, parse_order
from sim_vehicle_stub.pilot import Limits
from swarmctl.core.state import VEHICLE
from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
ORIGIN = (47.3977, 8.5456, 488.0)
OFFBOARD, LOITER, RTL, LAND = 0x60000, 0x3040000, 0x5040000, 0x6040000
VELOCITY = 1 | 2 | 4 | 64 | 128 | 256 | 1024 | 2048
REJECTED: int = mav.MAV_RESULT_TEMPORARILY_REJECTED
GPS: int = mav.MAV_SYS_STATUS_SENSOR_GPS


def test_gps_loss_px4_descends_blindly_with_the_wind(station: Make) -> None:
    s = station(wind_mps=(2.0, 0.0))
    s.fly_offboard(20.0)
    s.vehicle.faults.begin("gps-loss")
    before = len(s.all(33))
    s.run(5.0, lambda: s.setpoint(z=-20.0))
    assert s.mode == LAND
    assert len(s.all(33)) == before
    assert not s.last(1).onboard_control_sensors_health & GPS
    assert s.body["v_east"] == pytest.approx(2.0, abs=0.1)
    assert s.set_mode(OFFBOARD) == [0, REJECTED]
    s.vehicle.faults.end("gps-loss")
    s.run(4.0, lambda: s.setpoint(z=-10.0))
    assert len(s.all(33)) > before
    assert s.set_mode(OFFBOARD) == [0, 0]


def test_gps_loss_ardupilot_lands_and_refuses_modes_that_need_it(station: Make) -> None:
    s = station(autopilot="ardupilot")
    s.fly_guided(20.0)
    s.command(511, 33, 200_000)
    s.command(511, 193, 200_000)
    s.vehicle.faults.begin("gps-loss")
    s.run(1.0)
    assert (s.mode, s.last(193).flags & 0x10) == (9, 0)
    assert s.last(33).lat == pytest.approx(473977000, abs=2)
    assert s.command(176, 1, 4) == [mav.MAV_RESULT_FAILED]
    assert s.command(176, 1, 6) == [mav.MAV_RESULT_FAILED]
    s.run_until(lambda: not s.vehicle.armed, 60.0)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_link_loss_cuts_both_ways_and_ends(station: Make, autopilot: str) -> None:
    s = station(autopilot=autopilot)
    s.run(5.0)
    s.vehicle.faults.begin("link-loss")
    before = len(s.heard)
    s.run(5.0)
    assert s.command(512, 148) == []
    assert len(s.heard) == before
    s.vehicle.faults.end("link-loss")
    assert s.command(512, 148) == [0]


def test_battery_collapse_is_told_and_lasts_twenty_seconds(station: Make) -> None:
    s = station()
    s.fly_up(30.0)
    s.vehicle.faults.begin("battery-collapse")
    s.run(1.0)
    assert 3 <= s.last(1).battery_remaining <= 5
    assert s.mode == LOITER
    s.run(18.0)
    assert s.body["up"] > 29.0
    s.run(6.0)
    assert s.body["up"] == 0.0


@pytest.mark.parametrize(("action", "mode"), [(2, LAND), (3, LAND)])
def test_battery_collapse_has_the_action_of_the_parameter(station: Make, action: int, mode: int) -> None:
    s = station()
    s.set_parameter("COM_LOW_BAT_ACT", action)
    s.fly_up(10.0)
    s.vehicle.faults.begin("battery-collapse")
    s.run(0.5)
    assert s.mode == mode


def test_battery_low_returns_at_its_threshold(station: Make) -> None:
    s = station(limits=Limits(endurance_s=60.0))
    s.set_parameter("COM_LOW_BAT_ACT", 3)
    s.fly_up(10.0)
    s.run_until(lambda: s.mode == RTL, 60.0)
    assert s.vehicle.battery.percent == pytest.approx(7.0, abs=0.5)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_reboot_in_the_air_falls_and_forgets(station: Make, autopilot: str) -> None:
    s = station(autopilot=autopilot)
    s.fly_up(10.0) if autopilot == "px4" else s.fly_guided(10.0)
    s.command(511, 30, 50_000)
    s.vehicle.faults.begin("reboot")
    before = len(s.heard)
    s.run(1.9)
    assert len(s.heard) == before
    assert s.command(512, 148) == []
    s.run(3.5)
    assert (s.body["up"], s.vehicle.armed, s.vehicle.home is None) == (0.0, False, autopilot != "px4")
    assert s.last(0).base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED == 0
    first = s.heard[before][1]
    assert (first.sequence, s.vehicle.boot_ms < 4000) == (0, True)
    assert s.vehicle.interval_us(30) == (10_000 if autopilot == "px4" else -1)


@pytest.mark.parametrize(("autopilot", "result"), [("px4", REJECTED), ("ardupilot", mav.MAV_RESULT_FAILED)])
def test_arming_refused_until_it_ends(station: Make, autopilot: str, result: int) -> None:
    s = station(autopilot=autopilot)
    s.run(45.0)
    s.vehicle.faults.begin("arming-refused")
    assert s.arm() == [result]
    s.command(512, 1)
    assert not s.last(1).onboard_control_sensors_health & 0x10000000
    s.vehicle.faults.end("arming-refused")
    assert s.arm() == [0]


def test_motor_failure_falls_though_armed_and_disarms_on_the_ground(station: Make) -> None:
    s = station()
    s.fly_up(30.0)
    s.vehicle.faults.begin("motor-failure")
    s.run(1.0)
    assert s.vehicle.armed
    assert s.body["v_up"] < -8.0
    s.run(7.0)
    assert (s.body["up"], s.vehicle.armed) == (0.0, False)


def test_stuck_mode_is_acknowledged_and_not_entered(station: Make) -> None:
    s = station()
    s.fly_up(10.0)
    s.vehicle.faults.begin("stuck-mode")
    assert s.set_mode(RTL) == [0, 0]
    assert s.mode == LOITER
    s = station(autopilot="ardupilot")
    s.fly_guided(10.0)
    s.vehicle.faults.begin("stuck-mode")
    assert s.command(176, 1, 17) == [0]
    assert s.mode == 4


def test_ignored_setpoints_count_as_a_stream_but_are_not_flown(station: Make) -> None:
    s = station(limits=Limits())
    s.fly_offboard(10.0)
    s.run(2.0, lambda: s.setpoint(3.0, z=-10.0))
    s.vehicle.faults.begin("ignored-setpoints")
    s.run(5.0, lambda: s.setpoint(-3.0, z=-10.0))
    assert s.mode == OFFBOARD
    assert s.body["v_north"] == pytest.approx(3.0, abs=0.1)
    s = station(autopilot="ardupilot")
    s.fly_guided(10.0)
    s.vehicle.faults.begin("ignored-setpoints")
    s.run(3.0, lambda: s.setpoint(3.0, mask=VELOCITY))
    assert s.body["v_north"] == 0.0


def test_an_order_happens_at_its_time_to_its_vehicle_and_ends(station: Make) -> None:
    s = station(pads=[(0.0, 0.0), (20.0, 0.0)])
    s.fleet.order(parse_order("2:link-loss@3+2"))
    second = s.fleet.vehicles[1]
    heard = set()

    def listen() -> None:
        if second.outgoing():
            heard.add(int(s.now))

    s.run(10.0, listen)
    assert heard == {0, 1, 2, 5, 6, 7, 8, 9}
    assert len({round(time) for time, _ in s.all(0)}) == 11


def test_every_fault_can_be_begun_and_ended_at_any_moment(station: Make) -> None:
    s = station()
    s.fly_offboard(20.0)
    for name in FAULTS:
        s.vehicle.faults.begin(name)
        s.run(1.0, lambda: s.setpoint(1.0, z=-20.0))
        s.vehicle.faults.end(name)
        s.run(1.0, lambda: s.setpoint(1.0, z=-20.0))
    assert math.isfinite(s.body["up"])
    with pytest.raises(KeyError):
        s.vehicle.faults.begin("no-such")


@pytest.mark.parametrize(
    ("text", "order"),
    [
        ("gps-loss@12", FaultOrder("gps-loss", 12.0)),
        ("packet-loss=.3@0", FaultOrder("packet-loss", 0.0, value=0.3)),
        ("3:packet-delay=2@1.5+10", FaultOrder("packet-delay", 1.5, 10.0, 2.0, 3)),
    ],
)
def test_orders_are_read(text: str, order: FaultOrder) -> None:
    assert parse_order(text) == order


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gps-loss", "is not"),
        ("gps-loss@-3", "is not"),
        ("gps-loss@1+", "is not"),
        ("engine@3", "no fault 'engine': there are arming-refused"),
        ("reboot=1@3", "takes no value"),
        ("packet-loss=1.5@3", "goes from 0 to 1"),
    ],
)
def test_a_wrong_order_says_so(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        parse_order(text)


def test_an_order_for_nobody_says_so(station: Make) -> None:
    with pytest.raises(ValueError, match="there is no vehicle 2"):
        station().fleet.order(parse_order("2:reboot@1"))


@pytest.mark.row("px4-gcs-loss")
class TestGroundStationLoss:
    """PX4's failsafe for a ground station that is not heard."""

    def test_arming_needs_its_heartbeats_when_it_is_wanted(self, station: Make) -> None:
        s = station(hello=False)
        s.set_parameter("NAV_DLL_ACT", 2)
        s.run(5.0)
        assert s.arm() == [REJECTED]
        s.beat()
        assert s.arm() == [0]

    def test_loiter_after_12_seconds_return_5_later_and_offboard_by_order_alone(self, station: Make) -> None:
        s = station()
        s.set_parameter("NAV_DLL_ACT", 2)
        s.fly_offboard(10.0)

        def stream() -> None:
            s.setpoint(z=-10.0)

        s.beat()
        assert s.run_until(lambda: s.mode == LOITER, 20.0, stream) == pytest.approx(11.8, abs=0.2)
        assert s.run_until(lambda: s.mode == RTL, 20.0, stream) == pytest.approx(5.0, abs=0.2)
        s.beat()
        s.run(1.0, stream)
        assert s.mode == RTL
        assert s.set_mode(OFFBOARD) == [0, 0]
        s.run(1.0, stream)
        assert s.mode == OFFBOARD

    def test_nothing_happens_by_default(self, station: Make) -> None:
        s = station()
        s.fly_up(10.0)
        s.run(30.0)
        assert s.mode == LOITER


class TestWind:
    """A steady wind shows where it is more than the vehicle can fly against, and where nothing holds it."""

    def test_a_weak_one_is_flown_against(self, station: Make) -> None:
        s = station(limits=Limits(), wind_mps=(0.0, -3.0))
        s.fly_offboard(10.0)
        s.run(20.0, lambda: s.setpoint(12.0, z=-10.0))
        assert s.body["v_north"] == pytest.approx(12.0, abs=0.05)

    def test_a_strong_one_takes_speed_and_drives_it_back(self, station: Make) -> None:
        s = station(wind_mps=(0.0, -10.0))
        s.fly_offboard(10.0)
        s.run(20.0, lambda: s.setpoint(12.0, z=-10.0))
        assert s.body["v_north"] == pytest.approx(5.0, abs=0.05)
        s.fleet.wind_mps = (0.0, -20.0)
        s.run(20.0, lambda: s.setpoint(12.0, z=-10.0))
        assert s.body["v_north"] == pytest.approx(-5.0, abs=0.05)


@pytest.mark.row("px4-origin")
class TestScatter:
    """Altitudes and local origins differ between vehicles, by a seed."""

    PADS: ClassVar = [(20.0 * k, 0.0) for k in range(8)]

    def test_altitudes_and_origins_scatter_reproducibly(self, station: Make) -> None:
        def told(seed: int | None) -> tuple[list[int], list[float]]:
            s = station(pads=self.PADS, seed=seed)
            s.run(3.0)
            vehicles = s.fleet.vehicles
            north = [vehicle.personality.local_ned()[0] for vehicle in vehicles]
            return [vehicle.wire[2] for vehicle in vehicles], north

        altitudes, north = told(7)
        assert (altitudes, north) == told(7)
        assert altitudes != told(8)[0]
        assert 500 < max(altitudes) - min(altitudes) <= 1400
        assert 0.1 < max(map(abs, north)) <= 0.31
        assert set(told(None)[0]) == {488000}

    @pytest.mark.parametrize("seed", [1, 2, 3])
    def test_a_takeoff_by_the_vehicles_own_altitude_reaches_the_true_height(
        self, station: Make, seed: int
    ) -> None:
        s = station(seed=seed)
        s.run(5.0)
        s.command(22, *[math.nan] * 6, s.last(242).altitude / 1000.0 + 10.0)
        s.arm()
        s.run(20.0)
        assert s.body["up"] == pytest.approx(10.0, abs=0.1)
        s.command(512, 49)
        down = s.last(49).altitude / 1000.0 - s.last(242).altitude / 1000.0 - 15.0
        s.run(0.5, lambda: s.setpoint(z=down))
        s.set_mode(OFFBOARD)
        s.run(10.0, lambda: s.setpoint(z=down))
        assert s.body["up"] == pytest.approx(15.0, abs=0.1)


def test_a_configured_fleet_mixes_firmwares_in_wind() -> None:
    rows = np.zeros(2, VEHICLE)
    rows["speed"], rows["acceleration"], rows["braking"] = 15.0, 3.0, 2.0
    rows["climb"], rows["descent"], rows["climb_acceleration"], rows["pad_east"] = 4.0, 2.0, 2.0, (5.0, 25.0)
    fleet = configured_fleet(
        rows, ORIGIN, [None, 100.0], 0.1, autopilots=("px4", "ardupilot"), wind_mps=(1.0, 2.0)
    )
    px4, ardupilot = fleet.vehicles
    assert px4.parameters["MPC_XY_VEL_MAX"] == ardupilot.parameters["WP_SPD"] == 15.0
    assert ardupilot.limits.braking == 2.0
    assert fleet.wind_mps == (1.0, 2.0)
    everyone = configured_fleet(rows, ORIGIN, [None, None], 0.1, autopilots=("ardupilot",))
    assert {vehicle.personality.autopilot for vehicle in everyone.vehicles} == {3}
