"""Serial lines: what crosses them stays within the budget that was told, and rates come down to what fits."""

from pathlib import Path
from typing import Any

import pytest

from swarmctl.flight.budget import Load, Rates, lowered, plan, stale_s
from swarmctl.flight.errors import RefusedError
from swarmctl.mavlink.signing import Signing, units
from swarmctl.mission.model import Mission
from swarmctl.vehicle.addresses import Address

from .flown import small_mission
from .thin import ThinWires
from .virtual import PLACES_M, Live, outcomes

RADIO = Address("serial", "/dev/ttyUSB0", 57600)
SLOW = Address("serial", "/dev/ttyUSB0", 9600)
LAN = Address("udpin", "0.0.0.0", 14540)
KEY, DATE_S = bytes(range(32)), 1_764_072_000.0


@pytest.fixture
def mission(tmp_path: Path) -> Mission:
    return small_mission(tmp_path)


def test_one_vehicle_at_ten_hertz_fits_a_57600_baud_radio_signed_or_not(mission: Mission) -> None:
    for signed in (False, True):
        budget = plan(mission, [RADIO], signed, 1.0)
        assert budget.rates == budget.wanted == Rates(10.0, 10.0, 2.0)
    assert str(budget).splitlines() == [
        "link budget, bytes a second at most: setpoints at 10 Hz, positions at 10 Hz, status at 2 Hz",
        "  serial:///dev/ttyUSB0:57600: 1 vehicle, 1058 from, 913 to, 1972 of 4608 (80% of the line)",
    ]


def test_a_signature_is_thirteen_bytes_a_frame(mission: Mission) -> None:
    plain, signed = (plan(mission, [RADIO], key, 1.0).loads[0] for key in (False, True))
    assert signed.to_vehicles - plain.to_vehicles == 13 * (10 + 1 + 1 + 1)


def test_rates_come_down_step_by_step_and_for_all_alike(mission: Mission) -> None:
    found = [plan(mission, [RADIO] * count + [LAN], False, 1.0).rates for count in range(1, 7)]
    assert found == [
        *[Rates(10.0, 10.0, 2.0)] * 3,
        Rates(5.0, 5.0, 1.0),
        Rates(4.0, 4.0, 1.0),
        Rates(4.0, 2.0, 1.0),
    ]
    told = str(plan(mission, [RADIO] * 4 + [LAN], False, 1.0))
    assert told.startswith(
        "link budget, bytes a second at most: setpoints at 5 Hz, positions at 5 Hz, status at 1 Hz; "
        "lowered from setpoints at 10 Hz, positions at 10 Hz, status at 2 Hz\n"
    )


def test_a_line_that_carries_its_vehicles_at_no_rate_refuses_with_the_figures(mission: Mission) -> None:
    with pytest.raises(RefusedError) as caught:
        plan(mission, [SLOW, SLOW, LAN], False, 1.0)
    assert str(caught.value) == (
        "serial:///dev/ttyUSB0:9600 carries 768 bytes a second (80% of the line), and 2 vehicles on it need 1514 "
        "even with setpoints at 4 Hz, positions at 2 Hz, status at 1 Hz (put fewer on it, or make it faster)"
    )


def test_networks_are_taken_to_carry_what_is_asked(mission: Mission) -> None:
    budget = plan(mission, [LAN] * 100, True, 1.0)
    assert budget.rates == budget.wanted
    assert budget.loads == [Load(LAN, 100, 105850.0, 91300.0, None)]


def test_a_planners_period_stays_a_whole_number_of_setpoints(tmp_path: Path) -> None:
    mission = small_mission(tmp_path, {"planner.period_s": 0.5})
    assert plan(mission, [RADIO] * 5, False, 1.0).rates.setpoints == 4.0


def test_a_mission_that_wants_less_is_not_sent_more(tmp_path: Path) -> None:
    mission = small_mission(tmp_path, {"setpoints.rate_hz": 2})
    assert plan(mission, [SLOW], False, 1.0).rates == Rates(2.0, 2.0, 2.0)


def test_a_simulation_that_runs_faster_needs_a_faster_line(mission: Mission) -> None:
    assert plan(mission, [RADIO], False, 4.0).rates != plan(mission, [RADIO], False, 1.0).rates


def test_positions_that_come_less_often_are_older(mission: Mission) -> None:
    assert stale_s(Rates(10.0, 10.0, 2.0)) == 0.0
    assert stale_s(Rates(4.0, 2.0, 1.0)) == pytest.approx(0.2)
    assert lowered(mission, Rates(4.0, 2.0, 1.0)).setpoints.rate_hz == 4.0


def on_a_line(
    path: Path, line: Address, autopilots: list[str], signed: bool = False
) -> tuple[Live, list[str]]:
    """A flight of vehicles that share one line, and what is told of its budget."""
    told: list[str] = []
    count = len(autopilots)
    options: dict[str, Any] = {
        "addresses": [[line]] * count,
        "heard_on": [line] * count,
        "make_wires": ThinWires,
        "telling": told.append,
    }
    if signed:
        options["signing"] = Signing(KEY, lambda: units(DATE_S + live.now))
    stubs = {"key": KEY, "date_s": DATE_S} if signed else {}
    live = Live(path, autopilots=autopilots, places_m=PLACES_M[:count], options=options, stubs=stubs)
    return live, told


CASES = [
    (57600, ["px4"], False, Rates(10.0, 10.0, 2.0)),
    (57600, ["ardupilot"], True, Rates(10.0, 10.0, 2.0)),
    (57600, ["px4", "ardupilot", "px4"], True, Rates(5.0, 5.0, 1.0)),
    (9600, ["ardupilot"], False, Rates(4.0, 2.0, 1.0)),
]


@pytest.mark.parametrize(
    ("baud", "autopilots", "signed", "rates"), CASES, ids=["px4", "signed", "three", "9600"]
)
def test_a_flight_stays_within_its_lines_budget(
    tmp_path: Path, baud: int, autopilots: list[str], signed: bool, rates: Rates
) -> None:
    line = Address("serial", "/dev/ttyUSB0", baud)
    live, told = on_a_line(tmp_path, line, autopilots, signed)
    outcome = live.fly()
    assert outcomes(outcome) == ["landed"] * len(autopilots)
    assert outcome.exit_code() == 0
    budget = plan(small_mission(tmp_path), [line] * len(autopilots), signed, 1.0)
    assert (budget.rates, told) == (rates, [str(budget)])
    assert outcome.mission.setpoints.rate_hz == rates.setpoints
    world, stale = outcome.world, stale_s(rates)
    assert world.fleet["latency"].min() >= 0.3 + stale, "ArduPilot's own, the less of the two"
    limits = [session.adapter.limits for session in outcome.sessions if session.adapter is not None]
    unsure_m = max(
        (one.unsure_s + stale) * float(speed) for one, speed in zip(limits, world.fleet["speed"], strict=True)
    )
    assert world.rules["separation"] == pytest.approx(outcome.mission.safety.separation_m + unsure_m)
    (load,), wires = budget.loads, live.wires
    assert isinstance(wires, ThinWires)
    began = outcome.swarm.search_began
    assert began is not None
    searching = range(int(began), int(began + outcome.searched_s) - 5)
    for start in searching:
        assert wires.rate("from", start, start + 5) <= load.from_vehicles
        assert wires.rate("to", start, start + 5) <= load.to_vehicles
        assert wires.dropped[start] == 0
    middle = (searching[0], searching[-1])
    assert wires.rate("to", *middle) > 0.6 * load.to_vehicles
    assert wires.rate("from", *middle) > 0.5 * load.from_vehicles


def test_a_line_that_is_too_thin_refuses_before_anything_is_armed(tmp_path: Path) -> None:
    live, told = on_a_line(tmp_path, SLOW, ["px4", "px4"])
    with pytest.raises(RefusedError, match="carries 768 bytes a second"):
        live.fly()
    assert told == []
    assert not any(vehicle.armed for vehicle in live.fleet.vehicles)
