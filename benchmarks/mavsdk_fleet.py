"""MAVSDK steers a fleet of stub vehicles by velocity: how evenly the setpoints arrive, and what that costs.

The vehicles are PX4 stubs in a process of their own, on one UDP port each: over a shared port MAVSDK would
send everything to everybody.  The intervals are those at which setpoints arrive at each vehicle's socket,
stamped by the kernel; the share of a core is that of the process that runs MAVSDK, all its threads.

MAVSDK repeats the last setpoint 20 times a second by itself and cannot be told another rate; one that is set
anew goes out at once, and the repetition goes on from there.  Up to 20 Hz it is therefore left to itself,
and sends 20; for more, every vehicle's setpoint is set anew at that rate.

    python benchmarks/mavsdk_fleet.py [--vehicles 50] [--rate 20] [--seconds 20]
"""

import argparse
import asyncio
import json
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from mavsdk import ComponentType, Configuration, ConnectionResult, Mavsdk, System, log_subscribe
from mavsdk.plugins.action import Action
from mavsdk.plugins.offboard import Offboard, VelocityNedYaw
from mavsdk.plugins.telemetry import Telemetry

from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.links import HOST, Clock, serve
from sim_vehicle_stub.vehicle import StubVehicle
from swarmctl.live_cli import free_ports

VEHICLES, RATE_HZ, SECONDS = 50, 20.0, 20.0
REPEATED_HZ = 20.0
"""What MAVSDK sends by itself."""
ORIGIN = (47.3977, 8.5456, 488.0)
SPACING_M, HEIGHT_M = 10.0, 5.0
VELOCITY = VelocityNedYaw(1.0, 0.5, 0.0, 0.0)
BOOTED_S = 10
"""The vehicles booted so long ago and are ready."""
STREAMS_US = {0: 1_000_000, 1: 500_000, 33: 100_000, 245: 500_000}
"""What the vehicles tell, as to a client that has turned the rest off (for much of it MAVSDK has no call)."""
SETTLED_S, PATIENCE_S = 3.0, 60.0
SETPOINT, OFFBOARD = 84, 0x60000
SO_TIMESTAMPNS, TIMESPEC = 35, struct.Struct("@ll")
"""Linux: a datagram comes with the time at which the kernel received it."""


class Figures(NamedTuple):
    """What was measured; ``flown``: vehicles that were in OFFBOARD and in the air at the end."""

    vehicles: int
    flown: int
    received_hz: float
    p50_ms: float
    p99_ms: float
    core_share: float


def measure(vehicles: int = VEHICLES, rate_hz: float = RATE_HZ, seconds: float = SECONDS) -> Figures:
    """Fly so many vehicles, with setpoints at ``rate_hz`` (never below 20), and measure for ``seconds``.

    The calling process must have nothing else to do: its time is taken for MAVSDK's.  Raises TimeoutError if the
    vehicles are not all found, or do not all rise, and OSError if no ports are free.
    """
    log_subscribe(lambda *_: True)
    port = free_ports(vehicles)
    arguments = [sys.executable, __file__, "--vehicles", str(vehicles), "--stubs-to", str(port)]
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as stubs:
        try:
            steered = engage(discover(mavsdk, vehicles, port))
            steer(steered, rate_hz, SETTLED_S)
            start, used = time.time(), time.process_time()
            steer(steered, rate_hz, seconds)
            end, used = time.time(), time.process_time() - used
            answer, _ = stubs.communicate(f"{start} {end}\n", PATIENCE_S)
        finally:
            stubs.kill()
            mavsdk.destroy()
    told = json.loads(answer)
    intervals_ms = 1000.0 * np.array(told["intervals_s"])
    return Figures(
        vehicles,
        told["flown"],
        told["setpoints"] / (end - start) / vehicles,
        float(np.percentile(intervals_ms, 50.0)),
        float(np.percentile(intervals_ms, 99.0)),
        used / (end - start),
    )


# The side of MAVSDK


def wait_for(condition: Callable[[], bool]) -> None:
    """Look now and then; raises TimeoutError in the end."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError("the vehicles do not come along")
        time.sleep(0.05)


def discover(mavsdk: Mavsdk, vehicles: int, port: int) -> list[System]:
    """Every vehicle, each on its own port."""
    for index in range(vehicles):
        if mavsdk.add_any_connection(f"udpin://{HOST}:{port + index}") is not ConnectionResult.SUCCESS:
            raise OSError(f"MAVSDK cannot listen on port {port + index}")
    wait_for(lambda: mavsdk.system_count() == vehicles)
    return list(mavsdk.get_systems())


def engage(systems: Sequence[System]) -> list[Offboard]:
    """Take all off, into OFFBOARD."""
    telemetries = [Telemetry(system) for system in systems]
    actions = [Action(system) for system in systems]
    for action in actions:
        action.set_takeoff_altitude(HEIGHT_M)
        action.arm()
        action.takeoff()
    wait_for(lambda: all(one.position().relative_altitude_m > 0.9 * HEIGHT_M for one in telemetries))
    steered = [Offboard(system) for system in systems]
    for offboard in steered:
        offboard.set_velocity_ned(VELOCITY)
        offboard.start()
    return steered


def steer(steered: Sequence[Offboard], rate_hz: float, seconds: float) -> None:
    """Let MAVSDK repeat, or set anew what it is to send faster than that."""
    if rate_hz <= REPEATED_HZ:
        time.sleep(seconds)
        return
    due = time.monotonic()
    end = due + seconds
    while due < end:
        for offboard in steered:
            offboard.set_velocity_ned(VELOCITY)
        due += 1.0 / rate_hz
        time.sleep(max(0.0, due - time.monotonic()))


# The side of the vehicles


class TimedLink:
    """A vehicle's socket; the kernel says when each datagram came, however busy this process is."""

    def __init__(self, vehicle: StubVehicle, partner: tuple[str, int], clock: Clock) -> None:
        self.arrivals: list[float] = []
        self._vehicle, self._partner, self._clock = vehicle, partner, clock
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self._socket.bind((HOST, 0))
        asyncio.get_running_loop().add_reader(self._socket, self._read)

    def _read(self) -> None:
        """Note the time of a setpoint, and hand the bytes on; a datagram is one MAVLink 2 frame."""
        data, ((_, _, stamp),), _, _ = self._socket.recvmsg(2048, 64)
        if int.from_bytes(data[7:10], "little") == SETPOINT:
            seconds, nanoseconds = TIMESPEC.unpack(stamp)
            self.arrivals.append(seconds + 1e-9 * nanoseconds)
        self._vehicle.receive(data, self._clock.now())
        self.flush()

    def flush(self) -> None:
        """Send what the vehicle has to say."""
        for frame in self._vehicle.outgoing():
            self._socket.sendto(frame, self._partner)


async def play(vehicles: int, port: int) -> None:
    """Be the vehicles until a line on stdin names the span of time to tell of."""
    pads = [(SPACING_M * index, 0.0) for index in range(vehicles)]
    fleet = StubFleet(vehicles, origin=ORIGIN, pads_m=pads, now=-float(BOOTED_S))
    for second in range(-BOOTED_S, 0):
        fleet.advance(float(second))
    for vehicle in fleet.vehicles:
        vehicle.outgoing()
        for message_id in vehicle.personality.INTERVALS_US:
            vehicle.set_interval(message_id, STREAMS_US.get(message_id, -1))
    links: list[TimedLink] = []

    async def open_links(fleet: StubFleet, clock: Clock) -> list[TimedLink]:
        links.extend(TimedLink(one, (HOST, port + k), clock) for k, one in enumerate(fleet.vehicles))
        return links

    serving = asyncio.ensure_future(serve(fleet, open_links, 1.0))
    line = await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    serving.cancel()
    start, end = (float(word) for word in line.split())
    print(json.dumps(account(fleet, links, start, end)))


def account(fleet: StubFleet, links: Sequence[TimedLink], start: float, end: float) -> dict[str, Any]:
    """What happened between two times of the machine's clock."""
    spans = [[at for at in link.arrivals if start <= at <= end] for link in links]
    flown = [vehicle.personality.custom_mode == OFFBOARD and not vehicle.landed for vehicle in fleet.vehicles]
    return {
        "setpoints": sum(len(span) for span in spans),
        "intervals_s": [later - earlier for span in spans for earlier, later in pairwise(span)],
        "flown": sum(flown),
    }


def main() -> None:
    """Measure and print; or be the vehicles of such a measurement."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--vehicles", type=int, default=VEHICLES)
    parser.add_argument("--rate", type=float, default=RATE_HZ, help="Hz; below 20 it is 20")
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--stubs-to", type=int, metavar="PORT", help=argparse.SUPPRESS)
    wanted = parser.parse_args()
    if wanted.stubs_to is not None:
        asyncio.run(play(wanted.vehicles, wanted.stubs_to))
        return
    figures = measure(wanted.vehicles, wanted.rate, wanted.seconds)
    print(
        f"MAVSDK, {figures.flown} of {figures.vehicles} vehicles in OFFBOARD: setpoints arrive at "
        f"{figures.received_hz:.1f} Hz, interval p50 {figures.p50_ms:.1f} ms, p99 {figures.p99_ms:.1f} ms; "
        f"the client takes {figures.core_share:.1%} of a core"
    )


if __name__ == "__main__":
    main()
