"""Makes the committed recording in tests/data/search anew.

    python tests/data/refresh.py

Run it on purpose only: when a change of planners, guard, sensors, stub or file format is meant to change what
is recorded.  The recording is there to show that it is still read and recomputed by later versions, so commit
it together with the change that made it necessary, and say in the changelog what the change was.

Three vehicles search for 40 s.  flight.tlog is kept compressed, to stay below 300 KB in all; tests unpack it.
"""

import gzip
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SEARCH = Path(__file__).parent / "search"
KEPT = ("flight.mcap", "mission.yaml", "summary.json")
SEED = 3
MISSION = """
name: search
area: {size_m: [500, 400]}
keep_out:
  - {box_m: [200, 260, 180, 240]}
vehicles: {count: 3, speed_mps: 12, altitude_m: 6}
sensor: {range_m: 90, detection_probability: 0.9, false_alarms_per_hour: 30, position_noise_m: 2}
radio: {range_m: 250, loss: 0.1, delay_s: 1}
targets: {clusters: 6, count: 60, radius_m: 25, motion: wander}
duration_s: 40
"""


def refresh() -> None:
    """Fly, and put what is kept of the run folder in place of the old."""
    with tempfile.TemporaryDirectory() as temporary:
        # A relative --out: summary.json names the folder, and must not name one of this machine.
        (Path(temporary) / "search.yaml").write_text(MISSION)
        command = [
            sys.executable,
            "-m",
            "swarmctl.cli",
            "fly",
            "--mission",
            "search.yaml",
            "--seed",
            str(SEED),
        ]
        root = str(Path(__file__).parents[2])
        environment = {**os.environ, "PYTHONPATH": root}
        subprocess.run([*command, "--out", "search"], cwd=temporary, env=environment, check=True)
        flown = Path(temporary) / "search"
        shutil.rmtree(SEARCH, ignore_errors=True)
        SEARCH.mkdir()
        for name in KEPT:
            shutil.copyfile(flown / name, SEARCH / name)
        packed = gzip.compress((flown / "flight.tlog").read_bytes(), 9, mtime=0)
        (SEARCH / "flight.tlog.gz").write_bytes(packed)


if __name__ == "__main__":
    refresh()
