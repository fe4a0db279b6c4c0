"""What two keys of a mission can get wrong together: fences, launch points, counts, periods.

Each check takes a mission whose single keys are right and whose files are inlined, and yields findings.  It
names the keys that it reads, so that it is left out where one of them is already known to be wrong: one
mistake is reported once, and independent mistakes all at once.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from . import geometry, pads
from .errors import Finding, KeyPath
from .geometry import Floats
from .model import WIDEST_M, Mission, VehicleGroup

SHAPES = ("size_m", "polygon", "polygon_m")
SMALLEST_M2 = {"fence": 1.0, "keep-out": 1e-6}
MOST_FINDINGS = 20
"""From one check: a list of a thousand launch points may be wrong a thousand times."""


def find(mission: Mission, wrong: Iterable[KeyPath]) -> list[Finding]:
    """What all checks find that do not depend on a key already ``wrong``."""
    bad = {_keys(path) for path in wrong}
    found: list[Finding] = []
    for check in CHECKS:
        if not any(_touch(need, path) for need in check.reads for path in bad):
            new = list(islice(check.run(mission), MOST_FINDINGS))
            # Nothing can be said of places on ground that is wrong; the other checks stand side by side.
            bad |= {_keys(finding.path) for finding in new if finding.path[0] != "vehicles"}
            found += new
    return found


def _keys(path: KeyPath) -> KeyPath:
    """The path without its numbers: the place in any entry of a list."""
    return tuple(part for part in path if isinstance(part, str))


def _touch(one: KeyPath, other: KeyPath) -> bool:
    """Whether one path is the other or leads through it."""
    length = min(len(one), len(other))
    return one[:length] == other[:length]


def _area(mission: Mission) -> Iterator[Finding]:
    yield from _shape(geometry.border_m(mission), _area_path(mission), "fence")


def _area_path(mission: Mission) -> tuple[str, str]:
    return "area", next(key for key in SHAPES if getattr(mission.area, key) is not None)


def _keep_outs(mission: Mission) -> Iterator[Finding]:
    for k, item in enumerate(mission.keep_out):
        yield from _shape(geometry.keep_out_m(item, mission.origin), ("keep_out", k), "keep-out")


def _shape(corners: Floats, path: KeyPath, what: str) -> Iterator[Finding]:
    far = float(np.abs(corners).max())
    polygon = shapely.Polygon(corners)
    if far > WIDEST_M:
        yield Finding(path, f"reaches {far / 1000:.0f} km from the origin", "put the origin beside the area")
    elif "Self-intersection" in (reason := shapely.is_valid_reason(polygon)):
        place = reason.partition("[")[2].rstrip("]").replace(" ", ", ")
        message = f"the {what} crosses itself at [{place}] m east, north of the origin"
        yield Finding(path, message, "give its corners in order, going round")
    elif not polygon.is_valid or polygon.area <= SMALLEST_M2[what]:
        yield Finding(path, f"the {what} encloses nothing", "its corners must not lie on one line")


def _margin(mission: Mission) -> float:
    return 0.0 if mission.dynamics == "ideal" else mission.safety.fence_margin_m


def _parts(region: BaseGeometry) -> int:
    """How many pieces a region has, the crumbs of rounding left out."""
    return int(np.count_nonzero(shapely.area(shapely.get_parts(region)) > 1e-6))


def _legal(mission: Mission) -> Iterator[Finding]:
    margin = _margin(mission)
    region = geometry.grown(geometry.border_m(mission), -margin)
    if _parts(region) != 1:
        what = "cuts the area in parts" if _parts(region) else "leaves nothing of the area"
        given = "fence_margin_m" in mission.safety.model_fields_set
        hint = "it is kept from every side: it must be less than half of the area's narrowest width"
        path = ("safety", "fence_margin_m") if given else _area_path(mission)
        yield Finding(path, f"a fence margin of {margin:g} m {what}", hint)
        return
    for k, item in enumerate(mission.keep_out):
        zone = geometry.grown(geometry.keep_out_m(item, mission.origin), margin)
        region = shapely.difference(region, zone)
        if _parts(region) != 1:
            what = "cuts the area in parts" if _parts(region) else "leaves nothing of the area to fly in"
            hint = "make it smaller, move it, or lower safety.fence_margin_m"
            yield Finding(("keep_out", k), f"with {margin:g} m kept from it, {what}", hint)
            return


def _launch_points(mission: Mission) -> list[tuple[KeyPath, tuple[float, float]]]:
    if isinstance(mission.vehicles, VehicleGroup):
        launch = mission.vehicles.launch
        points = () if isinstance(launch, str) else launch
        return [(("vehicles", "launch", k), point) for k, point in enumerate(points)]
    entries = enumerate(mission.vehicles)
    return [(("vehicles", k, "launch"), e.launch) for k, e in entries if not isinstance(e.launch, str)]


def _launch(mission: Mission) -> Iterator[Finding]:
    regions = geometry.regions(mission, _margin(mission))
    shapely.prepare(regions.legal)
    for path, point in _launch_points(mission):
        if not regions.legal.covers(shapely.Point(point)):
            yield Finding(path, f"{list(point)} is {_whereabouts(regions, point)}", "move the launch point")


def _whereabouts(regions: geometry.Regions, point: tuple[float, float]) -> str:
    place = shapely.Point(point)
    for k, corners in enumerate(regions.keep_outs):
        if shapely.Polygon(corners).covers(place):
            return f"inside keep_out[{k}]"
    if not shapely.Polygon(regions.border).covers(place):
        return "outside the area"
    return "nearer than safety.fence_margin_m to the fence or to a keep-out"


def _placing(mission: Mission) -> Iterator[Finding]:
    """Whether a corner launch, or a spread one, has room."""
    if mission.launch not in ("corner", "spread") or mission.dynamics == "ideal":
        return
    path: KeyPath = ("vehicles", "launch") if isinstance(mission.vehicles, VehicleGroup) else ("vehicles",)
    try:
        pads.launch_pads(mission)
    except ValueError as error:
        hint = "lower spacing_m, move what is in the way, or name the pads: launch: [[east, north], ...]"
        yield Finding(path, f"{mission.launch}: {error}", hint)


def _separation(mission: Mission) -> Iterator[Finding]:
    limit = mission.safety.separation_m
    if mission.dynamics == "ideal":
        return
    if mission.launch == "corner" and mission.spacing_m < limit and len(mission.fleet) > 1:
        message = f"{mission.spacing_m:g} m is less than safety.separation_m, {limit:g} m"
        yield Finding(("vehicles", "spacing_m"), message, "put the pads further apart")
    points = _launch_points(mission)
    for k, other, distance in _too_near(np.array([point for _, point in points]).reshape(-1, 2), limit):
        message = f"{distance:.1f} m from launch point {other}, nearer than safety.separation_m, {limit:g} m"
        yield Finding(points[k][0], message, "put them further apart")


def _observations(mission: Mission) -> Iterator[Finding]:
    if mission.observations == "wire" and mission.dynamics == "ideal":
        message = "ideal points send no messages that could round what is seen"
        yield Finding(("observations",), message, "leave dynamics out, or say multicopter")


def _too_near(points: Floats, limit: float) -> Iterator[tuple[int, int, float]]:
    """Points whose nearest neighbour is nearer than ``limit``: the later, the earlier, their distance."""
    if len(points) < 2:
        return
    distances, neighbours = cKDTree(points).query(points, k=2)
    seen = set()
    for k in np.flatnonzero(distances[:, 1] < limit):
        # Of two points in one place either may come first.
        other = neighbours[k, 1] if neighbours[k, 0] == k else neighbours[k, 0]
        pair = max(int(k), int(other)), min(int(k), int(other))
        if pair not in seen:
            seen.add(pair)
            yield *pair, float(distances[k, 1])


def _fleet(mission: Mission) -> Iterator[Finding]:
    vehicles, count = mission.vehicles, len(mission.fleet)
    if isinstance(vehicles, VehicleGroup):
        if not isinstance(vehicles.launch, str) and len(vehicles.launch) != count:
            message = f"{len(vehicles.launch)} launch points for {count} vehicles"
            yield Finding(("vehicles", "launch"), message, "give each vehicle one, or change vehicles.count")
    else:
        kinds = [entry.launch if isinstance(entry.launch, str) else "a point" for entry in vehicles]
        for k, kind in enumerate(kinds):
            if kind != kinds[0]:
                message = f"is {kind}, but {kinds[0]} for the first vehicle"
                yield Finding(("vehicles", k, "launch"), message, "launch all vehicles in one way")


def _minimum(mission: Mission) -> Iterator[Finding]:
    least, count = mission.safety.minimum_vehicles, len(mission.fleet)
    if least > count:
        yield Finding(("safety", "minimum_vehicles"), f"{least}, but there are {count} vehicles", "lower it")


def _targets(mission: Mission) -> Iterator[Finding]:
    if not mission.targets.positions_m:
        return
    points = np.array(mission.targets.positions_m)
    inside = shapely.covers(shapely.Polygon(geometry.border_m(mission)), shapely.points(points))
    for k in np.flatnonzero(~inside):
        message = f"target {k} at {[round(float(x), 1) for x in points[k]]} is outside the area"
        yield Finding(("targets", "positions_m", int(k)), message, "remove it, or draw the area larger")


def _period(mission: Mission) -> Iterator[Finding]:
    period, rate = mission.planner.period_s, mission.setpoints.rate_hz
    ticks = period * rate
    if ticks < 1.0 or abs(ticks - round(ticks)) > 1e-9:
        message = f"{period:g} s is {ticks:g} setpoints at {rate:g} Hz"
        yield Finding(("planner", "period_s"), message, "it must be a whole number of setpoint intervals")


def _delay(mission: Mission) -> Iterator[Finding]:
    """Beacons of all vehicles travel alike: the ring that holds those under way has one length."""
    if isinstance(mission.vehicles, VehicleGroup):
        return
    for k, entry in enumerate(mission.vehicles):
        if entry.radio is not None and "delay_s" in entry.radio.model_fields_set:
            message = "the delay is that of the network, the same for all vehicles"
            yield Finding(
                ("vehicles", k, "radio", "delay_s"), message, "set radio.delay_s for the whole mission"
            )


class Check(NamedTuple):
    """A check and the keys that it reads."""

    run: Callable[[Mission], Iterator[Finding]]
    reads: tuple[KeyPath, ...]


GROUND: tuple[KeyPath, ...] = (
    ("origin",),
    ("area",),
    ("keep_out",),
    ("dynamics",),
    ("safety", "fence_margin_m"),
)
PADS: tuple[KeyPath, ...] = (("vehicles", "launch"), ("vehicles", "count"), ("vehicles", "spacing_m"))
CHECKS = (
    Check(_area, (("origin",), ("area",))),
    Check(_keep_outs, (("origin",), ("keep_out",))),
    Check(_launch, (*GROUND, ("vehicles", "launch"))),
    Check(_legal, GROUND),
    Check(_placing, (*GROUND, *PADS, ("safety", "separation_m"))),
    Check(_fleet, (("vehicles", "launch"), ("vehicles", "count"))),
    Check(_separation, (*PADS, ("dynamics",), ("safety", "separation_m"))),
    Check(_observations, (("observations",), ("dynamics",))),
    Check(_minimum, (("safety", "minimum_vehicles"), ("vehicles", "count"))),
    Check(_targets, (("origin",), ("area",), ("targets",))),
    Check(_period, (("planner", "period_s"), ("setpoints", "rate_hz"))),
    Check(_delay, (("vehicles",),)),
)
