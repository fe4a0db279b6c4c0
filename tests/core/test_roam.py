"""How targets move: within their bounds, no faster than they may, each seed its own way."""

import numpy as np
import pytest
import shapely

from swarmctl.core import roam
from swarmctl.core.arrays import Floats
from swarmctl.core.world import Motion, Scene, make_scene

from .worlds import Box, edges_of, region

AREA: Box = (0.0, 2000.0, 0.0, 1500.0)
LEGAL = region(AREA, [(700.0, 900.0, 500.0, 1000.0)])
RAW = edges_of(LEGAL)
CENTRES = np.array([[300.0, 300.0], [1500.0, 1000.0], [1100.0, 300.0]])
CLUSTERS = np.repeat([0, 1, 2], 30)
TIMES = np.arange(0.0, 3600.0, 5.0)


def homes(seed: int = 0) -> Floats:
    """Where 90 targets (90, 2) are laid out: three clusters in an area with a keep-out in its middle."""
    return CENTRES[CLUSTERS] + np.random.default_rng(seed).uniform(-90.0, 90.0, (90, 2))


def scene_of(seed: int = 1, **values: float) -> Scene:
    """Those targets, moving as said."""
    return make_scene(homes(), CLUSTERS, Motion(seed, raw=RAW, **values))


def tracks(scene: Scene, times: Floats = TIMES) -> Floats:
    """Where every target is at each time (T, times, 2)."""
    count = len(scene.targets)
    return np.array(
        [[roam.place_at(scene.grid, scene.targets, t, now) for now in times] for t in range(count)]
    )


def places(scene: Scene) -> Floats:
    """Each target's place in its record, (T, 1, 2)."""
    return np.column_stack((scene.targets["east"], scene.targets["north"]))[:, None]


def test_a_wandering_target_stays_about_its_place_uses_its_room_and_keeps_its_speed() -> None:
    scene = scene_of(wander_m=45.0, wander_mps=1.5)
    track = tracks(scene)
    off = np.abs(track - places(scene)).max(axis=1)
    assert off.max() <= 45.0
    assert off.min() >= 0.95 * 45.0
    speed = np.hypot(*np.diff(track, axis=1).T) / 5.0
    assert speed.max() <= 1.5 + 1e-9
    assert speed.max() > 0.97 * 1.5


def test_wandering_targets_go_their_own_ways_and_still_ones_stay() -> None:
    track = tracks(scene_of(wander_m=45.0))
    assert np.hypot(*np.ptp(track - track[:1], axis=1)[1:].T).min() > 20.0
    still = scene_of()
    assert (tracks(still) == places(still)).all()
    assert still.grid["stray"].tolist() == [0.0]


def test_a_drifting_cluster_starts_where_it_was_laid_out_and_keeps_together_at_its_speed() -> None:
    scene = scene_of(drift_m=400.0, drift_mps=2.0)
    moved = tracks(scene) - places(scene)
    assert np.abs(moved[:, 0]).max() < 1e-9
    for k in range(3):
        mine = moved[scene.targets["cluster"] == k]
        assert np.ptp(mine, axis=0).max() < 1e-9
        steps = np.hypot(*np.diff(mine[0], axis=0).T) / 5.0
        assert steps.max() <= 2.0 + 1e-9
        assert np.median(steps) == pytest.approx(2.0)  # but at its ends, where it turns
        assert np.hypot(*mine[0].T).max() > 100.0
        assert np.linalg.matrix_rank(mine[0], tol=1e-6) == 1  # a straight way


@pytest.mark.parametrize("seed", range(12))
def test_no_drifting_target_leaves_the_area_enters_a_keep_out_or_goes_too_far(seed: int) -> None:
    scene = make_scene(homes(seed), CLUSTERS, Motion(seed, drift_m=400.0, drift_mps=4.0, raw=RAW))
    track = tracks(scene)
    assert shapely.contains_xy(LEGAL, *track.reshape(-1, 2).T).all()
    assert np.hypot(*(track - places(scene)).T).max() <= 400.0 + 1e-9
    assert scene.grid[0]["stray"] <= 400.0
    assert (scene.grid["ahead"] + scene.grid["behind"]).min() > 100.0


def test_where_there_is_no_room_a_cluster_stays() -> None:
    walls = np.array([[100.0, -50.0], [100.0, 50.0]])
    narrow = region((99.5, 100.5, -50.5, 50.5))
    scene = make_scene(walls, np.zeros(2, np.int64), Motion(3, drift_m=400.0, raw=edges_of(narrow)))
    assert (tracks(scene) == places(scene)).all()


@pytest.mark.parametrize(
    "motion", [{"wander_m": 45.0}, {"drift_m": 400.0}, {"wander_m": 45.0, "drift_m": 400.0}]
)
def test_motion_is_a_function_of_seed_and_time_alone(motion: dict[str, float]) -> None:
    scene = scene_of(4, **motion)
    forward = tracks(scene)
    backward = tracks(scene, TIMES[::-1])[:, ::-1]
    assert forward.tobytes() == backward.tobytes() == tracks(scene_of(4, **motion)).tobytes()
    apart = np.hypot(*(forward - tracks(scene_of(5, **motion))).T)
    furthest = apart.max(axis=0)
    assert furthest.min() > 1.0  # another seed is another way for everyone
    assert np.median(furthest) > 60.0


def test_both_motions_add_up_and_stray_bounds_them() -> None:
    both = scene_of(wander_m=45.0, drift_m=300.0)
    wander, drift = tracks(scene_of(wander_m=45.0)), tracks(scene_of(drift_m=300.0))
    assert tracks(both) == pytest.approx(wander + drift - places(both))
    assert np.hypot(*(tracks(both) - places(both)).T).max() <= both.grid[0]["stray"]
