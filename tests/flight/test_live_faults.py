"""Each fault in the air has its answer, for both firmwares, in virtual time."""

from pathlib import Path

import pytest

from .virtual import Live, events, outcomes

AT_S = {"px4": 60, "ardupilot": 95}  # in the middle of the search
# fault: for each firmware how vehicle 2 ends, and what is told of it
ANSWERS = {
    "gps-loss": {
        "px4": ("released", "its mode became AUTO.LAND while engaged"),
        "ardupilot": ("released", "its mode became LAND while engaged"),
    },
    "link-loss": {
        "px4": ("lost", "no heartbeat for 3 s while engaged"),
        "ardupilot": ("lost", "silent while all others are down: told to land"),
    },
    "battery-collapse": {
        "px4": ("landed", "battery all but empty: lands where it is"),
        "ardupilot": ("landed", "battery all but empty: lands where it is"),
    },
    "reboot": {
        "px4": ("crashed", "it disarmed while engaged"),
        "ardupilot": ("crashed", "it disarmed while engaged"),
    },
    "motor-failure": {
        "px4": ("crashed", "it came down while engaged"),
        "ardupilot": ("crashed", "it came down while engaged"),
    },
    "stuck-mode": {
        "px4": ("landed", "DO_SET_MODE AUTO.LAND had no effect"),
        "ardupilot": ("lost", "left in the air, as far as is known: failed, GUIDED"),
    },
    "ignored-setpoints": {
        "px4": ("landed", "it does not fly its setpoints"),
        "ardupilot": ("landed", "it does not fly its setpoints"),
    },
    "packet-delay=2": {
        "px4": ("released", "its mode became AUTO.RTL while engaged"),
        "ardupilot": ("landed", "its link is too slow for setpoints: lands where it is"),
    },
}
STAYS_UP = {("stuck-mode", "ardupilot"), ("link-loss", "ardupilot")}
"""Those that nobody can bring down from here: told, not landed."""


@pytest.mark.parametrize("autopilot", list(AT_S))
@pytest.mark.parametrize("fault", list(ANSWERS))
def test_the_vehicle_ends_so_and_the_others_come_home(fault: str, autopilot: str, tmp_path: Path) -> None:
    live = Live(tmp_path, autopilots=[autopilot] * 3, faults=[f"2:{fault}@{AT_S[autopilot]}"])
    outcome = live.fly()
    ends, told = ANSWERS[fault][autopilot]
    assert outcomes(outcome) == ["landed", ends, "landed"]
    assert told in events(outcome, 2)
    assert outcome.exit_code() == 1
    assert live.down[0] and live.down[2]
    assert live.down[1] is ((fault, autopilot) not in STAYS_UP)
    if not live.down[1]:
        assert "left in the air, as far as is known" in events(outcome, 2)
    if fault not in ("stuck-mode", "ignored-setpoints"):  # noticed late, or only on the way home
        assert outcome.summary("")["searched_s"] < 70.0


@pytest.mark.parametrize("fault", ["gps-loss", "link-loss", "reboot", "motor-failure", "battery-collapse"])
def test_the_others_fly_on_where_the_mission_says_so(fault: str, tmp_path: Path) -> None:
    live = Live(tmp_path, {"safety.if_one_fails": "continue"}, faults=[f"2:{fault}@60"])
    outcome = live.fly()
    assert outcome.summary("")["searched_s"] == 70.0
    assert [outcomes(outcome)[i] for i in (0, 2)] == ["landed"] * 2
    assert outcome.exit_code() == 1


def test_position_lost_without_the_firmware_noticing(tmp_path: Path) -> None:
    """The position no longer comes, but heartbeats do: it is landed where it is."""
    live = Live(tmp_path)
    live.at = [(60.0, lambda live: live.fleet.vehicles[1].set_interval(33, -1))]
    outcome = live.fly()
    assert "vehicle 2: no valid position while engaged" in events(outcome, 2)
    assert (outcomes(outcome), outcome.exit_code()) == (["landed"] * 3, 1)
    assert all(live.down)
    assert outcome.summary("")["searched_s"] < 70.0
    assert "vehicle 2: landed away from its pad" in outcome.complaints()


def test_a_low_battery_is_heeded_while_all_hold(tmp_path: Path) -> None:
    live = Live(tmp_path, {"duration_s": 200})
    for vehicle in live.fleet.vehicles:
        vehicle.battery.__init__(400.0 if vehicle.system == 2 else None)  # type: ignore[misc]
    live.at = [(30.0, lambda live: live.swarm.hold(live.now)), (330.0, lambda live: live.orders.interrupt())]  # type: ignore[union-attr]
    outcome = live.fly()
    told = events(outcome, 2)
    assert "battery at 25 %: returns" in told
    assert float(told.split(" s: battery")[0]) < 330.0
    assert outcomes(outcome) == ["landed"] * 3


def test_a_silent_one_that_is_heard_again_when_all_others_are_down_comes_home(tmp_path: Path) -> None:
    live = Live(tmp_path, {"safety.if_one_fails": "continue"}, autopilots=["ardupilot"] * 3)
    network = live.fleet.vehicles[1].network
    live.at = [
        (95.0, lambda live: network.impair(up_cut=True, down_cut=True)),
        (260.0, lambda live: network.impair(up_cut=False, down_cut=False)),
    ]
    outcome = live.fly()
    assert "heartbeat again" in events(outcome, 2)
    assert (outcomes(outcome), all(live.down)) == (["landed"] * 3, True)
    fleet, track = outcome.world.fleet, outcome.track
    assert abs(track.field("east")[-1, 1] - fleet["pad_east"][1]) < 1.5
    assert abs(track.field("north")[-1, 1] - fleet["pad_north"][1]) < 1.5
