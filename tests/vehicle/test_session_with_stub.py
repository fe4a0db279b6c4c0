"""The session and the stub autopilot back to back: real frames both ways, in virtual time."""

import math
from collections import Counter

import pytest

from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.statistics import Tally

from .stub_flight import ARM_DISARM, BOTH, StubFlight


def test_take_off_fly_and_land() -> None:
    flight = StubFlight()
    flight.engage()
    session, body = flight.session, flight.body
    assert body["up"] == pytest.approx(20.0, abs=0.5)
    east, north = float(body["east"]), float(body["north"])
    flight.command(3.0, 4.0, 25.0)
    flight.run(10.0)
    share = flight.vehicle.limits.velocity_share
    assert body["east"] - east == pytest.approx(3.0 * share * 9.0, abs=4.0)
    assert body["north"] - north == pytest.approx(4.0 * share * 9.0, abs=4.0)
    assert body["up"] == pytest.approx(25.0, abs=0.3)
    telemetry = session.telemetry
    assert telemetry.height_m == pytest.approx(float(body["up"]), abs=0.002)
    assert (telemetry.v_east, telemetry.v_north) == pytest.approx((3.0 * share, 4.0 * share), abs=0.05)
    flight.land()
    assert flight.vehicle.landed
    assert flight.mode == MODES.hold


@pytest.mark.row("px4-ready")
def test_ready_waits_for_the_vehicles_boot() -> None:
    flight = StubFlight()
    flight.until_phase(Phase.READY)
    assert 4.5 <= flight.now < 8.0
    assert not flight.commands(ARM_DISARM)
    telemetry = flight.session.telemetry
    assert telemetry.version == "1.17.0"
    assert telemetry.home is not None and telemetry.home.alt_amsl_m == pytest.approx(488.0, abs=0.01)


@pytest.mark.row("px4-rates")
def test_in_flight_only_what_is_read_crosses_the_link() -> None:
    flight = StubFlight()
    flight.engage()
    since = flight.now
    flight.command(1.0, 0.0)
    flight.run(60.0)
    counts = Counter(f.message_id for t, f in flight.crossed if t > since and f.system == 1)
    assert counts[mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT] == 600
    assert counts[mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE] == pytest.approx(120, abs=1)
    assert counts.total() / 60.0 <= 20.0, counts
    statistics = flight.session.statistics()
    assert statistics.setpoint_interval is not None
    assert statistics.setpoint_interval.maximum_s == pytest.approx(0.1)
    assert statistics.setpoints_sent == 600
    assert statistics.messages_bad == 0


def test_the_links_round_trip_is_measured_once_a_second() -> None:
    flight = StubFlight()
    flight.engage()
    session = flight.session
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
    flight = StubFlight(*["px4"] * 6)
    flight.engage()
    flight.land()
    assert flight.texts(EventKind.FAILED) == []


@pytest.mark.parametrize("seed", range(3))
def test_a_flight_over_a_link_that_loses_a_third(seed: int) -> None:
    flight = StubFlight(link_loss_s=15.0)
    state = seed * 7919 + 12345

    def drop(frame: bytes) -> bool:
        nonlocal state
        state = (state * 1103515245 + 12345) & 0x7FFFFFFF
        return state >> 16 & 0xFF < 85

    flight.drop = drop
    flight.engage()
    flight.command(2.0, 0.0)
    flight.run(10.0)
    flight.land()


def test_a_few_heartbeats_that_get_lost_in_flight_are_no_lost_link() -> None:
    """Three in a row are lost once in two minutes where a fifth of all frames is."""
    flight = StubFlight()
    flight.engage()
    flight.command(1.0, 0.0)
    flight.drop = lambda frame: frame[7] == mav.MAVLINK_MSG_ID_HEARTBEAT and frame[5] == 1
    flight.run(7.0)
    assert flight.session.phase is Phase.ENGAGED
    flight.until_phase(Phase.LOST, 3.0)
    flight.drop = lambda frame: False
    flight.run(2.0)
    assert flight.texts(EventKind.REGAINED) == ["vehicle 1: heartbeat again"]


@pytest.mark.row("px4-setpoints-stop", "px4-rtl")
def test_setpoints_that_stop_end_in_the_firmwares_own_return_and_are_not_fought() -> None:
    flight = StubFlight()
    flight.engage()
    flight.run(0.3)
    flight.until_phase(Phase.RELEASED, 5.0)
    assert flight.session.reason == "vehicle 1: its mode became AUTO.RTL while engaged"
    flight.check_not_fought(60.0)
    assert flight.session.phase is Phase.RELEASED


def test_the_same_flight_twice_is_the_same_to_the_last_byte() -> None:
    def fly() -> list[bytes]:
        flight = StubFlight("px4", "px4")
        flight.engage()
        flight.command(math.pi, -1.0)
        flight.run(5.0)
        return [frame.raw for _, frame in flight.crossed]

    assert fly() == fly()


@pytest.mark.parametrize("autopilot", BOTH)
def test_setpoints_that_are_not_flown_are_told_once_until_they_are(autopilot: str) -> None:
    flight = StubFlight(autopilot)
    flight.engage()
    for k in range(2):
        flight.command(5.0, 0.0)
        flight.run(10.0)
        flight.vehicle.faults.begin("ignored-setpoints")
        flight.command(-5.0, 0.0)
        flight.run(20.0)
        assert flight.texts(EventKind.ASTRAY) == ["vehicle 1: it does not fly its setpoints"] * (k + 1)
        flight.vehicle.faults.end("ignored-setpoints")
    assert flight.session.phase is Phase.ENGAGED


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_is_turned_and_turned_is_not_astray(autopilot: str) -> None:
    flight = StubFlight(autopilot)
    flight.engage()
    for k in range(40):
        heading = 2.4 * k
        flight.command(10.0 * math.sin(heading), 10.0 * math.cos(heading))
        flight.run((0.5, 1.0, 1.0, 3.0, 12.0)[k % 5])
    assert flight.texts(EventKind.ASTRAY) == []


def test_a_simulators_slow_clock_is_not_taken_for_a_slow_link() -> None:
    """Its computer is busy: the vehicle's time falls behind by a second in twenty, the link does not."""
    flight = StubFlight("px4", speed=0.95)
    flight.until_phase(Phase.READY)
    ages = []
    for _ in range(600):
        flight.run(0.1)
        ages.append(flight.session.telemetry.age_s)
    assert max(ages) < 0.25
