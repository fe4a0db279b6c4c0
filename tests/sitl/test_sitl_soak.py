"""Ten missions in a row by one process on the same six autopilots: nothing is left of a flight but its folder."""

import gc
import os
from pathlib import Path

from swarmctl import live_cli
from swarmctl.dashboard import Progress
from swarmctl.flight.fly import write_results
from swarmctl.flight.orders import Orders
from swarmctl.mission.launch import as_found
from swarmctl.mission.load import load
from swarmctl.record.folder import RunFolder

from .conftest import MISSION
from .firmware import Simulators
from .test_sitl_missions import SPEEDS, fleet_up, is_safe

FLIGHTS, SETTLED = 10, 3
"""So many missions; after the third everything that is made once has been made."""
GROWTH_MB = 15.0


def held() -> tuple[int, int]:
    """Open files, ports among them, and threads of this process."""
    return len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))


def resident_mb() -> float:
    """Memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def test_ten_missions_in_a_row(simulators: Simulators, firmware: str, tmp_path: Path) -> None:
    speed = SPEEDS[firmware]
    urls = fleet_up(simulators, f"{firmware}-own", speed)[1::2]
    mission = as_found(load(MISSION, {"duration_s": 30.0}))
    holds, memory = [], []
    for flight in range(FLIGHTS):
        folder = RunFolder(tmp_path / f"flight{flight}")
        folder.path.mkdir()
        outcome = live_cli.fly_connected(
            mission, flight, folder, live_cli.Reach(urls, 60.0), Orders(), Progress(), speed=speed, sure=True,
            adapt=True,
        )  # fmt: skip
        is_safe(write_results(outcome, folder))
        assert outcome.exit_code() == 0
        del outcome
        gc.collect()  # pictures hold themselves in circles, which Python lets lie for several flights
        holds.append(held())
        memory.append(resident_mb())
        print(f"flight {flight + 1}: {holds[-1][0]} files, {holds[-1][1]} threads, {memory[-1]:.1f} MB")
    assert len(set(holds[SETTLED:])) == 1, holds
    assert memory[-1] - memory[SETTLED] < GROWTH_MB, memory
