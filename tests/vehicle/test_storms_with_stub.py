"""Whole flights of sessions and real stubs through bad links and everything that can break, drawn from seeds.

However bad it is, a flight ends landed or reported, in a bounded number of ticks; what is called landed is; and
nobody is left in the air but a vehicle that hears nobody, or keeps its mode whatever it is told.
"""

import random
from typing import Any

import pytest

from sim_vehicle_stub.faults import FAULTS, FaultOrder
from sim_vehicle_stub.fleet import StubFleet
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.fence import Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .storm import LAST_BREAK_S, Captain, Weather, drawn, fly
from .stub_flight import BOTH, ORIGIN, StubFlight

PREFLIGHT = Preflight(
    read_parameters=True,
    fence=Fence(
        [[(47.39, 8.53), (47.39, 8.56), (47.41, 8.56), (47.41, 8.53)]],
        [[(47.400, 8.550), (47.400, 8.551), (47.401, 8.551)]],
    ),
)
LIMIT_S = 900.0
SETTLED_S = 60.0
"""A vehicle that has ended and stood for so long stays where it is."""
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
        fault: FaultOrder | None = None,
        **given: float,
    ) -> None:
        self.weather, self.fault = weather, fault
        self.fleet = StubFleet(1, origin=ORIGIN, pads_m=[(0.0, 0.0)], autopilot=autopilot, seed=seed)
        if fault is not None:
            self.fleet.order(fault)
        (self.vehicle,) = self.fleet.vehicles
        self.session = Session(1, settings=SessionSettings(**given), now=0.0, preflight=PREFLIGHT)
        self.highest_m = 0.0
        self._moves_until = 0.0
        self.took_s = fly(
            self.session, self.advance, self.vehicle.receive, weather, seed=seed, limit_s=LIMIT_S,
            over=self.over,
        )  # fmt: skip
        self.events = self.session.events()

    def advance(self, now: float) -> list[bytes]:
        self.fleet.advance(now)
        self.highest_m = max(self.highest_m, float(self.fleet.truth[0]["up"]))
        return self.vehicle.outgoing()

    @property
    def flies(self) -> bool:
        return bool(self.vehicle.armed or self.fleet.truth[0]["up"] > 0.0)

    def over(self, now: float) -> bool:
        """Whether it has ended otherwise, and the vehicle stands."""
        if self.flies or self.session.phase not in ENDS:
            self._moves_until = now
        return now - self._moves_until >= SETTLED_S

    def texts(self, *kinds: EventKind) -> list[str]:
        return [event.text for event in self.events if event.kind in kinds]

    @property
    def reachable(self) -> bool:
        """Whether the vehicle hears orders in the end, and obeys them."""
        deaf = {"link-loss", "stuck-mode"} & self.vehicle.faults.active
        return not deaf and self.took_s < self.weather.dead_up_from

    def check_end(self) -> None:
        """Landed, and truly so; or reported, if it was ever heard; and down, if it can be reached."""
        if self.session.phase is Phase.LANDED:
            assert not self.flies and self.vehicle.landed
        elif self.session.phase is not Phase.CONNECTING:
            assert self.texts(ENDS[self.session.phase])
        assert not (self.flies and self.reachable)


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_flight_with_everything_in_fair_weather(autopilot: str) -> None:
    flight = Flight(autopilot, Weather())
    session = flight.session
    assert session.phase is Phase.LANDED and not flight.vehicle.armed
    assert flight.texts(EventKind.FAILED, EventKind.RELEASED, EventKind.LOST) == []
    assert session.fence_verified
    assert {"speed_mps", "acceleration_mps2", "fence_action"} <= session.parameters.keys()
    assert session.parameters["speed_mps"] == pytest.approx({"px4": 12.0, "ardupilot": 10.0}[autopilot])
    assert flight.highest_m == pytest.approx(25.0, abs=0.5)
    assert 20.0 < float(flight.fleet.truth[0]["east"]) < 40.0


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
def test_a_bad_link_is_flown_through_with_patience(autopilot: str, weather: Weather, seed: int) -> None:
    flight = Flight(autopilot, weather, seed, link_loss_s=15.0)
    flight.check_end()
    assert flight.highest_m > 15.0 or flight.texts(EventKind.FAILED)


@pytest.mark.parametrize("way", ["dead_up_from", "dead_down_from"])
@pytest.mark.parametrize("dead_from", [3.0, 20.0, 30.0, 50.0, 65.0])
@pytest.mark.parametrize("autopilot", BOTH)
def test_one_way_links(autopilot: str, dead_from: float, way: str) -> None:
    Flight(autopilot, Weather(**{way: dead_from})).check_end()


def fault_drawn(seed: int) -> FaultOrder | None:
    """Any fault at any time, for good or for a while; in half of all flights none."""
    dice = random.Random(f"fault {seed}")
    if dice.random() < 0.5:
        return None
    for_s = dice.uniform(1.0, 30.0) if dice.random() < 0.5 else float("inf")
    return FaultOrder(dice.choice(sorted(FAULTS)), dice.uniform(0.0, LAST_BREAK_S), for_s)


@pytest.mark.parametrize("seed", range(16))
@pytest.mark.parametrize("autopilot", BOTH)
def test_any_weather_and_any_fault_end_landed_or_reported(autopilot: str, seed: int) -> None:
    Flight(autopilot, drawn(seed), seed, fault_drawn(seed)).check_end()


class Squadron(StubFlight):
    """Vehicles of both firmwares, each with a captain, and a bad network of its own that may break one way."""

    def __init__(self, seed: int) -> None:
        super().__init__("px4", "ardupilot", "px4", "ardupilot-4.6", seed=seed)
        self.captains = [Captain(session, 10.0) for session in self.sessions]
        self.each_tick = self.order
        self.cuts: list[tuple[float, int, str]] = []
        dice = random.Random(f"squadron {seed}")
        for k, vehicle in enumerate(self.fleet.vehicles):
            vehicle.network.impair(**impairments(dice))
            if dice.random() < 0.3:
                way = dice.choice(("up_cut", "down_cut"))
                self.cuts.append((dice.uniform(0.0, LAST_BREAK_S), k, way))

    def order(self) -> None:
        """Cut what is due, and let every captain give his orders."""
        for at_s, k, way in self.cuts:
            if self.now >= at_s:
                self.fleet.vehicles[k].network.impair(**{way: True})
        for captain in self.captains:
            captain.command(self.now)

    def flies(self, k: int) -> bool:
        return bool(self.fleet.vehicles[k].armed or self.fleet.truth[k]["up"] > 0.0)

    def over(self) -> bool:
        """Whether all have ended, and stand if they can be reached."""
        return all(
            session.phase is Phase.LANDED
            or (session.phase in ENDS and not (self.flies(k) and not self.deaf(k)))
            for k, session in enumerate(self.sessions)
        )

    def deaf(self, k: int) -> bool:
        """Whether nothing reaches a vehicle any more."""
        return self.fleet.vehicles[k].network.impairments.up_cut

    def check_end(self, k: int) -> None:
        """Landed, and truly so; or reported."""
        session = self.sessions[k]
        if session.phase is Phase.LANDED:
            assert not self.flies(k)
        else:
            kind = ENDS[session.phase]
            assert [e for e in self.events if e.system == session.system and e.kind is kind]


def impairments(dice: random.Random) -> dict[str, Any]:
    """Of one vehicle's network."""
    return {
        "loss": dice.uniform(0.0, 0.4),
        "duplication": dice.uniform(0.0, 0.3),
        "reordering": dice.uniform(0.0, 0.3),
        "garbage": dice.choice((0.0, 0.2)),
        "delay_s": dice.choice((0.0, dice.uniform(0.0, 2.0))),
        "single_bytes": dice.random() < 0.2,
    }


@pytest.mark.parametrize("seed", range(4))
def test_a_squadron_in_which_every_link_is_bad_in_its_own_way(seed: int) -> None:
    squadron = Squadron(seed)
    squadron.run(max((at_s for at_s, _, _ in squadron.cuts), default=0.0))
    squadron.until(squadron.over, LIMIT_S)
    for k in range(len(squadron.sessions)):
        squadron.check_end(k)
