"""How fast a study runs: runs of the reference scenario on one core and on two, and large swarms.

    python benchmarks/study.py [--repeats 5] [--algos mdc,fco,...] [--vehicles 6,60,600,6000] [--keep]

The first table times 100 runs x 1600 s x 6 vehicles with all metrics, ideal dynamics and, in fewer runs, a guarded
multicopter's; a vehicle-step is one vehicle for one planner period (ten guarded setpoints).  The second flies one run
of ever more vehicles at the reference density.  Times are the best of several, beside those kept in study.json;
``--keep`` keeps these.
"""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

from swarmctl.core.planners import MODULES
from swarmctl.mission.load import load
from swarmctl.mission.scaling import at_constant_density
from swarmctl.mission.scenario import Scenario
from swarmctl.study.execute import local, run_seeds
from swarmctl.study.runs import Job, simulate

KEPT = Path(__file__).with_name("study.json")
RUNS, MULTICOPTER_RUNS = 100, 10
STEPS = 1600 * 6


def best(task: Callable[[], object], repeats: int) -> float:
    """The least wall time of some repetitions, in s."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        task()
        times.append(time.perf_counter() - began)
    return min(times)


def beside(figures: dict[str, float], kept: dict[str, float], key: str, value: float) -> str:
    """A time, and its ratio to the one kept."""
    figures[key] = value
    ratio = f"{value / kept[key]:5.2f} x" if kept.get(key) else "    new"
    return f"{value:9.3f} {ratio}"


def reference(algorithms: list[str], repeats: int, figures: dict[str, float], kept: dict[str, float]) -> None:
    """The first table."""
    mission = load()
    print(f"{'100 runs, s':12}{'one core':>17}{'ns/step':>9}{'two threads':>13}{'multicopter/ideal':>19}")
    for name in algorithms:
        ideal, multicopter = (
            Job(mission, name, tuple(range(1, runs + 1)), dynamics)
            for runs, dynamics in ((RUNS, True), (MULTICOPTER_RUNS, False))
        )
        simulate(Job(mission, name, (1,)))  # compiles
        one = best(lambda job=ideal: simulate(job), repeats)
        threads = {}
        for workers in (1, 2):
            with local(workers) as pool:
                threads[workers] = best(lambda n=name, p=pool: run_seeds(mission, n, range(1, 401), p), 3)
        simulate(Job(mission, name, (1,), ideal=False))
        guarded = best(lambda job=multicopter: simulate(job), 2) / MULTICOPTER_RUNS
        print(
            f"{name:12}{beside(figures, kept, name, one)}{one / RUNS / STEPS * 1e9:9.0f}"
            f"{threads[1] / threads[2]:11.2f} x{guarded / (one / RUNS):17.1f} x",
            flush=True,
        )


def scale(
    algorithms: list[str], counts: list[int], figures: dict[str, float], kept: dict[str, float]
) -> None:
    """The second table."""
    print(f"\n{'one run, s':12}{'vehicles':>9}{'search':>17}{'ns/step':>9}{'set up':>8}{'found':>8}")
    for name in algorithms:
        for count in counts:
            began = time.perf_counter()
            world = Scenario(load(None, at_constant_density(load(), count)), ideal=True).world(1, name)
            made = time.perf_counter() - began
            took = best(world.run_ideal, 1)
            print(
                f"{name:12}{count:9}{beside(figures, kept, f'{name} {count}', took)}"
                f"{took / count / 1600 * 1e9:9.0f}{made:8.2f}{(world.found >= 0).mean():8.3f}",
                flush=True,
            )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--algos", default=",".join(MODULES))
    parser.add_argument("--vehicles", default="6,60,600,6000")
    parser.add_argument("--scaled", default="mdc,fco,ace,belief")
    parser.add_argument("--keep", action="store_true")
    asked = parser.parse_args()
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    figures: dict[str, float] = dict(kept)
    reference(asked.algos.split(","), asked.repeats, figures, kept)
    scale(asked.scaled.split(","), [int(n) for n in asked.vehicles.split(",")], figures, kept)
    if asked.keep:
        KEPT.write_text(json.dumps({k: round(v, 4) for k, v in figures.items()}, indent=1) + "\n")


if __name__ == "__main__":
    main()
