"""Missions for more vehicles at the same density."""

import pytest

from swarmctl.mission.errors import MissionError
from swarmctl.mission.load import load
from swarmctl.mission.scaling import at_constant_density
from swarmctl.mission.scenario import Scenario


@pytest.mark.parametrize("count", [1, 6, 100, 2000])
def test_the_density_stays(count: int) -> None:
    base = load()
    mission = load(None, at_constant_density(base, count))
    width, height = mission.area.size_m or (0.0, 0.0)
    assert len(mission.fleet) == count
    assert width * height / count == pytest.approx(5000.0 * 5000.0 / 6, rel=1e-4)
    assert mission.targets.count == round(75 * count)
    assert mission.targets.clusters == count
    assert mission.launch == "spread"
    world = Scenario(mission, ideal=True).world(1)
    assert len(world.scene.targets) == round(75 * count)
    assert len({(row["east"], row["north"]) for row in world.poses}) == count


@pytest.mark.parametrize(
    ("mission", "why"),
    [("lake", "area: can grow only if"), ("mixed", "vehicles: cannot grow in number")],
)
def test_what_cannot_grow_is_refused(mission: str, why: str) -> None:
    with pytest.raises(MissionError, match=f"command line: {why}"):
        at_constant_density(load(mission), 10)
