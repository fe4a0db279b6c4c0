"""The session and the stub autopilot back to back: real frames both ways, in virtual time."""

import math
from collections.abc import Callable

import pytest

from sim_vehicle_stub.fleet import StubFleet
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.statistics import Tally

ORIGIN = (47.3977, 8.5456, 488.0)
TICK_S = 0.1


class Flight:
    """Sessions and a fleet of stubs on one clock that counts ticks."""

    def __init__(self, count: int = 1, **settings: float) -> None:
        self.tick_number = 0
        pads = [(20.0 * i, 0.0) for i in range(count)]
        self.fleet = StubFleet(count, origin=ORIGIN, pads_m=pads)
        self.sessions = [
            Session(v.system, settings=SessionSettings(**settings), now=0.0) for v in self.fleet.vehicles
        ]
        self.drop: Callable[[bytes], bool] = lambda frame: False
        self.each_tick: Callable[[], None] = lambda: None

    @property
    def now(self) -> float:
        return self.tick_number * TICK_S

    def tick(self) -> None:
        self.tick_number += 1
        now = self.now
        self.fleet.advance(now)
        for vehicle, session in zip(self.fleet.vehicles, self.sessions, strict=True):
            for frame in vehicle.outgoing():
                if not self.drop(frame):
                    session.receive(frame, now)
            session.poll(now)
        self.each_tick()
        for vehicle, session in zip(self.fleet.vehicles, self.sessions, strict=True):
            for frame in session.outgoing():
                if not self.drop(frame):
                    vehicle.receive(frame, now)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.tick()

    def until(self, phase: Phase, limit_s: float = 120.0) -> None:
        end = self.now + limit_s
        while not all(session.phase is phase for session in self.sessions):
            assert self.now < end, [f"{s.phase} {s.reason}" for s in self.sessions]
            self.tick()

    def engage(self, altitude_m: float = 20.0) -> None:
        self.until(Phase.READY)
        for session in self.sessions:
            session.take_off(altitude_m)
        self.until(Phase.HOLDING)
        for session in self.sessions:
            session.engage()
        self.until(Phase.ENGAGED)


def test_take_off_fly_and_land() -> None:
    flight = Flight()
    flight.engage()
    (session,), (vehicle,) = flight.sessions, flight.fleet.vehicles
    body = flight.fleet.truth[0]
    assert body["up"] == pytest.approx(20.0, abs=0.5)
    east, north = float(body["east"]), float(body["north"])
    flight.each_tick = lambda: session.setpoint(3.0, 4.0, 25.0)
    flight.run(10.0)
    assert body["east"] - east == pytest.approx(3.0 * 9.0, abs=4.0)
    assert body["north"] - north == pytest.approx(4.0 * 9.0, abs=4.0)
    assert body["up"] == pytest.approx(25.0, abs=0.3)
    telemetry = session.telemetry
    assert telemetry.height_m == pytest.approx(float(body["up"]), abs=0.002)
    assert (telemetry.v_east, telemetry.v_north) == pytest.approx((3.0, 4.0), abs=0.05)
    session.land()
    flight.until(Phase.LANDED)
    assert not vehicle.armed and vehicle.landed and body["up"] == 0.0
    assert vehicle.personality.custom_mode == MODES.hold


def test_ready_waits_for_the_vehicles_boot() -> None:
    flight = Flight()
    flight.until(Phase.READY)
    assert 4.5 <= flight.now < 8.0
    telemetry = flight.sessions[0].telemetry
    assert telemetry.version == "1.17.0"
    assert telemetry.home is not None and telemetry.home.alt_amsl_m == pytest.approx(488.0, abs=0.01)


def test_in_flight_only_what_is_read_crosses_the_link() -> None:
    flight = Flight()
    flight.engage()
    (session,) = flight.sessions
    session.traffic()
    flight.each_tick = lambda: session.setpoint(1.0, 0.0, 20.0)
    flight.run(60.0)
    frames = session.traffic()
    counts = {i: sum(f[5] == 1 and f[7] == i for f in frames) for i in {f[7] for f in frames}}
    assert counts[mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT] == 600
    assert counts[mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE] == pytest.approx(120, abs=1)
    assert mav.MAVLINK_MSG_ID_ATTITUDE not in counts and mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED not in counts
    interval = session.statistics().setpoint_interval
    assert interval is not None and interval.maximum_s == pytest.approx(0.1)
    assert session.statistics().setpoints_sent == 600


def test_the_links_round_trip_is_measured_once_a_second() -> None:
    flight = Flight()
    flight.engage()
    session = flight.sessions[0]
    pings = session.statistics()
    flight.run(60.0)
    after = session.statistics()
    assert pings.round_trip is not None and after.round_trip is not None
    assert after.round_trip.maximum_s <= 0.2
    assert after.round_trip.minimum_s >= 0.0


def test_a_pong_for_another_is_ignored() -> None:
    tally = Tally()
    tally.ping(1.0)
    tally.ping(2.0)
    pong = mav.MAVLink_timesync_message
    for other in (pong(5, 77), pong(0, 1_000_000_000), pong(5, 0)):
        tally.pong(other, 3.0)
    assert list(tally.pings_s) == []
    for _ in range(2):
        tally.pong(pong(5, 1_000_000_000), 3.5)
    assert list(tally.pings_s) == [2.5]


def test_six_vehicles_each_by_itself() -> None:
    flight = Flight(6)
    flight.engage()
    for session in flight.sessions:
        session.land()
    flight.until(Phase.LANDED)
    assert [
        event.text for s in flight.sessions for event in s.events() if event.kind is EventKind.FAILED
    ] == []


@pytest.mark.parametrize("seed", range(3))
def test_a_flight_over_a_link_that_loses_a_third(seed: int) -> None:
    flight = Flight(link_loss_s=15.0)
    state = seed * 7919 + 12345

    def drop(frame: bytes) -> bool:
        nonlocal state
        state = (state * 1103515245 + 12345) & 0x7FFFFFFF
        return state >> 16 & 0xFF < 85

    flight.drop = drop
    flight.engage()
    (session,) = flight.sessions
    flight.each_tick = lambda: session.setpoint(2.0, 0.0, 20.0)
    flight.run(10.0)
    session.land()
    flight.until(Phase.LANDED)
    assert not flight.fleet.vehicles[0].armed


def test_setpoints_that_stop_end_in_the_firmwares_own_return_and_are_not_fought() -> None:
    flight = Flight()
    flight.engage()
    flight.run(0.3)
    flight.until(Phase.RELEASED, 5.0)
    assert flight.sessions[0].reason == "vehicle 1: its mode became AUTO.RTL while engaged"
    flight.run(60.0)
    assert flight.sessions[0].phase is Phase.RELEASED


def test_the_same_flight_twice_is_the_same_to_the_last_byte() -> None:
    def fly() -> list[bytes]:
        flight = Flight(2)
        flight.engage()
        flight.each_tick = lambda: [s.setpoint(math.pi, -1.0, 20.0) for s in flight.sessions] and None
        flight.run(5.0)
        return [frame for session in flight.sessions for frame in session.traffic()]

    assert fly() == fly()
