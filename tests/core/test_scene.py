"""What there is to find, against the reference scenario's description; and the grid it is found through."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.spatial import distance

from swarmctl.core import calls, scene
from swarmctl.core.arrays import Floats, Integers
from swarmctl.core.world import make_scene

from .worlds import Box, edges_of, region

AREA: Box = (0.0, 5000.0, 0.0, 5000.0)
KEEP_OUTS: list[Box] = [(1500.0, 1700.0, 3200.0, 4000.0), (3500.0, 4200.0, 1500.0, 1700.0)]
LEGAL = region(AREA, KEEP_OUTS)
RADIUS = 300.0
SEEDS = range(60)


def centres_of(
    seed: int, area: Box = AREA, count: int = 6, legal: shapely.Geometry = LEGAL, first: Box | None = None
) -> Floats:
    """Cluster centres (count, 2), the launch point in the south-west corner; ``first``: where they are tried first."""
    centres = np.zeros((count, 2))
    starts = np.array([[area[0], area[2]]])
    boxes = np.array([first or area, area])
    calls.place_centres(seed, count, RADIUS, edges_of(legal), boxes, starts, centres)
    return centres


def laid_out(seed: int, centres: Floats, count: int = 450, hot_share: float = 0.4) -> tuple[Floats, Integers]:
    """Places (count, 2) and cluster numbers of the targets."""
    places, clusters = np.zeros((count, 2)), np.zeros(count, np.int64)
    sizes, numbers = np.zeros(len(centres)), np.zeros(len(centres), np.int64)
    calls.lay_out(seed, RADIUS, hot_share, edges_of(LEGAL), centres, sizes, numbers, places, clusters)
    assert numbers.tolist() == np.bincount(clusters, minlength=len(centres)).tolist()
    return places, clusters


def test_centres_keep_their_distances_where_there_is_room() -> None:
    for seed in SEEDS:
        wide = (0.0, 50_000.0, 0.0, 50_000.0)
        centres = centres_of(seed, wide, legal=region(wide))
        assert distance.pdist(centres).min() >= 0.98 * (
            2.4 * RADIUS + 150.0
        )  # the first tries give way by 0.5 % each
        assert np.hypot(*centres.T).min() >= 0.98 * 900.0


def test_centres_lie_in_the_area_and_in_no_keep_out() -> None:
    for seed in SEEDS:
        assert all(LEGAL.contains(shapely.Point(c)) for c in centres_of(seed))


def test_in_the_reference_area_clusters_keep_most_of_their_distance() -> None:
    gaps = [distance.pdist(centres_of(seed)).min() for seed in SEEDS]
    assert np.median(gaps) > 0.9 * 870.0
    assert min(gaps) > 0.5 * 870.0


def test_placing_ends_where_there_is_no_room() -> None:
    narrow = (0.0, 400.0, 0.0, 400.0)
    centres = centres_of(3, narrow, count=12, legal=region(narrow))
    assert ((centres >= 0.0) & (centres <= 400.0)).all()
    assert len(np.unique(centres, axis=0)) == 12


def test_centres_are_drawn_from_the_inner_box_while_it_holds_a_legal_place() -> None:
    inner = (2000.0, 4000.0, 3000.0, 4800.0)
    for seed in range(10):
        x, y = centres_of(seed, first=inner).T
        assert (x.min(), y.min()) > (2000.0, 3000.0)
        assert (x.max(), y.max()) < (4000.0, 4800.0)
    east = centres_of(1, first=(1500.0, 1700.0, 3200.0, 4000.0))  # all of it a keep-out
    assert shapely.contains_xy(LEGAL, east).all()


def test_with_no_legal_place_at_all_they_lie_at_the_start() -> None:
    nowhere = region((9000.0, 9001.0, 9000.0, 9001.0))
    assert (
        centres_of(1, (100.0, 500.0, 100.0, 500.0), legal=nowhere, count=2).tolist() == [[100.0, 100.0]] * 2
    )


def test_centres_fill_the_area() -> None:
    drawn = np.vstack([centres_of(seed) for seed in range(200)])
    quarters, *_ = np.histogram2d(drawn[:, 0], drawn[:, 1], bins=2, range=[[0, 5000], [0, 5000]])
    assert quarters.min() > 0.2 * len(drawn)


def test_no_target_outside_the_area_or_in_a_keep_out() -> None:
    for seed in range(30):
        places, clusters = laid_out(seed, centres_of(seed))
        assert shapely.contains_xy(LEGAL, places).all()
        assert set(clusters) == set(range(6))


def test_no_target_in_a_keep_out_that_covers_half_a_cluster() -> None:
    places, _ = laid_out(4, np.array([[1700.0, 3600.0], [3850.0, 1480.0]]))
    assert shapely.contains_xy(LEGAL, places).all()


def test_larger_clusters_have_more_targets() -> None:
    numbers = []
    for seed in SEEDS:
        _, clusters = laid_out(seed, centres_of(seed), 900)
        numbers += np.bincount(clusters).tolist()
    assert np.mean(numbers) == pytest.approx(150.0)
    assert max(numbers) / min(numbers) < 1.02 * (1.3 / 0.7) ** 3  # R² × U(0.7, 1.3)
    assert np.std(numbers) / 150.0 == pytest.approx(0.38, abs=0.08)


def test_forty_percent_of_every_cluster_lie_in_its_hot_spot() -> None:
    centres = centres_of(2)
    mixed, clusters = laid_out(2, centres)
    hot, _ = laid_out(2, centres, hot_share=1.0)
    even, _ = laid_out(2, centres, hot_share=0.0)
    in_spot, spread = (mixed == hot).all(axis=1), (mixed == even).all(axis=1)
    assert (in_spot != spread).all()
    for k in range(6):
        mine = clusters == k
        assert in_spot[mine].sum() == round(0.4 * mine.sum())


def test_a_hot_spot_is_a_gaussian_off_the_centre() -> None:
    offsets, widths = [], []
    for seed in range(40):
        centre = np.array([[2500.0, 2500.0]])
        places, _ = laid_out(seed, centre, 400, hot_share=1.0)
        offsets.append(np.hypot(*(places.mean(axis=0) - centre[0])))
        widths.append(places.std(axis=0))
        assert stats.kstest(stats.zscore(places[:, 0]), "norm").pvalue > 1e-5
    widths_m = np.array(widths)
    assert widths_m.mean() == pytest.approx(0.3 * RADIUS, rel=0.1)
    assert 0.3 * 0.7 * RADIUS * 0.85 < widths_m.min() < widths_m.max() < 0.3 * 1.3 * RADIUS * 1.15
    assert max(offsets) < 0.5 * 1.3 * RADIUS * 1.1
    assert np.mean(offsets) == pytest.approx(0.25 * RADIUS, rel=0.25)


def test_an_outline_is_a_star_of_the_cluster_radius() -> None:
    centre = np.array([[2500.0, 2500.0]])
    means = []
    for seed in range(12):
        places, _ = laid_out(seed, centre, 6000, hot_share=0.0)
        dx, dy = (places - centre[0]).T
        away, angle = np.hypot(dx, dy), np.arctan2(dy, dx)
        sector = ((angle + np.pi) / (2.0 * np.pi) * 60.0).astype(int) % 60
        outline = np.array([away[sector == k].max() for k in range(60)])
        assert outline.max() < 1.3 * RADIUS * (1.0 + 0.35 + 0.25 + 0.15)
        assert outline.max() / outline.min() > 1.1  # no circle
        means.append(outline.mean())
        # Evenly filled from the centre to the outline: (r / outline)² is uniform.
        share = (away / outline[sector]) ** 2
        assert np.quantile(share, [0.25, 0.5, 0.75]) == pytest.approx([0.25, 0.5, 0.75], abs=0.08)
    assert 0.7 * RADIUS < min(means) < max(means) < 1.4 * RADIUS
    assert np.mean(means) == pytest.approx(RADIUS, rel=0.15)


def test_a_layout_depends_on_its_seed_alone() -> None:
    first = laid_out(7, centres_of(7))
    laid_out(8, centres_of(8))
    again = laid_out(7, centres_of(7))
    assert first[0].tobytes() == again[0].tobytes()
    assert not np.isin(laid_out(8, centres_of(8))[0], first[0]).any()


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-5e3, 5e3), st.floats(-5e3, 5e3)), max_size=60),
    st.floats(1.0, 2000.0),
)
def test_the_grid_holds_every_target_once_in_its_own_cell(
    spots: list[tuple[float, float]], cell: float
) -> None:
    places = np.array(spots).reshape(-1, 2)
    made = make_scene(places, np.arange(len(places)), reach_m=cell)
    sorted_places = np.column_stack((made.targets["east"], made.targets["north"]))
    assert sorted(made.targets["cluster"]) == list(range(len(places)))
    assert (sorted_places == places[made.targets["cluster"]]).all()
    first = made.starts[:, 0]
    assert first[0] == 0
    assert first[-1] == len(places)
    for c in range(len(first) - 1):
        for x, y in sorted_places[first[c] : first[c + 1]]:
            assert scene.cell_of(made.grid, x, y) == c
