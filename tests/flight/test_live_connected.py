"""Vehicles by connect URL: stub vehicles in a process of their own, over UDP, TCP and a serial line."""

import json
import signal
import socket
from pathlib import Path

import pytest

from swarmctl.live_cli import free_ports

from .processes import (
    GROUP,
    HOME,
    MISSION,
    PATIENCE_S,
    SPEED,
    Start,
    fleet_of,
    flown,
    read_until,
    write,
)


def test_check_shows_what_it_found_and_arms_nothing(start: Start, stubs: Start, tmp_path: Path) -> None:
    port = free_ports(2)
    stubs("--port", port, "--autopilot", "px4,ardupilot")
    url = f"udpin://127.0.0.1:{port}-{port + 1}"
    check = start("swarmctl", "check", "--mission", write(tmp_path, MISSION + GROUP), "--connect", url)
    out, err = check.communicate(timeout=PATIENCE_S)
    assert check.returncode == 0, out + err
    assert "there: valid. 2 vehicles" in out and "nothing was armed" in out
    rows = [line for line in out.splitlines() if "ready to arm" in line]
    assert "px4 1.17.0" in rows[0] and "ardupilot 4.8.0" in rows[1]
    for row in rows:
        assert "100 %" in row and "m E," in row and "m/s" in row and "verified" in row
    assert "its fence is switched off (FENCE_ENABLE 1)" in out and "(GF_ACTION 3): --adapt sets that" in out
    # and nobody was: they are still there to be checked again
    again = start("swarmctl", "check", "--mission", tmp_path / "there.yaml", "--connect", url)
    assert again.wait(PATIENCE_S) == 0


def test_check_of_vehicles_that_stand_elsewhere(start: Start, stubs: Start, tmp_path: Path) -> None:
    port = free_ports(2)
    stubs("--port", port)
    elsewhere = write(tmp_path, (MISSION + GROUP).replace("47.3960", "47.4960"))
    check = start(
        "swarmctl", "check", "--mission", elsewhere, "--connect", f"udpin://127.0.0.1:{port}-{port + 1}"
    )
    out, _ = check.communicate(timeout=PATIENCE_S)
    assert check.returncode == 3
    assert "vehicle 1: it stands outside the area" in out
    assert "the fence of the mission is not on board" in out


def test_both_firmwares_on_one_shared_port(start: Start, stubs: Start, tmp_path: Path) -> None:
    port = free_ports(2)
    stubs("--port", port, "--shared", "--autopilot", "px4,ardupilot")
    code, summary = flown(
        start(
            "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--yes", "--json", "--speed", SPEED,
            "--connect", f"udpin://127.0.0.1:{port}", "--out", tmp_path / "run",
        )
    )  # fmt: skip
    assert code == 0
    assert [(v["autopilot"], v["outcome"]) for v in summary["per_vehicle"]] == [
        ("px4", "landed"),
        ("ardupilot", "landed"),
    ]
    for vehicle in summary["per_vehicle"]:
        link = vehicle["link"]
        assert link["messages_received"] > 500 and link["loss"] < 0.05
        assert link["setpoint_interval_ms"]["p50"] == pytest.approx(100.0, abs=20.0)
        assert 0.0 < link["round_trip_ms"]["p50"] < 1000.0
        assert link["command_round_trip_ms"]["p50"] > 0.0


def test_each_vehicle_by_the_missions_own_url_and_over_tcp(
    start: Start, stubs: Start, tmp_path: Path
) -> None:
    port = free_ports(12)
    stubs("--tcp", port, "--autopilot", "px4,ardupilot")
    mission = fleet_of(
        f'autopilot: ardupilot, connect: "tcp://127.0.0.1:{port + 10}"',
        f'autopilot: px4, connect: "tcp://127.0.0.1:{port}"',
    )
    code, summary = flown(
        start(
            "swarmctl", "fly", "--mission", write(tmp_path, mission), "--yes", "--json", "--speed", SPEED, "--out",
            tmp_path / "run",
        )
    )  # fmt: skip
    assert code == 0
    assert [(v["id"], v["autopilot"], v["outcome"]) for v in summary["per_vehicle"]] == [
        (2, "ardupilot", "landed"),
        (1, "px4", "landed"),
    ]


def test_serial_lines(start: Start, tmp_path: Path) -> None:
    home = f"{HOME[0]},{HOME[1]},488"
    stub = start("sim_vehicle_stub.cli", "--vehicles", 2, "--home", home, "--speed", SPEED, "--pty")
    paths = [read_until(stub, f"vehicle {k}: ").split()[-1] for k in (1, 2)]
    code, summary = flown(
        start(
            "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--yes", "--json", "--speed", SPEED,
            *(word for path in paths for word in ("--connect", f"serial://{path}:921600")), "--out", tmp_path / "run",
        )
    )  # fmt: skip
    assert (code, [v["outcome"] for v in summary["per_vehicle"]]) == (0, ["landed"] * 2)


@pytest.mark.parametrize(("typed", "code"), [("yes\n", 0), ("no\n", 3), ("", 3)])
def test_a_typed_yes_arms_real_vehicles(
    start: Start, stubs: Start, tmp_path: Path, typed: str, code: int
) -> None:
    port = free_ports(2)
    stubs("--port", port)
    flight = start(
        "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--speed", SPEED, "--duration", 5,
        "--connect", f"udpin://127.0.0.1:{port}-{port + 1}", "--out", tmp_path / "run",
    )  # fmt: skip
    said = read_until(flight, "Type yes to take off")
    assert "ready to arm: vehicles 1 (px4 1.17.0), 2 (px4 1.17.0)" in said
    out, err = flight.communicate(typed, timeout=PATIENCE_S)
    assert flight.returncode == code, err
    assert ("2 of 2 vehicles landed" in out) is (code == 0)
    assert ("refused: not confirmed: nothing was armed" in err) is (code == 3)
    assert (tmp_path / "run").exists() is (code == 0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_while_it_asks_ends_at_once(
    start: Start, stubs: Start, tmp_path: Path, number: int
) -> None:
    port = free_ports(2)
    stubs("--port", port)
    flight = start(
        "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--speed", SPEED, "--connect",
        f"udpin://127.0.0.1:{port}-{port + 1}", "--out", tmp_path / "run",
    )  # fmt: skip
    read_until(flight, "Type yes to take off")
    flight.send_signal(number)
    assert flight.wait(10.0) == 4  # though nothing was typed
    assert flight.stderr is not None
    assert "stopped before anything was armed" in flight.stderr.read()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_an_interruption_in_the_air_brings_all_home(
    start: Start, stubs: Start, tmp_path: Path, number: int
) -> None:
    port = free_ports(2)
    stubs("--port", port)
    flight = start(
        "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--speed", SPEED, "--duration", 4000,
        "--yes", "--json", "--connect", f"udpin://127.0.0.1:{port}-{port + 1}", "--out", tmp_path / "run",
    )  # fmt: skip
    read_until(flight, "searching")
    if number == signal.SIGHUP:
        assert flight.stderr is not None
        flight.stderr.close()  # the terminal is gone: what is said must not end the flight
        flight.stderr = None
    flight.send_signal(number)
    out, _ = flight.communicate(timeout=PATIENCE_S)
    assert flight.returncode == 4
    assert [v["outcome"] for v in json.loads(out)["per_vehicle"]] == ["landed"] * 2


def test_a_port_in_use_is_told(start: Start, tmp_path: Path) -> None:
    port = free_ports(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", port))
        flight = start(
            "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--yes", "--connect",
            f"udpin://127.0.0.1:{port}", "--out", tmp_path / "run",
        )  # fmt: skip
        _, err = flight.communicate(timeout=PATIENCE_S)
    assert flight.returncode == 3
    assert f"udpin://127.0.0.1:{port}: cannot open: " in err and "in use" in err
    assert not (tmp_path / "run").exists()


def test_some_urls_in_the_mission_are_not_enough(start: Start, tmp_path: Path) -> None:
    mission = fleet_of('connect: "udpin://127.0.0.1:14999"', "autopilot: px4")
    flight = start("swarmctl", "fly", "--mission", write(tmp_path, mission), "--out", tmp_path / "run")
    _, err = flight.communicate(timeout=PATIENCE_S)
    assert flight.returncode == 2
    assert "vehicles.connect: some vehicles have one and some have none" in err
