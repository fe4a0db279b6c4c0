"""Watches a vehicle's telemetry for what nobody tells: its position gone, its battery low, a restart.

The position is lost when heartbeats still come but no valid position does.  With no heartbeat either it is
the link that is lost, which is another matter.
"""

from .settings import SessionSettings
from .telemetry import Telemetry

# Boot time may seem to run backwards by as much as frames are late; a restart sets it back further.
RESTART_MS = 5000
# Heartbeats since the last position: a single one may just have come first after a gap.
BEATS_WITHOUT_POSITION = 2


class Watch:
    """What has been noticed of one vehicle since it was set up."""

    def __init__(self, settings: SessionSettings) -> None:
        self._settings = settings
        self.begin()

    def begin(self) -> None:
        """Start anew: the vehicle is being set up."""
        self.streams_gone = False  #: it may have forgotten what it was asked to send
        self._low_battery_told = False
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
