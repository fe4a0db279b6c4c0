"""The mission protocol on both firmwares: fence and rally points put in, read back, cleared; fence actions.

A MAVSDK client needs its row "fence, rally" of both.
"""

import math
from collections.abc import Callable
from random import Random
from typing import Any

import pytest

from sim_vehicle_stub.fences import Circle, Fence, Polygon, Zone
from sim_vehicle_stub.plans import MOST_ITEMS
from swarmctl.core.geodesy import to_geodetic
from swarmctl.mavlink.dialect import mav

Make = Callable[..., Any]
ORIGIN = (47.3977, 8.5456, 488.0)
FENCE, RALLY = 1, 2
INCLUDE, EXCLUDE, CIRCLE_OUT, RALLY_POINT = 5001, 5002, 5004, 5100
REQUESTS = {"px4": 51, "ardupilot": 40}
OFFBOARD, LOITER, RTL = 0x60000, 0x3040000, 0x5040000
VELOCITY = 1 | 2 | 4 | 64 | 128 | 256 | 1024 | 2048
Row = tuple[int, float, float, float]


def box(half: float, command: int = INCLUDE) -> list[Row]:
    """A square about the origin: command, vertices, east, north."""
    corners = ((half, half), (-half, half), (-half, -half), (half, -half))
    return [(command, 4, east, north) for east, north in corners]


def item_of(number: int, row: Row, kind: int, frame: int = 3) -> Any:
    command, p1, east, north = row
    lat, lon = to_geodetic(east, north, *ORIGIN)
    return mav.MAVLink_mission_item_int_message(
        1, 1, number, frame, command, 0, 1, p1, 0, 0, 0, round(lat * 1e7), round(lon * 1e7), 0, kind
    )


def upload(s: Any, rows: list[Row], kind: int = FENCE, frame: int = 3) -> int:
    """Put a plan in as a client does; the result that the vehicle acknowledges."""
    s.send(mav.MAVLink_mission_count_message(1, 1, len(rows), kind))
    for number, row in enumerate(rows):
        _, frame_asked = s.heard[-1]
        assert frame_asked.message_id == REQUESTS[s.autopilot]
        assert (frame_asked.fields.seq, frame_asked.fields.mission_type) == (number, kind)
        s.send(item_of(number, row, kind, frame))
    ack = s.last(47)
    assert ack.mission_type == kind
    return int(ack.type)


@pytest.fixture(params=["px4", "ardupilot"])
def vehicle(station: Make, request: pytest.FixtureRequest) -> Any:
    s = station(autopilot=request.param)
    s.autopilot = request.param
    return s


def named(s: Any, autopilot: str = "px4") -> Any:
    s.autopilot = autopilot
    return s


@pytest.mark.row("px4-fence", "ardupilot-fence")
def test_fence_upload_and_download_echo_their_kind(vehicle: Any) -> None:
    s = vehicle
    rows = [*box(100.0), (CIRCLE_OUT, 12.5, 30.0, 40.0)]
    assert upload(s, rows) == 0
    s.send(mav.MAVLink_mission_request_list_message(1, 1, FENCE))
    assert (s.last(44).count, s.last(44).mission_type) == (5, FENCE)
    for number, row in enumerate(rows):
        s.send(mav.MAVLink_mission_request_int_message(1, 1, number, FENCE))
        item, sent = s.last(73), item_of(number, row, FENCE)
        assert (item.seq, item.command, item.param1, item.x, item.y, item.frame, item.mission_type) == (
            (number, sent.command, sent.param1, sent.x, sent.y, 3, FENCE)
        )
    s.send(mav.MAVLink_mission_request_message(1, 1, 4, FENCE))
    assert (s.last(39).param1, s.last(39).mission_type) == (12.5, FENCE)
    assert s.last(39).x == pytest.approx(item.x * 1e-7, abs=1e-5)


def test_rally_points_are_kept_beside_the_fence_and_cleared_alone(vehicle: Any) -> None:
    s = vehicle
    assert upload(s, box(100.0)) == 0
    assert upload(s, [(RALLY_POINT, 0, 1.0, 2.0)], RALLY) == 0
    s.send(mav.MAVLink_mission_clear_all_message(1, 1, FENCE))
    assert (s.last(47).type, s.last(47).mission_type) == (0, FENCE)
    assert not s.vehicle.fence
    s.send(mav.MAVLink_mission_request_list_message(1, 1, RALLY))
    assert s.last(44).count == 1
    s.send(mav.MAVLink_mission_clear_all_message(1, 1, 255))
    s.send(mav.MAVLink_mission_request_list_message(1, 1, RALLY))
    assert s.last(44).count == 0


def test_a_mission_item_in_floats_is_taken(vehicle: Any) -> None:
    s = vehicle
    s.send(mav.MAVLink_mission_count_message(1, 1, 1, RALLY))
    s.send(mav.MAVLink_mission_item_message(1, 1, 0, 3, RALLY_POINT, 0, 1, 0, 0, 0, 0, 47.4, 8.5, 0, RALLY))
    assert s.last(47).type == 0
    assert s.vehicle.plans.kept[RALLY][0].x == pytest.approx(474000000, abs=40)
    s.send(mav.MAVLink_mission_count_message(1, 1, 1, RALLY))
    s.send(mav.MAVLink_mission_item_message(1, 1, 0, 3, RALLY_POINT, 0, 1, 0, 0, 0, 0, math.nan, 8, 0, RALLY))
    assert s.last(47).type == mav.MAV_MISSION_INVALID


@pytest.mark.row("px4-fence")
@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_fence_frames_that_are_accepted(station: Make, frame: int) -> None:
    assert upload(named(station()), box(50.0), frame=frame) == 0


@pytest.mark.parametrize(
    ("rows", "frame", "result"),
    [
        (box(50.0), 1, mav.MAV_MISSION_UNSUPPORTED_FRAME),
        ([(16, 0.0, 0.0, 0.0)], 3, mav.MAV_MISSION_UNSUPPORTED),
        (box(50.0)[:3], 3, mav.MAV_MISSION_INVALID_PARAM1),
        ([*box(50.0)[:3], (EXCLUDE, 4, 0.0, 0.0)], 3, mav.MAV_MISSION_INVALID_PARAM1),
        ([(INCLUDE, 2, 0.0, 0.0), (INCLUDE, 2, 9.0, 0.0)], 3, mav.MAV_MISSION_INVALID_PARAM1),
        ([(INCLUDE, math.nan, 0.0, 0.0)], 3, mav.MAV_MISSION_INVALID_PARAM1),
        ([(CIRCLE_OUT, 0.0, 0.0, 0.0)], 3, mav.MAV_MISSION_INVALID_PARAM1),
    ],
)
def test_a_wrong_fence_is_refused_whole_and_the_old_one_stays(
    vehicle: Any, rows: list[Row], frame: int, result: int
) -> None:
    s = vehicle
    assert upload(s, box(100.0)) == 0
    assert upload(s, rows, frame=frame) == result
    assert len(s.vehicle.plans.kept[FENCE]) == 4
    assert s.vehicle.fence.broken_at(101.0, 0.0)


def test_what_there_is_not_is_said(vehicle: Any) -> None:
    s = vehicle
    for message, result in (
        (mav.MAVLink_mission_count_message(1, 1, 1, 7), mav.MAV_MISSION_UNSUPPORTED),
        (mav.MAVLink_mission_count_message(1, 1, MOST_ITEMS + 1, FENCE), mav.MAV_MISSION_NO_SPACE),
        (mav.MAVLink_mission_request_list_message(1, 1, 7), mav.MAV_MISSION_UNSUPPORTED),
        (mav.MAVLink_mission_clear_all_message(1, 1, 7), mav.MAV_MISSION_UNSUPPORTED),
        (mav.MAVLink_mission_request_int_message(1, 1, 0, FENCE), mav.MAV_MISSION_INVALID_SEQUENCE),
        (mav.MAVLink_mission_count_message(1, 1, 0, FENCE), 0),
    ):
        before = len(s.all(47))
        s.send(message)
        assert [fields.type for _, fields in s.all(47)[before:]] == [result]


def test_lost_items_are_asked_for_again_and_doubled_ones_do_no_harm(vehicle: Any) -> None:
    s = vehicle
    rows = box(100.0)
    s.send(mav.MAVLink_mission_count_message(1, 1, 4, FENCE))
    s.run(1.2)
    assert [f.seq for _, f in s.all(REQUESTS[s.autopilot])] == [0, 0]
    for number in (0, 0, 2, 1, 2, 1, 3):
        s.send(item_of(number, rows[number], FENCE))
    assert s.last(47).type == 0
    acks = len(s.all(47))
    s.send(item_of(3, rows[3], FENCE))
    assert [(f.type, f.mission_type) for _, f in s.all(47)[acks:]] == [(0, FENCE)]
    assert len(s.vehicle.plans.kept[FENCE]) == 4


def test_an_upload_that_stops_is_given_up(vehicle: Any) -> None:
    s = vehicle
    s.send(mav.MAVLink_mission_count_message(1, 1, 4, FENCE))
    s.run(20.0)
    assert s.last(47).type == mav.MAV_MISSION_OPERATION_CANCELLED
    asked = len(s.all(REQUESTS[s.autopilot]))
    s.run(5.0)
    assert len(s.all(REQUESTS[s.autopilot])) == asked


def test_plans_outlast_a_reboot(vehicle: Any) -> None:
    s = vehicle
    upload(s, box(100.0))
    s.vehicle.faults.begin("reboot")
    s.run(3.0)
    s.send(mav.MAVLink_mission_request_list_message(1, 1, FENCE))
    assert s.last(44).count == 4


class TestShapes:
    """A fence's geometry by itself."""

    L_SHAPE = Polygon(((0.0, 0.0), (30.0, 0.0), (30.0, 10.0), (10.0, 10.0), (10.0, 30.0), (0.0, 30.0)))

    @pytest.mark.parametrize(
        ("place", "inside"),
        [((5, 5), True), ((25, 5), True), ((5, 25), True), ((20, 20), False), ((-1, 5), False)],
    )
    def test_a_polygon_with_a_notch(self, place: tuple[float, float], inside: bool) -> None:
        assert self.L_SHAPE.holds(*place) is inside

    def test_nearest_places_on_borders(self) -> None:
        assert self.L_SHAPE.nearest(20.0, 12.0) == pytest.approx((20.0, 10.0))
        assert self.L_SHAPE.nearest(40.0, -3.0) == pytest.approx((30.0, 0.0))
        assert Circle(10.0, 0.0, 5.0).nearest(20.0, 0.0) == pytest.approx((15.0, 0.0))
        assert Circle(10.0, 0.0, 5.0).nearest(10.0, 0.0) == pytest.approx((15.0, 0.0))

    def test_one_inclusion_is_enough_and_no_exclusion_is_allowed(self) -> None:
        near, far = Circle(0.0, 0.0, 10.0), Circle(30.0, 0.0, 10.0)
        fence = Fence([Zone(near, True), Zone(far, True), Zone(Circle(0.0, 0.0, 3.0), False)])
        assert [fence.broken_at(east, 0.0) for east in (1.0, 5.0, 15.0, 25.0)] == [True, False, True, False]

    def test_asking_along_a_way_gives_what_asking_afresh_does(self) -> None:
        zones = [Zone(self.L_SHAPE, True), Zone(Circle(5.0, 5.0, 2.0), False)]
        held = Fence(zones)
        dice = Random(1)
        east, north, broken = 1.0, 1.0, []
        for _ in range(3000):  # from side to side of the L, steps of a metre or less
            east = min(max(east + dice.uniform(-1.0, 1.0), -5.0), 35.0)
            north = min(max(north + dice.uniform(-1.0, 1.0), -5.0), 35.0)
            broken.append(held.broken_at(east, north))
            assert broken[-1] is Fence(zones).broken_at(east, north)
        assert 500 < sum(broken) < 2500


@pytest.mark.row("px4-fence")
class TestPx4Fence:
    """What follows a breach, by GF_ACTION."""

    def fly_out(self, station: Make, action: int) -> Any:
        s = named(station())
        upload(s, box(30.0))
        s.set_parameter("GF_ACTION", action)
        s.fly_offboard(10.0)
        s.run_until(lambda: s.body["north"] > 30.0, 30.0, lambda: s.setpoint(3.0, z=-10.0))
        return s

    def test_action_1_only_warns(self, station: Make) -> None:
        s = self.fly_out(station, 1)
        s.run(3.0, lambda: s.setpoint(3.0, z=-10.0))
        assert s.mode == OFFBOARD
        assert any("Geofence" in text for text in s.texts())

    def test_action_2_loiters_about_2_m_outside_until_offboard_is_ordered(self, station: Make) -> None:
        s = self.fly_out(station, 2)
        s.run(10.0, lambda: s.setpoint(3.0, z=-10.0))
        assert s.mode == LOITER
        assert s.body["north"] - 30.0 == pytest.approx(2.0, abs=1.0)
        assert s.last(0).system_status == mav.MAV_STATE_CRITICAL
        assert s.set_mode(OFFBOARD) == [0, 0]
        s.run(5.0, lambda: s.setpoint(-3.0, z=-10.0))
        assert s.mode == OFFBOARD
        assert s.body["north"] < 30.0

    def test_action_3_loiters_for_five_seconds_then_returns(self, station: Make) -> None:
        s = self.fly_out(station, 3)
        s.run(1.0)
        assert s.mode == LOITER
        assert s.run_until(lambda: s.mode == RTL, 10.0) == pytest.approx(4.0, abs=0.5)

    @pytest.mark.parametrize(
        "zone",
        [
            [(EXCLUDE, 4, east, 60.0 + north) for _, _, east, north in box(30.0)],
            [(CIRCLE_OUT, 30.0, 0.0, 60.0)],
        ],
        ids=["polygon", "circle"],
    )
    def test_a_zone_to_keep_out_of_is_a_fence_too(self, station: Make, zone: list[Row]) -> None:
        s = named(station())
        assert upload(s, [*box(90.0), *zone]) == 0
        s.fly_offboard(10.0)
        s.run_until(lambda: s.mode == LOITER, 30.0, lambda: s.setpoint(3.0, z=-10.0))
        assert s.body["north"] == pytest.approx(30.0, abs=0.5)

    def test_arming_outside_is_accepted(self, station: Make) -> None:
        s = named(station(pads=[(50.0, 0.0)]))
        upload(s, box(30.0))
        s.fly_up(10.0)
        assert s.mode == LOITER


@pytest.mark.row("ardupilot-fence")
class TestArduPilotFence:
    """Throttled short of it, or what follows a breach."""

    def flying(self, station: Make, **parameters: float) -> Any:
        s = named(station(autopilot="ardupilot"), "ardupilot")
        upload(s, box(60.0))
        for name, value in {"FENCE_ENABLE": 1, **parameters}.items():
            s.set_parameter(name, value)
        s.fly_guided(10.0)
        return s

    def test_avoidance_silently_throttles_short_of_it(self, station: Make) -> None:
        s = self.flying(station)
        texts = len(s.texts())
        s.run(40.0, lambda: s.setpoint(8.0, mask=VELOCITY))
        assert 50.0 < s.body["north"] < 60.0
        assert abs(s.body["v_north"]) < 0.2
        assert (s.mode, len(s.texts())) == (4, texts)

    @pytest.mark.parametrize(("action", "mode"), [(1, 6), (2, 9), (4, 17)])
    def test_without_avoidance_a_breach_has_its_action(self, station: Make, action: int, mode: int) -> None:
        s = self.flying(station, AVOID_ENABLE=0, FENCE_ACTION=action)
        s.run_until(lambda: s.mode != 4, 30.0, lambda: s.setpoint(8.0, mask=VELOCITY))
        assert s.mode == mode
        assert 60.0 < s.body["north"] < 62.0

    def test_it_cannot_be_armed_outside(self, station: Make) -> None:
        s = named(station(autopilot="ardupilot", pads=[(90.0, 0.0)]), "ardupilot")
        upload(s, box(60.0))
        assert s.command(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == [0]
        s.run(45.0)
        assert s.arm() == [mav.MAV_RESULT_FAILED]
        assert s.command(mav.MAV_CMD_DO_FENCE_ENABLE, 0) == [0]
        assert s.arm() == [0]
