"""ArduCopter's parameters under their present names and under those of 4.6 and before.

Inside the stub a parameter goes by its present name and unit.  An older firmware has `OLD_NAMES` instead,
some of them in centimetres, and does not answer to the new ones.
"""

from typing import NamedTuple

from ..parameters import Parameters
from ..pilot import Limits


class OldName(NamedTuple):
    """What a parameter was called, and how many of its units one of today's is."""

    name: str
    units: float = 1.0


OLD_NAMES = {
    "ARMING_SKIPCHK": OldName("ARMING_CHECK"),
    "LAND_ALT_LOW_M": OldName("LAND_ALT_LOW", 100.0),
    "LAND_SPD_MS": OldName("LAND_SPEED", 100.0),
    "MAV_GCS_SYSID": OldName("SYSID_MYGCS"),
    "MAV_SYSID": OldName("SYSID_THISMAV"),
    "PILOT_SPD_DN": OldName("PILOT_SPEED_DN", 100.0),
    "RTL_ALT_M": OldName("RTL_ALT", 100.0),
    "WP_ACC": OldName("WPNAV_ACCEL", 100.0),
    "WP_SPD": OldName("WPNAV_SPEED", 100.0),
    "WP_SPD_DN": OldName("WPNAV_SPEED_DN", 100.0),
    "WP_SPD_UP": OldName("WPNAV_SPEED_UP", 100.0),
}


TOLD_AT_BOOT = ("STAT_BOOTCNT", "STAT_FLTTIME", "STAT_RUNTIME")
"""Parameters that it tells of unasked, because it changes them itself."""


def at_boot(limits: Limits) -> dict[str, float]:
    """The parameters of 4.8."""
    return {
        "ARMING_SKIPCHK": 0,
        "AVOID_ENABLE": 3,
        "AVOID_MARGIN": 2.0,
        "DISARM_DELAY": 10,
        "FENCE_ACTION": 1,
        "FENCE_ALT_MAX": 100.0,
        "FENCE_ENABLE": 0,
        "FENCE_RADIUS": 300.0,
        "FENCE_TYPE": 7,
        "FS_EKF_ACTION": 1,
        "FS_GCS_ENABLE": 0,
        "FS_GCS_TIMEOUT": 5.0,
        "GUID_TIMEOUT": 3.0,
        "LAND_ALT_LOW_M": 10.0,
        "LAND_SPD_MS": min(0.5, limits.descent_mps),
        "MAV_GCS_SYSID": 255,
        "MAV_SYSID": 1,
        "PILOT_SPD_DN": 2.5,
        "RTL_ALT_M": 15.0,
        "RTL_LOIT_TIME": 5000,
        "STAT_BOOTCNT": 1,
        "STAT_FLTTIME": 0,
        "STAT_RUNTIME": 0,
        "WP_ACC": limits.acceleration_mps2,
        "WP_SPD": limits.speed_mps,
        "WP_SPD_DN": limits.descent_mps,
        "WP_SPD_UP": limits.climb_mps,
    }


def at_boot_of_old(limits: Limits) -> dict[str, float]:
    """The parameters of 4.6."""
    values = {}
    for name, value in at_boot(limits).items():
        old = OLD_NAMES.get(name, OldName(name))
        values[old.name] = type(value)(value * old.units)
    return values


class Reader:
    """Reads a vehicle's parameters by present name and in present units, whichever it has."""

    def __init__(self, parameters: Parameters, old: bool) -> None:
        self._parameters = parameters
        self._old = OLD_NAMES if old else {}

    def __getitem__(self, name: str) -> float:
        old = self._old.get(name)
        return self._parameters[name] if old is None else self._parameters[old.name] / old.units

    def set(self, name: str, value: float) -> None:
        """Set from inside; raises KeyError for an unknown name."""
        old = self._old.get(name)
        if old is None:
            self._parameters.set(name, value)
        else:
            self._parameters.set(old.name, value * old.units)
