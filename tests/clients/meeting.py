"""A stub vehicle and MAVSDK meeting over UDP on this machine: two parties that share nothing but frames.

The stub is served in this process by an event loop in a thread of its own, several times faster than the
wall, and every frame that reaches it is kept.  MAVSDK is a native library with threads of its own: it asks
with blocking calls, tells through callbacks, and lives by the wall's clock.  What happened is read from the
stub (the truth of its body, whether it is armed, its plans and parameters), in the stub's own thread.
"""

import asyncio
import contextlib
import math
from collections.abc import Callable, Iterator
from threading import Thread
from typing import Any, NamedTuple

from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk
from mavsdk.plugins.action import Action
from mavsdk.plugins.geofence import Geofence
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Offboard
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.links import HOST, Clock, UdpLink, serve
from swarmctl.live_cli import free_ports
from swarmctl.mavlink.codec import Decoder, Frame
from swarmctl.mavlink.dialect import mav

ORIGIN = (47.3977, 8.5456, 488.0)
SPEED = 5.0
"""Times the wall's: MAVSDK's 20 setpoints a second are then 4 in a second of the vehicle's time."""
LONG_BOOTED_S = 45.0
"""By then both firmwares know where they are."""
DISCOVERED_WITHIN_S = 10.0
LOOK_EVERY_S = 0.005
PATIENCE_S = 20.0
COMMANDS = (mav.MAVLINK_MSG_ID_COMMAND_LONG, mav.MAVLINK_MSG_ID_COMMAND_INT)


class Modes(NamedTuple):
    """Custom modes of a firmware by what MAVSDK calls them."""

    hold: int
    offboard: int
    return_home: int


MODES = {"px4": Modes(0x3040000, 0x60000, 0x5040000), "ardupilot": Modes(17, 4, 6)}


class Heard(NamedTuple):
    """A frame that reached the vehicle: when by its clock, and by the wall's (s)."""

    at: float
    wall: float
    frame: Frame


class Link(UdpLink):
    """The vehicle's socket, which keeps what comes and what goes."""

    def __init__(self, stub: "ServedStub", port: int, clock: Clock) -> None:
        super().__init__(stub.vehicle, (HOST, port), clock)
        self._stub = stub
        self._decoder, self._decoder_of_own = Decoder(), Decoder()

    def datagram_received(self, data: bytes, address: tuple[str, int]) -> None:
        wall = asyncio.get_running_loop().time()
        now = self._clock.now()
        self._stub.heard += [Heard(now, wall, frame) for frame in self._decoder.feed(data)]
        super().datagram_received(data, address)

    def flush(self) -> None:
        for raw in self._vehicle.outgoing():
            self._stub.said += self._decoder_of_own.feed(raw)
            self._transport.sendto(raw, self._partner)

    def close(self) -> None:
        self._transport.close()


class ServedStub:
    """One stub vehicle that runs by itself; it booted ``booted_s`` seconds of its own time ago."""

    def __init__(self, autopilot: str, port: int, speed: float, booted_s: float) -> None:
        self.fleet = StubFleet(1, origin=ORIGIN, pads_m=[(0.0, 0.0)], autopilot=autopilot, now=-booted_s)
        self.vehicle = self.fleet.vehicles[0]
        self.truth: Any = self.fleet.truth[0]
        self.heard: list[Heard] = []
        self.said: list[Frame] = []
        for second in range(round(-booted_s), 0):
            self.fleet.advance(float(second))
        self.vehicle.outgoing()
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever)
        self._thread.start()
        self._in_its_thread(self._start(port, speed))

    def _in_its_thread(self, work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    async def _start(self, port: int, speed: float) -> None:
        async def open_link(fleet: StubFleet, clock: Clock) -> list[Link]:
            self._link = Link(self, port, clock)
            await self._loop.create_datagram_endpoint(lambda: self._link, (HOST, 0))
            return [self._link]

        self._serving = self._loop.create_task(serve(self.fleet, open_link, speed))

    @property
    def wall(self) -> float:
        """Seconds of the clock that `Heard.wall` is read from."""
        return self._loop.time()

    @property
    def now(self) -> float:
        """Seconds of the vehicle's clock."""
        return self.vehicle.now

    @property
    def place(self) -> tuple[float, float, float]:
        """East, north, up (m): the truth."""
        east, north, up = (float(self.truth[axis]) for axis in ("east", "north", "up"))
        return east, north, up

    @property
    def velocity(self) -> tuple[float, float, float]:
        """East, north, up (m/s): the truth."""
        east, north, up = (float(self.truth[axis]) for axis in ("v_east", "v_north", "v_up"))
        return east, north, up

    @property
    def mode(self) -> int:
        """The custom mode that it is in."""
        return self.vehicle.personality.custom_mode

    def until(self, condition: Callable[[], bool], limit_s: float = PATIENCE_S) -> float:
        """Wait for a condition, at most ``limit_s`` of the vehicle's time; the seconds it took."""
        return float(self._in_its_thread(self._until(condition, limit_s)))

    async def _until(self, condition: Callable[[], bool], limit_s: float) -> float:
        start = self.now
        while not condition():
            assert not self._serving.done(), self._serving.exception()
            assert self.now - start < limit_s, "it never happened"
            await asyncio.sleep(LOOK_EVERY_S)
        return self.now - start

    def arrive(self, *place: float) -> None:
        """Wait until the vehicle stands still at a place: east, north, up (m)."""
        self.until(lambda: math.dist(self.place, place) < 0.2 and math.hypot(*self.velocity) < 0.05, 60.0)

    def run(self, seconds: float) -> None:
        """Let the vehicle's time pass."""
        end = self.now + seconds
        self.until(lambda: self.now >= end, seconds + PATIENCE_S)

    def do(self, action: Callable[..., Any], *arguments: Any) -> None:
        """Have something done in the vehicle's thread."""

        async def act() -> None:
            action(*arguments)

        self._in_its_thread(act())

    def received(self, message_id: int) -> list[Any]:
        """The fields of all messages of this kind that came."""
        return [heard.frame.fields for heard in self.heard if heard.frame.message_id == message_id]

    def told(self, message_id: int) -> list[Any]:
        """The fields of all messages of this kind that the vehicle sent."""
        return [frame.fields for frame in self.said if frame.message_id == message_id]

    def commands(self, number: int) -> list[Any]:
        """The fields of all commands of this number that came."""
        return [
            fields
            for message_id in COMMANDS
            for fields in self.received(message_id)
            if fields.command == number
        ]

    def close(self) -> None:
        self._in_its_thread(self._stop())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _stop(self) -> None:
        self._serving.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._serving
        self._link.close()


class Client:
    """MAVSDK as a ground station with a connection, and the plugins that the tests use."""

    def __init__(self, url: str) -> None:
        self.mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        assert self.mavsdk.add_any_connection(url) is ConnectionResult.SUCCESS

    def discover(self) -> None:
        """Wait for the vehicle and make the plugins, which ask it for this and that."""
        system = self.mavsdk.first_autopilot(DISCOVERED_WITHIN_S)
        assert system is not None
        self.system = system
        self.action, self.telemetry, self.offboard = Action(system), Telemetry(system), Offboard(system)
        self.param, self.geofence, self.mission_raw = Param(system), Geofence(system), MissionRaw(system)

    def close(self) -> None:
        self.mavsdk.destroy()


class Meeting(NamedTuple):
    """Who meets."""

    stub: ServedStub
    client: Client

    def bear_rare_setpoints(self) -> None:
        """Have PX4 wait for them as long as ArduPilot does: ten times as fast as the wall, two come a second."""
        if "COM_OF_LOSS_T" in self.stub.vehicle.parameters:
            self.client.param.set_param_float("COM_OF_LOSS_T", 3.0)

    def take_off(self, height_m: float) -> None:
        """From the ground to hovering at a height."""
        self.client.action.set_takeoff_altitude(height_m)
        self.client.action.arm()
        self.client.action.takeoff()
        self.stub.arrive(*self.stub.place[:2], height_m)


@contextlib.contextmanager
def meeting(autopilot: str, speed: float = SPEED, booted_s: float = LONG_BOOTED_S) -> Iterator[Meeting]:
    """Vehicle and client on a port of their own, from discovery on; afterwards nothing of either is left."""
    port = free_ports(1)
    with contextlib.ExitStack() as stack:
        client = Client(f"udpin://{HOST}:{port}")
        stack.callback(client.close)
        stub = ServedStub(autopilot, port, speed, booted_s)
        stack.callback(stub.close)
        client.discover()
        yield Meeting(stub, client)
