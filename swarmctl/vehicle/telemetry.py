"""What one vehicle last said of itself, in SI units and an east-north-up frame."""

import math
from dataclasses import dataclass
from typing import NamedTuple


class GeoPoint(NamedTuple):
    """A geodetic position: degrees, and metres above mean sea level."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


@dataclass(slots=True)
class Telemetry:
    """The vehicle's last word on everything; one object a session, updated in place.

    Positions stay the integers that crossed the link (degrees × 1e7).  ``received_at`` is the caller's
    time of the last valid position, ``-inf`` before the first.
    """

    lat_e7: int = 0
    lon_e7: int = 0
    altitude_amsl_m: float = 0.0
    height_m: float = 0.0  #: above home
    v_east: float = 0.0  #: m/s
    v_north: float = 0.0
    v_up: float = 0.0
    received_at: float = -math.inf
    age_s: float = 0.0  #: how old that position was then, beyond the least that any took to come
    clock_offset_s: float = math.inf  #: the caller's clock less the vehicle's, by the quickest position
    boot_ms: int = 0  #: the vehicle's own clock at that position
    armed: bool = False
    mode: int = -1  #: HEARTBEAT.custom_mode; -1 before the first
    landed_state: int = 0  #: MAV_LANDED_STATE; 0 is undefined
    battery_percent: int | None = None  #: None when the vehicle does not know
    home: GeoPoint | None = None
    origin: GeoPoint | None = None  #: of the vehicle's own local frame
    healthy: bool = False  #: the firmware's pre-arm checks pass
    status_received: bool = False  #: SYS_STATUS has come
    version: str | None = None  #: of the firmware, "1.17.0"

    @property
    def positioned(self) -> bool:
        """Whether a valid position has come."""
        return self.received_at > -math.inf

    def forget_clock(self) -> None:
        """The vehicle's clock was set anew."""
        self.clock_offset_s, self.age_s = math.inf, 0.0

    def forget(self) -> None:
        """Forget all but mode and arming, which every heartbeat tells: the vehicle may have restarted."""
        blank = Telemetry(mode=self.mode, armed=self.armed)
        for name in Telemetry.__slots__:
            setattr(self, name, getattr(blank, name))
