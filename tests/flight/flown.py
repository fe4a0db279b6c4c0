"""One small mission, flown in lockstep inside the test process and recorded, for the tests of this folder.

It is short (a second of wall time) and yet has everything that a recording must carry: several vehicles, a
keep-out, misses, false alarms and noise of the sensor, loss and delay of the radio, wandering targets.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pymap3d
from numpy.typing import NDArray
from pymavlink import mavutil

from sim_vehicle_stub.configured import configured_fleet
from sim_vehicle_stub.fleet import StubFleet
from swarmctl.core.world import World
from swarmctl.flight import fly as flight
from swarmctl.flight.orders import Orders
from swarmctl.flight.results import Outcome
from swarmctl.flight.swarm import Swarm
from swarmctl.mission.load import load
from swarmctl.mission.model import Mission
from swarmctl.record.folder import RunFolder

WIDTH_M, HEIGHT_M = 900.0, 800.0
KEEP_OUT_M = (400.0, 500.0, 350.0, 500.0)  # west, east, south, north
ORIGIN = (47.3977, 8.5456, 488.0)
ALTITUDE_M = 12.0
SMALL = f"""
name: small
origin: {{lat: {ORIGIN[0]}, lon: {ORIGIN[1]}, alt_m: {ORIGIN[2]}}}
area: {{size_m: [{WIDTH_M}, {HEIGHT_M}]}}
keep_out:
  - {{box_m: {list(KEEP_OUT_M)}}}
vehicles: {{count: 3, speed_mps: 18, altitude_m: {ALTITUDE_M}}}
sensor: {{range_m: 130, detection_probability: 0.8, false_alarms_per_hour: 60, position_noise_m: 3}}
radio: {{range_m: 400, loss: 0.1, delay_s: 2}}
targets: {{clusters: 8, count: 80, radius_m: 40, motion: wander}}
duration_s: 70
"""

Hobble = Callable[[StubFleet], Any]
"""Makes of sound stub vehicles what a test needs: anything with ``truth``, ``vehicles`` and ``advance``."""
Watch = Callable[[float, Swarm, World], None]


@dataclass(frozen=True)
class Flown:
    """A finished flight and its folder."""

    mission: Mission
    outcome: Outcome
    summary: dict[str, Any]
    folder: RunFolder


def small_mission(folder: Path, settings: dict[str, object] | None = None) -> Mission:
    """The small mission with ``settings`` over it; its file goes into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "small.yaml"
    file.write_text(SMALL)
    return load(file, settings)


def sound(fleet: StubFleet) -> StubFleet:
    """Vehicles with nothing wrong with them."""
    return fleet


def unwatched(now: float, swarm: Swarm, world: World) -> None:
    """Nobody looks on."""


def fly(
    path: Path, settings: dict[str, object] | None = None, *, seed: int = 1, hobble: Hobble = sound,
    watch: Callable[[Orders], Watch] | None = None,
) -> Flown:  # fmt: skip
    """Fly the small mission as the command line does, into ``path``/run.

    ``watch`` is given the operator's orders and returns what is called every ten seconds of the flight.
    """
    mission = small_mission(path, settings)
    folder = RunFolder(path / "run")
    folder.path.mkdir()
    orders = Orders()

    def make(mission: Mission, world: World) -> Any:
        endurance = flight.endurance_s(mission)
        interval = 1.0 / mission.setpoints.rate_hz
        return hobble(configured_fleet(world.fleet, ORIGIN, endurance, interval))

    report = watch(orders) if watch else unwatched
    outcome = flight.fly(mission, seed, folder, make, orders, report)
    return Flown(mission, outcome, flight.write_results(outcome, folder), folder)


@dataclass(frozen=True)
class Told:
    """What GLOBAL_POSITION_INT told, (K, V): metres in the mission's frame, by tick and vehicle."""

    times_s: NDArray[np.float64]
    east: NDArray[np.float64]
    north: NDArray[np.float64]
    up: NDArray[np.float64]

    @property
    def airborne(self) -> NDArray[np.bool_]:
        """Who was more than half a metre up."""
        return np.asarray(self.up > 0.5)


def read_with_pymavlink(tlog: Path) -> list[Any]:
    """Every message of a log, by pymavlink's own reader."""
    reader = mavutil.mavlink_connection(str(tlog), dialect="ardupilotmega")
    messages = []
    while (message := reader.recv_msg()) is not None:
        messages.append(message)
    reader.close()
    return messages


def told_positions(messages: list[Any], vehicles: int) -> Told:
    """Positions from messages alone, converted by pymap3d; ticks in which a vehicle was silent are left out."""
    ticks: dict[float, dict[int, Any]] = {}
    for message in messages:
        if message.get_type() == "GLOBAL_POSITION_INT":
            ticks.setdefault(message._timestamp, {})[message.get_srcSystem()] = message
    whole = {t: row for t, row in ticks.items() if len(row) == vehicles}
    table = [[row[i + 1] for i in range(vehicles)] for row in whole.values()]
    lat = np.array([[m.lat for m in row] for row in table]) * 1e-7
    lon = np.array([[m.lon for m in row] for row in table]) * 1e-7
    up = np.array([[m.relative_alt for m in row] for row in table]) * 1e-3
    east, north, _ = pymap3d.geodetic2enu(lat, lon, ORIGIN[2] + up, *ORIGIN)
    return Told(np.array(list(whole)), east, north, up)


def nearest_approach(told: Told) -> float | None:
    """The least horizontal distance (m) of two airborne vehicles less than 5 m apart in height."""
    near = []
    for i in range(told.up.shape[1]):
        for j in range(i):
            met = told.airborne[:, i] & told.airborne[:, j] & (np.abs(told.up[:, i] - told.up[:, j]) < 5.0)
            apart = np.hypot(told.east[:, i] - told.east[:, j], told.north[:, i] - told.north[:, j])
            near += apart[met].tolist()
    return min(near, default=None)


def outside(told: Told, slack_m: float) -> int:
    """Airborne positions more than ``slack_m`` outside the border or inside the keep-out."""
    west, east, south, north = KEEP_OUT_M
    s = slack_m
    within = (told.east > -s) & (told.east < WIDTH_M + s) & (told.north > -s) & (told.north < HEIGHT_M + s)
    kept_out = (told.east > west + s) & (told.east < east - s) & (told.north > south + s)
    kept_out &= told.north < north - s
    return int((told.airborne & (~within | kept_out)).sum())
