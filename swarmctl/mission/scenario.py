"""From a mission and a seed to the arrays that fly: the one way a World comes about.

A :class:`Scenario` keeps what all runs of a mission share (regions, the vehicles); :meth:`Scenario.world` adds
what a seed draws: where targets lie and on which headings vehicles start.
"""

import math
from functools import cached_property

import numpy as np

from swarmctl.core import calls, state
from swarmctl.core.arrays import Floats, Records
from swarmctl.core.world import Fences, Motion, Scene, World, make_scene, make_settings

from . import geometry, launch, pads
from .model import Mission, Radio, Vehicle

CLIMB_MPS = 3.0  # the stub's vertical limits, those of a middling multicopter
DESCENT_MPS = 2.0
CLIMB_ACCELERATION_MPS2 = 2.0
LANDING_MPS = 0.7
WANDER_SHARE = 0.15  # of the cluster radius: how far a wandering target swings to each side
DRIFT_SHARE = 2.0  # of the cluster radius: how far a drifting cluster goes to each side, where there is room
BEACON_BYTES, CONTACT_BYTES = 40, 16  # what a beacon and each contact in it take on a limited radio


class Scenario:
    """Everything about a mission that no seed changes.

    ``ideal``: x += v dt, no margin, no guard, a corner launch being one point on the border; else a multicopter
    under guard.
    ``stands`` (V, 2) replaces the mission's pads: where vehicles were found standing.
    """

    def __init__(self, mission: Mission, *, ideal: bool, stands: Floats | None = None) -> None:
        self.mission = mission
        self.ideal = ideal
        self.regions = geometry.regions(mission)
        self._stands = stands

    @cached_property
    def starts(self) -> Floats:
        """Where each vehicle starts, (V, 2)."""
        if self.ideal and self.mission.launch in ("corner", "as_found"):
            return np.tile(launch.ideal_start(self.regions), (len(self.mission.fleet), 1))
        if self._stands is not None:
            return self._stands
        named = pads.launch_pads(self.mission)
        if named is not None:
            return named
        # As found, but nobody was looked for: stubs stand where a corner launch would put them.
        count, margin = len(self.mission.fleet), self.mission.safety.fence_margin_m
        return pads.corner_pads(self.regions, count, self.mission.spacing_m, margin)

    @cached_property
    def fences(self) -> Fences:
        """The fence as drawn, as planners see it, and as the guard keeps it."""
        r = self.regions
        return Fences(r.raw, r.raw if self.ideal else r.plan, r.guard)

    @cached_property
    def _standing(self) -> Records:
        """The vehicles (V,) VEHICLE on their pads, without headings."""
        fleet = np.zeros(len(self.mission.fleet), state.VEHICLE)
        for row, vehicle in zip(fleet, self.mission.fleet, strict=True):
            _describe(row, vehicle, self.mission)
        fleet["pad_east"], fleet["pad_north"] = self.starts.T
        return fleet

    def fleet(self, seed: int) -> Records:
        """The vehicles (V,) VEHICLE, with this seed's initial headings."""
        fleet = self._standing.copy()
        headings = launch.draw_headings(self._opening, len(fleet), seed)
        # Those spread all over the area are not in each other's way, and handing out thousands takes minutes.
        if not self.ideal and self.mission.launch != "spread":
            headings = launch.uncross(self.starts, headings)
        fleet["heading_east"], fleet["heading_north"] = np.cos(headings), np.sin(headings)
        return fleet

    @cached_property
    def _kept_clear(self) -> Floats:
        """Where clusters keep off, (S, 2): launch points, but not those all over the area."""
        return np.ascontiguousarray(self.starts[:1] if self.mission.launch == "spread" else self.starts)

    @cached_property
    def _opening(self) -> tuple[float, float]:
        return launch.opening(self.mission, self.regions, self.starts)

    @cached_property
    def _rules(self) -> Records:
        """What holds for all runs, (1,) RULES."""
        mission = self.mission
        period = mission.planner.period_s
        rules = np.zeros(1, state.RULES)
        row = rules[0]
        row["period"], row["interval"] = period, 1.0 / mission.setpoints.rate_hz
        row["separation"], row["duration"] = mission.safety.separation_m, mission.duration_s
        row["metric"], row["ideal"] = mission.planner.terms == "metric", self.ideal
        row["radio_delay"] = math.ceil(mission.radio.delay_s / period - 1e-9)
        row["alarm_slots"] = max(_alarm_slots(v, mission.duration_s) for v in mission.fleet)
        row["landing_speed"] = LANDING_MPS
        row["wire"] = mission.observations == "wire"
        row["origin_lat"], row["origin_lon"], row["origin_alt"] = (
            mission.origin.lat, mission.origin.lon, mission.origin.alt_m,
        )  # fmt: skip
        row["wind_east"], row["wind_north"] = mission.stub.wind_mps
        return rules

    def rules(self, seed: int, targets: int) -> Records:
        """What holds for the whole run, (1,) RULES."""
        rules = self._rules.copy()
        rules["seed"], rules["targets"] = seed, targets
        return rules

    @cached_property
    def _sees_furthest_m(self) -> float:
        return max(vehicle.sensor.range_m for vehicle in self.mission.fleet)

    def scene(self, seed: int) -> Scene:
        """What there is to find with this seed."""
        wanted = self.mission.targets
        places, clusters = self._placed() if wanted.positions_m is not None else self._drawn(seed)
        motion = Motion(
            seed,
            WANDER_SHARE * wanted.radius_m if wanted.motion == "wander" else 0.0,
            wanted.wander_mps,
            DRIFT_SHARE * wanted.radius_m if wanted.cluster_motion == "drift" else 0.0,
            wanted.cluster_mps,
            self.regions.raw,
        )
        return make_scene(places, clusters, motion, self._sees_furthest_m)

    def world(self, seed: int, algorithm: str | None = None, again: World | None = None) -> World:
        """All arrays of one run, vehicles standing at their start.

        ``again`` is a world of this scenario and algorithm that is not needed any more: its arrays are used again.
        """
        name = algorithm or self.mission.planner.algorithm
        scene = self.scene(seed)
        fleet, rules = self.fleet(seed), self.rules(seed, len(scene.targets))
        if again is None:
            world = World(name, fleet, rules, scene, self.fences, self.settings(name))
        else:
            world = again
            world.restart(fleet, rules, scene)
        for poses in (world.truth, world.poses):
            poses["east"], poses["north"] = self.starts.T
        return world

    def settings(self, algorithm: str) -> Records:
        """An algorithm's parameters, (1,): as the mission gives them, the others at their defaults."""
        return make_settings(algorithm, self.mission.planner.parameters.get(algorithm, {}))

    def _placed(self) -> tuple[Floats, np.ndarray[tuple[int], np.dtype[np.int64]]]:
        places = np.array(self.mission.targets.positions_m, dtype=float).reshape(-1, 2)
        return places, np.zeros(len(places), np.int64)

    def _drawn(self, seed: int) -> tuple[Floats, np.ndarray[tuple[int], np.dtype[np.int64]]]:
        wanted = self.mission.targets
        low, high = self.regions.border.min(axis=0), self.regions.border.max(axis=0)
        # Centres lie a radius inside the area where it is wide enough, so that clusters are not cut in half.
        inset = np.minimum(wanted.radius_m, (high - low) / 4.0)
        whole = np.array([low[0], high[0], low[1], high[1]])
        shrink = np.array([inset[0], -inset[0], inset[1], -inset[1]])
        box = np.stack((whole + shrink, whole))
        centres = np.zeros((wanted.clusters, 2))
        places, clusters = np.zeros((wanted.count, 2)), np.zeros(wanted.count, np.int64)
        calls.place_centres(
            seed,
            wanted.clusters,
            wanted.radius_m,
            self.regions.raw,
            box,
            self._kept_clear,
            centres,
        )
        calls.lay_out(
            seed, wanted.radius_m, wanted.hot_spot_share, self.regions.raw, centres,
            np.zeros(wanted.clusters), np.zeros(wanted.clusters, np.int64), places, clusters,
        )  # fmt: skip
        return places, clusters


def _describe(row: np.void, vehicle: Vehicle, mission: Mission) -> None:
    """Fill one VEHICLE record with what the mission says of it."""
    acceleration = mission.safety.max_acceleration_mps2
    row["speed"], row["altitude"] = vehicle.speed_mps, vehicle.altitude_m
    row["acceleration"] = row["braking"] = acceleration
    row["climb"], row["descent"] = CLIMB_MPS, DESCENT_MPS
    row["climb_acceleration"] = CLIMB_ACCELERATION_MPS2
    sensor, radio = vehicle.sensor, vehicle.radio
    row["sensor_range"], row["detection_probability"] = sensor.range_m, sensor.detection_probability
    row["alarms_per_second"] = sensor.false_alarms_per_hour / 3600.0
    row["position_noise"] = sensor.position_noise_m
    row["radio_range"], row["radio_loss"] = radio.range_m, radio.loss
    row["beacon_contacts"] = _contacts_a_beacon(radio, mission.planner.period_s)


def _contacts_a_beacon(radio: Radio, period: float) -> int:
    """How many contacts fit a beacon; -1: all."""
    if radio.bandwidth_bps is None:
        return -1
    return max(0, int((radio.bandwidth_bps * period / 8.0 - BEACON_BYTES) // CONTACT_BYTES))


def _alarm_slots(vehicle: Vehicle, duration: float) -> int:
    """Serial numbers set aside for one vehicle's false alarms: twice what is expected, and some."""
    rate = vehicle.sensor.false_alarms_per_hour / 3600.0
    return math.ceil(2.0 * rate * duration) + 20 if rate > 0.0 else 0
