"""How fast is the main job?  The whole of ``swarmctl fly`` as a user runs it, several times.

    python benchmarks/lockstep.py [--flights 3] [--algo fco] [--cold]

Prints the real-time factor (simulated seconds from first take-off to last landing over wall seconds from first
to last tick, everything recorded), the whole process's wall time and peak memory, and how long --help takes.
With --cold it also times a first start, with an empty kernel cache.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def run(arguments: list[str], cache: str | None = None) -> tuple[float, str]:
    """Wall time (s) and standard output of one ``swarmctl`` process."""
    environment = dict(os.environ) | ({"XDG_CACHE_HOME": cache} if cache else {})
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "swarmctl", *arguments],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    return time.perf_counter() - began, done.stdout


def fly(algorithm: str, cache: str | None = None) -> tuple[float, float]:
    """Wall time of the whole process (s) and the real-time factor of the flight."""
    with tempfile.TemporaryDirectory() as folder:
        wall, out = run(["fly", "--algo", algorithm, "--json", "--out", str(Path(folder) / "run")], cache)
    return wall, json.loads(out)["real_time_factor"]


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--flights", type=int, default=3)
    parser.add_argument("--algo", default="fco")
    parser.add_argument("--cold", action="store_true")
    arguments = parser.parse_args()
    if arguments.cold:
        with tempfile.TemporaryDirectory() as cache:
            print(f"first ever start, kernels compiled: {fly(arguments.algo, cache)[0]:.1f} s in all")
    fly(arguments.algo)
    flights = [fly(arguments.algo) for _ in range(arguments.flights)]
    factors = sorted(factor for _, factor in flights)
    print(
        f"real-time factor: best {factors[-1]:.0f}, median {factors[len(factors) // 2]:.0f}, worst {factors[0]:.0f}"
    )
    print(f"whole process: {min(wall for wall, _ in flights):.1f} s at best")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"peak memory: {peak:.0f} MiB")
    print(f"swarmctl --help: {min(run(['--help'])[0] for _ in range(5)):.3f} s at best")


if __name__ == "__main__":
    main()
