"""MAVSDK writes fences, rally points and parameters into the stub, and reads them back.

A test named for a row shows that row of "What a MAVSDK 4.1 client needs from a vehicle".
"""

import struct
from collections.abc import Callable
from typing import Any

import pytest
from mavsdk.plugins.geofence import Circle, FenceType, GeofenceData, Point, Polygon
from mavsdk.plugins.mission_raw import MissionItem
from mavsdk.plugins.offboard import VelocityNedYaw
from mavsdk.plugins.param import ParamError, ParamResult

from sim_vehicle_stub.plans import FENCE, RALLY
from swarmctl.core.calls import to_geodetic
from swarmctl.mavlink.dialect import mav

from .meeting import MODES, ORIGIN, Meeting

Meet = Callable[..., Meeting]
CORNERS_M = ((-40.0, -40.0), (40.0, -40.0), (40.0, 30.0), (-40.0, 30.0))
HOLE_M, HOLE_RADIUS_M = (-20.0, 0.0), 5.0
# What each firmware asks for an item with, and what else either answers about a plan.
REQUESTS = {"px4": mav.MAVLINK_MSG_ID_MISSION_REQUEST_INT, "ardupilot": mav.MAVLINK_MSG_ID_MISSION_REQUEST}
ANSWERS = (
    mav.MAVLINK_MSG_ID_MISSION_ACK,
    mav.MAVLINK_MSG_ID_MISSION_COUNT,
    mav.MAVLINK_MSG_ID_MISSION_ITEM_INT,
)
# One integer and one float of each firmware: name, what it is at first, what is written.
INTEGERS = {"px4": ("GF_ACTION", 2, 3), "ardupilot": ("RTL_LOIT_TIME", 5000, 1234)}
FLOATS = {"px4": ("RTL_RETURN_ALT", 30.0, 17.5), "ardupilot": ("RTL_ALT_M", 15.0, 17.5)}


def point(east: float, north: float) -> Point:
    return Point(*to_geodetic(east, north, *ORIGIN))


def fence() -> GeofenceData:
    """A rectangle to stay in with a hole to stay out of."""
    border = Polygon([point(*corner) for corner in CORNERS_M], FenceType.INCLUSION)
    return GeofenceData([border], [Circle(point(*HOLE_M), HOLE_RADIUS_M, FenceType.EXCLUSION)])


def kinds_of_plan(messages: list[Any]) -> set[int]:
    """What the messages say they are about; there are some."""
    assert messages
    return {message.mission_type for message in messages}


def degrees(points: list[Point]) -> list[float]:
    return [value for one in points for value in (one.latitude_deg, one.longitude_deg)]


def test_row_fence_goes_up_item_by_item_and_comes_down_again(meet: Meet, autopilot: str) -> None:
    stub, client = meet()
    client.geofence.upload_geofence(fence())
    held = stub.vehicle.fence
    assert held is not None
    assert [held.broken_at(*place) for place in ((0.0, 0.0), (0.0, 31.0), (-41.0, 0.0), HOLE_M)] == [
        False, True, True, True,
    ]  # fmt: skip
    items = stub.vehicle.plans.kept[FENCE]
    assert [item.command for item in items] == [mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION] * 4 + [
        mav.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
    ]
    assert [asked.seq for asked in stub.told(REQUESTS[autopilot])] == [0, 1, 2, 3, 4]
    assert [ack.type for ack in stub.told(mav.MAVLINK_MSG_ID_MISSION_ACK)] == [mav.MAV_MISSION_ACCEPTED]
    back = client.geofence.download_geofence()
    (border,), (hole,) = back.polygons, back.circles
    assert (border.fence_type, hole.fence_type) == (FenceType.INCLUSION, FenceType.EXCLUSION)
    assert degrees(border.points) == pytest.approx(degrees(fence().polygons[0].points), abs=1e-7)
    assert degrees([hole.point]) == pytest.approx(degrees([point(*HOLE_M)]), abs=1e-7)
    assert hole.radius == HOLE_RADIUS_M
    for message_id in (REQUESTS[autopilot], *ANSWERS):
        assert kinds_of_plan(stub.told(message_id)) == {FENCE}
    client.geofence.clear_geofence()
    assert stub.vehicle.plans.kept[FENCE] == []
    assert stub.vehicle.fence is None


def test_row_fence_rally_points_are_a_plan_of_their_own(meet: Meet) -> None:
    stub, client = meet()
    client.geofence.upload_geofence(fence())
    rally = MissionItem(
        0, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mav.MAV_CMD_NAV_RALLY_POINT, 0, 1,
        0.0, 0.0, 0.0, 0.0, 473_978_000, 85_457_000, 20.0, RALLY,
    )  # fmt: skip
    client.mission_raw.upload_rally_points([rally])
    (item,) = stub.vehicle.plans.kept[RALLY]
    assert (item.x, item.y, item.z) == (473_978_000, 85_457_000, 20.0)
    assert len(stub.vehicle.plans.kept[FENCE]) == 5
    (back,) = client.mission_raw.download_rallypoints()
    assert (back.x, back.y, back.z, back.mission_type) == (473_978_000, 85_457_000, 20.0, RALLY)


def test_the_fence_that_was_uploaded_stops_the_vehicle(meet: Meet, autopilot: str) -> None:
    flight = meet(speed=10.0)
    stub, client = flight
    flight.bear_rare_setpoints()
    client.geofence.upload_geofence(fence())
    if autopilot == "ardupilot":
        client.param.set_param_int("FENCE_ENABLE", 1)
    flight.take_off(5.0)
    client.offboard.set_velocity_ned(VelocityNedYaw(5.0, 0.0, 0.0, 0.0))
    client.offboard.start()
    stub.until(lambda: stub.place[1] > 15.0)
    stub.until(lambda: stub.velocity[1] < 0.1, 30.0)
    if autopilot == "px4":
        assert stub.mode == MODES["px4"].hold
        assert 30.0 < stub.place[1] < 40.0
    else:
        assert stub.mode == MODES["ardupilot"].offboard
        assert 25.0 < stub.place[1] < 30.0


def test_row_integer_parameters_cross_bytewise_for_px4_and_cast_for_ardupilot(
    meet: Meet, autopilot: str
) -> None:
    stub, client = meet()
    name, before, after = INTEGERS[autopilot]
    assert client.param.get_param_int(name) == before
    client.param.set_param_int(name, after)
    assert stub.vehicle.parameters[name] == after
    (written,) = stub.received(mav.MAVLINK_MSG_ID_PARAM_SET)
    assert written.param_type == mav.MAV_PARAM_TYPE_INT32
    if autopilot == "px4":
        assert struct.pack("<f", written.param_value) == struct.pack("<i", after)
    else:
        assert written.param_value == float(after)
    assert client.param.get_param_int(name) == after


def test_float_parameters_are_written_and_read(meet: Meet, autopilot: str) -> None:
    stub, client = meet()
    name, before, after = FLOATS[autopilot]
    assert client.param.get_param_float(name) == before
    client.param.set_param_float(name, after)
    assert stub.vehicle.parameters[name] == after
    assert client.param.get_param_float(name) == after


def test_all_parameters_are_read_with_their_types(meet: Meet) -> None:
    stub, client = meet()
    told = client.param.get_all_params()
    integers = {one.name: one.value for one in told.int_params}
    floats = {one.name: one.value for one in told.float_params}
    values = {entry.name: stub.vehicle.parameters[entry.name] for entry in stub.vehicle.parameters}
    assert integers == {name: value for name, value in values.items() if isinstance(value, int)}
    assert floats == pytest.approx({name: v for name, v in values.items() if not isinstance(v, int)})


def test_a_type_that_is_not_the_parameters_changes_nothing(meet: Meet, autopilot: str) -> None:
    stub, client = meet()
    name, before, _ = INTEGERS[autopilot]
    with pytest.raises(ParamError) as caught:
        client.param.get_param_float(name)
    assert caught.value.result is ParamResult.WRONG_TYPE
    if autopilot == "px4":
        with pytest.raises(ParamError):
            client.param.set_param_float(name, 1.0)
    assert stub.vehicle.parameters[name] == before


@pytest.mark.parametrize(
    ("autopilot", "result", "least_s", "most_s"),
    [("px4", ParamResult.DOES_NOT_EXIST, 0.0, 0.5), ("ardupilot", ParamResult.TIMEOUT, 2.9, 3.5)],
)
def test_row_unknown_parameter_is_answered_at_once_or_costs_3_s(
    meet: Meet, result: ParamResult, least_s: float, most_s: float
) -> None:
    stub, client = meet()
    began = stub.wall
    with pytest.raises(ParamError) as caught:
        client.param.get_param_int("NO_SUCH_THING")
    assert caught.value.result is result
    assert least_s <= stub.wall - began < most_s
    assert "NO_SUCH_THING" not in stub.vehicle.parameters
