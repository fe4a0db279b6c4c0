"""Every named fault of the stub, begun by hand or ordered on the command line, and what the session does.

``IN_FLIGHT`` says it for a vehicle that flies setpoints: the phase that the session comes to, or keeps, and the
report that names the reason.  Faults on the ground, faults that end, and what becomes of the vehicle follow.
"""

from typing import Any, NamedTuple

import pytest
from click.testing import CliRunner

from sim_vehicle_stub import links
from sim_vehicle_stub.cli import main
from sim_vehicle_stub.faults import FAULTS
from sim_vehicle_stub.fleet import StubFleet
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase

from .stub_flight import BOTH, StubFlight

BEGINS_S = {"px4": 35.0, "ardupilot": 75.0}
"""A time at which each flies setpoints."""
BATTERY_LOW_PERCENT = 25.0


class Answer(NamedTuple):
    """The session's phase ``within_s`` of the fault, and how its report ends."""

    phase: Phase
    kind: EventKind | None = None
    said: str = ""
    within_s: float = 10.0


FLIES_ON = Answer(Phase.ENGAGED)
CRASHED = Answer(Phase.FAILED, EventKind.FAILED, "it came down while engaged", 5.0)
RESTARTED = Answer(Phase.FAILED, EventKind.FAILED, "it disarmed while engaged", 4.0)
SILENT = Answer(Phase.LOST, EventKind.LOST, "no heartbeat for 3 s while engaged", 4.1)
ASTRAY = Answer(Phase.ENGAGED, EventKind.ASTRAY, "it does not fly its setpoints", 18.0)
BATTERY_LOW = Answer(Phase.ENGAGED, EventKind.BATTERY_LOW, "4 % left", 2.0)
IN_FLIGHT = {
    "arming-refused": FLIES_ON,
    "battery-collapse": BATTERY_LOW,
    "ignored-setpoints": ASTRAY,
    "link-loss": SILENT,
    "motor-failure": CRASHED,
    "packet-delay": FLIES_ON,
    "packet-duplication": FLIES_ON,
    "packet-loss": FLIES_ON,
    "packet-reordering": FLIES_ON,
    "reboot": RESTARTED,
    "stuck-mode": FLIES_ON,
}
POSITION_LOST = {
    "px4": Answer(Phase.RELEASED, EventKind.RELEASED, "its mode became AUTO.LAND while engaged", 1.1),
    "ardupilot": Answer(Phase.RELEASED, EventKind.RELEASED, "its mode became LAND while engaged", 1.1),
}


def answer_to(autopilot: str, name: str) -> Answer:
    """Without a position each firmware lands, in a mode of its own."""
    return POSITION_LOST[autopilot] if name == "gps-loss" else IN_FLIGHT[name]


def commanded(monkeypatch: pytest.MonkeyPatch, *words: str) -> StubFleet:
    """The fleet that `sim-vehicle-stub` would serve."""
    fleets: list[StubFleet] = []

    async def keep(fleet: StubFleet, *_: Any) -> None:
        fleets.append(fleet)

    monkeypatch.setattr(links, "serve", keep)
    result = CliRunner().invoke(main, [*words, "--home", "47.3977,8.5456,488"])
    assert result.exit_code == 0, result.output
    return fleets[0]


def flown(autopilot: str, fleet: StubFleet | None = None) -> StubFlight:
    """A vehicle that flies east when its fault begins, and from then on is told to fly west."""
    flight = StubFlight(autopilot, fleet=fleet, battery_low_percent=BATTERY_LOW_PERCENT)
    flight.engage()
    flight.command(5.0, 0.0)
    flight.run(BEGINS_S[autopilot] - flight.now - 0.1)
    assert flight.session.phase is Phase.ENGAGED and not flight.texts(EventKind.FAILED)
    flight.command(-5.0, 0.0)
    return flight


def begun(autopilot: str, name: str, value: float | None = None) -> StubFlight:
    """The same, and the fault."""
    flight = flown(autopilot)
    flight.vehicle.faults.begin(name, value)
    return flight


def check(flight: StubFlight, answer: Answer) -> None:
    """The session comes to its phase and keeps it, and has reported."""
    since = flight.now
    if answer.phase is not Phase.ENGAGED:
        flight.until_phase(answer.phase, answer.within_s)
    flight.run(answer.within_s - (flight.now - since))
    assert flight.session.phase is answer.phase
    if answer.kind is not None:
        assert flight.texts(answer.kind) == [f"vehicle 1: {answer.said}"]


def test_every_fault_has_an_answer() -> None:
    assert {*IN_FLIGHT, "gps-loss"} == FAULTS.keys()


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("autopilot", BOTH)
def test_a_fault_begun_by_hand_has_its_answer(autopilot: str, name: str) -> None:
    check(begun(autopilot, name), answer_to(autopilot, name))


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("autopilot", BOTH)
def test_a_fault_ordered_on_the_command_line_has_its_answer(
    monkeypatch: pytest.MonkeyPatch, autopilot: str, name: str
) -> None:
    order = f"{name}@{BEGINS_S[autopilot]:g}"
    fleet = commanded(monkeypatch, "--autopilot", autopilot, "--fault", order)
    check(flown(autopilot, fleet), answer_to(autopilot, name))
    assert name in fleet.vehicles[0].faults.active


@pytest.mark.parametrize(
    ("name", "value"),
    [("packet-loss", 0.4), ("packet-duplication", 0.5), ("packet-reordering", 0.5), ("packet-delay", 0.8)],
)
@pytest.mark.parametrize("autopilot", BOTH)
def test_a_bad_network_is_flown_through_and_landed_from(autopilot: str, name: str, value: float) -> None:
    flight = begun(autopilot, name, value)
    flight.run(10.0)
    assert flight.session.phase is Phase.ENGAGED
    flight.land()


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_without_a_position_comes_down_by_itself(autopilot: str) -> None:
    flight = begun(autopilot, "gps-loss")
    flight.until_phase(Phase.RELEASED)
    flight.until(lambda: not flight.session.telemetry.armed, 60.0)
    assert flight.body["up"] == 0.0


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_whose_battery_collapses_is_landed_by_order(autopilot: str) -> None:
    flight = begun(autopilot, "battery-collapse")
    flight.command(0.0, 0.0, 6.0)
    flight.until(lambda: bool(flight.texts(EventKind.BATTERY_LOW)), 2.0)
    flight.until(lambda: flight.body["up"] < 8.0, 12.0)
    flight.land()


@pytest.mark.parametrize(("autopilot", "phase"), [("px4", Phase.RELEASED), ("ardupilot", Phase.ENGAGED)])
def test_a_link_that_comes_back_shows_what_became_of_the_vehicle(autopilot: str, phase: Phase) -> None:
    """PX4 is on its way home by then and stays so; ArduPilot has stopped and flies on."""
    flight = begun(autopilot, "link-loss")
    flight.until_phase(Phase.LOST, 5.0)
    flight.run(10.0)
    flight.vehicle.faults.end("link-loss")
    flight.until_phase(phase, 3.0)
    assert flight.texts(EventKind.REGAINED) == ["vehicle 1: heartbeat again"]
    if phase is Phase.RELEASED:
        flight.check_not_fought(3.0)
        flight.until(lambda: not flight.vehicle.armed)
    else:
        flight.run(3.0)
        flight.land()


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_is_never_heard_again_is_reported(autopilot: str) -> None:
    """PX4 comes home by its own failsafe; ArduPilot hears nobody and has none: it hovers until it is reached."""
    flight = begun(autopilot, "link-loss")
    flight.until_phase(Phase.LOST, 5.0)
    flight.session.land()
    flight.until_phase(Phase.FAILED)
    assert "land mode: DO_SET_MODE" in flight.session.reason and "never answered" in flight.session.reason
    assert flight.vehicle.armed is (autopilot == "ardupilot")
    flight.vehicle.faults.end("link-loss")
    flight.session.land()
    flight.until_phase(Phase.LANDED)
    assert not flight.vehicle.armed and flight.body["up"] == 0.0


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_keeps_its_mode_is_given_up_and_says_so(autopilot: str) -> None:
    flight = begun(autopilot, "stuck-mode")
    flight.session.hold()
    flight.until_phase(Phase.FAILED, 25.0)
    assert "hold mode: DO_SET_MODE" in flight.session.reason
    assert "had no effect in 20 s; last answer ACCEPTED" in flight.session.reason
    flight.session.land()
    flight.run(3.0)
    flight.vehicle.faults.end("stuck-mode")
    flight.until_phase(Phase.LANDED)
    assert not flight.vehicle.armed and flight.body["up"] == 0.0


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_does_not_fly_its_setpoints_is_landed_by_order(autopilot: str) -> None:
    flight = begun(autopilot, "ignored-setpoints")
    flight.until(lambda: bool(flight.texts(EventKind.ASTRAY)), 18.0)
    flight.land()


# On the ground


@pytest.mark.parametrize(
    ("name", "for_s"),
    [
        ("reboot", 1.0),
        ("link-loss", 10.0),
        ("gps-loss", 10.0),
        ("arming-refused", 60.0),
        ("packet-loss", 60.0),
    ],
)
@pytest.mark.parametrize("begins_s", [4.0, 23.0, 50.0])
@pytest.mark.parametrize("autopilot", BOTH)
def test_what_passes_on_the_ground_delays_the_flight(
    monkeypatch: pytest.MonkeyPatch, autopilot: str, begins_s: float, name: str, for_s: float
) -> None:
    order = f"{name}@{begins_s:g}+{for_s:g}"
    fleet = commanded(monkeypatch, "--autopilot", autopilot, "--fault", order)
    flight = StubFlight(autopilot, fleet=fleet)
    flight.run(begins_s + for_s + 10.0)
    flight.engage()
    flight.land()


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_refuses_to_arm_is_named_before_or_after_it_was_ready(autopilot: str) -> None:
    flight = StubFlight(autopilot)
    flight.vehicle.faults.begin("arming-refused")
    flight.until_phase(Phase.FAILED, 200.0)
    assert "vehicle 1: ready to arm: not reached in 90 s" in flight.session.reason
    flight = StubFlight(autopilot)
    flight.until_phase(Phase.READY)
    flight.vehicle.faults.begin("arming-refused")
    flight.session.take_off(20.0)
    flight.until_phase(Phase.FAILED)
    assert "vehicle 1: arming: ARM had no effect in 20 s" in flight.session.reason
    assert not flight.vehicle.armed


@pytest.mark.parametrize(
    ("autopilot", "said"),
    [
        ("px4", "take-off mode: NAV_TAKEOFF had no effect in 20 s"),
        ("ardupilot", "guided mode: DO_SET_MODE GUIDED had no effect in 90 s"),
    ],
)
def test_a_mode_that_is_stuck_on_the_ground_is_named(autopilot: str, said: str) -> None:
    flight = StubFlight(autopilot)
    flight.vehicle.faults.begin("stuck-mode")
    flight.until(lambda: flight.session.phase in (Phase.READY, Phase.FAILED), 200.0)
    if flight.session.phase is Phase.READY:
        flight.session.take_off(20.0)
    flight.until_phase(Phase.FAILED)
    assert said in flight.session.reason
    assert not flight.vehicle.armed


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_battery_that_collapses_on_the_ground_is_told_before_take_off(autopilot: str) -> None:
    flight = StubFlight(autopilot, battery_low_percent=BATTERY_LOW_PERCENT)
    flight.vehicle.faults.begin("battery-collapse")
    flight.until_phase(Phase.READY)
    assert flight.texts(EventKind.BATTERY_LOW) == ["vehicle 1: 5 % left"]
