"""MAVProxy reads and writes the stub's parameters and fence: what it prints is what the vehicle holds."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .mavproxy_rig import SOON_S, MavProxy, ServedFleet, flown

Rig = tuple[ServedFleet, MavProxy]
RETURN_POINT, INCLUSION, EXCLUSION, CIRCLE_EXCLUSION = 5000, 5001, 5002, 5004
ITEMS = [
    (INCLUSION, 4, 47.3987000, 8.5471000),
    (INCLUSION, 4, 47.3987000, 8.5441000),
    (INCLUSION, 4, 47.3967000, 8.5441000),
    (INCLUSION, 4, 47.3967000, 8.5471000),
    (EXCLUSION, 3, 47.3981000, 8.5451000),
    (EXCLUSION, 3, 47.3983000, 8.5453000),
    (EXCLUSION, 3, 47.3981000, 8.5455000),
    (CIRCLE_EXCLUSION, 12.5, 47.3985000, 8.5465000),
]
"""Command, vertices or radius (m), latitude, longitude."""


@pytest.fixture(params=["px4", "ardupilot"])
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Rig]:
    with flown(request.param, tmp_path) as both:
        yield both


def held(fleet: ServedFleet) -> list[Any]:
    """The fence in the vehicle; places in 1e-7 degrees."""
    return [(item.command, item.p1, item.x, item.y) for item in fleet.fence]


def test_parameters_are_shown_as_they_are_held_and_set(rig: Rig) -> None:
    """Rows "parameters" and "integer parameters": bytewise for PX4, cast for ArduPilot."""
    fleet, mavproxy = rig
    parameters = fleet.vehicle.parameters
    count = mavproxy.hear(r"Received (\d+) parameters")
    assert int(count[1]) == len(parameters)
    mavproxy.type("param show *", "param set NO_SUCH 1")
    mavproxy.hear("Unable to find parameter 'NO_SUCH'")
    shown = dict(mavproxy.said(r"([A-Z][A-Z0-9_]+) +(-?[\d.]+)\r?\n"))
    assert {name: float(value) for name, value in shown.items()} == {
        entry.name: pytest.approx(parameters[entry.name], rel=1e-6) for entry in parameters
    }

    whole, real = ("GF_ACTION", "MPC_XY_VEL_MAX") if "GF_ACTION" in parameters else ("FENCE_ACTION", "WP_SPD")
    mavproxy.type(f"param set {whole} 3", f"param set {real} 6.5")
    fleet.until(lambda: (parameters[whole], parameters[real]) == (3, 6.5), SOON_S)
    assert isinstance(parameters[whole], int)


def test_a_fence_is_put_in_from_a_file_listed_saved_and_cleared(rig: Rig, tmp_path: Path) -> None:
    """Row "fence": polygons and circles to stay in and out of, item by item."""
    fleet, mavproxy = rig
    lines = [
        f"{k}\t0\t0\t{c}\t{p1}\t0\t0\t0\t{x:.7f}\t{y:.7f}\t0\t1" for k, (c, p1, x, y) in enumerate(ITEMS)
    ]
    (tmp_path / "fence.txt").write_text("\n".join(["QGC WPL 110", *lines, ""]))
    mavproxy.type(f"fence load {tmp_path / 'fence.txt'}")
    mavproxy.hear("MISSION_ACK: TYPE_FENCE: ACCEPTED")
    assert held(fleet) == [
        (c, p1, pytest.approx(x * 1e7, abs=1), pytest.approx(y * 1e7, abs=1)) for c, p1, x, y in ITEMS
    ]

    mavproxy.type("fence list")
    mavproxy.hear(f"Saved {len(ITEMS)} fence items")
    listed = mavproxy.said(r"(\d+) 0 (\d+\.\d+) (\d+\.\d+) \S+ p1=(\S+)")
    assert [(int(c), float(p1), round(float(x) * 1e7), round(float(y) * 1e7)) for c, x, y, p1 in listed] == (
        held(fleet)
    )

    mavproxy.type("fence clear")
    fleet.until(lambda: fleet.fence == [], SOON_S)
    assert fleet.vehicle.fence is None


def test_a_fence_in_the_older_format_is_put_in_too(rig: Rig, tmp_path: Path) -> None:
    """A return point, then the corners, the last of them the first again."""
    fleet, mavproxy = rig
    corners = [(x, y) for _, _, x, y in ITEMS[:4]]
    places = [(47.3977, 8.5456), *corners, corners[0]]
    (tmp_path / "fence.txt").write_text("".join(f"{x:.7f}\t{y:.7f}\n" for x, y in places))
    mavproxy.type(f"fence load {tmp_path / 'fence.txt'}")
    mavproxy.hear("MISSION_ACK: TYPE_FENCE: ACCEPTED")
    assert [item.command for item in fleet.fence] == [RETURN_POINT, *[INCLUSION] * 4]
    assert fleet.vehicle.fence is not None
    assert fleet.vehicle.fence.broken_at(0.0, 0.0) is False
    assert fleet.vehicle.fence.broken_at(0.0, 300.0) is True
