"""Serial lines from the command line: two of them, one unplugged in flight, and a thin one that is filled no further
than its budget says."""

import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .processes import HOME, MISSION, Start, flown, read_until, write
from .serial_line import SerialLine

TWO = "vehicles: {count: 2, speed_mps: 8, altitude_m: 10}\n"
SLOWER = "4"
"""What a line adds to every delay is so many times as long in flight time."""
Lines = Callable[..., list[SerialLine]]


@pytest.fixture
def lines(start: Start, tmp_path: Path) -> Iterator[Lines]:
    """Stub vehicles, each on an adapter of its own."""
    made: list[SerialLine] = []

    def run(count: int, autopilot: str, speed: str = SLOWER, **of_line: float) -> list[SerialLine]:
        stub = start(
            "sim_vehicle_stub.cli", "--vehicles", count, "--home", f"{HOME[0]},{HOME[1]},488", "--speed", speed,
            "--autopilot", autopilot, "--pty",
        )  # fmt: skip
        for k in range(1, count + 1):
            path = read_until(stub, f"vehicle {k}: ").split()[-1]
            made.append(SerialLine(tmp_path / f"ttyUSB{k - 1}", path, **of_line))
        return made

    yield run
    for line in made:
        line.close()


def fly(
    start: Start,
    tmp_path: Path,
    mission: str,
    lines: list[SerialLine],
    baud: int = 921600,
    speed: str = SLOWER,
) -> subprocess.Popen[str]:
    urls = [word for line in lines for word in ("--connect", f"serial://{line.path}:{baud}")]
    return start(
        "swarmctl", "fly", "--mission", write(tmp_path, mission), *urls, "--yes", "--json", "--speed", speed,
        "--out", tmp_path / "run",
    )  # fmt: skip


def test_a_line_unplugged_in_flight_is_a_lost_vehicle_and_the_other_comes_home(
    start: Start, lines: Lines, tmp_path: Path
) -> None:
    one, other = lines(2, "px4")
    flight = fly(start, tmp_path, MISSION + TWO, [one, other])
    read_until(flight, "searching")
    other.unplug()
    code, summary = flown(flight)
    assert code == 1
    assert [v["outcome"] for v in summary["per_vehicle"]] == ["landed", "lost"]
    assert "no heartbeat for 3 s while engaged" in "\n".join(summary["per_vehicle"][1]["events"])


def test_a_line_plugged_in_again_brings_its_vehicle_back(start: Start, lines: Lines, tmp_path: Path) -> None:
    """ArduPilot waits in GUIDED where it was; PX4 would be on its way home."""
    one, other = lines(2, "ardupilot")
    flight = fly(start, tmp_path, MISSION + TWO + "safety: {if_one_fails: continue}\n", [one, other])
    read_until(flight, "searching")
    other.unplug()
    read_until(flight, "no heartbeat for 3 s")
    other.plug()
    code, summary = flown(flight)
    assert [v["outcome"] for v in summary["per_vehicle"]] == ["landed", "landed"]
    assert "heartbeat again" in "\n".join(summary["per_vehicle"][1]["events"])
    assert code == 0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_thin_line_is_filled_no_further_than_its_budget_says(
    start: Start, lines: Lines, tmp_path: Path, autopilot: str
) -> None:
    """57600 baud in real time, here four times as fast on four times the line."""
    (line,) = lines(1, autopilot, bytes_per_s=4 * 5760.0)
    mission = MISSION + TWO.replace("2", "1", 1)
    flight = fly(start, tmp_path, mission, [line], baud=4 * 57600)
    told = read_until(flight, "of the line")
    read_until(flight, "searching")
    since = max(t for t, _ in line.from_vehicle.counts)
    code, summary = flown(flight)
    assert (code, summary["per_vehicle"][0]["outcome"]) == (0, "landed")
    assert summary["per_vehicle"][0]["link"]["messages_bad"] == 0
    from_vehicle, to_vehicle = (float(n) for n in re.findall(r"(\d+) (?:from|to),", told))
    for direction, limit in ((line.from_vehicle, from_vehicle), (line.to_vehicle, to_vehicle)):
        carried = [size for t, size in direction.counts if since <= t < since + 5.0]
        assert 0.4 * limit < sum(carried) / 5.0 <= limit
