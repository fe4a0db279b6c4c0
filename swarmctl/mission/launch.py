"""Where vehicles start, and on which heading.

Headings are drawn evenly from a quarter turn that looks into the area (the paper's [0, π/2] from the corner of
a rectangle), from the whole circle where vehicles start in the open.  They are handed out so that no two rays
cross: the assignment of pads to far points on the rays with the least total length has no crossing.
"""

import math

import numpy as np
import shapely
from scipy.optimize import linear_sum_assignment

from swarmctl.core.arrays import Floats
from swarmctl.core.calls import uniforms
from swarmctl.core.randoms import LAUNCH

from .geometry import Regions
from .model import Mission, VehicleGroup, Vehicles

FAR_M = 1e6


def as_found(mission: Mission) -> Mission:
    """The mission with real vehicles: launched where they stand, unless it says where."""
    vehicles = mission.vehicles
    each = (vehicles,) if isinstance(vehicles, VehicleGroup) else vehicles
    if any("launch" in one.model_fields_set for one in each):
        return mission
    return _each(mission, launch="as_found")


def flown_by(mission: Mission, autopilot: str) -> Mission:
    """The mission with every vehicle of one autopilot, which stubs play, or (``auto``) of any."""
    if autopilot != "auto":
        stub = mission.stub.model_copy(update={"autopilot": autopilot})
        mission = mission.model_copy(update={"stub": stub})
    return _each(mission, autopilot=autopilot)


def _each(mission: Mission, **update: str) -> Mission:
    """The mission with something the same for every vehicle."""
    vehicles = mission.vehicles
    if isinstance(vehicles, VehicleGroup):
        changed: Vehicles = vehicles.model_copy(update=update)
    else:
        changed = tuple(one.model_copy(update=update) for one in vehicles)
    copy = mission.model_copy(update={"vehicles": changed})
    copy.__dict__.pop("fleet", None)  # worked out from the vehicles, and copied with them
    return copy


def ideal_start(regions: Regions) -> Floats:
    """Where all vehicles start in ideal dynamics, (2,): the corner of the border that lies south-west most."""
    corner: Floats = regions.border[np.argmin(regions.border.sum(axis=1))]
    return corner


def draw_headings(opening: tuple[float, float], count: int, seed: int) -> Floats:
    """Initial headings (count,) in radians from east, one drawn for each vehicle from an :func:`opening`."""
    draws = np.empty(count)
    uniforms(seed, LAUNCH, draws)
    first, width = opening
    return first + width * draws


def opening(mission: Mission, regions: Regions, starts: Floats) -> tuple[float, float]:
    """The first heading and the width of the range that headings are drawn from, vehicles at ``starts`` (V, 2)."""
    if mission.launch != "corner":
        return 0.0, 2.0 * math.pi
    if mission.area.size_m is not None:
        return 0.0, math.pi / 2.0
    centre = shapely.Polygon(regions.border).centroid
    east, north = starts.mean(axis=0)
    return math.atan2(centre.y - north, centre.x - east) - math.pi / 4.0, math.pi / 2.0


def uncross(pads: Floats, headings: Floats) -> Floats:
    """The same headings (V,), handed out to ``pads`` (V, 2) so that the rays do not cross."""
    far = FAR_M * np.column_stack((np.cos(headings), np.sin(headings)))
    # |far - pad| less its common part: what is left keeps its digits.
    lengths = np.sqrt(((pads[:, None] - far[None]) ** 2).sum(axis=2)) - FAR_M
    _, order = linear_sum_assignment(lengths)
    handed: Floats = headings[order]
    return handed
