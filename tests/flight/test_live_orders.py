"""What the operator orders of single vehicles, who is refused before arming, and a controller in trouble."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from swarmctl.core.calls import to_geodetic
from swarmctl.flight import swarm as swarm_module
from swarmctl.flight.control import ControlError
from swarmctl.flight.errors import RefusedError
from swarmctl.flight.orders import obey
from swarmctl.flight.preparation import Preparation
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.record import mcap_read
from swarmctl.record.errors import RunFolderError
from swarmctl.record.replay import replay
from swarmctl.record.tlog import TlogWriter
from swarmctl.vehicle.addresses import Address

from .flown import ORIGIN
from .virtual import PLACES_M, Live, events, outcomes

POSCTL = 3.0


def order(words: str, answers: list[str] | None = None) -> Callable[[Live], None]:
    """`swarmctl control RUN words`."""

    def give(live: Live) -> None:
        assert live.swarm is not None
        answer = obey(words.split(), live.swarm, live.now)
        if answers is not None:
            answers.append(answer)

    return give


def pilot_takes(system: int, mode: float = POSCTL, sub: float = 0.0) -> Callable[[Live], None]:
    """A pilot's ground station changes a vehicle's mode."""

    def take(live: Live) -> None:
        message = mav.MAVLink_command_long_message(
            system, 1, mav.MAV_CMD_DO_SET_MODE, 0, 1.0, mode, sub, 0.0, 0.0, 0.0, 0.0
        )
        live.wires.send(system, Encoder(200, 190).encode(message))

    return take


def pilot_flies(system: int, east: float, north: float) -> Callable[[Live], None]:
    """A pilot's ground station sends a vehicle somewhere at its altitude."""

    def fly(live: Live) -> None:
        lat, lon = to_geodetic(east, north, *ORIGIN)[:2]
        message = mav.MAVLink_command_int_message(
            system, 1, mav.MAV_FRAME_GLOBAL, mav.MAV_CMD_DO_REPOSITION, 0, 0,
            -1.0, mav.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE, 0.0, math.nan, round(lat * 1e7), round(lon * 1e7), math.nan,
        )  # fmt: skip
        live.wires.send(system, Encoder(200, 190).encode(message))

    return fly


def test_a_vehicle_is_retaken_inside_the_missions_fence_only(tmp_path: Path) -> None:
    refused: list[str] = []

    def try_to_retake(live: Live) -> None:
        with pytest.raises(ControlError) as error:
            order("retake 2")(live)
        refused.append(str(error.value))

    live = Live(tmp_path, {"safety.if_one_fails": "continue", "vehicles.speed_mps": 8.0})
    live.at = [
        (50.0, pilot_flies(2, -40.0, 60.0)),
        (100.0, try_to_retake),
        (101.0, pilot_flies(2, 60.0, 60.0)),
        (140.0, order("retake 2")),
    ]
    outcome = live.fly()
    assert re.search(r"vehicle 2: cannot be retaken, it is \d+\.\d m outside the mission's fence", refused[0])
    assert (outcomes(outcome), all(live.down)) == (["landed"] * 3, True)
    assert events(outcome, 2).count("retaken by the operator") == 1


def test_a_vehicle_taken_over_is_retaken_by_order_only(tmp_path: Path) -> None:
    answers: list[str] = []
    live = Live(tmp_path, {"safety.if_one_fails": "continue"})
    live.at = [(50.0, pilot_takes(2, 4.0, 3.0)), (60.0, order("retake 2", answers))]
    outcome = live.fly()
    assert answers == ["retake vehicle 2 at 60.0 s"]
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)
    told = events(outcome, 2)
    assert "its mode became AUTO.LOITER while engaged" in told
    assert "retaken by the operator" in told
    fleet, track = outcome.world.fleet, outcome.track
    assert abs(track.field("east")[-1, 1] - fleet["pad_east"][1]) < 1.5
    assert abs(track.field("north")[-1, 1] - fleet["pad_north"][1]) < 1.5
    assert replay(mcap_read.read(live.folder.mcap)).same


def test_a_vehicle_released_by_order_is_no_reason_to_break_off(tmp_path: Path) -> None:
    live = Live(tmp_path)  # if_one_fails: abort
    live.at = [(50.0, order("release 2")), (200.0, pilot_takes(2, 4.0, 6.0))]
    outcome = live.fly()
    assert outcome.summary("")["searched_s"] == 70.0
    assert outcomes(outcome) == ["landed", "released", "landed"]
    assert all(live.down)
    assert "released by the operator" in events(outcome, 2)
    assert live.now < 300.0  # watched until the pilot had landed it, and no longer


def test_a_released_vehicle_may_be_retaken_after_all_others_are_down(tmp_path: Path) -> None:
    live = Live(tmp_path)
    live.at = [(50.0, order("release 2")), (250.0, order("retake 2"))]
    outcome = live.fly()
    assert (outcomes(outcome), all(live.down)) == (["landed"] * 3, True)
    fleet, track = outcome.world.fleet, outcome.track
    assert abs(track.field("east")[-1, 1] - fleet["pad_east"][1]) < 1.5


def test_watching_others_vehicles_ends_with_ctrl_c(tmp_path: Path) -> None:
    live = Live(tmp_path)
    live.at = [
        (45.0, order("release 2")),  # where it hovers in nobody's way home
        *((250.0 + k, lambda live: live.orders.interrupt()) for k in (0, 1)),
    ]
    outcome = live.fly()
    assert live.now < 255.0
    assert "left in the air, as far as is known: released, AUTO.LOITER" in events(outcome, 2)
    assert outcome.exit_code() == 4


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("retake 2", "vehicle 2: order: retake is not possible while engaged"),
        ("release 9", "there is no vehicle 9 in this flight"),
        ("release all", "there is no vehicle all in this flight"),
        ("release", "'release' is no order"),
        ("dance", "'dance' is no order (hold, resume, return, land, release ID, retake ID)"),
    ],
)
def test_senseless_orders_are_refused_and_change_nothing(words: str, why: str, tmp_path: Path) -> None:
    refused: list[str] = []

    def give(live: Live) -> None:
        with pytest.raises(ControlError) as error:
            order(words)(live)
        refused.append(str(error.value))

    live = Live(tmp_path)
    live.at = [(50.0, give)]
    outcome = live.fly()
    assert why in refused[0]
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)


OUTSIDE = ((60.0, 60.0), (100.0, 5.0), (60.0, 100.0))
NEAR = ((60.0, 60.0), (100.0, 60.0), (60.0, 70.0))


@pytest.mark.parametrize(
    ("made", "why"),
    [
        ({"places_m": OUTSIDE}, "vehicle 2: it stands outside the area"),
        ({"places_m": NEAR}, "vehicle 3: it stands 10.0 m from vehicle 1; separation_m is 15"),
        (
            {"settings": {"vehicles.launch": [[60, 60], [120, 60], [60, 100]]}},
            "vehicle 2: it stands 20 m from",
        ),
        ({"settings": {"vehicles.autopilot": "ardupilot"}}, "vehicle 1: the mission wants ardupilot"),
        (
            {"settings": {"safety.battery_return_percent": 100}},
            "vehicle 1: its battery is at 100 %, and 100 %",
        ),
        ({"faults": ["2:arming-refused@0"]}, "vehicle 2 gave up: ready to arm: not reached in 90 s"),
        ({"options": {"addresses": [[Address("tcp", "x", 1)]] * 3}}, "heard 0 of 3 vehicles"),
    ],
)
def test_who_is_refused_is_told_and_nobody_is_armed(made: dict[str, Any], why: str, tmp_path: Path) -> None:
    live = Live(tmp_path, **{"seed": None, **made})
    with pytest.raises(RefusedError) as error:
        live.fly()
    assert why in str(error.value)
    lines = [line for line in str(error.value).splitlines() if line.startswith("vehicle ")]
    refused = {int(line.split()[1].rstrip(":")) for line in lines}
    assert not any(vehicle.fence for vehicle in live.fleet.vehicles if vehicle.system in refused)
    assert not any(vehicle.armed for vehicle in live.fleet.vehicles)


def test_the_others_fly_without_one_that_is_refused_where_the_mission_says_so(tmp_path: Path) -> None:
    live = Live(tmp_path, {"safety.if_one_fails": "continue"}, places_m=OUTSIDE)
    outcome = live.fly()
    assert (outcomes(outcome), outcome.exit_code()) == (["landed", "refused", "landed"], 1)
    assert "stands outside the area" in events(outcome, 2)
    assert outcome.summary("")["searched_s"] == 70.0
    assert live.fleet.vehicles[1].fence is None and live.fleet.truth["up"][1] == 0.0


def test_each_vehicle_at_its_own_address(tmp_path: Path) -> None:
    """The mission's first vehicle is the one heard at its address, whatever its system id."""
    ports = [Address("udpin", "127.0.0.1", 14540 + k) for k in range(3)]
    turned = [[ports[2]], [ports[0]], [ports[1]]]
    live = Live(tmp_path, options={"addresses": turned, "heard_on": ports})
    outcome = live.fly()
    assert [session.system for session in outcome.sessions] == [3, 1, 2]
    assert outcomes(outcome) == ["landed"] * 3


def test_the_fence_on_board_is_the_missions(tmp_path: Path) -> None:
    live = Live(tmp_path)
    outcome = live.fly()
    for session, vehicle in zip(outcome.sessions, live.fleet.vehicles, strict=True):
        assert session.fence_verified
        assert vehicle.fence is not None
        east, north = PLACES_M[0]
        assert not vehicle.fence.broken_at(east, north)
        for place in ((-1.0, 100.0), (450.0, 400.0), (901.0, 100.0)):
            assert vehicle.fence.broken_at(*place)


def test_a_recording_that_fails_brings_everybody_home(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flush = TlogWriter.flush

    def full(writer: TlogWriter) -> None:
        if live.now > 60.0:
            raise RunFolderError("flight.tlog: cannot write: No space left on device")
        flush(writer)

    monkeypatch.setattr(TlogWriter, "flush", full)
    live = Live(tmp_path)
    with pytest.raises(RunFolderError, match="No space left"):
        live.fly()
    assert all(live.down)
    pads = zip(PLACES_M, live.fleet.truth, strict=True)
    assert all(abs(body["east"] - e) < 1.5 and abs(body["north"] - n) < 1.5 for (e, n), body in pads)


def test_a_controller_that_fails_lands_everybody_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tick = swarm_module.Swarm.tick

    def fails(swarm: swarm_module.Swarm, k: int, now: float) -> None:
        if now > 60.0:
            raise ZeroDivisionError("a mistake of the program")
        tick(swarm, k, now)

    monkeypatch.setattr(swarm_module.Swarm, "tick", fails)
    live = Live(tmp_path)
    with pytest.raises(ZeroDivisionError):
        live.fly()
    assert all(live.down)


def test_a_yes_is_asked_for_once_all_is_known_and_a_no_arms_nobody(tmp_path: Path) -> None:
    import asyncio

    asked: list[Preparation] = []

    def confirm(preparation: Preparation) -> "asyncio.Future[bool]":
        asked.append(preparation)
        answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        asyncio.get_running_loop().call_later(30.0, answer.set_result, False)
        return answer

    live = Live(tmp_path, options={"confirm": confirm})
    with pytest.raises(RefusedError, match="not confirmed: nothing was armed"):
        live.fly()
    assert len(asked) == 1 and asked[0].done
    assert [finding.item for finding in asked[0].findings[0]][:2] == ["autopilot", "health"]
    assert not any(vehicle.armed for vehicle in live.fleet.vehicles)
