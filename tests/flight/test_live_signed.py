"""Signed flights from the command line, with somebody on the line who has no key."""

import re
import signal
from pathlib import Path

import pytest

from swarmctl.live_cli import free_ports

from .meddler import Meddler
from .processes import MISSION, PATIENCE_S, SPEED, Start, flown, read_until, write

ONE = "vehicles: {count: 1, speed_mps: 8, altitude_m: 10}\n"
KINDS = ("unsigned", "wrongly_signed", "replayed")


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A key file; what is kept of its times is this test's own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path = tmp_path / "key"
    path.write_text("0123456789abcdef" * 4)
    path.chmod(0o600)
    return path


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_stranger_on_the_line_neither_orders_nor_deceives(
    start: Start, stubs: Start, tmp_path: Path, key: Path, autopilot: str
) -> None:
    port = free_ports(20)
    stub = stubs("--vehicles", 1, "--tcp", port, "--autopilot", autopilot, "--signing-key", key)
    meddler = Meddler(port + 5, port, autopilot)
    code, summary = flown(
        start(
            "swarmctl", "fly", "--mission", write(tmp_path, MISSION + ONE), "--connect", f"tcp://127.0.0.1:{port + 5}",
            "--signing-key", key, "--yes", "--json", "--speed", SPEED, "--out", tmp_path / "run",
        )
    )  # fmt: skip
    (vehicle,) = summary["per_vehicle"]
    assert (code, vehicle["outcome"]) == (0, "landed")
    link, told = vehicle["link"], "\n".join(vehicle["events"])
    for kind in KINDS:
        assert 3 <= link[f"messages_{kind}"] <= meddler.to_controller
        assert f"frames in its name are dropped: {kind.replace('_', ' ')}" in told
    stub.send_signal(signal.SIGINT)
    dropped = re.findall(r"\d+", read_until(stub, "dropped"))[1:]
    assert dropped == [str(meddler.to_vehicle)] * 3 and meddler.to_vehicle > 3
    meddler.close()


def test_a_key_that_vehicles_do_not_have_is_said_to_be_why_nobody_is_heard(
    start: Start, stubs: Start, tmp_path: Path, key: Path
) -> None:
    port = free_ports(2)
    stubs("--port", port)
    check = start(
        "swarmctl", "check", "--mission", write(tmp_path, MISSION + ONE), "--connect", f"udpin://127.0.0.1:{port}",
        "--signing-key", key, "--connect-timeout", 2,
    )  # fmt: skip
    _, err = check.communicate(timeout=PATIENCE_S)
    assert check.returncode == 3
    assert re.search(
        r"heard 0 of 1 vehicles.*frames dropped for their signature: system 1: \d+ unsigned", err
    )


def test_ardupilot_is_given_a_key_and_rid_of_it_and_px4_is_said_to_take_none(
    start: Start, stubs: Start, tmp_path: Path, key: Path
) -> None:
    port = free_ports(3)
    stubs("--port", port, "--autopilot", "ardupilot,px4", "--shared")
    words = ("--connect", f"udpin://127.0.0.1:{port}", "--signing-key")
    other = tmp_path / "other"
    other.write_text("ab" * 32)
    given = "vehicle 1: it signs with this key\nvehicle 2: it does not do so\n"
    for words_now, typed, said, code in (
        ((key,), "no\n", "", 3),
        ((key,), "yes\n", given, 3),
        ((key, "--yes"), "", given, 3),
        ((other, "--remove"), "yes\n", "vehicle 1: it does not do so\nvehicle 2: it signs no more\n", 3),
        ((key, "--remove"), "yes\n", "vehicle 1: it signs no more\nvehicle 2: it signs no more\n", 0),
    ):
        sign = start("swarmctl", "sign", *words, *words_now)
        out, err = sign.communicate(typed, timeout=PATIENCE_S)
        assert (out, sign.returncode) == (said, code), err
