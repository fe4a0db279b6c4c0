"""No twin, the baselines' half: see test_no_twin.py."""

import pytest

from swarmctl.mission.load import load
from swarmctl.mission.model import Mission

from .paired import Pair

BASELINES = ("dpso-u", "bounce", "levy", "sweep")
SEEDS = (1, 2, 3, 4, 5)


def reference(algorithm: str, **settings: object) -> Mission:
    """missions/paper.yaml as ``fly`` flies it, for a study that sees what messages carry."""
    return load(None, {"planner.algorithm": algorithm, "observations": "wire", **settings})


@pytest.mark.parametrize("algorithm", BASELINES)
@pytest.mark.parametrize("seed", SEEDS)
def test_study_and_flight_decide_the_same_for_1600_s(algorithm: str, seed: int) -> None:
    pair = Pair(reference(algorithm), seed).fly()
    assert pair.ticks == 16_000
    assert (pair.flown.found >= 0).sum() == (pair.studied.found >= 0).sum() > 100
