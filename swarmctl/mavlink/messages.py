"""The frequent messages as typed tuples, in wire order, and what is needed to pack and unpack them.

Field names, units and values are pymavlink's own, and so are the types and the checksum seed of each
message: nothing about the wire format is written down a second time.  The order of the fields is the one
on the wire (large types first), which is what lets a payload be unpacked straight into the tuple; the
dialect is asked at import whether that still holds.
"""

import struct
from collections.abc import Sequence
from itertools import islice
from typing import Any, NamedTuple

from .dialect import mav


class GlobalPositionInt(NamedTuple):
    """GLOBAL_POSITION_INT: degrees × 1e7, mm (above sea level, above home), cm/s north east down, 0.01°."""

    time_boot_ms: int
    lat: int
    lon: int
    alt: int
    relative_alt: int
    vx: int
    vy: int
    vz: int
    hdg: int


class LocalPositionNed(NamedTuple):
    """LOCAL_POSITION_NED: metres and m/s north, east, down from the vehicle's own origin."""

    time_boot_ms: int
    x: float
    y: float
    z: float
    vx: float
    vy: float
    vz: float


class Attitude(NamedTuple):
    """ATTITUDE: radians and rad/s."""

    time_boot_ms: int
    roll: float
    pitch: float
    yaw: float
    rollspeed: float
    pitchspeed: float
    yawspeed: float


class Heartbeat(NamedTuple):
    """HEARTBEAT: who is there, in which mode, armed or not."""

    custom_mode: int
    type: int
    autopilot: int
    base_mode: int
    system_status: int
    mavlink_version: int


class SysStatus(NamedTuple):
    """SYS_STATUS: sensor bits, load in 0.1 %, battery in mV, cA and percent, link errors."""

    onboard_control_sensors_present: int
    onboard_control_sensors_enabled: int
    onboard_control_sensors_health: int
    load: int
    voltage_battery: int
    current_battery: int
    drop_rate_comm: int
    errors_comm: int
    errors_count1: int
    errors_count2: int
    errors_count3: int
    errors_count4: int
    battery_remaining: int
    onboard_control_sensors_present_extended: int
    onboard_control_sensors_enabled_extended: int
    onboard_control_sensors_health_extended: int


class ExtendedSysState(NamedTuple):
    """EXTENDED_SYS_STATE: whether the vehicle is on the ground."""

    vtol_state: int
    landed_state: int


class SetPositionTargetLocalNed(NamedTuple):
    """SET_POSITION_TARGET_LOCAL_NED: a setpoint, of which ``type_mask`` names the fields to ignore."""

    time_boot_ms: int
    x: float
    y: float
    z: float
    vx: float
    vy: float
    vz: float
    afx: float
    afy: float
    afz: float
    yaw: float
    yaw_rate: float
    type_mask: int
    target_system: int
    target_component: int
    coordinate_frame: int


class Timesync(NamedTuple):
    """TIMESYNC: nanoseconds by the clock of who answers, 0 in a question, and of who asked."""

    tc1: int
    ts1: int


class HomePosition(NamedTuple):
    """HOME_POSITION: degrees × 1e7, mm above sea level, the place in the vehicle's own frame (m)."""

    latitude: int
    longitude: int
    altitude: int
    x: float
    y: float
    z: float
    q: Sequence[float]
    approach_x: float
    approach_y: float
    approach_z: float
    time_usec: int


class BatteryStatus(NamedTuple):
    """BATTERY_STATUS: mAh, hJ, 0.01 degrees Celsius, mV of each cell, 0.01 A, percent."""

    current_consumed: int
    energy_consumed: int
    temperature: int
    voltages: Sequence[int]
    current_battery: int
    id: int
    battery_function: int
    type: int
    battery_remaining: int
    time_remaining: int = 0
    charge_state: int = 0
    voltages_ext: Sequence[int] = (0, 0, 0, 0)
    mode: int = 0
    fault_bitmask: int = 0


class SystemTime(NamedTuple):
    """SYSTEM_TIME: µs since 1970, ms since boot."""

    time_unix_usec: int
    time_boot_ms: int


class EstimatorStatus(NamedTuple):
    """ESTIMATOR_STATUS: how well the vehicle's estimate fits what it measures, and what it is good for."""

    time_usec: int
    vel_ratio: float
    pos_horiz_ratio: float
    pos_vert_ratio: float
    mag_ratio: float
    hagl_ratio: float
    tas_ratio: float
    pos_horiz_accuracy: float
    pos_vert_accuracy: float
    flags: int


class Vibration(NamedTuple):
    """VIBRATION: levels by axis, and how often each accelerometer clipped."""

    time_usec: int
    vibration_x: float
    vibration_y: float
    vibration_z: float
    clipping_0: int
    clipping_1: int
    clipping_2: int


class HotMessage(NamedTuple):
    """How to pack and unpack one frequent message."""

    message_id: int
    fields: type[Any]
    payload: struct.Struct
    crc_extra: bytes
    lengths: tuple[int, ...]
    """How many values of the payload each field has; empty if each has one."""

    def grouped(self, values: tuple[Any, ...]) -> list[Any]:
        """One value for each field: an array is a list, as in pymavlink's messages."""
        rest = iter(values)
        return [list(islice(rest, length)) if length > 1 else next(rest) for length in self.lengths]

    def flat(self, values: tuple[Any, ...]) -> list[Any]:
        """The inverse."""
        flat: list[Any] = []
        for value, length in zip(values, self.lengths, strict=True):
            flat += value if length > 1 else (value,)
        return flat


def _hot(fields: type[Any]) -> HotMessage:
    """Build from the dialect, which must agree on the order of the fields; it may have more at the end."""
    for message in mav.mavlink_map.values():
        if message.msgname.replace("_", "") == fields.__name__.upper():
            count = len(fields._fields)
            if tuple(message.ordered_fieldnames[:count]) != fields._fields:
                raise TypeError(f"{message.msgname}: the installed pymavlink has other fields than {fields}")
            lengths, codes = tuple(message.lengths[:count]), message.native_format.decode()[1 : count + 1]
            payload = "<" + "".join(f"{n}{code}" for n, code in zip(lengths, codes, strict=True))
            return HotMessage(
                message.id,
                fields,
                struct.Struct(payload),
                bytes([message.crc_extra]),
                lengths if sum(lengths) > count else (),
            )
    raise TypeError(f"the installed pymavlink has no message {fields.__name__}")


GLOBAL_POSITION_INT = _hot(GlobalPositionInt)
LOCAL_POSITION_NED = _hot(LocalPositionNed)
ATTITUDE = _hot(Attitude)
HEARTBEAT = _hot(Heartbeat)
SET_POSITION_TARGET_LOCAL_NED = _hot(SetPositionTargetLocalNed)
SYS_STATUS = _hot(SysStatus)
EXTENDED_SYS_STATE = _hot(ExtendedSysState)

HOT_MESSAGES = {
    hot.message_id: hot
    for hot in (
        GLOBAL_POSITION_INT,
        LOCAL_POSITION_NED,
        ATTITUDE,
        HEARTBEAT,
        SET_POSITION_TARGET_LOCAL_NED,
        SYS_STATUS,
        EXTENDED_SYS_STATE,
        *map(_hot, (Timesync, HomePosition, BatteryStatus, SystemTime, EstimatorStatus, Vibration)),
    )
}
BY_FIELDS = {hot.fields: hot for hot in HOT_MESSAGES.values()}
