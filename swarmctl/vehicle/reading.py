"""From the messages that every firmware sends alike to telemetry: units, signs and axes."""

from collections.abc import Callable
from typing import Any

from swarmctl.core.wire import in_si
from swarmctl.mavlink.dialect import mav

from .telemetry import GeoPoint, Telemetry

DRIFT = 1e-4
"""Seconds a second by which two clocks may drift apart."""
LEAST_AGE_S = 0.002
"""Less is the clocks' own millisecond."""


def read_position(telemetry: Telemetry, fields: Any, now: float) -> None:
    """GLOBAL_POSITION_INT: mm, and cm/s north, east, down.  0, 0 is what some firmwares say before a fix."""
    if fields.lat == 0 and fields.lon == 0:
        return
    telemetry.lat_e7 = fields.lat
    telemetry.lon_e7 = fields.lon
    telemetry.altitude_amsl_m = fields.alt / 1000.0
    telemetry.height_m, telemetry.v_east, telemetry.v_north, telemetry.v_up = in_si(
        fields.relative_alt, fields.vx, fields.vy, fields.vz
    )
    _date(telemetry, fields.time_boot_ms, now)
    telemetry.received_at = now


def _date(telemetry: Telemetry, boot_ms: int, now: float) -> None:
    """How long the position was under way, by the vehicle's own clock; clocks may drift apart a little."""
    offset = now - boot_ms / 1000.0
    since_s = max(boot_ms - telemetry.boot_ms, 0) / 1000.0
    telemetry.clock_offset_s = min(telemetry.clock_offset_s + DRIFT * since_s, offset)
    age = offset - telemetry.clock_offset_s
    telemetry.age_s = age if age > LEAST_AGE_S else 0.0
    telemetry.boot_ms = boot_ms


def read_clock(telemetry: Telemetry, asked_at: float, vehicle_s: float) -> None:
    """A ping that left at ``asked_at`` was answered when the vehicle's clock showed ``vehicle_s``.

    So the clocks are at least so far apart by now.  A simulator that cannot keep up falls behind by seconds in a
    flight, and without this its positions would seem ever older.
    """
    telemetry.clock_offset_s = max(telemetry.clock_offset_s, asked_at - vehicle_s)


def read_heartbeat(telemetry: Telemetry, fields: Any) -> None:
    """HEARTBEAT: mode and arming."""
    telemetry.mode = fields.custom_mode
    telemetry.armed = bool(fields.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)


def read_landed_state(telemetry: Telemetry, fields: Any) -> None:
    """EXTENDED_SYS_STATE."""
    telemetry.landed_state = fields.landed_state


def read_status(telemetry: Telemetry, fields: Any) -> None:
    """SYS_STATUS: the battery, which is -1 while the vehicle does not know."""
    percent = fields.battery_remaining
    telemetry.battery_percent = percent if percent >= 0 else None
    telemetry.status_received = True


def read_home(telemetry: Telemetry, fields: Any) -> None:
    """HOME_POSITION: degrees × 1e7 and mm."""
    telemetry.home = _geo_point(fields)


def read_origin(telemetry: Telemetry, fields: Any) -> None:
    """GPS_GLOBAL_ORIGIN: degrees × 1e7 and mm."""
    telemetry.origin = _geo_point(fields)


def read_version(telemetry: Telemetry, fields: Any) -> None:
    """AUTOPILOT_VERSION: a byte each of major, minor and patch, above one for the release type."""
    word = fields.flight_sw_version
    telemetry.version = f"{word >> 24 & 0xFF}.{word >> 16 & 0xFF}.{word >> 8 & 0xFF}"


def _geo_point(fields: Any) -> GeoPoint:
    return GeoPoint(fields.latitude / 1e7, fields.longitude / 1e7, fields.altitude / 1000.0)


READERS: dict[int, Callable[[Telemetry, Any], None]] = {
    mav.MAVLINK_MSG_ID_HEARTBEAT: read_heartbeat,
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: read_landed_state,
    mav.MAVLINK_MSG_ID_SYS_STATUS: read_status,
    mav.MAVLINK_MSG_ID_HOME_POSITION: read_home,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: read_origin,
    mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION: read_version,
}
