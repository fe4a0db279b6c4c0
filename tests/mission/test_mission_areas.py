"""Areas and targets from KML, GeoJSON and QGroundControl plans, good and bad."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.mission import areas, geometry
from swarmctl.mission.areas import AreaError, read_outline, read_points
from swarmctl.mission.model import Mission

SQUARE = [(47.3977, 8.5456), (47.3977, 8.5600), (47.4070, 8.5600), (47.4070, 8.5456)]
SMALL = [(47.4000, 8.5500), (47.4000, 8.5510), (47.4010, 8.5510)]


def lon_lat(ring: list[tuple[float, float]]) -> list[list[float]]:
    return [[lon, lat] for lat, lon in [*ring, ring[0]]]


def kml_ring(side: str, ring: list[tuple[float, float]]) -> str:
    places = "\n ".join(f"{lon},{lat},0" for lon, lat in lon_lat(ring))
    return f"<{side}><LinearRing><coordinates>\n {places}\n</coordinates></LinearRing></{side}>"


def placemark(name: str, *rings: str) -> str:
    return f"<Placemark><name>{name}</name><Polygon>{''.join(rings)}</Polygon></Placemark>"


def kml(*placemarks: str) -> bytes:
    body = "".join(placemarks)
    text = (
        f'<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>{body}</Document></kml>'
    )
    return text.encode()


def feature(name: str | None, kind: str, coordinates: object) -> dict[str, object]:
    properties = {"name": name} if name else None
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def collection(*features: object) -> bytes:
    return json.dumps({"type": "FeatureCollection", "features": features}).encode()


def plan(polygons: list[object], circles: list[object]) -> bytes:
    fence = {"polygons": polygons, "circles": circles, "version": 2}
    return json.dumps({"fileType": "Plan", "geoFence": fence, "mission": {}, "version": 1}).encode()


AREAS = {
    "field.kml": kml(
        placemark("field", kml_ring("outerBoundaryIs", SQUARE)),
        placemark("Keep-Out mast", kml_ring("outerBoundaryIs", SMALL)),
    ),
    "hole.kml": kml(
        placemark("field", kml_ring("outerBoundaryIs", SQUARE), kml_ring("innerBoundaryIs", SMALL))
    ),
    "field.geojson": collection(
        feature("field", "Polygon", [lon_lat(SQUARE)]), feature("exclusion 1", "Polygon", [lon_lat(SMALL)])
    ),
    "hole.json": json.dumps({"type": "Polygon", "coordinates": [lon_lat(SQUARE), lon_lat(SMALL)]}).encode(),
    "multi.GeoJSON": collection(
        feature(None, "MultiPolygon", [[lon_lat(SQUARE), lon_lat(SMALL)]]),
        feature(None, "Point", [8.55, 47.4]),
        {"type": "Feature", "properties": {}, "geometry": None},
    ),
    "fence.plan": plan([{"inclusion": True, "polygon": SQUARE}, {"inclusion": False, "polygon": SMALL}], []),
}


@pytest.mark.parametrize("name", AREAS)
def test_border_and_keep_outs_are_found(name: str) -> None:
    outline = read_outline(name, AREAS[name])
    assert outline.borders == [SQUARE]
    assert outline.keep_outs == [SMALL]
    assert outline.circles == []


def test_a_plan_has_circles() -> None:
    circle = {"center": [47.4, 8.55], "radius": 50}
    content = plan(
        [{"inclusion": True, "polygon": SQUARE}], [{"inclusion": False, "circle": circle, "version": 1}]
    )
    assert read_outline("a.plan", content).circles == [(47.4, 8.55, 50.0)]


def load_with(read: Callable[..., Mission], folder: Path, name: str, content: bytes) -> Mission:
    (folder / name).write_bytes(content)
    return read(f"area: {{file: {name}}}\nkeep_out: [{{box_m: [800, 900, 800, 900]}}]")


@pytest.mark.parametrize("name", AREAS)
def test_a_mission_takes_the_area_in(read: Callable[..., Mission], tmp_path: Path, name: str) -> None:
    mission = load_with(read, tmp_path, name, AREAS[name])
    assert mission.area.file is None
    assert mission.area.polygon_m is not None
    assert mission.area.polygon_m[0] == (0.0, 0.0)
    assert mission.area.polygon_m[2] == pytest.approx((1087, 1034), abs=1)
    assert mission.keep_out[0].box_m is not None
    small = geometry.local_m(tuple(SMALL), mission.origin)
    assert np.allclose(geometry.regions(mission).keep_outs[1], small)


def test_an_inclusion_circle_is_an_area_inside_it(read: Callable[..., Mission], tmp_path: Path) -> None:
    circle = {"center": [47.4027, 8.5520], "radius": 500}
    mission = load_with(read, tmp_path, "c.plan", plan([], [{"inclusion": True, "circle": circle}]))
    center = geometry.local_m(((47.4027, 8.5520),), mission.origin)[0]
    corners = np.array(mission.area.polygon_m)
    assert np.allclose(np.hypot(*(corners - center).T), 500)
    assert len(corners) == 32


ENTITIES = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]><kml>&b;</kml>'
ONE = feature("a", "Polygon", [lon_lat(SQUARE)])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.shp", b"", "is of an unknown kind"),
        ("a", b"", "is of an unknown kind"),
        ("a.kml", b"", "is not KML: no element found"),
        ("a.kml", b"<kml><Placemark>", "is not KML: no element found"),
        ("a.kml", b"\x00\xff", "is not KML"),
        ("a.kml", b'<?xml version="1.0" encoding="klingon"?><kml/>', "is not KML"),
        ("a.kml", b"<kml/>", "holds no polygon to search in"),
        ("a.kml", ENTITIES, "has a document type"),
        ("a.kml", kml(placemark("x")), "without its one outerBoundaryIs"),
        ("a.kml", AREAS["field.kml"].replace(b"8.5456,47.3977", b"8.5456;47.3977"), "where longitude,"),
        ("a.kml", AREAS["field.kml"].replace(b"8.5456,47.3977", b"nan,47.3977"), "where a latitude and a"),
        ("a.kml", AREAS["field.kml"].replace(b"Keep-Out", b"other"), "holds 2 areas, one is needed"),
        ("a.kml", kml(placemark("x", kml_ring("outerBoundaryIs", SMALL[:2]))), "has a polygon of 2 corners"),
        ("a.geojson", b"", "is not JSON"),
        ("a.geojson", b"\xff", "is not UTF-8"),
        ("a.geojson", b"[" * 100_000, "is n"),
        ("a.geojson", b"[]", "where a mapping belongs"),
        ("a.geojson", b"{}", "holds no polygon"),
        ("a.geojson", collection(5), "has 5 where a mapping belongs"),
        ("a.geojson", collection(ONE, ONE), "holds 2 areas"),
        ("a.geojson", collection(feature("a", "Polygon", [])), "a polygon without corners"),
        ("a.geojson", collection(feature("a", "Polygon", [[[8.5], [8.6]]])), "where a longitude"),
        ("a.geojson", collection(feature("a", "Polygon", [[["8", "47"]]])), "where a latitude"),
        ("a.geojson", collection(feature("a", "Polygon", [[[8, 10**400]]])), "where a latitude"),
        ("a.geojson", AREAS["field.geojson"].replace(b"8.5456", b"NaN"), "where a latitude"),
        ("a.geojson", AREAS["field.geojson"].replace(b"8.5456", b"true"), "where a latitude"),
        ("a.plan", b'{"fileType": "Params"}', 'its fileType is not "Plan"'),
        ("a.plan", plan([], []), "holds no polygon"),
        ("a.plan", plan([{"inclusion": True}], []), "has None where a list belongs"),
        ("a.plan", plan([], [{"inclusion": True, "circle": {"center": [47, 8], "radius": -1}}]), "radius -1"),
        ("a.plan", plan([], [{"circle": {"center": [47, 8], "radius": 10**400}}]), "a circle with"),
        ("a.plan", plan([], [{"circle": {"center": [47], "radius": 1}}]), "has [47] where a latitude and a"),
    ],
)  # fmt: skip
def test_a_bad_file_says_what_is_wrong(name: str, content: bytes, message: str) -> None:
    with pytest.raises(AreaError) as caught:
        read_outline(name, content)
    assert message in str(caught.value)


def test_a_huge_file_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(areas, "MAX_BYTES", 10)
    with pytest.raises(AreaError, match="is too large: more than 10 bytes"):
        read_outline("a.json", AREAS["hole.json"])


@given(st.binary(max_size=60), st.sampled_from(["kml", "geojson", "plan"]))
def test_garbage_never_gets_further_than_an_area_error(content: bytes, kind: str) -> None:
    with pytest.raises(AreaError):
        read_outline(f"a.{kind}", content)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["type", "features", "geometry", "coordinates", "geometries", "properties"]),
            inner,
        )
    ),
)
KINDS = st.sampled_from(["Feature", "FeatureCollection", "Polygon", "MultiPolygon", "GeometryCollection"])


@given(JSON, KINDS, st.sampled_from(["features", "geometry", "coordinates", "geometries", "properties"]))
def test_garbage_in_geojson_never_gets_further(data: object, kind: str, key: str) -> None:
    content = json.dumps({"type": kind, key: data}).encode()
    with pytest.raises(AreaError):
        read_outline("a.json", content)


@given(JSON, st.sampled_from(["polygons", "circles"]))
def test_garbage_in_plans_never_gets_further(data: object, key: str) -> None:
    for fence in (data, {key: data}, {key: [data]}, {key: [{"polygon": data, "circle": data}]}):
        content = json.dumps({"fileType": "Plan", "geoFence": fence}).encode()
        with pytest.raises(AreaError):
            read_outline("a.plan", content)


# Targets.


def test_points_and_multipoints_are_targets(read: Callable[..., Mission], tmp_path: Path) -> None:
    content = collection(
        feature("boat", "Point", [8.55, 47.40]),
        feature(None, "MultiPoint", [[8.55, 47.41, 3.0], [8.56, 47.4]]),
    )
    assert read_points(content) == [(47.40, 8.55), (47.41, 8.55), (47.4, 8.56)]
    (tmp_path / "t.geojson").write_bytes(content)
    targets = read("targets: {file: t.geojson}").targets
    assert targets.file is None
    assert targets.count == 3
    assert targets.positions_m is not None
    assert targets.positions_m[0] == pytest.approx((332, 256), abs=1)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (collection(), "m.yaml:1:11: targets.file: 't.json' holds no Point or MultiPoint"),
        (collection(feature("", "Point", [8.55])), "'t.json' has [8.55] where a longitude and a latitude"),
        (collection(feature("", "Point", [8.5, 47.4])), "target 0 at [-3442.4, 256.7] is outside the area"),
        (collection(feature("", "Point", [18.5, 47.4])), "'t.json' reaches 7"),
    ],
)
def test_bad_targets_are_traced_to_their_file(
    complaints: Callable[..., list[str]], tmp_path: Path, content: bytes, message: str
) -> None:
    (tmp_path / "t.json").write_bytes(content)
    (line,) = complaints("targets: {file: t.json}")
    assert line.startswith("m.yaml:1:11: targets.file: ")
    assert message in line


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]], "the fence crosses itself"),
        ([SQUARE[0], (47.39771, 8.55), SQUARE[1]], "a fence margin of 20 m leaves nothing"),
        ([(57.0, 8.0), (57.0, 8.1), (57.1, 8.1)], "'a.json' reaches 10"),
    ],
)
def test_a_bad_area_is_traced_to_its_file(
    complaints: Callable[..., list[str]], tmp_path: Path, content: list[tuple[float, float]], message: str
) -> None:
    (tmp_path / "a.json").write_bytes(collection(feature("a", "Polygon", [lon_lat(content)])))
    (line,) = complaints("area: {file: a.json}")
    assert line.startswith("m.yaml:1:8: area.file: ")
    assert message in line


def test_a_keep_out_of_a_file_is_traced_to_it(complaints: Callable[..., list[str]], tmp_path: Path) -> None:
    big = [(47.39, 8.54), (47.39, 8.57), (47.41, 8.57), (47.41, 8.54)]
    content = collection(
        feature("a", "Polygon", [lon_lat(SQUARE)]), feature("keep out", "Polygon", [lon_lat(big)])
    )
    (tmp_path / "a.json").write_bytes(content)
    (line,) = complaints("area: {file: a.json}\nkeep_out: [{box_m: [800, 900, 800, 900]}]")
    assert line.startswith("m.yaml:1:8: area.file: with 20 m kept from it, leaves nothing")


@pytest.mark.parametrize("name", ["gone.kml", "..", "/nowhere/a.kml"])
def test_a_file_that_cannot_be_read(complaints: Callable[..., list[str]], name: str) -> None:
    (line,) = complaints(f"area: {{file: '{name}'}}")
    assert line.startswith(f"m.yaml:1:8: area.file: '{name}' ")
