"""The stub's parts by themselves: streams, parameters, bodies, the fleet's arguments."""

import math

import numpy as np
import pytest

from sim_vehicle_stub import bodies
from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.parameters import Parameters, from_wire, to_wire
from sim_vehicle_stub.personalities.projection import project, reproject
from sim_vehicle_stub.pilot import Limits
from sim_vehicle_stub.streams import Streams

ORIGIN = (47.3977, 8.5456, 488.0)


def test_a_stream_that_was_due_several_times_is_sent_once_and_keeps_its_beat() -> None:
    streams = Streams({7: 100}, 0)
    assert streams.take_due(0) == [7]
    assert streams.take_due(99) == []
    assert streams.take_due(350) == [7]
    assert streams.take_due(399) == []
    assert streams.take_due(400) == [7]


def test_a_stream_can_be_set_stopped_and_restored() -> None:
    streams = Streams({7: 100, 8: -1}, 0)
    assert (streams.interval_us(7), streams.interval_us(8)) == (100, -1)
    streams.set_interval(7, -1, 0)
    streams.set_interval(8, 50, 0)
    assert streams.take_due(1000) == [8]
    streams.set_interval(7, 0, 1000)
    streams.set_interval(8, 0, 1000)
    assert streams.take_due(1099) == []
    assert streams.take_due(1100) == [7]


@pytest.mark.parametrize("value", [0, 1, -1, 2**31 - 1, -(2**31), 1065353216])
def test_integers_survive_the_float_field(value: int) -> None:
    assert from_wire(to_wire(value), 6) == value


def test_a_parameter_keeps_its_type() -> None:
    parameters = Parameters({"A": 1, "B": 2.0})
    parameters.set("A", 3.7)
    parameters.set("B", 4)
    assert (parameters["A"], parameters["B"]) == (3, 4.0)
    assert parameters.entry("B").wire_type == 9
    assert parameters.name_at(2) is None


@pytest.mark.parametrize(("north", "east"), [(0.0, 0.0), (1000.0, -700.0), (-5.0, 3000.0)])
def test_the_projection_is_undone(north: float, east: float) -> None:
    place = reproject(north, east, *ORIGIN[:2])
    assert project(*place, *ORIGIN[:2]) == pytest.approx((north, east), abs=1e-3)


def test_bodies_do_not_depend_on_each_other_or_on_how_often_they_are_moved() -> None:
    def fly(calls: list[float], count: int) -> np.ndarray:
        fleet = StubFleet(count, origin=ORIGIN, pads_m=[(20.0 * k, 0.0) for k in range(count)])
        fleet.vehicles[0].pilot.power(True)
        fleet.vehicles[0].pilot.pace(12.0, 3.0, 1.5, 0.7)
        fleet.vehicles[0].pilot.height(20.0)
        fleet.vehicles[0].pilot.velocity(3.0, 4.0)
        for now in calls:
            fleet.advance(now)
        return fleet.truth[:1].copy()

    often = fly([k * 0.1 for k in range(101)], 1)
    assert often.tobytes() == fly([10.0], 3).tobytes()
    assert often["up"][0] > 15.0


def test_without_power_a_body_falls_and_stands() -> None:
    truth = np.zeros(1, bodies.BODY)
    truth["up"] = 20.0
    arrays = (np.zeros(1, bodies.COMMAND), np.zeros(1, bodies.LIMITS))
    bodies.move(truth, *arrays, 0.0, 0.0, 50, 0.02)
    assert truth["up"][0] == pytest.approx(20.0 - 9.81 / 2, abs=0.2)
    bodies.move(truth, *arrays, 0.0, 0.0, 100, 0.02)
    assert tuple(truth[0]) == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_landing_slows_down_near_the_ground() -> None:
    rates = [bodies.landing_rate(up, 1.5, 0.7) for up in (50.0, 10.0, 7.5, 5.0, 0.0)]
    assert rates == pytest.approx([-1.5, -1.5, -1.1, -0.7, -0.7])


def test_time_never_runs_backwards_for_the_bodies() -> None:
    fleet = StubFleet(1, origin=ORIGIN, pads_m=[(0.0, 0.0)])
    fleet.advance(3.0)
    fleet.advance(2.0)
    fleet.advance(3.02)
    assert fleet.vehicles[0].boot_ms == 3020


def test_boot_may_be_at_any_time() -> None:
    fleet = StubFleet(1, origin=ORIGIN, pads_m=[(0.0, 0.0)], now=1000.0)
    fleet.advance(1004.6)
    assert fleet.vehicles[0].personality.ready
    assert fleet.vehicles[0].boot_ms == 4600


def test_each_vehicle_has_its_own_limits() -> None:
    fleet = StubFleet(2, origin=ORIGIN, pads_m=[(0, 0), (9, 0)], limits=[Limits(5.0), Limits(9.0)])
    assert [v.parameters["MPC_XY_VEL_MAX"] for v in fleet.vehicles] == [5.0, 9.0]


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="the stub plays px4"):
        StubFleet(1, origin=ORIGIN, pads_m=[(0, 0)], autopilot="betaflight")
    with pytest.raises(ValueError, match="2 vehicles need"):
        StubFleet(2, origin=ORIGIN, pads_m=[(0, 0)])


def test_the_fleet_stands_where_its_pads_are() -> None:
    fleet = StubFleet(2, origin=ORIGIN, pads_m=[(0.0, 0.0), (100.0, 0.0)])
    metres = (
        (fleet.vehicles[1].wire[1] - fleet.vehicles[0].wire[1]) * 1e-7 * 111320 * math.cos(math.radians(47.4))
    )
    assert metres == pytest.approx(100.0, abs=0.5)
