"""The session against both of the stub's firmwares: whole flights, bad links, and everything that can break."""

from collections.abc import Sequence
from typing import Any

import pytest

from sim_vehicle_stub.faults import FaultOrder
from sim_vehicle_stub.fleet import StubFleet
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .storm import Weather, fly

ORIGIN = (47.3977, 8.5456, 488.0)
PREFLIGHT = Preflight(
    read_parameters=True,
    fence=Fence(
        [[(47.39, 8.53), (47.39, 8.56), (47.41, 8.56), (47.41, 8.53)]],
        [[(47.400, 8.550), (47.400, 8.551), (47.401, 8.551)]],
    ),
)
BOTH = ["px4", "ardupilot"]
LIMIT_S = 700.0
ENDS = {
    Phase.FAILED: EventKind.FAILED,
    Phase.RELEASED: EventKind.RELEASED,
    Phase.LOST: EventKind.LOST,
}


class Flight:
    """One stub and its session, flown by the captain through ``weather``."""

    def __init__(
        self,
        autopilot: str,
        weather: Weather,
        seed: int = 1,
        faults: Sequence[FaultOrder] = (),
        **given: float,
    ) -> None:
        self.fleet = StubFleet(1, origin=ORIGIN, pads_m=[(0.0, 0.0)], autopilot=autopilot)
        for fault in faults:
            self.fleet.order(fault)
        (self.vehicle,) = self.fleet.vehicles
        settings = SessionSettings(**given)  # type: ignore[arg-type]
        self.session = Session(1, settings=settings, now=0.0, preflight=PREFLIGHT)
        self.highest_m = 0.0
        self.took_s = fly(
            self.session, self.advance, self.vehicle.receive, weather, seed=seed, limit_s=LIMIT_S
        )
        self.events = self.session.events()

    def advance(self, now: float) -> list[bytes]:
        self.fleet.advance(now)
        self.highest_m = max(self.highest_m, float(self.fleet.truth[0]["up"]))
        return self.vehicle.outgoing()

    def texts(self, *kinds: EventKind) -> list[str]:
        return [event.text for event in self.events if event.kind in kinds]

    def check_end(self) -> None:
        """Landed, and truly so; or reported."""
        if self.session.phase is Phase.LANDED:
            assert not self.vehicle.armed and self.vehicle.landed
        else:
            kind = ENDS[self.session.phase]
            assert self.texts(kind)


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_flight_with_everything(autopilot: str) -> None:
    flight = Flight(autopilot, Weather())
    session = flight.session
    assert session.phase is Phase.LANDED and not flight.vehicle.armed
    assert flight.texts(EventKind.FAILED, EventKind.RELEASED, EventKind.LOST) == []
    assert session.fence_verified
    assert {"speed_mps", "acceleration_mps2", "fence_action"} <= session.parameters.keys()
    assert session.parameters["speed_mps"] == pytest.approx({"px4": 12.0, "ardupilot": 10.0}[autopilot])
    assert flight.highest_m == pytest.approx(25.0, abs=0.5)
    assert 20.0 < float(flight.fleet.truth[0]["east"]) < 40.0


def test_ardupilot_of_older_days_has_its_own_parameter_names() -> None:
    flight = Flight("ardupilot-4.6", Weather())
    assert flight.session.phase is Phase.LANDED
    assert flight.session.parameters["speed_mps"] == pytest.approx(10.0)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "weather",
    [
        Weather(loss=0.4),
        Weather(delay_s=2.0, repeat=0.2),
        Weather(loss=0.2, delay_s=0.5, repeat=0.2, garbage=0.3, crumbs=True),
    ],
    ids=["loss", "late", "everything"],
)
@pytest.mark.parametrize("autopilot", BOTH)
def test_bad_links(autopilot: str, weather: Weather, seed: int) -> None:
    flight = Flight(autopilot, weather, seed, link_loss_s=15.0)
    flight.check_end()
    assert flight.highest_m > 15.0 or flight.texts(EventKind.FAILED)


@pytest.mark.parametrize("way", ["dead_up_from", "dead_down_from"])
@pytest.mark.parametrize("dead_from", [3.0, 20.0, 30.0, 50.0, 65.0])
@pytest.mark.parametrize("autopilot", BOTH)
def test_one_way_links(autopilot: str, dead_from: float, way: str) -> None:
    flight = Flight(autopilot, Weather(**{way: dead_from}))
    flight.check_end()


IN_FLIGHT = {"px4": 30.0, "ardupilot": 60.0}


@pytest.mark.parametrize(
    "name",
    [
        "gps-loss",
        "battery-collapse",
        "link-loss",
        "motor-failure",
        "reboot",
        "stuck-mode",
        "ignored-setpoints",
    ],
)
@pytest.mark.parametrize("autopilot", BOTH)
def test_faults_in_flight_end_landed_or_reported(autopilot: str, name: str) -> None:
    flight = Flight(autopilot, Weather(), faults=[FaultOrder(name, IN_FLIGHT[autopilot])])
    flight.check_end()


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_crash_is_told(autopilot: str) -> None:
    flight = Flight(autopilot, Weather(), faults=[FaultOrder("motor-failure", IN_FLIGHT[autopilot])])
    assert "while engaged" in flight.texts(EventKind.FAILED)[0]
    flight.check_end()


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_reboot_on_the_ground_delays_the_flight(autopilot: str) -> None:
    flight = Flight(autopilot, Weather(), faults=[FaultOrder("reboot", 3.0)])
    assert flight.session.phase is Phase.LANDED and flight.highest_m > 20.0


@pytest.mark.parametrize("autopilot", BOTH)
def test_refused_arming_names_it(autopilot: str) -> None:
    flight = Flight(autopilot, Weather(), faults=[FaultOrder("arming-refused", 0.0)])
    assert flight.highest_m == 0.0 and not flight.vehicle.armed
    told: Any = flight.texts(EventKind.FAILED)
    assert told and "arm" in told[0].lower()
