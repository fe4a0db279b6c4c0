"""What belief is worth: its speed, the figures on the reference scenario, and how it holds up in others, fco beside it.

    python benchmarks/belief.py [--speed] [--reference] [--table] [--wind] [--runs 1000] [--table-runs 100]

All four without any of the first four.  Times are seconds of search to a level of the targets, mean ± standard
deviation of the runs that reached it, in brackets how many never did.  Wind blows only where MAVLink is flown, so its
rows are whole flights of ``swarmctl fly``, a few of them.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from swarmctl.core.arrays import Floats, Records
from swarmctl.mission.load import load
from swarmctl.mission.scenario import Scenario
from swarmctl.study.runs import LEVELS_PERCENT, Job, simulate

PAPER = Path(__file__).parents[1] / "missions" / "paper.yaml"
LEVEL = LEVELS_PERCENT.index(85)
Settings = dict[str, object]
NEAR_UNIFORM: Settings = {"targets.clusters": 450, "targets.radius_m": 50}
TABLE: dict[str, Settings] = {
    "reference": {},
    **{f"{n} vehicles": {"vehicles.count": n} for n in (3, 9, 12)},
    **{f"sensor {m} m": {"sensor.range_m": m} for m in (150, 300, 450)},
    **{f"{n} clusters": {"targets.clusters": n} for n in (3, 12)},
    "no radio": {"radio.range_m": 0},
    **{f"radio {m} m": {"radio.range_m": m} for m in (200, 1500)},
    "near-uniform targets": NEAR_UNIFORM,
    "20 % radio loss": {"radio.loss": 0.2},
    "detection 0.7": {"sensor.detection_probability": 0.7},
    "wandering targets": {"targets.motion": "wander"},
}
WINDS = ([0, 0], [4, 0], [6, 6])


def figure(times: Floats) -> str:
    """Mean ± standard deviation (unfinished)."""
    done = times[np.isfinite(times)]
    if not len(done):
        return f"never ({len(times)})"
    return f"{done.mean():.0f}±{done.std():.0f} ({len(times) - len(done)})"


def fly(
    algorithm: str, seeds: Sequence[int], *, ideal: bool = True, settings: Settings | None = None
) -> Records:
    """RUN records of some runs of the reference scenario, with something different."""
    return simulate(Job(load(PAPER, settings), algorithm, tuple(seeds), ideal))


def speed() -> None:
    """Processor time of 100 ideal runs, kernels alone, best of five."""
    scenario = Scenario(load(PAPER), ideal=True)
    for algorithm in ("belief", "fco"):
        world = scenario.world(1, algorithm)
        world.run_ideal()
        best = np.inf
        for _ in range(5):
            spent = 0.0
            for seed in range(1, 101):
                world = scenario.world(seed, algorithm, world)
                began = time.process_time()
                world.run_ideal()
                spent += time.process_time() - began
            best = min(best, spent)
        print(f"{algorithm}: {best:.2f} s for 100 runs x 1600 s x 6 vehicles, one core, ideal", flush=True)


def reference(runs: int) -> None:
    """All levels, pairs won against fco, and what ``then: converge`` gives; a fifth of the runs with multicopters."""
    for ideal in (True, False):
        seeds = range(1, (runs if ideal else runs // 5) + 1)
        flown = {name: fly(name, seeds, ideal=ideal) for name in ("belief", "fco")}
        for name, results in flown.items():
            levels = "  ".join(
                f"{p} %: {figure(results['time_s'][:, k])}" for k, p in enumerate(LEVELS_PERCENT)
            )
            print(f"{'ideal' if ideal else 'multicopter'} {name:7} {levels}", flush=True)
        times = {name: results["time_s"][:, LEVEL] for name, results in flown.items()}
        print(
            f"    belief is ahead at 85 % in {np.mean(times['belief'] < times['fco']):.1%} of {len(seeds)} pairs"
        )
        results = fly("belief", seeds, ideal=ideal, settings={"planner.parameters.belief.then": "converge"})
        print(
            f"    then converge: {results['in_range'].mean():.1f} targets in range on average, "
            f"85 % at {figure(results['time_s'][:, LEVEL])}",
            flush=True,
        )


def table(runs: int) -> None:
    """Time to 85 % in other scenarios; a fifth of the runs with multicopters."""
    print(
        "\n| | belief, ideal | fco, ideal | belief, multicopter | fco, multicopter |\n|---|---|---|---|---|"
    )
    for name, settings in TABLE.items():
        columns = [
            figure(
                fly(algorithm, range(1, (runs if ideal else runs // 5) + 1), ideal=ideal, settings=settings)[
                    "time_s"
                ][:, LEVEL]
            )
            for ideal in (True, False)
            for algorithm in ("belief", "fco")
        ]
        print(f"| {name} | {' | '.join(columns)} |", flush=True)


def flight_time(algorithm: str, seed: int, wind: list[int], folder: Path) -> float:
    """Time to 85 % (s) of a lockstep flight in wind."""
    mission = folder / "mission.yaml"
    mission.write_text(PAPER.read_text().replace("wind_mps: [0, 0]", f"wind_mps: {wind}"))
    command = [sys.executable, "-m", "swarmctl", "fly", "--mission", str(mission), "--algo", algorithm]
    command += ["--seed", str(seed), "--json", "--out", str(folder / f"{algorithm}-{seed}-{wind[0]}")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    reached = json.loads(done.stdout)["time_to_s"]["85"]
    return np.inf if reached is None else float(reached)


def wind(flights: int) -> None:
    """Time to 85 % of flights over MAVLink in wind."""
    for speed_mps in WINDS:
        for algorithm in ("belief", "fco"):
            with tempfile.TemporaryDirectory() as folder:
                times = [
                    flight_time(algorithm, seed, speed_mps, Path(folder)) for seed in range(1, flights + 1)
                ]
            print(f"wind {speed_mps} m/s, {algorithm}: {figure(np.array(times))}", flush=True)


def main() -> None:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for part in ("speed", "reference", "table", "wind"):
        parser.add_argument(f"--{part}", action="store_true")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--table-runs", type=int, default=100)
    parser.add_argument("--flights", type=int, default=3)
    given = parser.parse_args()
    everything = not (given.speed or given.reference or given.table or given.wind)
    if given.speed or everything:
        speed()
    if given.reference or everything:
        reference(given.runs)
    if given.table or everything:
        table(given.table_runs)
    if given.wind or everything:
        wind(given.flights)


if __name__ == "__main__":
    main()
