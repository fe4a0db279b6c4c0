"""The command `sim-vehicle-stub` over real UDP sockets of this machine, many times faster than real time."""

import contextlib
import os
import signal
import socket
import subprocess
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from click.testing import CliRunner

from sim_vehicle_stub.cli import main
from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav

from .stub_process import line_with, running

TIMEOUT_S = 20.0


def bound(port: int) -> socket.socket:
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", port))
    link.settimeout(TIMEOUT_S)
    return link


def free_base() -> int:
    """A port P such that the ten from P on and the twelve from P+40 on are free now."""
    for base in range(20000 + os.getpid() % 20000, 60000, 97):
        with contextlib.suppress(OSError):
            for port in (*range(base, base + 10), *range(base + 40, base + 52)):
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


def heartbeat_of(decoder: Decoder, receive: Callable[[], bytes]) -> Any:
    """The next HEARTBEAT that comes."""
    for _ in range(100_000):
        for frame in decoder.feed(receive()):
            if frame.message_id == 0:
                return frame
    raise AssertionError("no heartbeat")


def heard_from(link: socket.socket, count: int) -> dict[int, int]:
    """System id and own port of the first ``count`` vehicles whose heartbeats come."""
    heard: dict[int, int] = {}
    for _ in range(100_000):
        data, address = link.recvfrom(2048)
        for frame in Decoder().feed(data):
            if frame.message_id == 0:
                heard[frame.system] = address[1]
        if len(heard) == count:
            return heard
    raise AssertionError(f"only {heard}")


@pytest.fixture
def stub() -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """Two vehicles in a process of their own."""
    port = free_base()
    arguments = ["--vehicles", "2", "--port", str(port), "--speed", "20", "--home", "47.0,8.0,100"]
    with running(*arguments) as process:
        yield port, process


@pytest.mark.row("px4-links", "px4-partner-lock")
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

    # A second client hears nothing, though it is obeyed.
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
        (["--vehicles", "41"], "--shared"),
        (["--vehicles", "3", "--from", "14542"], "would send from UDP ports"),
        (["--vehicles", "251"], "--vehicles"),
        (["--autopilot", "betaflight"], "--autopilot"),
        (["--speed", "0"], "--speed"),
        (["--speed", "nan"], "--speed"),
        (["--port", "80"], "--port"),
        (["--home", "47,8"], "LAT,LON,ALT"),
        (["--home", "91,8,0"], "no place to fly"),
        (["--home", "nan,8,0"], "no place to fly"),
        (["--vehicles", "3", "--autopilot", "px4,ardupilot"], "2 firmwares for 3"),
        (["--wind", "3"], "EAST,NORTH"),
        (["--wind", "nan,0"], "more than 100"),
        (["--fault", "flood@3"], "no fault 'flood'"),
        (["--fault", "2:reboot@3"], "no vehicle 2"),
        (["--shared", "--pty"], "only one of"),
        (["--tcp", "65530", "--vehicles", "2"], "no ports for 2"),
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


@pytest.mark.row("px4-links", "ardupilot-links")
def test_shared_all_send_to_one_port_and_are_answered_at_their_own() -> None:
    port = free_base()
    client = Client(port, port + 41)
    arguments = ("--vehicles", "2", "--autopilot", "px4,ardupilot", "--port", str(port), "--shared")
    with contextlib.closing(client.link), running(*arguments, "--speed", "10"):
        assert heard_from(client.link, 2) == {1: port + 40, 2: port + 41}
        client.send(mav.MAVLink_command_long_message(2, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
        assert client.wait_for(77).system == 2


@pytest.mark.row("px4-links")
def test_from_the_tenth_vehicle_on_all_may_share_the_last_port() -> None:
    port = free_base()
    arguments = ("--vehicles", "12", "--autopilot", "ardupilot", "--port", str(port), "--ports", "10")
    with (
        contextlib.closing(bound(port)) as first,
        contextlib.closing(bound(port + 9)) as last,
        running(*arguments, "--speed", "20"),
    ):
        assert heard_from(first, 1) == {1: port + 40}
        assert heard_from(last, 3) == {10: port + 49, 11: port + 50, 12: port + 51}


@pytest.mark.row("px4-links", "ardupilot-links")
@pytest.mark.parametrize("own", ["chosen", "any"])
def test_where_vehicles_send_from_can_be_chosen_or_left_to_the_machine(own: str) -> None:
    port = free_base()
    wanted = port + 45 if own == "chosen" else 0
    arguments = ("--vehicles", "2", "--port", str(port), "--shared", "--from", str(wanted))
    with contextlib.closing(bound(port)) as link, running(*arguments, "--speed", "20"):
        heard = heard_from(link, 2)
    if wanted:
        assert heard == {1: wanted, 2: wanted + 1}
    else:
        assert heard[1] != heard[2]
        assert min(heard.values()) >= 1024
        assert not {port + 40, port + 41} & set(heard.values())


@pytest.mark.row("ardupilot-links")
def test_tcp_boots_with_the_first_client_and_has_one_at_a_time() -> None:
    port = free_base()
    arguments = ("--vehicles", "2", "--autopilot", "ardupilot", "--tcp", str(port), "--speed", "10")
    with running(*arguments) as process:
        line_with(process, f"tcp ports from {port} on")
        decoder = Decoder()
        with connected(port + 10) as first:
            assert heartbeat_of(decoder, lambda: first.recv(4096)).system == 2
            ask = mav.MAVLink_command_long_message(2, 1, 512, 0, mav.MAVLINK_MSG_ID_VFR_HUD, 0, 0, 0, 0, 0, 0)
            encoder = Encoder(255, 190)
            for byte in encoder.encode(ask):
                first.sendall(bytes([byte]))
            while not any(f.message_id == 77 for f in decoder.feed(first.recv(4096))):
                pass
            with connected(port + 10) as second, contextlib.suppress(ConnectionResetError):
                assert second.recv(10) == b""
        with connected(port + 10) as third:
            assert heartbeat_of(Decoder(), lambda: third.recv(4096)).system == 2


def test_a_vehicle_boots_when_its_own_client_comes() -> None:
    port = free_base()

    def boot_s(decoder: Decoder, link: socket.socket) -> float:
        while True:
            for frame in decoder.feed(link.recv(4096)):
                if frame.message_id == 30:
                    return float(frame.fields.time_boot_ms) / 1000.0

    with running("--vehicles", "2", "--tcp", str(port), "--speed", "50") as process:
        line_with(process, "tcp ports")
        with connected(port) as first:
            decoder = Decoder()
            while boot_s(decoder, first) < 30.0:
                pass
            with connected(port + 10) as second:
                assert boot_s(Decoder(), second) < 15.0


def connected(port: int) -> socket.socket:
    """A connection; the port may be opened a moment after it is announced."""
    for _ in range(200_000):
        with contextlib.suppress(ConnectionRefusedError):
            return socket.create_connection(("127.0.0.1", port), TIMEOUT_S)
    raise AssertionError(f"nobody listens on {port}")


def test_a_pseudo_terminal_stands_for_a_serial_port() -> None:
    with running("--pty", "--speed", "10") as process:
        path = line_with(process, "vehicle 1:").split()[-1]
        terminal = os.open(path, os.O_RDWR | os.O_NOCTTY)
        with os.fdopen(terminal, "r+b", buffering=0) as line:
            decoder = Decoder()
            assert heartbeat_of(decoder, lambda: line.read(4096)).system == 1
            ask = mav.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
            line.write(Encoder(255, 190).encode(ask))
            while not any(f.message_id == 77 for f in decoder.feed(line.read(4096))):
                pass


def test_a_fault_happens_on_the_command_line_too() -> None:
    port = free_base()
    client = Client(port, port + 40)
    with (
        contextlib.closing(client.link),
        running("--port", str(port), "--speed", "20", "--fault", "reboot@5", "--wind", "1,-2", "--seed", "4"),
    ):
        client.wait_for(30, lambda f: f.time_boot_ms > 4500)
        client.wait_for(30, lambda f: f.time_boot_ms < 1000)
        assert abs(client.wait_for(33).fields.alt - 488000) > 1


def test_a_tcp_port_that_is_taken_says_so() -> None:
    port = free_base()
    with socket.create_server(("127.0.0.1", port)):
        result = CliRunner().invoke(main, ["--tcp", str(port)])
    assert result.exit_code == 2
    assert f"cannot use the ports from {port} on" in result.output
