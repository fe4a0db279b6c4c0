"""How ArduCopter reads setpoints in GUIDED: group by group, places before velocities.

One ignored axis ignores its whole group, and a message that leaves nothing, or names a frame that it does
not know, stops the vehicle.  Velocities are flown for GUID_TIMEOUT, places until something else is said.
"""

import math
from typing import TYPE_CHECKING, Any

from swarmctl.core.calls import to_local
from swarmctl.mavlink.dialect import mav

from .projection import from_flat

if TYPE_CHECKING:
    from ..vehicle import StubVehicle
    from .ardupilot_parameters import Reader

POSITION, VELOCITY, YAW = 1 | 2 | 4, 8 | 16 | 32, 1024
LOCAL_FRAMES = frozenset({mav.MAV_FRAME_LOCAL_NED, mav.MAV_FRAME_LOCAL_OFFSET_NED})
BODY_FRAMES = frozenset({mav.MAV_FRAME_BODY_NED, mav.MAV_FRAME_BODY_OFFSET_NED})
RELATIVE_FRAMES = frozenset({mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
SEA_LEVEL_FRAMES = frozenset({mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT})
TURNS_ABOVE_MPS = 0.5
"""The nose turns into a velocity that is faster."""
TIME_SLACK_S = 1e-6
Place = tuple[float, float, float]


class Setpoints:
    """The setpoints that one vehicle flies."""

    def __init__(self, vehicle: "StubVehicle", values: "Reader") -> None:
        self._vehicle = vehicle
        self._values = values
        self._velocity: tuple[float, float] | None = None
        self._velocity_at = -math.inf

    def stop(self) -> None:
        """Brake and stay; forget what was to be flown."""
        self._velocity = None
        pilot = self._vehicle.pilot
        pilot.velocity(0.0, 0.0)
        pilot.climb_rate(0.0)

    def step(self) -> None:
        """Time has passed: stop when the last velocity is too old, and short of a fence."""
        if self._velocity is None:
            return
        if self._vehicle.now - self._velocity_at > self._values["GUID_TIMEOUT"] + TIME_SLACK_S:
            self.stop()
        else:
            self._vehicle.pilot.velocity(*self._throttled(*self._velocity))

    def fly_local(self, setpoint: Any) -> None:
        """Fly a SET_POSITION_TARGET_LOCAL_NED."""
        frame = setpoint.coordinate_frame
        if frame not in LOCAL_FRAMES and frame not in BODY_FRAMES:
            self.stop()
            return
        turn = self._vehicle.yaw if frame in BODY_FRAMES else 0.0
        sine, cosine = math.sin(turn), math.cos(turn)
        place = None
        if not setpoint.type_mask & POSITION and math.isfinite(setpoint.x + setpoint.y + setpoint.z):
            north = cosine * setpoint.x - sine * setpoint.y
            east = sine * setpoint.x + cosine * setpoint.y
            place = self._local_place(north, east, setpoint.z, frame == mav.MAV_FRAME_LOCAL_NED)
        v_north = cosine * setpoint.vx - sine * setpoint.vy
        v_east = sine * setpoint.vx + cosine * setpoint.vy
        self._steer(setpoint, place, v_east, v_north)

    def fly_global(self, setpoint: Any) -> None:
        """Fly a SET_POSITION_TARGET_GLOBAL_INT."""
        frame, vehicle = setpoint.coordinate_frame, self._vehicle
        if frame not in RELATIVE_FRAMES and frame not in SEA_LEVEL_FRAMES:
            self.stop()
            return
        place = None
        if not setpoint.type_mask & POSITION and math.isfinite(setpoint.alt):
            home_alt = vehicle.home[2] if vehicle.home is not None else vehicle.zero_amsl_m
            base = home_alt if frame in RELATIVE_FRAMES else 0.0
            east, north = to_local(setpoint.lat_int * 1e-7, setpoint.lon_int * 1e-7, *vehicle.fleet_origin)
            place = (east, north, setpoint.alt + base - vehicle.zero_amsl_m)
        self._steer(setpoint, place, setpoint.vy, setpoint.vx)

    def _local_place(self, north: float, east: float, down: float, from_origin: bool) -> Place:
        """A place in the fleet's frame, given from the vehicle's local origin or from where it is."""
        vehicle = self._vehicle
        if not from_origin:
            at_east, at_north, at_up = vehicle.pilot.place[:3]
            return at_east + east, at_north + north, at_up - down
        lat, lon = from_flat(north, east, *vehicle.local_origin[:2])
        fleet_east, fleet_north = to_local(lat, lon, *vehicle.fleet_origin)
        return fleet_east, fleet_north, vehicle.local_origin[2] - down - vehicle.zero_amsl_m

    def _steer(self, setpoint: Any, place: Place | None, v_east: float, v_north: float) -> None:
        pilot = self._vehicle.pilot
        if place is not None:
            self._velocity = None
            pilot.go_to(*place[:2])
            pilot.height(place[2])
        elif not setpoint.type_mask & VELOCITY and math.isfinite(v_east + v_north + setpoint.vz):
            self._velocity, self._velocity_at = (v_east, v_north), self._vehicle.now
            pilot.velocity(*self._throttled(v_east, v_north))
            pilot.climb_rate(-setpoint.vz)
        else:
            self.stop()
        self._turn(setpoint)

    def _turn(self, setpoint: Any) -> None:
        """Where the nose points: as told, or into the velocity."""
        if not setpoint.type_mask & YAW and math.isfinite(setpoint.yaw):
            self._vehicle.face(setpoint.yaw)
        elif self._velocity is not None:
            east, north = self._velocity
            if east * east + north * north > TURNS_ABOVE_MPS * TURNS_ABOVE_MPS:
                self._vehicle.face(math.atan2(east, north))

    def _throttled(self, v_east: float, v_north: float) -> tuple[float, float]:
        """The velocity that can still stop short of the fence: its part towards the nearest border."""
        vehicle, values = self._vehicle, self._values
        if vehicle.fence is None or not values["FENCE_ENABLE"] or not values["AVOID_ENABLE"]:
            return v_east, v_north
        east, north = vehicle.pilot.place[:2]
        border_east, border_north = vehicle.fence.nearest(east, north)
        d_east, d_north = border_east - east, border_north - north
        distance = math.sqrt(d_east * d_east + d_north * d_north)
        if distance == 0.0 or vehicle.fence.broken_at(east, north):
            return v_east, v_north
        d_east, d_north = d_east / distance, d_north / distance
        towards = v_east * d_east + v_north * d_north
        braking = vehicle.limits.braking
        allowed = math.sqrt(braking * max(0.0, distance - values["AVOID_MARGIN"]))
        excess = max(0.0, towards - allowed)
        return v_east - excess * d_east, v_north - excess * d_north
