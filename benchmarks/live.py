"""Live flight at 1 × over UDP: how regular setpoints are, what the controller costs, how soon all are down.

    python benchmarks/live.py [--vehicles 6 100] [--seconds 60] [--rates 10 20]
                              [--backends mavlink mavsdk] [--mavsdk 50]

Flies `swarmctl fly --speed 1` inside this process with its stub vehicles in another, and counts this process's
own time from the barrier to the end of the search, planners on; with ``--backends mavlink mavsdk`` once by either
backend, one after the other.  ``--mavsdk N`` prints beside it what MAVSDK
takes to send bare velocity setpoints to N stub vehicles at 20 Hz (no planner, no guard, no recording).
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from swarmctl.core.world import World
from swarmctl.dashboard import Progress
from swarmctl.flight.fly import warm_up
from swarmctl.flight.orders import Orders
from swarmctl.flight.parts import Part
from swarmctl.flight.swarm import Swarm
from swarmctl.live_cli import Reach, backend, fly_with_stubs
from swarmctl.mission.load import load
from swarmctl.record.folder import RunFolder

MISSION = """
name: live
area: {size_m: [1000, 1000]}
keep_out:
  - {box_m: [500, 600, 450, 600]}
vehicles: {speed_mps: 12, altitude_m: 30}
sensor: {range_m: 60}
radio: {range_m: 200}
targets: {clusters: 6, count: 200, radius_m: 60}
"""
HEADER = (
    f"{'':32}{'p50 ms':>9}{'p99 ms':>9}{'max ms':>9}{'core %':>9}{'round trip ms':>15}"
    f"{'down after s':>14}{'nearest m':>11}"
)


class Account(Progress):
    """Takes the time when the search begins and ends."""

    def __init__(self) -> None:
        super().__init__()
        self.spent: dict[Part, tuple[float, float, float]] = {}

    def flying(self, now: float, swarm: Swarm, world: World) -> None:
        """Note the first report of each part: flight time, wall and processor seconds."""
        self.spent.setdefault(swarm.part, (now, time.perf_counter(), time.process_time()))

    def share_of_a_core(self) -> float:
        """What this process used from the barrier to the end of the search."""
        _, wall_0, cpu_0 = self.spent[Part.SEARCHING]
        _, wall_1, cpu_1 = self.spent[Part.RETURNING]
        return (cpu_1 - cpu_0) / (wall_1 - wall_0)

    def landing_s(self) -> float:
        """From the end of the search until everybody was down."""
        return self.spent[Part.OVER][0] - self.spent[Part.RETURNING][0]


def fly(vehicles: int, seconds: float, rate_hz: float, algorithm: str, by: str = "mavlink") -> dict[str, Any]:
    """One flight's figures."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        (path / "live.yaml").write_text(MISSION)
        settings = {
            "vehicles.count": vehicles, "duration_s": seconds, "setpoints.rate_hz": rate_hz,
            "planner.algorithm": algorithm,
        }  # fmt: skip
        mission = load(path / "live.yaml", settings)
        warm_up(mission, algorithm)
        account = Account()
        run = RunFolder.create(path / "run", algorithm=algorithm, now=None)  # type: ignore[arg-type]
        outcome = fly_with_stubs(mission, 1, run, 1.0, Orders(), account, backend(Reach(backend=by)))
    for line in outcome.complaints():
        print(line, file=sys.stderr)
    intervals = np.concatenate([np.asarray(s.setpoint_intervals_s) for s in outcome.sessions]) * 1e3
    trips = [s.statistics().round_trip for s in outcome.sessions]
    return {
        "vehicles": vehicles, "backend": by, "rate_hz": rate_hz, "p50_ms": float(np.percentile(intervals, 50)),
        "p99_ms": float(np.percentile(intervals, 99)), "max_ms": float(intervals.max()),
        "core": account.share_of_a_core(), "down_s": account.landing_s(),
        "round_trip_ms": 1e3 * float(np.median([t.median_s for t in trips if t])),
        "nearest_m": outcome.min_separation_m(), "exit": outcome.exit_code(),
    }  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vehicles", type=int, nargs="+", default=[6, 100])
    parser.add_argument("--seconds", type=float, default=60.0, help="length of the search")
    parser.add_argument("--rates", type=float, nargs="+", default=[10.0, 20.0], help="setpoints a second")
    parser.add_argument("--algo", default="fco")
    parser.add_argument("--backends", nargs="+", choices=["mavlink", "mavsdk"], default=["mavlink"])
    parser.add_argument("--mavsdk", type=int, default=0, metavar="N", help="drive N vehicles by MAVSDK too")
    parser.add_argument("--json", action="store_true", help="print JSON lines instead")
    arguments = parser.parse_args()
    if not arguments.json:
        print(HEADER)
    for vehicles in arguments.vehicles:
        for rate_hz in arguments.rates:
            for by in arguments.backends:
                show(fly(vehicles, arguments.seconds, rate_hz, arguments.algo, by), arguments.json)
    if arguments.mavsdk:
        import mavsdk_fleet

        figures = mavsdk_fleet.measure(arguments.mavsdk, 20.0, arguments.seconds)
        name = f"MAVSDK, {figures.vehicles} at 20 Hz"
        print(f"{name:32}{figures.p50_ms:9.1f}{figures.p99_ms:9.1f}{'':9}{100 * figures.core_share:9.1f}")


def show(figures: dict[str, Any], as_json: bool) -> None:
    """One line."""
    if as_json:
        print(json.dumps(figures), flush=True)
        return
    name = f"{figures['vehicles']} by {figures['backend']}, {figures['rate_hz']:g} Hz"
    print(
        f"{name:32}{figures['p50_ms']:9.1f}{figures['p99_ms']:9.1f}{figures['max_ms']:9.1f}"
        f"{100 * figures['core']:9.1f}{figures['round_trip_ms']:15.1f}{figures['down_s']:14.0f}"
        f"{figures['nearest_m'] or 0:11.1f}" + ("" if figures["exit"] == 0 else f"  EXIT {figures['exit']}"),
        flush=True,
    )


if __name__ == "__main__":
    main()
