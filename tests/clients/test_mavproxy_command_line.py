"""`sim-vehicle-stub` alone, as its help says to use it, and MAVProxy over each kind of link that it has.

The vehicles are in another process here, so what they do is seen on what they tell.
"""

import contextlib
import socket
from collections.abc import Iterator
from pathlib import Path

from click.testing import CliRunner

from sim_vehicle_stub.cli import OWN_PORT_OFFSET, main
from swarmctl.live_cli import free_ports

from ..stub.stub_process import line_with, running
from .mavproxy_rig import MavProxy

LOCATED = "EKF_STATUS_REPORT {flags : 831"
"""Row "ready to arm": flags 0x33f."""


@contextlib.contextmanager
def mavproxy(master: str, folder: Path) -> Iterator[MavProxy]:
    client = MavProxy(master, folder)
    try:
        client.hear("online system")
        yield client
    finally:
        client.close()


def fly_ardupilot(client: MavProxy) -> None:
    """Wait for the position, arm in GUIDED and climb to 10 m."""
    client.type("set streamrate 5", "watch EKF_STATUS_REPORT")
    client.hear(LOCATED)
    client.type("mode guided", "arm throttle", "takeoff 10", "watch GLOBAL_POSITION_INT")
    client.hear("ARMED")
    client.hear(r"relative_alt : (9[89]|10[0-2])\d\d,")


def test_tcp_boots_the_vehicle_that_mavproxy_connects_to(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    with running("--autopilot", "ardupilot", "--tcp", str(port), "--speed", "20") as stub:
        line_with(stub, f"tcp ports from {port} on")
        with mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as client:
            client.hear("AP: ArduCopter V4.8")  # said once, 1 s after boot
            fly_ardupilot(client)


def test_two_vehicles_share_the_udp_port_of_a_ground_station(tmp_path: Path) -> None:
    port = free_ports(OWN_PORT_OFFSET + 2)
    arguments = ("--vehicles", "2", "--autopilot", "ardupilot", "--speed", "20")
    with (
        running(*arguments, "--shared", "--port", str(port)),
        mavproxy(f"udpin:127.0.0.1:{port}", tmp_path) as client,
    ):
        client.hear("Detected vehicle 2:1 on link 0")
        client.type("vehicle 2")
        fly_ardupilot(client)
        client.type("watch", "vehicle 1", "status HEARTBEAT GLOBAL_POSITION_INT")
        assert int(client.hear(r"HEARTBEAT \{.* base_mode : (\d+)")[1]) & 128 == 0
        assert client.hear(r"relative_alt : (-?\d+)")[1] == "0"


def test_a_pseudo_terminal_is_a_serial_port(tmp_path: Path) -> None:
    with running("--pty", "--speed", "5") as stub:
        path = line_with(stub, "vehicle 1:").split()[-1]
        with mavproxy(f"{path},57600", tmp_path) as client:
            client.hear(r"Received \d+ parameters")
            client.type("long NAV_TAKEOFF 0 0 0 nan nan nan 493", "watch HEARTBEAT")
            client.hear("Mode TAKEOFF")
            client.type("arm throttle", "watch GLOBAL_POSITION_INT")
            client.hear("ARMED")
            client.hear(r"relative_alt : (4[89]|5[0-2])\d\d,")


def test_the_help_says_how_to_point_ground_stations_at_it() -> None:
    said = CliRunner().invoke(main, ["--help"]).output
    for text in (
        "QGroundControl",
        "sim-vehicle-stub --shared --port 14550",
        "--master=udpin:127.0.0.1:14550",
        "--master=tcp:127.0.0.1:5760",
        "--master=/dev/pts/",
    ):
        assert text in said
