"""What makes ArduCopter leave the mode it is in: ground station, fence, position.  It never goes back."""

import math
from typing import TYPE_CHECKING

from swarmctl.mavlink.dialect import mav

from .ardupilot_commands import Mode

if TYPE_CHECKING:
    from .ardupilot import ArduPilot

GCS_ACTIONS = {1: Mode.RTL, 3: Mode.SMART_RTL, 5: Mode.LAND}
FENCE_ACTIONS = {1: Mode.RTL, 2: Mode.LAND, 3: Mode.SMART_RTL, 4: Mode.BRAKE}
CEILING, RADIUS, SHAPES = 1, 2, 4
"""The bits of FENCE_TYPE: a height above home, a circle about home, and the polygons and circles of the plan."""


class Failsafes:
    """The failsafes of one vehicle; each is noticed once, when it begins."""

    def __init__(self, autopilot: "ArduPilot") -> None:
        self._autopilot = autopilot
        self._vehicle = autopilot.vehicle
        self._values = autopilot.values
        self.forget()

    def forget(self) -> None:
        """A new flight."""
        self._gcs_lost = False
        self._outside = False
        self._unlocated = not self._vehicle.located

    @property
    def outside_fence(self) -> bool:
        """Whether an enabled fence is broken where the vehicle is."""
        vehicle, values = self._vehicle, self._values
        if not values["FENCE_ENABLE"]:
            return False
        types, place = int(values["FENCE_TYPE"]), vehicle.pilot.place[:2]
        fence, home = vehicle.fence, vehicle.home
        return bool(
            (types & SHAPES and fence is not None and fence.broken_at(*place))
            or (types & RADIUS and math.dist(place, vehicle.home_place) > values["FENCE_RADIUS"])
            or (types & CEILING and home and vehicle.wire[2] * 1e-3 - home[2] > values["FENCE_ALT_MAX"])
        )

    @property
    def misses_fence(self) -> bool:
        """Whether a fence is switched on that there is nothing of."""
        values = self._values
        return bool(values["FENCE_ENABLE"] and values["FENCE_TYPE"] == SHAPES and self._vehicle.fence is None)

    def watch(self) -> None:
        """Notice what has begun since the last tick."""
        if self._vehicle.landed:
            return
        self._watch_ground_station()
        self._watch_fence()
        self._watch_position()

    def _watch_ground_station(self) -> None:
        heard, was = self._vehicle.gcs_at, self._gcs_lost
        if heard is None or not self._values["FS_GCS_ENABLE"]:
            return
        self._gcs_lost = self._vehicle.now - heard > self._values["FS_GCS_TIMEOUT"]
        if self._gcs_lost and not was:
            self._say("GCS Failsafe")
            self._autopilot.fail_into(GCS_ACTIONS.get(int(self._values["FS_GCS_ENABLE"]), Mode.RTL))

    def _watch_fence(self) -> None:
        was, self._outside = self._outside, self.outside_fence
        if was and not self._outside:
            self._vehicle.say(mav.MAV_SEVERITY_NOTICE, "Fence breach cleared")
        if self._outside and not was:
            self._vehicle.say(mav.MAV_SEVERITY_NOTICE, "Polygon fence breached")
            action = FENCE_ACTIONS.get(int(self._values["FENCE_ACTION"]))
            if action is not None:
                self._autopilot.fail_into(action)

    def _watch_position(self) -> None:
        was, self._unlocated = self._unlocated, not self._vehicle.located
        if self._unlocated and not was and self._values["FS_EKF_ACTION"]:
            self._say("EKF Failsafe: changed to LAND Mode")
            self._autopilot.fail_into(Mode.LAND)

    def _say(self, text: str) -> None:
        self._vehicle.say(mav.MAV_SEVERITY_CRITICAL, text)
