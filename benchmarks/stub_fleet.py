"""What a fleet of stub vehicles costs in wall time: 100 in one process, each flown by setpoints at 10 Hz.

A client turns every stream down but the position at 10 Hz and the status at 2 Hz, takes all vehicles into
OFFBOARD and measures the other process's share of a core.  ``python benchmarks/stub_fleet.py`` (Linux)
"""

import os
import socket
import subprocess
import sys
import time

from sim_vehicle_stub.personalities import px4_defaults
from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav

VEHICLES, PORT = 100, 24540
SETTLE_S, MEASURE_S, INTERVAL_S = 8.0, 20.0, 0.1
MASK = 1 | 2 | 32 | 64 | 128 | 256 | 2048
POSITION = 33
WANTED_US = {POSITION: 100_000, 1: 500_000, 245: 500_000, 0: 1_000_000}
INTERVALS_US = {**dict.fromkeys(px4_defaults.INTERVALS_US, -1), **WANTED_US}


def orders(encoder: Encoder, system: int) -> list[bytes]:
    """The rates that a controller asks for; then OFFBOARD and arming."""
    rates = [(511, message, interval) for message, interval in INTERVALS_US.items()]
    return [
        encoder.encode(mav.MAVLink_command_long_message(system, 1, number, 0, a, b, 0, 0, 0, 0, 0))
        for number, a, b in [*rates, (176, 1, 6), (400, 1, 0)]
    ]


def setpoints(encoder: Encoder) -> list[bytes]:
    """One for every vehicle."""
    return [
        encoder.set_position_target_local_ned(
            0, system, 1, 1, MASK, 0.0, 0.0, -50.0, 3.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        )
        for system in range(1, VEHICLES + 1)
    ]


def cpu_seconds(process: int) -> float:
    """User and system time that a process has used."""
    with open(f"/proc/{process}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def fly(link: socket.socket, seconds: float, encoder: Encoder, decoder: Decoder) -> tuple[int, int]:
    """Send setpoints and read what comes: positions, and of how many vehicles the last were in the air."""
    positions = 0
    airborne: dict[int, bool] = {}
    due = time.monotonic()
    end = due + seconds
    while (now := time.monotonic()) < end:
        if now >= due:
            due += INTERVAL_S
            for index, frame in enumerate(setpoints(encoder)):
                link.sendto(frame, ("127.0.0.1", PORT + 40 + index))
        link.settimeout(max(0.001, due - now))
        try:
            data = link.recv(2048)
        except TimeoutError:
            continue
        for frame in decoder.feed(data):
            if frame.message_id == POSITION:
                positions += 1
                airborne[frame.system] = frame.fields.relative_alt > 1000
    return positions, sum(airborne.values())


def main() -> None:
    """Print the share of a core, and what came of it."""
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    link.bind(("127.0.0.1", PORT))
    arguments = ["--vehicles", str(VEHICLES), "--shared", "--port", str(PORT)]
    process = subprocess.Popen([sys.executable, "-m", "sim_vehicle_stub.cli", *arguments])
    encoder, decoder = Encoder(255, 190), Decoder()
    try:
        link.settimeout(60.0)
        link.recv(2048)
        for attempt in range(2):  # a vehicle that is not ready yet is asked again
            for index in range(VEHICLES):
                for frame in orders(encoder, index + 1):
                    link.sendto(frame, ("127.0.0.1", PORT + 40 + index))
            fly(link, SETTLE_S if attempt == 0 else 2.0, encoder, decoder)
        before, start = cpu_seconds(process.pid), time.monotonic()
        positions, airborne = fly(link, MEASURE_S, encoder, decoder)
        wall = time.monotonic() - start
        share = (cpu_seconds(process.pid) - before) / wall
    finally:
        process.terminate()
        process.wait()
    rate = positions / wall / VEHICLES
    print(
        f"{VEHICLES} vehicles at 1 x: {share:.0%} of a core; {rate:.2f} positions a second each; "
        f"{airborne} in the air"
    )


if __name__ == "__main__":
    main()
