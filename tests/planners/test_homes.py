"""Where vehicles that fly belief start all over the area, each searches about its own launch place."""

import numpy as np
import pytest

from swarmctl.core.planners import belief, sectors
from swarmctl.mission.load import load
from swarmctl.mission.scaling import at_constant_density
from swarmctl.mission.scenario import Scenario
from swarmctl.study.runs import Job, simulate

from ..core.worlds import Box
from .situation import Situation

AREA: Box = (0.0, 2000.0, 0.0, 1000.0)
FAR = [(500.0, 250.0), (1500.0, 250.0), (500.0, 750.0), (1500.0, 750.0)]


def test_a_home_is_about_the_own_launch_place_and_as_large_as_the_vehicle_is_good_at_sweeping() -> None:
    s = Situation("belief", FAR, [30.0] * 4, area=AREA)
    s.world.fleet["speed"], s.world.fleet["sensor_range"] = (
        [10.0, 10.0, 20.0, 40.0],
        [50.0, 100.0, 50.0, 50.0],
    )
    s.world.prepare()
    shares = np.array([1.0, 2.0, 2.0, 4.0]) / 9.0
    radii = 1.5 * np.sqrt(shares * 2000.0 * 1000.0 / np.pi)
    assert [s.remembers("home", i) for i in range(4)] == pytest.approx(radii.tolist())
    for i, (east, north) in enumerate(FAR):
        assert sectors.own(s.world.memory, i, east + 0.99 * radii[i], north)
        assert sectors.own(s.world.memory, i, east, north - 0.99 * radii[i])
        assert not sectors.own(s.world.memory, i, east, north + 1.01 * radii[i])


def test_they_search_at_once_and_those_from_one_place_fly_out_first() -> None:
    far = Situation("belief", FAR, [30.0] * 4, area=AREA)
    assert far.world.memory["mode"].tolist() == [belief.SEARCH] * 4
    together = Situation("belief", [(500.0, 250.0), (520.0, 250.0)], [30.0] * 2, area=AREA)
    assert together.world.memory["mode"].tolist() == [belief.FIRST_LEG] * 2
    assert together.world.memory["home"].tolist() == [0.0, 0.0]


def test_nobody_flies_far_from_home_before_it_is_searched() -> None:
    mission = load(None, {**at_constant_density(load(), 24), "duration_s": 300.0, "targets.count": 0})
    world = Scenario(mission, ideal=True).world(3, "belief")
    starts = np.column_stack((world.poses["east"], world.poses["north"]))
    world.run_ideal()
    gone = np.hypot(*(np.column_stack((world.poses["east"], world.poses["north"])) - starts).T)
    assert np.median(gone) < world.memory["home"][0]


def test_a_large_swarm_finds_most_sooner_than_fco() -> None:
    mission = load(None, at_constant_density(load(), 60))
    seeds = tuple(range(1, 7))
    seconds = {name: simulate(Job(mission, name, seeds))["time_s"][:, 3].mean() for name in ("belief", "fco")}
    assert seconds["belief"] < 0.85 * seconds["fco"]
