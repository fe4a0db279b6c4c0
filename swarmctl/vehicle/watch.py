"""Watches a vehicle's telemetry for what nobody tells: its position gone, its battery low, setpoints not flown.

The position is lost when heartbeats still come but no valid position does.  With no heartbeat either it is
the link that is lost, which is another matter.  A vehicle is astray when it does the contrary of what it is
told and nothing about it; one that is slow to turn, falls short of its speed or dodges among others is not.
"""

import math

from .settings import SessionSettings
from .telemetry import Telemetry

# Boot time may seem to run backwards by as much as frames are late; a restart sets it back further.
RESTART_MS = 5000
# Heartbeats since the last position: a single one may just have come first after a gap.
BEATS_WITHOUT_POSITION = 2
# Faster than the one is flying, slower than the other is standing (m/s); so much of a step towards what it is told
# is obeying (m/s); and an angle of 120 degrees off (its cosine) is flying the other way.
FLIES_MPS, STANDS_MPS, MENDED_MPS, BACKWARDS = 2.0, 0.5, 1.0, -0.5
# Setpoints further apart than this (s) are two streams.
STREAM_GAP_S = 1.0
# Over so long (s) what it is told is smoothed: nobody can follow setpoints that change at every tick.
SMOOTHING_S = 2.0


class Watch:
    """What has been noticed of one vehicle since it was set up."""

    def __init__(self, settings: SessionSettings) -> None:
        self._settings = settings
        self.begin()

    def begin(self) -> None:
        """Start anew: the vehicle is being set up."""
        self.streams_gone = False  #: it may have forgotten what it was asked to send
        self._low_battery_told = False
        self._astray_told = False
        self._told_at = self._astray_since = -math.inf
        self._astray_from = (0.0, 0.0)
        self._told = (0.0, 0.0)  # smoothed: among many others a vehicle is told to dodge this way and that
        self.forgive()

    def forgive(self) -> None:
        """The link was silent: what did not come then is not missing."""
        self._beats = 0
        self._beat_at = float("-inf")

    def position_lost(self, telemetry: Telemetry, now: float) -> bool:
        """Count a heartbeat; whether the position is lost by now.  Before the first there is none to lose."""
        came_since = telemetry.received_at >= self._beat_at
        self._beats = 0 if came_since else self._beats + 1
        self._beat_at = now
        missing_s = now - telemetry.received_at
        long_ago = telemetry.positioned and missing_s >= self._settings.position_loss_s
        return self._beats >= BEATS_WITHOUT_POSITION and long_ago

    def battery_low(self, telemetry: Telemetry) -> bool:
        """Whether the battery is low; said once."""
        percent, limit = telemetry.battery_percent, self._settings.battery_low_percent
        if self._low_battery_told or percent is None or limit is None or percent > limit:
            return False
        self._low_battery_told = True
        return True

    def astray(self, v_east: float, v_north: float, telemetry: Telemetry, now: float) -> bool:
        """Whether a vehicle that is told this velocity (m/s) has been astray for long; said once, until it obeys."""
        flown = (telemetry.v_east, telemetry.v_north)
        pause_s = (now - self._told_at) * self._settings.time_scale
        begins = pause_s > STREAM_GAP_S
        self._told_at = now
        self._told = flown if begins else _smoothed(self._told, (v_east, v_north), pause_s / SMOOTHING_S)
        off = _contrary(self._told, flown) or (
            math.hypot(v_east, v_north) < STANDS_MPS <= FLIES_MPS <= math.hypot(*flown)
        )
        if begins or not off or self._mends(v_east, v_north, flown):
            self._astray_told &= off
            self._astray_since, self._astray_from = now, flown
            return False
        if self._astray_told or now - self._astray_since < self._settings.astray_s:
            return False
        self._astray_told = True
        return True

    def _mends(self, v_east: float, v_north: float, flown: tuple[float, float]) -> bool:
        """Whether it has come nearer to what it is told now."""
        d_east, d_north = flown[0] - self._astray_from[0], flown[1] - self._astray_from[1]
        to_east, to_north = v_east - flown[0], v_north - flown[1]
        return d_east * to_east + d_north * to_north >= MENDED_MPS * math.hypot(to_east, to_north)


def _contrary(told: tuple[float, float], flown: tuple[float, float]) -> bool:
    """Whether a vehicle stands that is told to fly, or flies the other way."""
    wanted, speed = math.hypot(*told), math.hypot(*flown)
    if wanted < FLIES_MPS:
        return False
    along = told[0] * flown[0] + told[1] * flown[1]
    return speed < STANDS_MPS or (speed >= FLIES_MPS and along < BACKWARDS * wanted * speed)


def _smoothed(before: tuple[float, float], told: tuple[float, float], share: float) -> tuple[float, float]:
    """``before``, moved by ``share`` of the way towards ``told``."""
    share = min(share, 1.0)
    return before[0] + share * (told[0] - before[0]), before[1] + share * (told[1] - before[1])
