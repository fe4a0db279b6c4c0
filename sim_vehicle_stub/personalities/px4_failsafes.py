"""What makes PX4 leave the mode it is in: fence, ground station, battery, position.

Each is noticed once, when it begins.  Most make it loiter for a while first, so that a pilot can choose; a
mode that is ordered ends the failsafe.  (The loss of setpoints is part of OFFBOARD itself.)
"""

import math
from typing import TYPE_CHECKING

from swarmctl.mavlink.dialect import mav

from .px4_commands import Mode

if TYPE_CHECKING:
    from .px4 import Px4

GCS_NOTICED_S = 1.8
"""What passes, beside the parameter, until a silent ground station has consequences."""
WARN = 1
FAST_BREACH_CMPS, FAST_BREACH_S = 600, 2.2
"""Who is so fast is still on its way out when the breach is noticed anew, so long after; then holding is not enough."""
FENCE_ACTIONS = {2: Mode.LOITER, 3: Mode.RTL, 5: Mode.LAND}
GCS_ACTIONS = {1: Mode.LOITER, 2: Mode.RTL, 3: Mode.LAND}
BATTERY_LEVELS = (
    ("BAT_LOW_THR", "Low battery level, return advised"),
    ("BAT_CRIT_THR", "Critical battery level, land now"),
    ("BAT_EMERGEN_THR", "Emergency battery level, land immediately"),
)
BATTERY_ACTIONS: dict[int, tuple[Mode | None, ...]] = {
    2: (None, Mode.LAND, Mode.LAND),
    3: (None, Mode.RTL, Mode.LAND),
}
"""By COM_LOW_BAT_ACT: what each level brings about; with other values nobody looks."""


class Failsafes:
    """The failsafes of one vehicle."""

    def __init__(self, px4: "Px4") -> None:
        self._px4 = px4
        self._vehicle = px4.vehicle
        self._parameters = px4.vehicle.parameters
        self.parameter_changed()
        self.forget()

    def parameter_changed(self) -> None:
        """Read the parameters that every tick depends on."""
        self._fence_action = int(self._parameters["GF_ACTION"])
        self._gcs_action = int(self._parameters["NAV_DLL_ACT"])
        self._battery_actions = BATTERY_ACTIONS.get(int(self._parameters["COM_LOW_BAT_ACT"]))

    def forget(self) -> None:
        """A new flight: nothing has gone wrong yet, and a fence is broken only by leaving it."""
        self._outside = self._breaks_fence()
        self._gcs_lost = False
        self._unlocated = False
        self._level = 0
        self.cancel()

    def cancel(self) -> None:
        """A mode was ordered: nothing is to follow."""
        self._then: Mode | None = None
        self._then_at = math.inf

    @property
    def misses_ground_station(self) -> bool:
        """Whether a ground station is wanted and not heard."""
        if self._gcs_action == 0:
            return False
        heard = self._vehicle.gcs_at
        patience = self._parameters["COM_DL_LOSS_T"] + GCS_NOTICED_S
        return heard is None or self._vehicle.now - heard > patience

    def watch(self) -> None:
        """Notice what has begun since the last tick."""
        vehicle = self._vehicle
        if vehicle.landed:
            return
        if self._then is not None and vehicle.now >= self._then_at:
            mode, self._then = self._then, None
            self._px4.fail_into(mode)
        if vehicle.fence is not None:
            self._watch_fence()
        if self._gcs_action:
            self._watch_ground_station()
        if self._battery_actions is not None:
            self._watch_battery(self._battery_actions)
        if vehicle.located is self._unlocated:
            self._watch_position()

    def fence_changed(self) -> None:
        """A fence that home is not inside of is taken and told as any other, but complained of and not heeded."""
        if not self._is_fence_valid():
            text = "Geofence invalid, doesn't contain Home position"
            self._vehicle.say(mav.MAV_SEVERITY_CRITICAL, text)

    def _is_fence_valid(self) -> bool:
        fence, home = self._vehicle.fence, self._vehicle.home
        return fence is None or home is None or not fence.broken_at(*self._vehicle.home_place)

    def _breaks_fence(self) -> bool:
        fence, place = self._vehicle.fence, self._vehicle.pilot.place[:2]
        return fence is not None and fence.broken_at(*place) and self._is_fence_valid()

    def _watch_fence(self) -> None:
        was, self._outside = self._outside, self._breaks_fence()
        if was or not self._outside or self._fence_action == 0:
            return
        self._vehicle.say(mav.MAV_SEVERITY_WARNING, "Geofence: approaching or outside geofence")
        if self._fence_action == WARN:
            return
        mode = FENCE_ACTIONS.get(self._fence_action, Mode.LOITER)
        self._loiter_then(mode)
        if mode is Mode.LOITER and math.hypot(*self._vehicle.wire[4:6]) >= FAST_BREACH_CMPS:
            self._then, self._then_at = Mode.RTL, self._vehicle.now + FAST_BREACH_S

    def _watch_ground_station(self) -> None:
        was, self._gcs_lost = self._gcs_lost, self.misses_ground_station
        if was or not self._gcs_lost:
            return
        self._vehicle.say(mav.MAV_SEVERITY_WARNING, "Connection to ground station lost")
        self._loiter_then(GCS_ACTIONS.get(self._gcs_action, Mode.RTL))

    def _watch_battery(self, actions: tuple[Mode | None, ...]) -> None:
        share = self._vehicle.battery.percent / 100.0
        while self._level < len(BATTERY_LEVELS) and share <= self._parameters[BATTERY_LEVELS[self._level][0]]:
            text = BATTERY_LEVELS[self._level][1]
            mode = actions[self._level]
            self._level += 1
            self._vehicle.say(mav.MAV_SEVERITY_CRITICAL, text)
            if mode is not None:
                self.cancel()
                self._px4.fail_into(mode)

    def _watch_position(self) -> None:
        """Without a position it can only descend, and drifts."""
        self._unlocated = not self._vehicle.located
        if self._unlocated:
            self._vehicle.say(mav.MAV_SEVERITY_CRITICAL, "Position estimate lost, blind descent")
            self.cancel()
            self._px4.fail_into(Mode.LAND)

    def _loiter_then(self, mode: Mode) -> None:
        """Loiter for COM_FAIL_ACT_T, then do what the failsafe is for."""
        self._px4.fail_into(Mode.LOITER)
        if mode is not Mode.LOITER:
            self._then, self._then_at = mode, self._vehicle.now + self._parameters["COM_FAIL_ACT_T"]
