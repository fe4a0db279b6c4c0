"""Does the guard keep its word?  Whole missions, take-off to landing, counted at every setpoint tick.

    python benchmarks/safety.py [--runs 200] [--flights 3] [--mission FILE] [--algos fco,mdc,...]

The first table flies the compiled loop with multicopter dynamics; the second the same missions over MAVLink.
Printed: vehicle-ticks outside the keep-in or inside a keep-out, the nearest two airborne vehicles came at one
height, runs below the separation, vehicles that did not land, the share of the search they stood still, the
longest flight, and the mean times to 25, 50 and 85 % (a run that never gets there counts as the whole search).
"""

import argparse
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from swarmctl.core import stages
from swarmctl.core.planners import MODULES
from swarmctl.mission.load import load
from swarmctl.mission.scenario import Scenario
from swarmctl.record.summary import time_to

HEADER = (
    f"{'':8}{'runs':>5}{'outside':>9}{'nearest':>9}{'too near':>9}{'not down':>9}{'standing':>9}"
    f"{'longest':>9}{'t25':>7}{'t50':>7}{'t85':>7}{'never':>7}"
)


def fly_compiled(scenario: Scenario, algorithm: str, seed: int) -> tuple[float, ...]:
    """One mission in the compiled loop: its account, the flight's length, who is not down, the times."""
    world = scenario.world(seed, algorithm)
    _, account, length = world.run_multicopter()
    down = int((world.errands["stage"] != stages.LANDED).sum())
    found = np.where(world.found < 0, np.inf, world.found * scenario.mission.planner.period_s)
    times = time_to(found)
    return (
        *account[:3],
        account[2] / max(account[3], 1.0),
        length,
        down,
        *(_late(times[k]) for k in ("25", "50", "85")),
    )


def _late(time_s: float | None) -> float:
    return float("inf") if time_s is None else time_s


def print_row(name: str, rows: list[tuple[float, ...]], separation: float, search_s: float) -> bool:
    """One algorithm's line; returns whether it was safe throughout."""
    table = np.array(rows)
    nearest, outside, standing = table[:, 0], table[:, 1], table[:, 3]
    times = np.minimum(table[:, 6:9], search_s).mean(axis=0)
    never = int(np.isinf(table[:, 8]).sum())
    near, down = int((nearest < separation).sum()), int(table[:, 5].sum())
    print(
        f"{name:8}{len(rows):5}{outside.sum():9.0f}{nearest.min():9.2f}{near:9}{down:9}"
        f"{100 * standing.mean():8.2f}%{table[:, 4].max():9.0f}{times[0]:7.0f}{times[1]:7.0f}{times[2]:7.0f}{never:7}",
        flush=True,
    )
    return outside.sum() == 0 and near == 0 and down == 0


def fly_mavlink(algorithm: str, seed: int, mission: str | None) -> tuple[float, ...]:
    """One mission by the command line, over MAVLink."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "swarmctl", "fly", "--algo", algorithm, "--seed", str(seed)]
        command += ["--out", folder, "--json"] + (["--mission", mission] if mission else [])
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        summary = json.loads(done.stdout)
    down = sum(v["outcome"] != "landed" for v in summary["per_vehicle"])
    simulated = summary["wall_s"] * summary["real_time_factor"]
    times = [_late(summary["time_to_s"][k]) for k in ("25", "50", "85")]
    nearest = summary["min_separation_m"] or float("inf")
    return (
        nearest,
        summary["geofence_violations"],
        0.0,
        summary["standing_fraction"],
        simulated,
        down,
        *times,
    )


def main() -> int:
    """Print both tables; exit status 1 if anything was unsafe."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--flights", type=int, default=3)
    parser.add_argument("--mission")
    parser.add_argument("--algos", default=",".join(MODULES))
    arguments = parser.parse_args()
    mission = load(arguments.mission)
    scenario = Scenario(mission, ideal=False)
    separation, search = mission.safety.separation_m, mission.duration_s
    safe = True
    print(f"compiled loop, multicopter dynamics: {mission.name}\n{HEADER}")
    with ThreadPoolExecutor(2) as pool:
        for name in arguments.algos.split(","):
            rows = list(pool.map(lambda seed, a=name: fly_compiled(scenario, a, seed), range(arguments.runs)))
            safe &= print_row(name, rows, separation, search)
    if arguments.flights:
        print(f"over MAVLink, lockstep\n{HEADER}")
    with ThreadPoolExecutor(2) as pool:
        for name in arguments.algos.split(",") if arguments.flights else ():
            flown = pool.map(
                lambda seed, a=name: fly_mavlink(a, seed, arguments.mission), range(arguments.flights)
            )
            safe &= print_row(name, list(flown), separation, search)
    print("safe throughout" if safe else "NOT SAFE")
    return 0 if safe else 1


if __name__ == "__main__":
    sys.exit(main())
