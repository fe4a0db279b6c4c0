"""Every planner with a fleet in which no two vehicles are alike: each flies, sees and hears as it is itself."""

import numpy as np
import pytest

from swarmctl.core import planners

from ..core.worlds import Box
from .situation import Situation

AREA: Box = (0.0, 2000.0, 0.0, 2000.0)
SPEEDS = np.array([8.0, 15.0, 22.0, 30.0])
SENSORS = np.array([260.0, 60.0, 150.0, 90.0])
RADIOS = np.array([900.0, 300.0, 0.0, 600.0])


def mixed(algorithm: str) -> Situation:
    """Four vehicles among targets, about to start."""
    spots = np.random.default_rng(7).normal((1000.0, 1000.0), 400.0, (150, 2)).clip(1.0, 1999.0)
    starts = [(900.0, 900.0), (950.0, 900.0), (900.0, 950.0), (950.0, 950.0)]
    s = Situation(
        algorithm, starts, [20.0, 110.0, 200.0, 290.0], [(x, y) for x, y in spots], area=AREA, random=0.05
    )
    fleet = s.world.fleet
    fleet["speed"], fleet["sensor_range"], fleet["radio_range"] = SPEEDS, SENSORS, RADIOS
    s.world.prepare()
    return s


@pytest.mark.parametrize("algorithm", planners.MODULES)
def test_each_vehicle_flies_sees_and_hears_as_it_is_itself(algorithm: str) -> None:
    s = mixed(algorithm)
    world, targets = s.world, s.world.scene.targets
    full = np.zeros(4, int)
    heard = 0
    for tick in range(300):
        east, north = world.poses["east"].copy(), world.poses["north"].copy()
        s.fly()
        off = np.hypot(targets["east"] - east[:, None], targets["north"] - north[:, None])
        assert world.report_count.tolist() == (off <= SENSORS[:, None]).sum(axis=1).tolist()
        apart = np.hypot(east - east[:, None], north - north[:, None])
        near = (apart <= np.minimum(RADIOS, RADIOS[:, None])) & ~np.eye(4, dtype=bool)
        slot = tick % world.depth
        assert world.heard_count[slot].tolist() == near.sum(axis=1).tolist()
        heard += int(near.sum())
        flown = np.hypot(world.poses["east"] - east, world.poses["north"] - north)
        assert (flown <= SPEEDS * (1.0 + 1e-9)).all()
        full += flown >= SPEEDS * (1.0 - 1e-9)
        assert ((world.poses["east"] >= 0.0) & (world.poses["east"] <= 2000.0)).all()
    assert full.min() > 250  # a vehicle that finds no way at the fence stands for a period
    assert heard > 50
