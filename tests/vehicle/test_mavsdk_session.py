"""A session by way of MAVSDK and the stub autopilot back to back.  MAVSDK has threads and a clock of its own, so a
tick waits for it a little."""

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from threading import Event

import pytest

from sim_vehicle_stub.plans import FENCE
from swarmctl.core.calls import to_geodetic
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle import mavsdk_client
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.mavsdk_client import Client
from swarmctl.vehicle.mavsdk_session import MavsdkSession
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.protection import Remedy
from swarmctl.vehicle.settings import SessionSettings

from .stub_flight import BOTH, ORIGIN, SETPOINT, StubFlight

WAIT_S = 0.01
"""By the wall, for MAVSDK to have something to send."""
HEIGHT_M = 10.0
CORNERS_M = ((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0))
HOLE_M = ((20.0, 20.0), (30.0, 20.0), (25.0, 30.0))


class Flight(StubFlight):
    """A vehicle and a session by way of MAVSDK; no tick ends before MAVSDK has had its time."""

    def __init__(self, autopilot: str) -> None:
        super().__init__(autopilot)
        self._woken = Event()
        self.client = Client(self._woken.set)
        self.session = MavsdkSession(1, settings=SessionSettings(), now=0.0, client=self.client)

    def tick(self) -> None:
        super().tick()
        self._woken.wait(WAIT_S)
        self._woken.clear()


Meet = Callable[[str], Flight]


@pytest.fixture
def meet() -> Iterator[Meet]:
    """A vehicle that has just been switched on."""
    with ExitStack() as stack:

        def begin(autopilot: str) -> Flight:
            flight = Flight(autopilot)
            stack.callback(flight.client.close)
            return flight

        yield begin


def fence() -> Fence:
    """A square with a triangle to stay out of."""
    border, hole = ([to_geodetic(*corner, *ORIGIN)[:2] for corner in ring] for ring in (CORNERS_M, HOLE_M))
    return Fence([border], [hole])


@pytest.mark.parametrize("autopilot", BOTH)
def test_take_off_fly_hold_and_land(meet: Meet, autopilot: str) -> None:
    flight = meet(autopilot)
    flight.engage(HEIGHT_M)
    body = flight.body
    assert body["up"] == pytest.approx(HEIGHT_M, abs=0.5)
    flight.command(3.0, 4.0, HEIGHT_M + 3.0)
    flight.run(12.0)
    share = flight.vehicle.limits.velocity_share
    assert (body["v_east"], body["v_north"]) == pytest.approx((3.0 * share, 4.0 * share), abs=0.1)
    assert body["up"] == pytest.approx(HEIGHT_M + 3.0, abs=0.3)
    flight.session.hold()
    flight.until_phase(Phase.HOLDING)
    adapter = flight.session.adapter
    assert adapter is not None and flight.mode == adapter.modes.hold
    flight.run(5.0)
    assert flight.speed_mps < 0.1
    flight.session.resume()
    flight.until_phase(Phase.ENGAGED)
    flight.land()
    assert flight.vehicle.landed and not flight.vehicle.armed
    assert flight.session.phase is Phase.LANDED


@pytest.mark.parametrize("autopilot", BOTH)
def test_all_that_is_sent_is_sent_by_mavsdk_as_one_ground_station(meet: Meet, autopilot: str) -> None:
    flight = meet(autopilot)
    flight.engage(HEIGHT_M)
    ours = [f for _, f in flight.crossed if f.system != 1]
    assert {(f.system, f.component) for f in ours} == {(255, mav.MAV_COMP_ID_MISSIONPLANNER)}
    numbers = [f.sequence for f in ours]
    assert all((b - a) % 256 == 1 for a, b in pairwise(numbers))
    beats = [f.fields for f in ours if f.message_id == mav.MAVLINK_MSG_ID_HEARTBEAT]
    assert {beat.type for beat in beats} == {mav.MAV_TYPE_GCS}


@pytest.mark.parametrize("autopilot", BOTH)
def test_the_fence_is_on_board_and_read_back_and_parameters_are_known(meet: Meet, autopilot: str) -> None:
    flight = meet(autopilot)
    flight.until_phase(Phase.READY)
    assert not flight.session.fence_verified
    flight.session.check(Preflight(read_parameters=True, fence=fence()))
    flight.until_phase(Phase.READY)
    assert flight.session.fence_verified
    assert len(flight.vehicle.plans.kept[FENCE]) == len(CORNERS_M) + len(HOLE_M)
    adapter = flight.session.adapter
    assert adapter is not None
    assert set(flight.session.parameters) == {quantity.name for quantity in adapter.quantities}
    assert flight.session.parameters["fence_action"] in (1.0, 2.0)


@pytest.mark.parametrize(
    ("autopilot", "whole", "real"),
    [
        ("px4", ("GF_ACTION", 3), ("RTL_RETURN_ALT", 17.5)),
        ("ardupilot", ("FENCE_ENABLE", 1), ("RTL_ALT_M", 17.5)),
    ],
)
def test_parameters_are_set_as_what_they_are(
    meet: Meet, autopilot: str, whole: tuple[str, int], real: tuple[str, float]
) -> None:
    flight = meet(autopilot)
    flight.until_phase(Phase.READY)
    flight.session.check(Preflight(read_parameters=True))
    flight.until_phase(Phase.READY)
    remedies = tuple(Remedy(name, value, "a test") for name, value in (whole, real))
    flight.session.check(Preflight(remedies=remedies))
    flight.until_phase(Phase.READY)
    for name, value in (whole, real):
        assert flight.vehicle.parameters[name] == value


def test_a_fence_that_comes_back_as_another_is_refused(meet: Meet) -> None:
    flight = meet("px4")
    flight.until_phase(Phase.READY)

    def move_a_vertex() -> None:
        kept = flight.vehicle.plans.kept.get(FENCE, [])
        kept[2:3] = [item._replace(x=473_980_000) for item in kept[2:3]]

    flight.each_tick = move_a_vertex
    flight.session.check(Preflight(fence=fence()))
    flight.until_phase(Phase.FAILED)
    assert "vertex 2 is inclusion of 4, 47.3980000" in flight.session.reason
    assert not flight.session.fence_verified


def test_what_nobody_orders_any_more_is_not_repeated(meet: Meet) -> None:
    """MAVSDK itself goes on with the last velocity; PX4 must notice that its controller is gone."""
    flight = meet("px4")
    flight.engage(HEIGHT_M)
    flight.command(2.0, 0.0, HEIGHT_M)
    flight.run(3.0)
    assert len(flight.sent(SETPOINT, flight.now - 1.0)) >= 10
    flight.each_tick = lambda: None
    stopped = flight.now
    flight.run(5.0)
    assert flight.sent(SETPOINT, stopped + 0.3) == []
    assert flight.session.phase is Phase.RELEASED
    assert "AUTO.RTL" in flight.session.reason


@pytest.mark.parametrize("autopilot", BOTH)
def test_refused_to_arm_for_now_it_asks_again(meet: Meet, autopilot: str) -> None:
    flight = meet(autopilot)
    flight.until_phase(Phase.READY)
    flight.vehicle.faults.begin("arming-refused")
    flight.session.take_off(HEIGHT_M)
    flight.run(6.0)
    assert flight.session.phase is Phase.TAKING_OFF and not flight.vehicle.armed
    flight.vehicle.faults.end("arming-refused")
    flight.until_phase(Phase.HOLDING)
    assert flight.body["up"] == pytest.approx(HEIGHT_M, abs=0.5)


def test_refused_to_arm_for_good_it_says_so(meet: Meet) -> None:
    flight = meet("px4")
    flight.until_phase(Phase.READY)
    flight.vehicle.faults.begin("arming-refused")
    flight.session.take_off(HEIGHT_M)
    flight.until_phase(Phase.FAILED)
    assert "ARM had no effect in 20 s; last answer TEMPORARILY_REJECTED" in flight.session.reason


@pytest.mark.parametrize("autopilot", BOTH)
def test_an_acknowledged_mode_that_does_not_come_is_asked_for_again(meet: Meet, autopilot: str) -> None:
    """MAVSDK believes the acknowledgement; the session looks at the mode."""
    flight = meet(autopilot)
    flight.engage(HEIGHT_M)
    flight.command(0.0, 0.0, HEIGHT_M)
    flight.vehicle.faults.begin("stuck-mode")
    flight.session.land()
    flight.run(8.0)
    adapter = flight.session.adapter
    assert adapter is not None and flight.mode != adapter.modes.land
    assert math.isclose(flight.body["up"], HEIGHT_M, abs_tol=1.0)
    flight.vehicle.faults.end("stuck-mode")
    flight.until_phase(Phase.LANDED)
    assert flight.vehicle.landed


def test_a_second_client_leaves_the_log_of_the_first_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The binding frees what was subscribed before, which MAVSDK's threads may be calling: it crashed."""
    subscribed: list[object] = []
    monkeypatch.setattr(mavsdk_client, "log_subscribe", subscribed.append)
    for client in (Client(lambda: None), Client(lambda: None)):
        client.close()
    assert subscribed == []


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_restarts_on_the_ground_is_set_up_again(meet: Meet, autopilot: str) -> None:
    flight = meet(autopilot)
    flight.until_phase(Phase.READY)
    flight.run(10.0)
    flight.vehicle.faults.begin("reboot")
    flight.until_phase(Phase.IDENTIFYING)
    flight.hold_at(HEIGHT_M)
    assert flight.body["up"] == pytest.approx(HEIGHT_M, abs=0.5)
