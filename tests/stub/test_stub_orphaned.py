"""Stub vehicles whose controller died live on while somebody speaks to them, then end by themselves."""

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from sim_vehicle_stub.served import OWN_PORT_OFFSET, order
from swarmctl.live_cli import free_ports
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mission.load import load
from swarmctl.mission.scenario import Scenario

SOON = "from sim_vehicle_stub import served; served.LANDED_S = 2.0; served.main()"
ORIGIN = (47.3977, 8.5456, 488.0)
PATIENCE_S = 60.0


@pytest.fixture
def orphaned() -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A process with two vehicles, and the first port that one of them listens on; its controller has just died."""
    fleet = Scenario(load(None, {"vehicles.count": 2}), ideal=False).fleet(1)
    port = free_ports(2)
    process = subprocess.Popen([sys.executable, "-c", SOON], stdin=subprocess.PIPE, text=True)
    assert process.stdin is not None
    process.stdin.write(order(fleet, ORIGIN, [None, None], ["px4", "px4"], (0.0, 0.0), port, 10.0) + "\n")
    process.stdin.close()
    yield process, port + OWN_PORT_OFFSET
    process.kill()
    process.wait()


def test_nobody_comes(orphaned: tuple[subprocess.Popen[str], int]) -> None:
    process, _ = orphaned
    assert process.wait(PATIENCE_S) == 0


def test_another_controller_comes_and_goes(orphaned: tuple[subprocess.Popen[str], int]) -> None:
    process, port = orphaned
    encoder, pause = Encoder(255, 190), threading.Event()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as controller:
        controller.connect(("127.0.0.1", port))
        controller.settimeout(0.2)
        answered = 0
        while answered < 25:  # each a fifth of a second apart: longer than it waits for anybody
            assert process.poll() is None
            try:
                controller.send(encoder.heartbeat(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4))
                controller.recv(300)
                answered += 1
            except OSError:
                pass  # it is starting
            pause.wait(0.2)
    assert process.wait(PATIENCE_S) == 0
