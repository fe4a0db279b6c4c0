"""Stub vehicles in a process of their own, as a controller asks for them: the order comes as JSON on stdin.

    python -m sim_vehicle_stub.served < order.json

The process ends when its standard input is closed for good, so that no vehicle outlives its controller.
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
from .links import serve, udp

STEP_S = 0.02
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
    ending = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    done, _ = await asyncio.wait((serving, ending), return_when=asyncio.FIRST_COMPLETED)
    for task in done:
        task.result()
    serving.cancel()


def main() -> None:
    """Read the order, play the vehicles until the controller is gone."""
    asyncio.run(_run(json.loads(sys.stdin.readline())))


if __name__ == "__main__":
    main()
