"""A second ground station on one vehicle, by a link of its own: a pilot who interferes, or somebody who looks on.

It sends no ground station's heartbeats, so no firmware takes it for the controller that it misses.
"""

import math
import select
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

SYSTEM, COMPONENT = 250, mav.MAV_COMP_ID_MISSIONPLANNER
GREET_S, LOOK_S = 1.0, 0.2
WANTED = (mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
WANTED_US = 200_000
NEEDED = {"HEARTBEAT", "GLOBAL_POSITION_INT"}
FENCE: int = mav.MAV_MISSION_TYPE_FENCE
REQUESTS = ("MISSION_REQUEST", "MISSION_REQUEST_INT")
M_PER_DEG = 111_194.9
FORGETS_S = 3.0
"""A fence that was cleared is still asked for a moment."""
MODES: dict[str, dict[str, tuple[int, int]]] = {  # DO_SET_MODE's second and third parameter
    "px4": {"hold": (4, 3), "return": (4, 5), "land": (4, 6)},
    "ardupilot": {"hold": (17, 0), "return": (6, 0), "land": (9, 0)},
}
NUMBERS = {  # HEARTBEAT.custom_mode
    "px4": {"setpoints": 0x60000, "hold": 0x3040000, "return": 0x5040000, "land": 0x6040000},
    "ardupilot": {"setpoints": 4, "hold": 17, "return": 6, "land": 9},
}


class Pilot:
    """One vehicle's other ground station; ``last`` has the latest message of each kind, by its name."""

    def __init__(self, firmware: str, system: int, peer: int | None = None, port: int = 0) -> None:
        """Speaks to UDP port ``peer`` of this machine, or waits on ``port`` for the vehicle to speak."""
        self.firmware, self.system = firmware, system
        self.last: dict[str, Any] = {}
        self.modes: list[tuple[float, int]] = []  #: (wall s, custom_mode) at every change
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._peer = None if peer is None else ("127.0.0.1", peer)
        self._mav = mav.MAVLink(None, SYSTEM, COMPONENT)
        self._mav.robust_parsing = True
        self._greeted_at = -GREET_S

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    @property
    def height_m(self) -> float:
        """Above home."""
        return float(self.last["GLOBAL_POSITION_INT"].relative_alt) * 1e-3

    @property
    def place(self) -> tuple[float, float]:
        """Latitude and longitude."""
        position = self.last["GLOBAL_POSITION_INT"]
        return position.lat * 1e-7, position.lon * 1e-7

    @property
    def armed(self) -> bool:
        """By its heartbeat."""
        return bool(self.last["HEARTBEAT"].base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)

    def is_in(self, mode: str) -> bool:
        """Whether it is in one of NUMBERS."""
        return "HEARTBEAT" in self.last and self.last["HEARTBEAT"].custom_mode == NUMBERS[self.firmware][mode]

    def change_mode(self, mode: str, patience_s: float = 10.0) -> None:
        """To one of MODES, and see that it is done."""
        main, sub = MODES[self.firmware][mode]
        flag = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        self.command(mav.MAV_CMD_DO_SET_MODE, flag, main, sub)
        self.until(lambda: self.is_in(mode), patience_s)

    def command(self, number: int, *parameters: float) -> None:
        """COMMAND_LONG."""
        given = (*parameters, *[0.0] * 7)[:7]
        self.say(mav.MAVLink_command_long_message(self.system, 1, number, 0, *given))

    def set_parameters(self, values: Mapping[str, float]) -> None:
        """As numbers, which is ArduPilot's way; see that each is done."""
        for name, value in values.items():
            self.last.pop("PARAM_VALUE", None)
            self.say(mav.MAVLink_param_set_message(self.system, 1, name.encode(), value, 9))
            self.until(lambda name=name: self._told_of(name), 10.0)
            assert self.last["PARAM_VALUE"].param_value == value

    def _told_of(self, parameter: str) -> bool:
        return "PARAM_VALUE" in self.last and self.last["PARAM_VALUE"].param_id == parameter

    def say(self, message: Any) -> None:
        """Send a message, if it is known where to."""
        if self._peer is not None:
            self._socket.sendto(message.pack(self._mav), self._peer)
            self._mav.seq = (self._mav.seq + 1) % 256

    def until(self, condition: Callable[[], bool], patience_s: float) -> float:
        """Read what comes until ``condition``; the wall time that took.  Raises TimeoutError."""
        began = time.monotonic()
        while not condition():
            left = began + patience_s - time.monotonic()
            if left <= 0.0:
                raise TimeoutError(
                    f"vehicle {self.system}: {self.last.get('HEARTBEAT')}, not in {patience_s} s"
                )
            self._greet()
            if select.select([self._socket], [], [], min(left, LOOK_S))[0]:
                self._take()
        return time.monotonic() - began

    def pass_by(self, seconds: float) -> None:
        """Read what comes for so long."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end, seconds + GREET_S)

    def refreshed(self) -> "Pilot":
        """With a heartbeat of now: what has waited to be read is of before."""
        while select.select([self._socket], [], [], 0.0)[0]:
            self._take()
        for kind in NEEDED:
            self.last.pop(kind, None)
        self.until(lambda: set(self.last) >= NEEDED, 10.0)
        return self

    def fence_in(self, home: tuple[float, float], margin_m: float) -> None:
        """Put a box about ``home`` and where the vehicle is on board, in place of its fence."""
        d_lat, d_lon = margin_m / M_PER_DEG, margin_m / (M_PER_DEG * math.cos(math.radians(home[0])))
        south, north = sorted((home[0], self.place[0]))
        west, east = sorted((home[1], self.place[1]))
        south, north, west, east = south - d_lat, north + d_lat, west - d_lon, east + d_lon
        corners = [(south, west), (south, east), (north, east), (north, west)]
        for kind in (*REQUESTS, "MISSION_ACK"):
            self.last.pop(kind, None)
        self.say(mav.MAVLink_mission_count_message(self.system, 1, len(corners), FENCE))
        sent: set[int] = set()

        def uploaded() -> bool:
            for kind in REQUESTS:
                request = self.last.pop(kind, None)
                if request is not None and request.target_system == SYSTEM:
                    self._send_corner(request.seq, corners)
                    sent.add(request.seq)
            return "MISSION_ACK" in self.last and len(sent) == len(corners)

        self.until(uploaded, 20.0)
        assert self.last["MISSION_ACK"].type == mav.MAV_MISSION_ACCEPTED

    def _send_corner(self, number: int, corners: Sequence[tuple[float, float]]) -> None:
        lat, lon = corners[number]
        self.say(
            mav.MAVLink_mission_item_int_message(
                self.system, 1, number, mav.MAV_FRAME_GLOBAL, mav.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
                0, 0, len(corners), 0, 0, 0, round(lat * 1e7), round(lon * 1e7), 0, FENCE,
            )
        )  # fmt: skip

    def fly_to(self, lat: float, lon: float, patience_s: float) -> None:
        """Without a fence on board, which PX4 would refuse to leave, fly somewhere at this altitude, and be there."""
        self.last.pop("MISSION_ACK", None)
        self.say(mav.MAVLink_mission_clear_all_message(self.system, 1, FENCE))
        self.until(lambda: "MISSION_ACK" in self.last, 10.0)
        self.pass_by(FORGETS_S)
        alt_m = self.last["GLOBAL_POSITION_INT"].alt * 1e-3
        self.say(
            mav.MAVLink_command_int_message(
                self.system, 1, mav.MAV_FRAME_GLOBAL, mav.MAV_CMD_DO_REPOSITION, 0, 0,
                -1.0, mav.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE, 0, math.nan, round(lat * 1e7), round(lon * 1e7), alt_m,
            )
        )  # fmt: skip

        def there() -> bool:
            d_lat, d_lon = self.place[0] - lat, (self.place[1] - lon) * math.cos(math.radians(lat))
            return math.hypot(d_lat, d_lon) * M_PER_DEG < 5.0

        self.until(there, patience_s)

    def _greet(self) -> None:
        """Tell the vehicle now and then where to send to, and what."""
        if time.monotonic() < self._greeted_at + GREET_S:
            return
        self._greeted_at = time.monotonic()
        self.say(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4, 3))
        for message_id in WANTED:
            self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, WANTED_US)

    def _take(self) -> None:
        data, sender = self._socket.recvfrom(4096)
        self._peer = self._peer or sender
        for message in self._mav.parse_buffer(data) or ():
            if message.get_srcSystem() == self.system and message.get_srcComponent() == 1:
                self._note(message)

    def _note(self, message: Any) -> None:
        kind = message.get_type()
        before = self.last.get(kind)
        self.last[kind] = message
        if kind == "HEARTBEAT" and (before is None or before.custom_mode != message.custom_mode):
            self.modes.append((time.monotonic(), message.custom_mode))
