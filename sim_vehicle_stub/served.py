"""Stub vehicles in a process of their own, as a controller asks for them: the order comes as JSON on stdin.

    python -m sim_vehicle_stub.served < order.json

The controller that is done with them ends the process.  If it dies instead, which closes the process's standard
input, the vehicles do as their firmware's failsafe says, and another controller may find them; when they have landed,
or are left hovering, and nobody has spoken to them for a while, the process ends by itself.
"""

import asyncio
import json
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from swarmctl.core.arrays import Records
from swarmctl.core.state import VEHICLE

from .configured import configured_fleet
from .fleet import StubFleet
from .links import serve, udp

STEP_S = 0.02
LANDED_S, ALOFT_S = 30.0, 1800.0
"""Wall time without a ground station, after landing and in the air, after which an orphaned process ends."""
LOOK_S = 0.5
OWN_PORT_OFFSET = 1000


def order(
    vehicles: Records, origin: Sequence[float], endurance_s: Sequence[float | None], autopilots: Sequence[str],
    wind_mps: Sequence[float], port: int, speed: float,
) -> str:  # fmt: skip
    """The order for ``vehicles`` (V,) VEHICLE, vehicle i sending to ``port`` + i of this machine."""
    content = {
        "vehicles": [dict(zip(VEHICLE.names or (), row.tolist(), strict=True)) for row in vehicles],
        "origin": list(origin),
        "endurance_s": list(endurance_s),
        "autopilots": list(autopilots),
        "wind_mps": list(wind_mps),
        "port": port,
        "speed": speed,
    }
    return json.dumps(content)


async def _run(wanted: dict[str, Any]) -> None:
    vehicles = np.zeros(len(wanted["vehicles"]), VEHICLE)
    for row, values in zip(vehicles, wanted["vehicles"], strict=True):
        for name, value in values.items():
            row[name] = value
    lat, lon, alt = wanted["origin"]
    fleet = configured_fleet(
        vehicles, (lat, lon, alt), wanted["endurance_s"], STEP_S,
        autopilots=wanted["autopilots"], wind_mps=tuple(wanted["wind_mps"]),
    )  # fmt: skip
    serving = asyncio.ensure_future(
        serve(fleet, udp(wanted["port"], wanted["port"] + OWN_PORT_OFFSET, False), wanted["speed"])
    )
    ending = asyncio.ensure_future(_forsaken(fleet, wanted["speed"]))
    done, _ = await asyncio.wait((serving, ending), return_when=asyncio.FIRST_COMPLETED)
    for task in done:
        task.result()
    serving.cancel()


async def _forsaken(fleet: StubFleet, speed: float) -> None:
    """Wait until the controller is gone, and nobody has come in its place."""
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    landed_s = silent_s = 0.0
    while landed_s < LANDED_S and silent_s < ALOFT_S:
        await asyncio.sleep(LOOK_S)
        silent_s = min(vehicle.now - (vehicle.gcs_at or 0.0) for vehicle in fleet.vehicles) / speed
        down = not any(vehicle.armed for vehicle in fleet.vehicles)
        landed_s = min(landed_s + LOOK_S, silent_s) if down else 0.0


def main() -> None:
    """Read the order, play the vehicles until the controller is gone."""
    asyncio.run(_run(json.loads(sys.stdin.readline())))


if __name__ == "__main__":
    main()
