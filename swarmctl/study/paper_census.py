"""What a run came to cluster by cluster, which RUN does not have: how whole they were found, and who ends together."""

import numpy as np

from swarmctl.core.arrays import Floats, Records
from swarmctl.core.world import World
from swarmctl.mission.scenario import Scenario

from .paper_paths import step_on
from .runs import Job

VISIT_GAP_S = 60
"""A vehicle that has had nothing of a cluster in range for so long is no longer visiting it."""

# Of one run: how many clusters anybody visited; of those, how many a single visit of a single vehicle saw all targets
# of, the mean share that the best visit saw, and how many all vehicles together had found whole in the end; and how
# many vehicles have the same cluster in range in the end.
CENSUS = np.dtype(
    [("visited", "<i8"), ("whole", "<i8"), ("best_share", "<f8"), ("complete", "<i8"), ("gathered", "<i8")]
)


def census(job: Job) -> Records:
    """Fly every seed of the job in ideal dynamics; one CENSUS record each."""
    scenario = Scenario(job.mission, ideal=True)
    told = np.zeros(len(job.seeds), CENSUS)
    world: World | None = None
    for row, seed in zip(told, job.seeds, strict=True):
        world = scenario.world(seed, job.algorithm, world)
        shares = best_visits(world, step_on(world, job.mission.duration_s))
        visited = shares[shares > 0]
        row["visited"], row["whole"] = len(visited), (visited == 1).sum()
        row["best_share"] = visited.mean() if len(visited) else 0.0
        row["complete"], row["gathered"] = _complete(world), gathered(world)
    return told


def _complete(world: World) -> int:
    """How many clusters have all their targets found."""
    clusters = world.scene.targets["cluster"]
    there, found = np.bincount(clusters), np.bincount(clusters, world.found >= 0)
    return int(((there > 0) & (found == there)).sum())


def gathered(world: World) -> int:
    """How many vehicles have targets of one and the same cluster in range now: the most of any cluster."""
    targets = world.scene.targets
    apart = np.hypot(
        world.poses["east"][:, None] - targets["east"], world.poses["north"][:, None] - targets["north"]
    )
    near = apart <= world.fleet["sensor_range"][:, None]
    most = 0
    for cluster in np.unique(targets["cluster"]):
        most = max(most, int(near[:, targets["cluster"] == cluster].any(axis=1).sum()))
    return most


def best_visits(world: World, places: Floats) -> Floats:
    """For each cluster, the largest share of its targets that one vehicle had in range during one visit.

    A visit ends when nothing of the cluster was in range for VISIT_GAP_S.
    """
    targets = world.scene.targets
    period = float(world.rules[0]["period"])
    shares = np.zeros(int(targets["cluster"].max(initial=-1)) + 1)
    for cluster in range(len(shares)):
        rows = targets[targets["cluster"] == cluster]
        for vehicle, reach in enumerate(world.fleet["sensor_range"]):
            track = places[:-1, vehicle]
            low, high = (np.array([bound(rows["east"]), bound(rows["north"])]) for bound in (np.min, np.max))
            ticks = np.flatnonzero(((track >= low - reach) & (track <= high + reach)).all(axis=1))
            apart = np.hypot(track[ticks, None, 0] - rows["east"], track[ticks, None, 1] - rows["north"])
            near = apart <= reach
            there = near.any(axis=1)
            ticks, near = ticks[there], near[there]
            if len(ticks):
                ends = np.flatnonzero(np.diff(ticks) * period > VISIT_GAP_S) + 1
                for part in np.split(near, ends):
                    shares[cluster] = max(shares[cluster], part.any(axis=0).mean())
    return shares
