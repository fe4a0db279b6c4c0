"""Searches flown step by step: the same as whole runs, and the moments that figures show are real."""

import numpy as np
import pytest

from swarmctl.core.arrays import Floats
from swarmctl.mission.scenario import Scenario
from swarmctl.study import paper_scenes as scenes
from swarmctl.study.paper_census import CENSUS, best_visits, census, gathered
from swarmctl.study.paper_paths import fly_search, step_on
from swarmctl.study.paper_scenes import APART_S, Moment, turned
from swarmctl.study.paper_variants import Variant, ace, fco, many, mdc, silent
from swarmctl.study.runs import Job, simulate

from ..core.worlds import fences, fleet_of, rules_of, world_of


@pytest.mark.parametrize("flown", [mdc(), fco(), ace(), many()], ids=["mdc", "fco", "ace", "nine"])
def test_a_search_by_steps_is_the_whole_run_bit_for_bit(flown: Variant) -> None:
    whole = Scenario(flown.mission(), ideal=True).world(3)
    whole.run_ideal()
    stepped = fly_search(flown, 3, 1600)
    assert stepped.world.found.tobytes() == whole.found.tobytes()
    assert stepped.world.poses.tobytes() == whole.poses.tobytes()
    assert stepped.places.shape == (1601, len(whole.fleet), 2)
    assert stepped.places[-1, :, 0].tolist() == whole.poses["east"].tolist()


def test_without_radio_nobody_hears_anybody() -> None:
    told = scenes.Heard()
    fly_search(silent(fco()), 1, 100, told)
    after_launch = told.by_tick[1:]  # before, all stand at one point
    assert not any(hearers for tick in after_launch for hearers in tick)


def straight(vehicles: int, ticks: int) -> Floats:
    """Tracks straight north, 100 m apart."""
    places = np.zeros((ticks + 1, vehicles, 2))
    places[..., 0] = 100.0 * np.arange(vehicles)
    places[..., 1] = 25.0 * np.arange(ticks + 1)[:, None]
    return places


def test_a_turn_by_radio_is_where_the_tracks_part() -> None:
    alone = straight(3, 200)
    spoken = alone.copy()
    spoken[101:, 1, 0] += 25.0 * np.arange(1, 101)  # vehicle 1 turns east at tick 100
    spoken[101:, 1, 1] = spoken[100, 1, 1]
    nobody: list[list[list[int]]] = [[[], [], []] for _ in range(200)]
    all_hear = [[[1, 2], [0, 2], [0, 1]] for _ in range(200)]
    assert turned(spoken, alone, all_hear) == Moment(100, 1, 0)
    assert turned(spoken, alone, nobody) is None
    assert turned(alone, alone, all_hear) is None
    early = alone.copy()
    early[APART_S - 10 :, 1, 0] += 500.0
    assert turned(early, alone, all_hear) is None


def test_a_small_bend_is_no_turn() -> None:
    alone = straight(2, 200)
    spoken = alone.copy()
    spoken[101:, 1, 0] += 5.0 * np.arange(1, 101)
    assert turned(spoken, alone, [[[1], [0]] for _ in range(200)]) is None


def test_scenes_show_what_their_captions_say() -> None:
    without, with_radio = scenes.mdc_scenes(1)
    assert without.search.seed == with_radio.search.seed
    assert len(with_radio.moments) >= 2
    assert "is drawn to the best place of" in with_radio.caption
    without, with_radio = scenes.fco_scenes(1)
    (moment,) = with_radio.moments
    before, after = slice(None, moment.tick + 1), moment.tick + 1
    vehicle = moment.vehicle
    assert (without.search.places[before, vehicle] == with_radio.search.places[before, vehicle]).all()
    assert (without.search.places[after, vehicle] != with_radio.search.places[after, vehicle]).any()
    pair = with_radio.search.places[moment.tick, [vehicle, moment.other]]
    assert np.hypot(*(pair[1] - pair[0])) <= 600.0
    assert f"vehicle {vehicle + 1} hears vehicle {moment.other + 1}" in with_radio.caption
    mowing = scenes.ace_scene(1)
    (moment,) = mowing.moments
    assert f"so {moment.vehicle + 1} leaves" in mowing.caption


def test_what_happens_on_no_seed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scenes, "SEARCHED", 0)
    for scene in (*scenes.mdc_scenes(5), *scenes.fco_scenes(5), scenes.nine_scene(5), scenes.ace_scene(5)):
        assert scene.search.seed == 5
        assert scene.moments == ()
    assert "happened on none of 200" in scenes.ace_scene(5).caption


def test_a_visit_counts_what_one_vehicle_saw_before_it_went_away() -> None:
    targets = [(1000.0, 0.0), (1000.0, 500.0), (5000.0, 0.0)]
    fence = fences((-9000.0, 9000.0, -9000.0, 9000.0))
    world = world_of("bounce", fleet_of([(0.0, 0.0), (0.0, 0.0)]), rules_of(), fence, targets)
    world.scene.targets["cluster"] = world.scene.targets["east"] > 3000
    places = np.full((401, 2, 2), -5000.0)
    places[10:20, 0] = (1000.0, 0.0)  # sees one of the first cluster's two
    places[25:30, 0] = (1000.0, 500.0)  # and, on the same visit, the other
    places[200:210, 1] = (5000.0, 0.0)
    assert best_visits(world, places).tolist() == [1.0, 1.0]
    places[25:30, 0] = -5000.0
    places[125:130, 0] = (1000.0, 500.0)  # too late for the same visit
    assert best_visits(world, places).tolist() == [0.5, 1.0]


def test_gathered_are_those_at_one_cluster() -> None:
    fence = fences((-9000.0, 9000.0, -9000.0, 9000.0))
    starts = [(0.0, 0.0), (100.0, 0.0), (3000.0, 0.0), (0.0, 3000.0)]
    world = world_of(
        "bounce", fleet_of(starts), rules_of(), fence, [(0.0, 150.0), (3000.0, 100.0), (3000.0, -100.0)]
    )
    world.scene.targets["cluster"] = world.scene.targets["east"] > 2000
    assert gathered(world) == 2


def test_a_census_agrees_with_the_run() -> None:
    mission = ace().mission()
    told = census(Job(mission, "ace", (1, 2)))
    runs = simulate(Job(mission, "ace", (1, 2)))
    assert told.dtype == CENSUS
    assert (told["visited"] == 6).all()
    assert (told["whole"] <= told["complete"]).all()
    assert ((told["complete"] == 6) == (runs["final_fraction"] == 1)).all()
    assert ((told["best_share"] > 0.5) & (told["best_share"] <= 1)).all()


def test_steps_take_the_planners_period() -> None:
    mission = fco().mission()
    slow = mission.model_copy(update={"planner": mission.planner.model_copy(update={"period_s": 2.0})})
    world = Scenario(slow, ideal=True).world(1)
    assert len(step_on(world, 60.0)) == 31
