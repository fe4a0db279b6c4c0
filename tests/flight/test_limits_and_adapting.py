"""What a vehicle cannot fly is refused, or with `adapt` flown as it can; its own fence is set right then."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarmctl.flight.errors import RefusedError
from swarmctl.flight.live import LiveLink
from swarmctl.flight.preparation import Preparation
from swarmctl.record import mcap_read

from .virtual import Live

FAR: dict[str, object] = {"area.size_m": [250, 250], "keep_out": [], "targets.clusters": 2, "duration_s": 30}
"""An area of which no corner is more than 300 m away: ArduCopter's own circle is no bound there."""


def set_before(live: Live, **values: float) -> None:
    """Parameters that the vehicles have when they are switched on."""
    for vehicle in live.fleet.vehicles:
        for name, value in values.items():
            vehicle.parameters.set(name, value)
            vehicle.personality.parameter_changed(name)


def refusal(live: Live) -> str:
    """Why the flight was refused."""
    with pytest.raises(RefusedError) as refused:
        live.fly()
    return str(refused.value)


def test_a_vehicle_that_is_too_slow_is_refused(tmp_path: Path) -> None:
    live = Live(tmp_path, {"vehicles.speed_mps": 11.0}, autopilots=("px4", "px4", "ardupilot"))
    assert refusal(live) == (
        "vehicle 3: it flies at most 10 m/s, not the mission's 11 (--adapt flies it as it can)"
    )


def test_adapted_it_flies_as_fast_as_it_can_and_all_come_home(tmp_path: Path) -> None:
    live = Live(
        tmp_path, {"vehicles.speed_mps": 11.0, "duration_s": 40}, ("px4", "px4", "ardupilot"),
        options={"adapt": True},
    )  # fmt: skip
    outcome = live.fly()
    assert outcome.exit_code() == 0 and all(live.down)
    fastest = np.zeros(3)
    for tick in mcap_read.read(live.folder.mcap).rows("/ticks"):
        fastest = np.maximum(fastest, np.hypot(tick.rows["set_v_east"], tick.rows["set_v_north"]))
    assert fastest[2] == pytest.approx(10.0) and fastest[:2] == pytest.approx([11.0, 11.0])


@pytest.mark.parametrize(
    ("autopilot", "values", "told"),
    [
        ("ardupilot", {"FENCE_ENABLE": 1, "FENCE_TYPE": 6}, "its own fence ends 300 m from home; the"),
        ("ardupilot", {"FENCE_ENABLE": 1, "FENCE_TYPE": 5, "FENCE_ALT_MAX": 14.0}, "its own fence ends 14 m above"),
        ("px4", {"GF_MAX_HOR_DIST": 200.0}, "its own fence ends 200 m from home"),
        ("px4", {"GF_MAX_VER_DIST": 13.0}, "its own fence ends 13 m above home; the mission flies at 12 m (--adapt"),
        ("px4", {"GF_MAX_VER_DIST": 7.0}, "its own fence ends 7 m above home; the mission flies at 12 m"),
        ("px4", {"COM_OBL_RC_ACT": 7}, "COM_OBL_RC_ACT 7 stops its motors when setpoints stop"),
        ("px4", {"COM_OF_LOSS_T": 0.2}, "it waits only 0.2 s for a setpoint, and 10 a second are sent"),
    ],
)  # fmt: skip
def test_what_its_own_parameters_would_end_is_refused(
    tmp_path: Path, autopilot: str, values: dict[str, float], told: str
) -> None:
    live = Live(tmp_path, autopilots=(autopilot,) * 3)
    set_before(live, **values)
    said = refusal(live)
    assert told in said and said.count("vehicle") == 3
    assert not any(vehicle.armed or vehicle.flown for vehicle in live.fleet.vehicles)


def test_adapted_it_stays_below_a_ceiling_of_its_own(tmp_path: Path) -> None:
    live = Live(tmp_path, {**FAR}, ("px4",) * 3, options={"adapt": True})
    set_before(live, GF_MAX_VER_DIST=13.0)
    heights: list[float] = []
    live.at = [(40.0, lambda live: heights.extend(live.fleet.truth["up"]))]
    assert live.fly().exit_code() == 0
    assert heights == pytest.approx([10.0] * 3, abs=0.6)


@pytest.fixture
def prepared(monkeypatch: pytest.MonkeyPatch) -> list[Preparation]:
    """The preparations of the flights of a test."""
    seen: list[Preparation] = []
    prepare: Callable[..., Any] = LiveLink.prepare

    async def note(link: LiveLink, preparation: Preparation) -> None:
        seen.append(preparation)
        await prepare(link, preparation)

    monkeypatch.setattr(LiveLink, "prepare", note)
    return seen


def test_adapting_sets_the_fence_right_and_says_what_was(tmp_path: Path, prepared: list[Preparation]) -> None:
    live = Live(tmp_path, {**FAR}, ("px4", "ardupilot", "ardupilot-4.6"), options={"adapt": True})
    assert live.fly().exit_code() == 0
    px4, *copters = live.fleet.vehicles
    assert px4.parameters["GF_ACTION"] == 3
    for copter in copters:
        set_to = {name: copter.parameters[name] for name in ("FENCE_ENABLE", "FENCE_TYPE", "AVOID_ENABLE")}
        assert set_to == {"FENCE_ENABLE": 1, "FENCE_TYPE": 4, "AVOID_ENABLE": 2}
    assert prepared[0].changes[:3] == [
        "vehicle 1: GF_ACTION set to 3 (it was 2)",
        "vehicle 2: FENCE_TYPE set to 4 (it was 7)",
        "vehicle 2: FENCE_ENABLE set to 1 (it was 0)",
    ]
    assert prepared[0].troubles == [
        f"vehicle {copter.system}: nothing brings it down when its controller is gone"
        " (set its ground station failsafe)"
        for copter in copters
    ]


def test_unasked_nothing_is_set_but_everything_is_told(tmp_path: Path, prepared: list[Preparation]) -> None:
    live = Live(tmp_path, {**FAR}, ("px4", "ardupilot", "px4"))
    assert live.fly().exit_code() == 0
    px4, copter, _ = live.fleet.vehicles
    assert (px4.parameters["GF_ACTION"], copter.parameters["FENCE_ENABLE"]) == (2, 0)
    assert prepared[0].changes == []
    told = "\n".join(prepared[0].troubles)
    assert "vehicle 1: leaving its fence holds, and should return (GF_ACTION 3): --adapt sets that" in told
    assert "vehicle 2: the mission's fence" in told and "its fence is switched off (FENCE_ENABLE 1)" in told


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_circle_to_stay_out_of_is_a_circle_on_board(tmp_path: Path, autopilot: str) -> None:
    circle = {"circle_m": {"center_m": [150, 150], "radius_m": 12.5}}
    live = Live(tmp_path, {**FAR, "keep_out": [circle]}, (autopilot,) * 3)
    assert live.fly().exit_code() == 0
    for vehicle in live.fleet.vehicles:
        assert [item.command for item in vehicle.plans.kept[1]] == [5001] * 4 + [5004]
        assert vehicle.plans.kept[1][4].p1 == 12.5
        assert vehicle.fence.broken_at(150.0, 162.4) and not vehicle.fence.broken_at(150.0, 162.6)
