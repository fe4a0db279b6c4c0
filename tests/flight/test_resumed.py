"""A controller that is killed at any moment, and another that flies on: in virtual time, at every stage."""

import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from sim_vehicle_stub.configured import configured_fleet
from swarmctl.flight import resumption
from swarmctl.flight.errors import RefusedError
from swarmctl.flight.results import Outcome
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.record import mcap_read, rows
from swarmctl.record.errors import LogError, RecordError
from swarmctl.record.redraw import redraw
from swarmctl.record.replay import replay
from swarmctl.record.searched import searched
from swarmctl.record.stub_replay import replay_stub

from .test_live_orders import order
from .virtual import Live, events, outcomes

TARGETS = 80
LONG = {"duration_s": 120.0}


def killed(live: Live, at_s: float, gap_s: float) -> Path:
    """Fly until ``at_s``, kill the controller, and leave the vehicles to themselves for ``gap_s``: the folder."""
    left: list[Path] = []
    live.at.append((at_s, lambda live: left.append(live.die())))
    with pytest.raises(RuntimeError, match="Event loop stopped"):
        live.fly()
    live.forsake(gap_s)
    return left[0]


def seen_by(folder: Path) -> set[tuple[int, int]]:
    """Which vehicle (row) had seen which target, by a recording."""
    table = searched(mcap_read.read(folder / "flight.mcap"), 3, TARGETS).seen_rows()
    return set(zip(table["vehicle"].tolist(), table["target"].tolist(), strict=True))


def found_s(outcome: Outcome) -> list[float]:
    return [float(s) for s in outcome.found_s]


MOMENTS = [("px4", (24.0, 31.0, 40.0, 61.3, 99.0)), ("ardupilot", (62.0, 70.0, 75.0, 100.7, 130.0))]


@pytest.mark.parametrize("gap_s", [0.3, 9.0])
@pytest.mark.parametrize(("autopilot", "at_s"), [(name, at) for name, times in MOMENTS for at in times])
def test_killed_at_any_moment_it_is_flown_on_and_nothing_is_lost(
    autopilot: str, at_s: float, gap_s: float, tmp_path: Path
) -> None:
    live = Live(tmp_path, autopilots=[autopilot] * 3)
    left = killed(live, at_s, gap_s)
    before = resumption.read(left)
    assert before.restored.exact
    outcome = live.resume(left)
    assert (outcomes(outcome), outcome.exit_code(), all(live.down)) == (["landed"] * 3, 0, True)
    summary = outcome.summary("")
    assert summary["searched_s"] == 70.0 and summary["decisions"] == 3 * 70
    assert summary["resumed"] == str(left)
    assert seen_by(left) <= seen_by(live.folder.path)
    assert np.array_equal(outcome.swarm.seen, _as_table(seen_by(live.folder.path)))
    early = before.searched.found
    assert all(at == tick for at, tick in zip(found_s(outcome), early.tolist(), strict=True) if tick >= 0)
    assert all(at >= before.restored.ticks for at, t in zip(found_s(outcome), early, strict=True) if t < 0)
    again = replay(mcap_read.read(live.folder.mcap))
    assert again.same and again.decisions == 3 * (70 - before.restored.ticks) and not again.truncated
    assert replay(mcap_read.read(left / "flight.mcap")).same
    with pytest.raises(LogError, match="began in the air"):
        replay_stub(live.folder, configured_fleet)


def _as_table(pairs: set[tuple[int, int]]) -> np.ndarray:
    table = np.zeros((3, TARGETS), bool)
    for vehicle, target in pairs:
        table[vehicle, target] = True
    return table


def test_memory_is_to_the_bit_what_it_was(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG)
    memory: list[bytes] = []

    def remember(live: Live) -> None:
        assert live.swarm is not None
        world = live.swarm._world
        live.swarm._journal.breathe(math.inf)
        memory.extend(getattr(world, name).tobytes() for name in REMEMBERED)
        memory.extend(world.contacts_of(i).tobytes() for i in range(3))
        memory.append(str(live.swarm.planner_tick).encode())

    live.at = [(77.35, remember)]
    left = killed(live, 77.36, 0.0)
    restored = resumption.read(left).restored
    known = restored.world
    assert memory == [
        *(getattr(known, name).tobytes() for name in REMEMBERED),
        *(known.contacts_of(i).tobytes() for i in range(3)),
        str(restored.ticks).encode(),
    ]
    assert restored.ticks > 30 and restored.exact


REMEMBERED = ("memory", "knowledge", "told", "beacons", "heard", "heard_count", "wishes")


def test_a_resumed_flight_that_is_killed_is_resumed_again(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG)
    first = killed(live, 60.0, 2.0)
    second = _killed_again(live, first, 25.0)
    ticks = resumption.read(second).restored.ticks
    third = _killed_again(live, second, 6.0)  # while it takes them back
    assert resumption.read(third).restored.ticks == ticks > 20
    with pytest.raises(RecordError, match=f"{first}: was flown on in .*: resume that"):
        resumption.read(first)
    outcome = live.resume(third, "last")
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)
    assert outcome.summary("")["searched_s"] == 120.0
    assert seen_by(first) <= seen_by(second) <= seen_by(third) <= seen_by(live.folder.path)
    assert replay(mcap_read.read(live.folder.mcap)).same
    redraw(live.folder)
    assert live.folder.tracks.stat().st_size > 10_000


def _killed_again(live: Live, run: Path, at_s: float) -> Path:
    """Resume, and kill that controller too."""
    left: list[Path] = []
    name = f"after-{run.parent.name}-{run.name}"
    live.path = run.parent / name
    live.path.mkdir()
    live.at = [(at_s, lambda live: left.append(live.die()))]
    with pytest.raises(RuntimeError, match="Event loop stopped"):
        live.resume(run)
    live.forsake(1.0)
    return left[0]


def test_vehicles_that_came_near_one_another_part_before_they_change_height(tmp_path: Path) -> None:
    """ArduPilots hover where they were; here that is 4 m apart at one height, and one above the other."""
    live = Live(tmp_path, LONG, autopilots=["ardupilot"] * 3)
    left = killed(live, 90.0, 6.0)
    for body, place in zip(
        live.fleet.truth, ((200.0, 200.0, 16.0), (204.0, 200.0, 18.0), (201.0, 202.0, 30.0)), strict=True
    ):
        body["east"], body["north"], body["up"] = place
    gaps: list[float] = []
    heights: list[float] = []
    measure = live._measure

    def watch() -> None:
        measure()
        gaps.append(_least_gap(live))
        if gaps[-1] < 15.0:
            heights.extend(live.fleet.truth["up"].tolist())

    live._measure = watch  # type: ignore[method-assign]
    outcome = live.resume(left)
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 1)  # they had been too near
    parted = next(k for k, gap in enumerate(gaps) if gap >= 15.0)
    assert min(gaps[parted:]) >= 15.0
    assert all(min(abs(height - kept) for kept in (16.0, 18.0, 30.0)) < 0.5 for height in heights)


def _least_gap(live: Live) -> float:
    """The least distance (m) of two at about one height."""
    bodies = list(live.fleet.truth)
    return min(
        (
            math.hypot(a["east"] - b["east"], a["north"] - b["north"])
            for a, b in combinations(bodies, 2)
            if abs(a["up"] - b["up"]) < 5.0 and min(a["up"], b["up"]) > 1.0
        ),
        default=math.inf,
    )


def test_whoever_had_been_released_is_left_alone(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG)
    live.at = [(55.0, order("release 2"))]
    left = killed(live, 60.0, 1.0)
    outcome = live.resume(left)
    assert "it had been released, or taken over" in events(outcome, 2)
    assert outcomes(outcome) == ["landed", "released", "landed"]
    assert outcome.summary("")["searched_s"] == 120.0


def test_a_pilot_who_took_over_meanwhile_is_left_alone(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG, autopilots=["ardupilot"] * 3)
    left = killed(live, 90.0, 1.0)
    loiter = mav.MAVLink_set_mode_message(3, 1, 5)
    live.fleet.vehicles[2].receive(Encoder(200, 190).encode(loiter), live.fleet_s)
    outcome = live.resume(left)
    assert "a pilot flies it in LOITER" in events(outcome, 3)
    assert outcomes(outcome)[:2] == ["landed", "landed"]


def test_one_outside_the_fence_is_left_alone(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG, autopilots=["ardupilot"] * 3)
    left = killed(live, 90.0, 5.0)
    live.fleet.truth["east"][1] = -12.0
    outcome = live.resume(left)
    assert "vehicle 2: it is outside the fence" in events(outcome, 2)
    assert outcomes(outcome) == ["landed", "released", "landed"]


def test_one_whose_battery_is_low_is_brought_home_by_us(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG, autopilots=["ardupilot"] * 3)
    left = killed(live, 90.0, 5.0)
    live.fleet.vehicles[1].battery.collapse()
    live.fleet.vehicles[1].battery._endurance_s = 2000.0
    live.fleet.vehicles[1].battery._airborne_s = 1600.0
    outcome = live.resume(left)
    assert "battery at 19 %: returns" in events(outcome, 2)
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)


def test_one_that_is_not_heard_is_missed_and_taken_back_when_it_is(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG, autopilots=["ardupilot"] * 3)
    left = killed(live, 90.0, 5.0)
    live.fleet.vehicles[2].network.impair(up_cut=True, down_cut=True)
    live.at = [(60.0, lambda live: live.fleet.vehicles[2].network.impair(up_cut=False, down_cut=False))]
    outcome = live.resume(left)
    told = events(outcome, 3)
    assert "is not heard" in told and "taken back: found in the air, GUIDED" in told
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)


def test_the_order_to_return_still_holds(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG)
    live.at = [(60.0, order("return"))]
    outcome = live.resume(killed(live, 62.0, 0.5))
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 0)
    searched_s = outcome.summary("")["searched_s"]
    assert searched_s < 60.0 and searched_s == resumption.read(tmp_path / "killed").restored.ticks


def test_nobody_in_the_air_is_refused(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG)
    left = killed(live, 60.0, 200.0)
    with pytest.raises(RefusedError, match="nobody is in the air to be taken back\nvehicle 1: has landed"):
        live.resume(left)
    assert not list(live.folder.path.iterdir())
    assert resumption.read(left).restored.ticks > 0  # nothing forbids another try


def test_steering_is_not_restored(tmp_path: Path) -> None:
    live = Live(tmp_path, LONG)
    before = resumption.read(killed(live, 60.0, 0.0))
    world = before.restored.world
    assert rows.dump_state(world) and world.errands["stage"].any()
    before.give_back(world)
    assert not world.errands["stage"].any() and not world.sent.any() and not world.setpoints["v_east"].any()
