"""No twin: what a study computes is what flies.

Every algorithm searches the reference scenario for its 1600 s in a lockstep flight and, from the moment when the
barrier opens, in a study that sees what messages carry: every wish, every setpoint and all that vehicles know and
remember must be the same, bit for bit.  (Half of the algorithms are in test_no_twin_baselines.py, so that two
processes can share the work.)
"""

import math
from pathlib import Path

import numpy as np
import pytest

from swarmctl.core.planners import MODULES
from swarmctl.core.world import World
from swarmctl.mission.load import load
from swarmctl.mission.model import Mission

from .flown import small_mission
from .paired import Pair
from .test_no_twin_baselines import BASELINES, SEEDS, reference

MEDDLED_AT, MEDDLED_WITH = 7, 3


@pytest.mark.parametrize("algorithm", [name for name in MODULES if name not in BASELINES])
@pytest.mark.parametrize("seed", SEEDS)
def test_study_and_flight_decide_the_same_for_1600_s(algorithm: str, seed: int) -> None:
    pair = Pair(reference(algorithm), seed).fly()
    assert pair.ticks == 16_000
    assert (pair.flown.found >= 0).sum() == (pair.studied.found >= 0).sum() > 100


def hard(folder: Path, algorithm: str) -> Mission:
    """The small mission, which has everything random that there is, in a wind that not everybody can fly against."""
    given = {
        "planner.algorithm": algorithm, "observations": "wire", "stub.wind_mps": [9.0, -6.0],
        "origin.lat": -33.123456789, "origin.lon": 151.2, "origin.alt_m": 12.3456789,
        "vehicles.altitude_m": 12.3, "vehicles.layer_m": 0.7, "safety.max_acceleration_mps2": 3.3,
    }  # fmt: skip
    return small_mission(folder, given)


@pytest.mark.parametrize("algorithm", MODULES)
def test_so_they_do_in_wind_with_noise_loss_and_delay(algorithm: str, tmp_path: Path) -> None:
    assert Pair(hard(tmp_path, algorithm), 2).fly().ticks == 700


def test_in_that_wind_tracks_are_other_ones(tmp_path: Path) -> None:
    mission = hard(tmp_path, "fco")
    calm = mission.model_copy(update={"stub": mission.stub.model_copy(update={"wind_mps": (0.0, 0.0)})})
    blown, still = (Pair(m, 2).fly().studied.truth for m in (mission, calm))
    assert np.hypot(blown["east"] - still["east"], blown["north"] - still["north"]).max() > 1.0


def by_an_ulp(tick: int, world: World) -> None:
    """Let the flight's planner wish something else, by as little as there is."""
    if tick == MEDDLED_AT:
        wish = world.wishes[MEDDLED_WITH]
        wish["v_north"] = math.nextafter(wish["v_north"], math.inf)


def test_a_wish_that_differs_by_one_ulp_is_found_and_named() -> None:
    tick = rf"setpoint tick {10 * MEDDLED_AT}, planner tick {MEDDLED_AT}"
    said = rf"{tick}: vehicle {MEDDLED_WITH + 1}: wishes\.v_north is"
    with pytest.raises(AssertionError, match=said):
        Pair(reference("fco", duration_s=20.0), 1, by_an_ulp).fly()


def test_a_study_that_sees_exactly_is_another_one() -> None:
    exact = load(None, {"planner.algorithm": "fco", "duration_s": 20.0})
    with pytest.raises(AssertionError, match=r"setpoint tick \d+, .*: poses\.(east|north|v_east|v_north) is"):
        Pair(exact, 1).fly()
