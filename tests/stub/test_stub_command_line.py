"""The command `sim-vehicle-stub` over real UDP sockets of this machine, many times faster than real time."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from click.testing import CliRunner

from sim_vehicle_stub.cli import main
from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav

TIMEOUT_S = 20.0


def bound(port: int) -> socket.socket:
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", port))
    link.settimeout(TIMEOUT_S)
    return link


def free_base() -> int:
    """A port P such that P, P+1, P+40 and P+41 are free now."""
    for base in range(20000 + os.getpid() % 20000, 60000, 97):
        with contextlib.suppress(OSError):
            for port in (base, base + 1, base + 40, base + 41):
                bound(port).close()
            return base
    raise AssertionError("no free ports")


class Client:
    """One socket of a ground station."""

    def __init__(self, port: int, vehicle_port: int) -> None:
        self.link = bound(port)
        self.to = ("127.0.0.1", vehicle_port)
        self.encoder, self.decoder = Encoder(255, 190), Decoder()

    def send(self, message: Any) -> None:
        self.link.sendto(self.encoder.encode(message), self.to)

    def wait_for(self, message_id: int, condition: Callable[[Any], bool] = bool) -> Any:
        """The next such message; a socket time-out fails the test."""
        for _ in range(200_000):
            for frame in self.decoder.feed(self.link.recv(2048)):
                if frame.message_id == message_id and condition(frame.fields):
                    return frame
        raise AssertionError(f"no message {message_id}")


@pytest.fixture
def stub() -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """Two vehicles in a process of their own."""
    port = free_base()
    arguments = ["--vehicles", "2", "--port", str(port), "--speed", "20", "--home", "47.0,8.0,100"]
    process = subprocess.Popen(
        [sys.executable, "-m", "sim_vehicle_stub.cli", *arguments], stderr=subprocess.PIPE, text=True
    )
    yield port, process
    process.kill()
    process.communicate()


def test_two_vehicles_take_off_by_udp_and_ctrl_c_ends_them(stub: tuple[int, subprocess.Popen[str]]) -> None:
    port, process = stub
    clients = [Client(port + index, port + 40 + index) for index in range(2)]
    for index, client in enumerate(clients):
        assert client.wait_for(0).system == index + 1
        client.send(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
    client = clients[0]
    position = client.wait_for(33).fields
    assert (position.lat, position.lon, position.alt) == (470000000, 80000000, 100000)
    client.wait_for(1, lambda f: bool(f.onboard_control_sensors_health & 0x10000000))
    nan = float("nan")
    client.send(mav.MAVLink_command_long_message(1, 1, 22, 0, nan, nan, nan, nan, nan, nan, 105.0))
    client.send(mav.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    client.wait_for(33, lambda f: f.relative_alt > 4500)
    assert clients[1].wait_for(33).fields.relative_alt == 0

    # Row "partner lock": a second client hears nothing, though it is obeyed.
    other = Client(0, port + 40)
    other.send(mav.MAVLink_command_long_message(1, 1, 21, 0, nan, nan, nan, nan, nan, nan, nan))
    assert client.wait_for(77, lambda f: f.command == 21).fields.result == 0
    other.link.setblocking(False)
    with pytest.raises(BlockingIOError):
        other.link.recv(2048)

    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0
    assert f"from udp port {port + 40} on" in said
    assert "Traceback" not in said
    for each in (*clients, other):
        each.link.close()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--vehicles", "0"], "--vehicles"),
        (["--vehicles", "41"], "--vehicles"),
        (["--autopilot", "betaflight"], "--autopilot"),
        (["--speed", "0"], "--speed"),
        (["--speed", "nan"], "--speed"),
        (["--port", "80"], "--port"),
        (["--home", "47,8"], "LAT,LON,ALT"),
        (["--home", "91,8,0"], "no place to fly"),
        (["--home", "nan,8,0"], "no place to fly"),
    ],
)
def test_a_wrong_command_line_says_so(arguments: list[str], said: str) -> None:
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert said in result.output


def test_a_port_that_is_taken_says_so() -> None:
    port = free_base()
    with contextlib.closing(bound(port + 40)):
        result = CliRunner().invoke(main, ["--port", str(port)])
    assert result.exit_code == 2
    assert f"cannot use the ports from {port + 40} on" in result.output
