"""Small worlds for the core's tests: a few vehicles, a few targets, a box for an area."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from swarmctl.core import state
from swarmctl.core.arrays import Floats, Records
from swarmctl.core.world import Fences, World, make_scene, make_settings

Place = tuple[float, float]
Box = tuple[float, float, float, float]  # west, east, south, north

VEHICLE = {
    "speed": 25.0, "acceleration": 4.0, "braking": 4.0, "climb": 3.0, "descent": 2.0,
    "climb_acceleration": 2.0, "altitude": 50.0, "sensor_range": 200.0, "detection_probability": 1.0,
    "radio_range": 600.0, "beacon_contacts": -1, "heading_east": 1.0,
}  # fmt: skip
RULES = {
    "seed": 1, "period": 1.0, "interval": 0.1, "separation": 15.0, "duration": 60.0, "landing_speed": 0.7,
}  # fmt: skip


def edges_of(region: shapely.Geometry) -> Floats:
    """The borders of a polygon, or of several, as edges (E, 4)."""
    rings = [
        ring
        for part in shapely.get_parts(region)
        if part.geom_type == "Polygon"
        for ring in (part.exterior, *part.interiors)
    ]
    corners = [np.asarray(ring.coords) for ring in rings]
    return np.vstack([np.hstack((c[:-1], c[1:])) for c in corners])


def region(area: Box, keep_outs: Sequence[Box] = (), margin: float = 0.0) -> shapely.Geometry:
    """A box less some boxes, ``margin`` metres kept from each border."""
    west, east, south, north = area
    holes = [shapely.box(w - margin, s - margin, e + margin, n + margin) for w, e, s, n in keep_outs]
    inner = shapely.box(west + margin, south + margin, east - margin, north - margin)
    return shapely.difference(inner, shapely.union_all(holes))


def fences(area: Box, keep_outs: Sequence[Box] = (), margin: float = 0.0) -> Fences:
    """The fence as drawn, as planners see it, and, halfway between, as the guard keeps it."""
    raw, guard, plan = (edges_of(region(area, keep_outs, margin * k)) for k in (0.0, 0.5, 1.0))
    return Fences(raw, plan, guard)


def fleet_of(places: Sequence[Place], headings: Sequence[float] = (), **values: Any) -> Records:
    """Vehicles (V,) with pads at ``places``; ``headings`` in degrees from east to north."""
    fleet = np.zeros(len(places), state.VEHICLE)
    for name, value in {**VEHICLE, **values}.items():
        fleet[name] = value
    fleet["pad_east"], fleet["pad_north"] = np.array(places, float).reshape(-1, 2).T
    for row, heading in zip(fleet, headings, strict=False):
        row["heading_east"], row["heading_north"] = direction(heading)
    return fleet


def rules_of(**values: float) -> Records:
    """What holds for a run, (1,) RULES."""
    rules = np.zeros(1, state.RULES)
    for name, value in {**RULES, **values}.items():
        rules[name] = value
    return rules


def direction(degrees: float) -> Place:
    """The unit vector at an angle from east to north, exact for multiples of 90 degrees."""
    exact: dict[float, Place] = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}
    angle = math.radians(degrees)
    return exact.get(degrees % 360) or (math.cos(angle), math.sin(angle))


def world_of(
    algorithm: str, fleet: Records, rules: Records, fence: Fences, targets: Sequence[Place] = (),
    settings: dict[str, float] | None = None,
) -> World:  # fmt: skip
    """A world whose vehicles stand on their pads."""
    places = np.array(targets, float).reshape(-1, 2)
    scene = make_scene(places, np.zeros(len(places), np.int64))
    rules["targets"] = len(places)
    world = World(algorithm, fleet, rules, scene, fence, make_settings(algorithm, settings or {}))
    world.poses["east"], world.poses["north"] = fleet["pad_east"], fleet["pad_north"]
    return world


PER_VEHICLE = ("poses", "memory", "knowledge", "contacts", "has", "told", "reports", "report_count", "wishes")
REST = (
    "alarms", "found", "beacons", "heard", "heard_count", "errands", "paths", "wants", "sent", "setpoints",
    "orders",
)  # fmt: skip


def snapshot(world: World) -> dict[str, bytes]:
    """All of a world that changes, as bytes."""
    return {name: getattr(world, name).tobytes() for name in (*PER_VEHICLE, *REST)}


def restore(world: World, saved: dict[str, bytes]) -> None:
    """Put a world back to what ``snapshot`` saved."""
    for name, data in saved.items():
        array = getattr(world, name)
        array[...] = np.frombuffer(data, array.dtype).reshape(array.shape)
