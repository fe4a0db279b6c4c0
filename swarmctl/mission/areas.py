"""Search areas and targets out of other programs' files: KML, GeoJSON, QGroundControl's .plan.

Each reader turns bytes into an :class:`Outline`: one border, keep-out polygons and keep-out circles, all in
degrees.  Holes of a polygon are keep-outs; in KML and GeoJSON so are polygons whose name begins with
"keep-out" (or "keep out", "keep_out", "exclusion"); in a .plan file the geofence says which are.
Every fault of a file is an :class:`AreaError` with one line to show.
"""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar
from xml.etree import ElementTree

from .model import FARTHEST_M

T = TypeVar("T")

MAX_BYTES = 20_000_000

Ring = list[tuple[float, float]]
"""Corners as (latitude, longitude) in degrees, the first not repeated at the end."""


class AreaError(Exception):
    """A file that holds no usable area or targets; the text says why."""


@dataclass
class Outline:
    """An area to search: ``circles`` are (latitude, longitude, radius in metres)."""

    borders: list[Ring] = field(default_factory=list)
    keep_outs: list[Ring] = field(default_factory=list)
    circles: list[tuple[float, float, float]] = field(default_factory=list)
    border_circles: list[tuple[float, float, float]] = field(default_factory=list)

    def add(self, name: str, rings: list[Ring]) -> None:
        """Take one polygon: its outer ring first, then its holes."""
        outer, *holes = rings
        if re.match(r"\s*(keep[-_ ]?out|exclusion)", name, re.IGNORECASE):
            self.keep_outs.append(outer)
        else:
            self.borders.append(outer)
            self.keep_outs.extend(holes)


def read_outline(name: str, content: bytes) -> Outline:
    """The area in a file's ``content``; its ``name``'s ending says what it is.  Raises AreaError."""
    readers: dict[str, Callable[[bytes], Outline]] = {
        "kml": _from_kml,
        "geojson": _from_geojson,
        "json": _from_geojson,
        "plan": _from_plan,
    }
    reader = readers.get(name.rpartition(".")[2].lower())
    if reader is None:
        raise AreaError("is of an unknown kind; .kml, .geojson and .plan files are read")
    outline = _shallow(reader, content)
    count = len(outline.borders) + len(outline.border_circles)
    if count != 1:
        raise AreaError(
            f"holds {count} areas, one is needed; name a polygon keep-out... to have it kept out"
            if count
            else "holds no polygon to search in"
        )
    return outline


def read_points(content: bytes) -> Ring:
    """The Points and MultiPoints of a GeoJSON file: (latitude, longitude) in degrees.  Raises AreaError."""
    points = _shallow(_from_points, content)
    if not points:
        raise AreaError("holds no Point or MultiPoint")
    return points


def _shallow(reader: Callable[[bytes], T], content: bytes) -> T:
    """What ``reader`` makes of the content, unless that is too large or nested beyond Python's stack."""
    if len(content) > MAX_BYTES:
        raise AreaError(f"is too large: more than {MAX_BYTES} bytes")
    try:
        return reader(content)
    except RecursionError:
        raise AreaError("is nested too deeply") from None


def _from_points(content: bytes) -> Ring:
    points: Ring = []
    for _, geometry in _geometries(_json(content)):
        places = geometry.get("coordinates")
        if geometry.get("type") == "Point":
            points.append(_place(places))
        elif geometry.get("type") == "MultiPoint":
            points.extend(_place(place) for place in _list(places))
    return points


def _degrees(lat: object, lon: object) -> tuple[float, float]:
    for value, limit in ((lat, 90.0), (lon, 180.0)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= limit:
            raise AreaError(f"has {lat!r:.30}, {lon!r:.30} where a latitude and a longitude belong")
    return float(lat), float(lon)  # type: ignore[arg-type]


def _ring(places: list[tuple[float, float]]) -> Ring:
    if len(places) > 1 and places[0] == places[-1]:
        places = places[:-1]
    if len(places) < 3:
        raise AreaError(f"has a polygon of {len(places)} corners")
    return places


def _list(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise AreaError(f"has {value!r:.30} where a list belongs")
    return value


def _mapping(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise AreaError(f"has {value!r:.30} where a mapping belongs")
    return value


def _json(content: bytes) -> Any:
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise AreaError("is not UTF-8 text") from None
    except ValueError as error:
        raise AreaError(f"is not JSON: {error}") from None


# GeoJSON has (longitude, latitude), and rings that repeat their first corner.


def _from_geojson(content: bytes) -> Outline:
    outline = Outline()
    for name, geometry in _geometries(_json(content)):
        places = geometry.get("coordinates")
        if geometry.get("type") == "Polygon":
            outline.add(name, _rings(places))
        elif geometry.get("type") == "MultiPolygon":
            for polygon in _list(places):
                outline.add(name, _rings(polygon))
    return outline


def _geometries(data: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every geometry with the name of its feature."""
    data = _mapping(data)
    if data.get("type") == "FeatureCollection":
        for feature in _list(data.get("features")):
            yield from _geometries(feature)
    elif data.get("type") == "Feature":
        properties = data.get("properties") or {}
        if data.get("geometry") is not None:
            for _, geometry in _geometries(data["geometry"]):
                yield str(_mapping(properties).get("name") or ""), geometry
    elif data.get("type") == "GeometryCollection":
        for geometry in _list(data.get("geometries")):
            yield from _geometries(geometry)
    else:
        yield "", data


def _rings(places: object) -> list[Ring]:
    rings = [_ring([_place(place) for place in _list(ring)]) for ring in _list(places)]
    if not rings:
        raise AreaError("has a polygon without corners")
    return rings


def _place(place: object) -> tuple[float, float]:
    numbers = _list(place)
    if len(numbers) < 2:
        raise AreaError(f"has {place!r:.30} where a longitude and a latitude belong")
    return _degrees(numbers[1], numbers[0])


# KML is XML: <Polygon> with <outerBoundaryIs> and <innerBoundaryIs>, each "lon,lat[,alt] lon,lat[,alt] ...".


def _from_kml(content: bytes) -> Outline:
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise AreaError("has a document type, which KML has no use for")
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise AreaError(f"is not KML: {error}") from None
    outline = Outline()
    for placemark in _named(root, "Placemark"):
        name = next((child.text or "" for child in placemark if _tag(child) == "name"), "")
        for polygon in _named(placemark, "Polygon"):
            outline.add(name, _kml_rings(polygon))
    return outline


def _kml_rings(polygon: ElementTree.Element) -> list[Ring]:
    outer = [_kml_ring(side) for side in _named(polygon, "outerBoundaryIs")]
    if len(outer) != 1:
        raise AreaError("has a Polygon without its one outerBoundaryIs")
    return outer + [_kml_ring(side) for side in _named(polygon, "innerBoundaryIs")]


def _kml_ring(side: ElementTree.Element) -> Ring:
    text = " ".join(element.text or "" for element in _named(side, "coordinates"))
    return _ring([_kml_place(item) for item in text.split()])


def _kml_place(item: str) -> tuple[float, float]:
    try:
        lon, lat, *_ = (float(part) for part in item.split(","))
    except ValueError:
        raise AreaError(f"has {item!r:.30} where longitude,latitude belongs") from None
    return _degrees(lat, lon)


def _named(element: ElementTree.Element, name: str) -> Iterator[ElementTree.Element]:
    return (inner for inner in element.iter() if _tag(inner) == name)


def _tag(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


# A .plan file's geofence: polygons of (latitude, longitude) and circles, each an inclusion or an exclusion.


def _from_plan(content: bytes) -> Outline:
    plan = _mapping(_json(content))
    if plan.get("fileType") != "Plan":
        raise AreaError('is not a QGroundControl plan: its fileType is not "Plan"')
    fence = _mapping(plan.get("geoFence") or {})
    outline = Outline()
    for item in _list(fence.get("polygons") or []):
        places = [_plan_place(place) for place in _list(_mapping(item).get("polygon"))]
        (outline.borders if item.get("inclusion") else outline.keep_outs).append(_ring(places))
    for item in _list(fence.get("circles") or []):
        circle = _plan_circle(_mapping(_mapping(item).get("circle")))
        (outline.border_circles if item.get("inclusion") else outline.circles).append(circle)
    return outline


def _plan_place(place: object) -> tuple[float, float]:
    numbers = _list(place)
    if len(numbers) < 2:
        raise AreaError(f"has {place!r:.30} where a latitude and a longitude belong")
    return _degrees(numbers[0], numbers[1])


def _plan_circle(circle: dict[str, Any]) -> tuple[float, float, float]:
    lat, lon = _plan_place(circle.get("center"))
    radius = circle.get("radius")
    if isinstance(radius, bool) or not isinstance(radius, (int, float)) or not 0 < radius <= FARTHEST_M:
        raise AreaError(f"has a circle with the radius {radius!r:.30}")
    return lat, lon, float(radius)
