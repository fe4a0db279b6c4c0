"""How PX4 reads setpoints: per axis, whatever the mask leaves; and when it misses them.

Horizontally a place goes before a velocity, vertically a height before a climb rate; what is left out is
held.  OFFBOARD asks for nothing but that the last setpoint is younger than COM_OF_LOSS_T: one is enough to
switch, if the command comes soon.  Messages in a frame that PX4 does not know are complained of, one text
each, and count for nothing.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from swarmctl.core.calls import to_local
from swarmctl.core.wire import height_of
from swarmctl.mavlink.dialect import mav

from .projection import reproject

if TYPE_CHECKING:
    from ..vehicle import StubVehicle

NO_XY, NO_Z, NO_VXY, NO_VZ, NO_YAW = 1 | 2, 4, 8 | 16, 32, 1024
LOCAL_NED: int = mav.MAV_FRAME_LOCAL_NED
BODY_NED: int = mav.MAV_FRAME_BODY_NED
RELATIVE_FRAMES = frozenset({mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
SEA_LEVEL_FRAMES = frozenset({mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT})

VELOCITY_DRIFT_MPS = 0.13
"""Climb rate by which the height runs away while nothing but velocities is commanded."""
NOTICED_S = 0.1
"""What passes, beside the parameter, until the loss of setpoints has consequences."""
TOLERANCE_S = 1e-6


class Setpoints:
    """The setpoints that one vehicle gets, and the last of them."""

    def __init__(self, vehicle: "StubVehicle") -> None:
        self._vehicle = vehicle
        self._parameters = vehicle.parameters
        self._last: Any = None
        self._fly: Callable[[Any], None] = self._fly_local
        self._last_at = -math.inf

    @property
    def lost(self) -> bool:
        """Whether the last setpoint is too old, or there was none."""
        return self._age > self._parameters["COM_OF_LOSS_T"] + TOLERANCE_S

    @property
    def missed(self) -> bool:
        """Whether it has been for so long that something is done about it."""
        return self._age > self._parameters["COM_OF_LOSS_T"] + NOTICED_S - TOLERANCE_S

    @property
    def _age(self) -> float:
        return self._vehicle.now - self._last_at

    def take_local(self, setpoint: Any) -> bool:
        """Note a SET_POSITION_TARGET_LOCAL_NED; False if it cannot be used."""
        if setpoint.coordinate_frame not in (LOCAL_NED, BODY_NED):
            self._complain("SET_POSITION_TARGET_LOCAL_NED", setpoint.coordinate_frame)
            return False
        self._note(setpoint, self._fly_local)
        return True

    def take_global(self, setpoint: Any) -> bool:
        """Note a SET_POSITION_TARGET_GLOBAL_INT; False if it cannot be used."""
        if setpoint.coordinate_frame not in RELATIVE_FRAMES | SEA_LEVEL_FRAMES:
            self._complain("SET_POSITION_TARGET_GLOBAL_INT", setpoint.coordinate_frame)
            return False
        self._note(setpoint, self._fly_global)
        return True

    def fly_last(self) -> None:
        """Fly the last setpoint, if there was one."""
        if self._last is not None:
            self._fly(self._last)

    def _complain(self, message: str, frame: int) -> None:
        self._vehicle.say(mav.MAV_SEVERITY_ERROR, f"{message} coordinate frame {frame} unsupported")

    def _note(self, setpoint: Any, fly: Callable[[Any], None]) -> None:
        self._last_at = self._vehicle.now
        self._last, self._fly = setpoint, fly

    def _fly_local(self, setpoint: Any) -> None:
        vehicle = self._vehicle
        v_north, v_east = setpoint.vx, setpoint.vy
        in_body = setpoint.coordinate_frame == BODY_NED
        if in_body:
            sine, cosine = math.sin(vehicle.yaw), math.cos(vehicle.yaw)
            v_north, v_east = cosine * v_north - sine * v_east, sine * v_north + cosine * v_east
        mask = setpoint.type_mask
        x, y, z = setpoint.x, setpoint.y, setpoint.z
        place = None
        if not in_body and not mask & NO_XY and math.isfinite(x + y):
            lat, lon = reproject(x, y, *vehicle.local_origin[:2])
            place = to_local(lat, lon, *vehicle.fleet_origin)
        height = None
        if not in_body and not mask & NO_Z and math.isfinite(z):
            height = height_of(z, vehicle.local_origin[2], vehicle.zero_amsl_m)
        self._steer(setpoint, place, height, v_east, v_north)

    def _fly_global(self, setpoint: Any) -> None:
        vehicle = self._vehicle
        mask = setpoint.type_mask
        place = None
        if not mask & NO_XY:
            place = to_local(setpoint.lat_int * 1e-7, setpoint.lon_int * 1e-7, *vehicle.fleet_origin)
        height = None
        if not mask & NO_Z and math.isfinite(setpoint.alt):
            base = 0.0
            if setpoint.coordinate_frame in RELATIVE_FRAMES and vehicle.home is not None:
                base = vehicle.home[2]
            height = setpoint.alt + base - vehicle.zero_amsl_m
        self._steer(setpoint, place, height, setpoint.vy, setpoint.vx)

    def _steer(
        self,
        setpoint: Any,
        place: tuple[float, float] | None,
        height: float | None,
        v_east: float,
        v_north: float,
    ) -> None:
        """Give the pilot what a setpoint means, each axis for itself."""
        pilot, mask = self._vehicle.pilot, setpoint.type_mask
        if place is not None:
            pilot.go_to(*place)
        elif not mask & NO_VXY and math.isfinite(v_east + v_north):
            pilot.velocity(v_east, v_north)
        else:
            pilot.velocity(0.0, 0.0)
        if height is not None:
            pilot.height(height)
        elif not mask & NO_VZ and math.isfinite(setpoint.vz):
            pilot.climb_rate(VELOCITY_DRIFT_MPS - setpoint.vz)
        else:
            pilot.climb_rate(0.0)
        if not mask & NO_YAW and math.isfinite(setpoint.yaw):
            self._vehicle.face(setpoint.yaw)
