"""How a vehicle really stops, against what the guard assumes of it: one vehicle, real or simulated.

    python benchmarks/stopping.py udpin://0.0.0.0:14540 [--speeds 2,4,8] [--speed FACTOR] [--altitude 20]

It takes off where it stands, flies east at each speed and is told to stop, then west; then it lands.  It needs
``--room`` metres (150) of free air east of it.  Distances are counted from where the vehicle was last known to be
when the order to stop was sent, as the guard counts them; assumed are those of core/guard.py with the adapter's
figures and this link's round trip.  A row that says NO means that the guard would be too hopeful.
"""

import argparse
import asyncio
import math
from collections.abc import Callable
from typing import NamedTuple

from swarmctl.core.calls import to_local
from swarmctl.core.guard import BRAKING_SHARE
from swarmctl.flight.live import FlightClock, LiveLink
from swarmctl.vehicle.addresses import parse
from swarmctl.vehicle.backend import Mavlink
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.switchboard import Switchboard

RATE_HZ = 20.0
PERIOD_S = 0.1
STANDING_MPS = 0.15
SETTLE_S, STEADY_S, LONGEST_S = 3.0, 2.0, 20.0


class Stop(NamedTuple):
    """One stop: the speed (m/s) at the order, how far it then came (m), at most, and when (s) it stood.

    ``late_m``: how much farther it came, at worst, than was assumed at a later moment of the stop.
    """

    speed_mps: float
    distance_m: float
    assumed_m: float
    stood_s: float
    began_s: float  #: until it had lost a tenth of its speed
    late_m: float


class Pilot:
    """Flies one session by setpoints and looks where it is."""

    def __init__(self, link: LiveLink, session: Session, altitude_m: float) -> None:
        self._link, self._session, self._altitude_m = link, session, altitude_m
        t = session.telemetry
        self._origin = (t.lat_e7 * 1e-7, t.lon_e7 * 1e-7, t.altitude_amsl_m)

    @property
    def east(self) -> float:
        """Metres east of where it began."""
        t = self._session.telemetry
        return float(to_local(t.lat_e7 * 1e-7, t.lon_e7 * 1e-7, *self._origin)[0])

    @property
    def v_east(self) -> float:
        """Metres a second."""
        return self._session.telemetry.v_east

    async def until(self, done: Callable[[], bool], longest_s: float, each: Callable[[], None]) -> float:
        """Let time pass; how much did."""
        began = self._link.clock.now()
        while not done() and self._link.clock.now() - began < longest_s:
            each()
            self._link.flush(self._link.poll())
            await asyncio.sleep(PERIOD_S / self._link.clock.speed)
        return self._link.clock.now() - began

    async def fly(self, v_east: float, seconds: float) -> None:
        """One velocity for so long."""
        await self.until(lambda: False, seconds, lambda: self.ask(v_east))

    def ask(self, v_east: float) -> None:
        """One setpoint."""
        self._session.setpoint(v_east, 0.0, self._altitude_m)

    async def stop(self, assumed_m: Callable[[float], float]) -> Stop:
        """Ask for standstill; how that went."""
        began, from_m, speed = self._link.clock.now(), self.east, self.v_east
        way = math.copysign(1.0, speed)
        farthest, began_s = 0.0, math.nan
        ends: list[float] = []

        def look() -> None:
            nonlocal farthest, began_s
            ends.append(way * (self.east - from_m) + assumed_m(max(way * self.v_east, 0.0)))
            self.ask(0.0)
            farthest = max(farthest, way * (self.east - from_m))
            if math.isnan(began_s) and abs(self.v_east) < 0.9 * abs(speed):
                began_s = self._link.clock.now() - began

        stood = await self.until(lambda: way * self.v_east < STANDING_MPS, LONGEST_S, look)
        await self.until(lambda: False, SETTLE_S, look)
        late = max(farthest - end for end in ends)
        return Stop(abs(speed), farthest, assumed_m(abs(speed)), stood, began_s, max(late, 0.0))


def assumed_m(session: Session, speed: float, acceleration: float) -> float:
    """What the guard takes the way to standstill for (core/guard.py), from the last known position on."""
    assert session.adapter is not None
    limits, trip = session.adapter.limits, session.statistics().round_trip
    braking = BRAKING_SHARE * min(limits.braking_mps2, acceleration)
    latency = limits.latency_s + (trip.median_s if trip else 0.0)
    lag = limits.lag_s
    return speed * latency + speed * speed / (2.0 * braking) + min(speed, braking * lag) * lag


async def phase(link: LiveLink, session: Session, wanted: Phase) -> None:
    """Wait for it."""
    while session.phase is not wanted:
        if session.phase is Phase.FAILED:
            raise SystemExit(session.reason)
        link.poll()
        await asyncio.sleep(0.02)


async def measure(options: argparse.Namespace) -> None:
    """Fly, and print a row a stop."""
    link = LiveLink(FlightClock(options.speed), Switchboard(), lambda now, sessions: None, Mavlink())
    settings = SessionSettings(rate_hz=RATE_HZ)
    link.meet(await link.find([parse(options.url)], 30.0), settings)
    (session,) = link.sessions
    await phase(link, session, Phase.READY)
    session.check(Preflight(read_parameters=True))
    await phase(link, session, Phase.READY)
    assert session.adapter is not None
    told = session.parameters
    print(f"{session.adapter.name} {session.telemetry.version}: {session.adapter.limits}")
    print({name: round(value, 3) for name, value in told.items()})
    session.take_off(options.altitude)
    await phase(link, session, Phase.HOLDING)
    session.engage()
    await phase(link, session, Phase.ENGAGED)
    pilot = Pilot(link, session, options.altitude)
    acceleration = session.adapter.limits.acceleration_mps2 or min(
        told.get("acceleration_mps2", math.inf), 4.0
    )
    print(f"{'asked':>6} {'speed':>6} {'way':>7} {'assumed':>8}  kept {'stood':>6} {'began':>6} {'late':>6}")
    for speed in map(float, options.speeds.split(",")):
        for way in (1.0, -1.0):
            await pilot.fly(way * speed, min(STEADY_S + speed, options.room / speed))
            stop = await pilot.stop(lambda v: assumed_m(session, v, acceleration))
            kept = "yes" if stop.distance_m <= stop.assumed_m else "NO"
            print(
                f"{speed:6.1f} {stop.speed_mps:6.2f} {stop.distance_m:7.2f} {stop.assumed_m:8.2f}  {kept:4}"
                f" {stop.stood_s:6.2f} {stop.began_s:6.2f} {stop.late_m:6.2f}", flush=True,
            )  # fmt: skip
    session.land()
    await phase(link, session, Phase.LANDED)
    link.close()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("url")
    parser.add_argument("--speeds", default="2,4,6,8,10")
    parser.add_argument("--speed", type=float, default=1.0, help="of the simulation, times real time")
    parser.add_argument("--altitude", type=float, default=20.0)
    parser.add_argument("--room", type=float, default=150.0)
    asyncio.run(measure(parser.parse_args()))


if __name__ == "__main__":
    main()
