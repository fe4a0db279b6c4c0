"""One vehicle fails in the air: what the others do, what is reported, and that the folder can be read."""

from pathlib import Path

import numpy as np
import pytest

from swarmctl.flight.errors import FlightError, RefusedError
from swarmctl.mavlink.dialect import mav
from swarmctl.record import mcap_read
from swarmctl.record.folder import RunFolder
from swarmctl.record.redraw import redraw
from swarmctl.record.replay import replay

from .flown import Flown, fly, read_with_pymavlink
from .hobbled import Hobble, goes_silent, mode_is_changed, motors_stop, never_arms, never_speaks

MID_FLIGHT_S = 53.0  # the search lasts from about 20 s to 90 s
POSITION: int = mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT


def outcomes(flown: Flown) -> list[str]:
    """How each vehicle ended."""
    return [v["outcome"] for v in flown.summary["per_vehicle"]]


def events_of(flown: Flown, system: int) -> str:
    """What is told of one vehicle."""
    return "\n".join(flown.summary["per_vehicle"][system - 1]["events"])


def assert_others_are_home(flown: Flown) -> None:
    """Vehicles 1 and 3 stand on their pads, and the limits were kept by those that we fly."""
    track, fleet = flown.outcome.track, flown.outcome.world.fleet
    for i in (0, 2):
        off = np.hypot(
            track.field("east")[-1, i] - fleet["pad_east"][i],
            track.field("north")[-1, i] - fleet["pad_north"][i],
        )
        assert off < 1.0
        assert not track.airborne[-1, i]
    assert flown.summary["min_separation_m"] >= 15.0


def assert_readable(flown: Flown) -> None:
    """Replay recomputes everything, and pymavlink reads all frames."""
    assert replay(mcap_read.read(flown.folder.mcap)).same
    size = sum(8 + len(m.get_msgbuf()) for m in read_with_pymavlink(flown.folder.tlog))
    assert flown.folder.tlog.stat().st_size == size


@pytest.mark.parametrize(
    ("hobble", "outcome", "told", "within_s"),
    [
        (motors_stop(MID_FLIGHT_S), "crashed", "vehicle 2: it disarmed while engaged", 6.0),
        (
            mode_is_changed(MID_FLIGHT_S),
            "released",
            "vehicle 2: its mode became AUTO.LOITER while engaged",
            6.0,
        ),
        (goes_silent(MID_FLIGHT_S, HEARTBEAT), "lost", "vehicle 2: no heartbeat for 3 s while engaged", 10.0),
    ],
)
def test_one_fails_and_the_others_come_home(
    hobble: Hobble, outcome: str, told: str, within_s: float, tmp_path: Path
) -> None:
    flown = fly(tmp_path, hobble=hobble)
    assert flown.outcome.exit_code() == 1
    assert outcomes(flown) == ["landed", outcome, "landed"]
    assert told in events_of(flown, 2)
    began = flown.outcome.swarm.search_began
    assert began is not None
    assert MID_FLIGHT_S - began <= flown.summary["searched_s"] < MID_FLIGHT_S - began + within_s
    assert_others_are_home(flown)
    assert_readable(flown)


def test_the_others_go_on_where_the_mission_says_so(tmp_path: Path) -> None:
    flown = fly(tmp_path, {"safety.if_one_fails": "continue"}, hobble=motors_stop(MID_FLIGHT_S))
    assert flown.outcome.exit_code() == 1
    assert outcomes(flown) == ["landed", "crashed", "landed"]
    assert flown.summary["searched_s"] == 70.0
    assert_others_are_home(flown)
    assert_readable(flown)


def test_the_others_stop_where_too_few_are_left(tmp_path: Path) -> None:
    settings: dict[str, object] = {"safety.if_one_fails": "continue", "safety.minimum_vehicles": 3}
    flown = fly(tmp_path, settings, hobble=motors_stop(MID_FLIGHT_S))
    assert flown.outcome.exit_code() == 1
    assert flown.summary["searched_s"] < 40.0
    assert_others_are_home(flown)


def test_a_vehicle_that_was_taken_over_is_never_fought(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=mode_is_changed(MID_FLIGHT_S))
    messages = read_with_pymavlink(flown.folder.tlog)
    ours = [m for m in messages if m.get_srcSystem() == 255 and getattr(m, "target_system", 0) == 2]
    released_by = MID_FLIGHT_S + 1.1  # a heartbeat tells the mode
    assert max(m._timestamp for m in ours) <= released_by
    others = [m for m in messages if m.get_srcSystem() == 255 and getattr(m, "target_system", 0) == 1]
    assert max(m._timestamp for m in others) > released_by + 10.0


def test_a_vehicle_whose_heartbeat_comes_back_too_late_is_let_go(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=goes_silent(MID_FLIGHT_S, HEARTBEAT, back_at_s=63.0))
    assert flown.outcome.exit_code() == 1
    assert outcomes(flown) == ["landed", "released", "landed"]
    told = events_of(flown, 2)
    assert all(text in told for text in ("no heartbeat for 3 s", "heartbeat again", "mode became AUTO.RTL"))
    assert_others_are_home(flown)


def test_a_gap_shorter_than_the_limit_changes_nothing(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=goes_silent(MID_FLIGHT_S + 0.05, HEARTBEAT, back_at_s=MID_FLIGHT_S + 2.0))
    assert flown.outcome.exit_code() == 0
    assert outcomes(flown) == ["landed"] * 3
    assert flown.summary["searched_s"] == 70.0
    assert events_of(flown, 2) == ""


def test_silence_while_climbing_lands_the_others(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=goes_silent(14.0))
    assert flown.outcome.exit_code() == 1
    assert outcomes(flown) == ["landed", "lost", "landed"]
    assert flown.summary["decisions"] == 0
    assert_others_are_home(flown)
    assert_readable(flown)


@pytest.mark.parametrize("hobble", [goes_silent(MID_FLIGHT_S), goes_silent(MID_FLIGHT_S, POSITION)])
def test_a_position_that_does_not_come_in_lockstep_is_an_error(hobble: Hobble, tmp_path: Path) -> None:
    with pytest.raises(FlightError, match=r"vehicle 2: no position in the tick at 53\.0 s"):
        fly(tmp_path, hobble=hobble)
    folder = RunFolder.open(tmp_path / "run")
    result = replay(mcap_read.read(folder.mcap))
    assert result.same
    assert (result.truncated, result.decisions > 60) == (False, True)
    assert read_with_pymavlink(folder.tlog)[-1]._timestamp == pytest.approx(MID_FLIGHT_S - 0.1, abs=1e-3)
    assert redraw(folder).stat().st_size > 10_000


def test_one_that_never_arms_is_refused_and_nobody_searches(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=never_arms)
    assert outcomes(flown) == ["landed", "refused", "landed"]
    assert flown.outcome.exit_code() == 3
    assert flown.summary["searched_s"] == 0.0


def test_one_that_falls_on_the_way_up_has_crashed(tmp_path: Path) -> None:
    flown = fly(tmp_path, hobble=motors_stop(18.0), settings={"vehicles.altitude_m": 30})
    assert outcomes(flown)[1] == "crashed"
    assert flown.outcome.exit_code() == 1


def test_one_that_never_speaks_is_refused_in_time(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="vehicle 2 is still connecting at 20 s"):
        fly(tmp_path, hobble=never_speaks)


def test_a_crashed_vehicle_sees_and_tells_nothing_more(tmp_path: Path) -> None:
    settings: dict[str, object] = {"safety.if_one_fails": "continue", "sensor.false_alarms_per_hour": 3000}
    flown = fly(tmp_path, settings, hobble=motors_stop(MID_FLIGHT_S))
    began = flown.outcome.swarm.search_began
    assert began is not None
    for message in mcap_read.read(flown.folder.mcap).rows("/observations", "/heard"):
        if message.time_s > MID_FLIGHT_S + 2.0:
            field = "vehicle" if message.topic == "/observations" else "sender"
            assert 1 not in message.rows[field]


def test_a_low_battery_sends_its_vehicle_home(tmp_path: Path) -> None:
    flown = fly(tmp_path, {"vehicles.endurance_s": 60, "duration_s": 200})
    assert outcomes(flown) == ["landed"] * 3
    assert all("battery at 25 %: returns" in events_of(flown, system) for system in (1, 2, 3))
    assert flown.outcome.track.times_s[-1] < 150.0
