"""MAVSDK as the ground station of one vehicle, without a socket: bytes in, bytes out.

Every vehicle has an instance of MAVSDK to itself, on its ``raw://`` connection.  So MAVSDK sees the frames of
this vehicle alone (on a connection of its own it sends everything to everybody who shares a port), all that it
sends can be recorded, and a controller that hangs sends nothing: MAVSDK by itself would go on repeating the last
setpoint.

MAVSDK calls back from threads of its own.  Those callbacks append to a queue and call ``wake``, nothing else;
everything here is to be called from one thread.
"""

from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any, NamedTuple

from mavsdk import Configuration, ConnectionResult, Mavsdk, MavsdkError, log_subscribe
from mavsdk.plugins.action import Action
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Offboard, VelocityNedYaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

from .link import GROUND_COMPONENT, GROUND_SYSTEM

NORTH_DEG = 0.0

# It would write to stdout.  Once for the process: the binding frees the function that was there before while
# MAVSDK's threads may still be calling it.
log_subscribe(lambda *_: True)


class Plugins(NamedTuple):
    """What MAVSDK does with a vehicle; ``blocking``: a thread for its calls that wait."""

    action: Any
    offboard: Any
    mission_raw: Any
    param: Any
    direct: Any
    telemetry: Any
    blocking: ThreadPoolExecutor


Done = Callable[[int | None], None]
"""Called from any thread with the MAV_RESULT of a deed; None if nobody knows."""
Deed = Callable[[Plugins, Done], None]
"""Something to have MAVSDK do, which it only begins before it returns."""


class Answer(NamedTuple):
    """How a deed ended: its name, and the MAV_RESULT, None if nobody knows."""

    name: str
    result: int | None


class Client:
    """MAVSDK for one vehicle.  ``wake`` is called, from any thread, when there is something to send or to hear."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._woken = False
        self._outgoing: deque[bytes] = deque()
        self._answers: deque[Answer] = deque()
        self._under_way: set[str] = set()
        self._plugins: Plugins | None = None
        self._configuration = Configuration.create_manual(GROUND_SYSTEM, GROUND_COMPONENT, True)
        self._mavsdk = Mavsdk(self._configuration)
        assert self._mavsdk.add_any_connection("raw://") is ConnectionResult.SUCCESS
        self._mavsdk.subscribe_raw_bytes_to_be_sent(lambda frame: self._put(self._outgoing, frame))

    def _put(self, queue: "deque[Any]", item: Any) -> None:
        """From MAVSDK's threads: queue, and wake the caller once."""
        queue.append(item)
        if not self._woken:
            self._woken = True
            self._wake()

    def feed(self, data: bytes) -> None:
        """Bytes came from the vehicle."""
        self._mavsdk.pass_received_raw_bytes(data)

    def drain(self) -> list[bytes]:
        """What MAVSDK wants sent, a frame each; given out once."""
        return _drained(self._outgoing)

    def answers(self) -> list[Answer]:
        """How deeds ended; each is given out once.  To be asked before ``drain``: from here on, it wakes again."""
        self._woken = False
        answers: list[Answer] = _drained(self._answers)
        self._under_way.difference_update(answer.name for answer in answers)
        return answers

    def do(self, name: str, deed: Deed) -> None:
        """Begin a deed, unless it is under way; nothing happens while MAVSDK does not know the vehicle."""
        plugins = self._found()
        if plugins is None or name in self._under_way:
            return
        self._under_way.add(name)
        deed(plugins, lambda result: self._put(self._answers, Answer(name, result)))

    def steer(self, v_north: float, v_east: float, v_down: float) -> None:
        """Set the velocity (m/s) that MAVSDK sends at once, and then repeats."""
        plugins = self._found()
        if plugins is not None:
            with suppress(MavsdkError):
                plugins.offboard.set_velocity_ned(VelocityNedYaw(v_north, v_east, v_down, NORTH_DEG))

    def send(self, name: str, fields_json: str, system: int, component: int) -> None:
        """Send a message that no plugin has a call for."""
        plugins = self._found()
        if plugins is not None:
            message = MavlinkMessage(name, GROUND_SYSTEM, GROUND_COMPONENT, system, component, fields_json)
            with suppress(MavsdkError):
                plugins.direct.send_message(message)

    @property
    def healthy(self) -> bool:
        """Whether the vehicle has a position and a home, and can be armed, as MAVSDK sees it."""
        plugins = self._found()
        if plugins is None:
            return False
        health = plugins.telemetry.health()
        return bool(health.is_armable and health.is_global_position_ok and health.is_home_position_ok)

    def _found(self) -> Plugins | None:
        """The plugins, once MAVSDK has heard the vehicle."""
        if self._plugins is None:
            system = self._mavsdk.first_autopilot(0.0)
            if system is not None:
                self._plugins = Plugins(
                    Action(system), Offboard(system), MissionRaw(system), Param(system), MavlinkDirect(system),
                    Telemetry(system), ThreadPoolExecutor(1),
                )  # fmt: skip
        return self._plugins

    def stop(self) -> None:
        """Begin nothing any more that waits."""
        if self._plugins is not None:
            self._plugins.blocking.shutdown(wait=False, cancel_futures=True)

    def close(self) -> None:
        """End MAVSDK with its threads and temporary folders; a call that waits is waited for, 3 s at most."""
        if self._plugins is not None:
            self._plugins.blocking.shutdown()
        self._mavsdk.destroy()
        self._configuration.destroy()


def _drained(queue: "deque[Any]") -> list[Any]:
    """Everything that is in a queue by now."""
    return [queue.popleft() for _ in range(len(queue))]
