"""What `swarmctl fly --resume` refuses before it looks for any vehicle, and why."""

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.record import mcap_read
from swarmctl.record.mcap_log import McapLog

from .given import Swarmctl
from .test_cli_bad_input import files_below, refused

LIVE = {"systems": "1 2 3", "connect": "udpin://127.0.0.1:1 " * 3, "speed": "1", "own_stubs": "no"}


@pytest.fixture
def died(flown: Path, tmp_path: Path) -> Callable[..., Path]:
    """The folder of a flight that did not end, made of one that did; ``about`` is added to what it says of itself."""

    def make(about: dict[str, str], ticks: bool = True) -> Path:
        run = tmp_path / "run"
        run.mkdir()
        log = mcap_read.read(flown / "flight.mcap")
        (run / "mission.yaml").write_bytes((flown / "mission.yaml").read_bytes())
        with McapLog(run / "flight.mcap") as copy:
            copy.metadata("flight", {**log.metadata["flight"], **about})
            for message in log.rows():
                channel = copy.channel(message.topic, message.rows.dtype)
                if ticks or message.topic != "/ticks":
                    copy.write_rows(channel, message.tick, message.time_s, message.rows)
        return run

    return make


def test_no_such_run(swarmctl: Swarmctl, tmp_path: Path) -> None:
    refused(swarmctl("fly", "--resume", tmp_path / "none"), "no such run")


def test_one_killed_before_anything_was_recorded(swarmctl: Swarmctl, tmp_path: Path) -> None:
    refused(swarmctl("fly", "--resume", tmp_path), "nothing was recorded: nobody had taken off")


def test_one_that_has_ended(swarmctl: Swarmctl, flown: Path) -> None:
    refused(
        swarmctl("fly", "--resume", flown), "this flight has ended", "summary.json", "fly the mission anew"
    )


def test_one_in_lockstep(swarmctl: Swarmctl, died: Callable[..., Path]) -> None:
    refused(swarmctl("fly", "--resume", died({})), "a flight in lockstep: its vehicles ended with it")


def test_one_that_never_took_off(swarmctl: Swarmctl, died: Callable[..., Path]) -> None:
    refused(swarmctl("fly", "--resume", died(LIVE, ticks=False)), "nobody had taken off")


@pytest.mark.parametrize(
    ("about", "why"),
    [
        ({"systems": "1 2 x"}, "does not say how its vehicles were reached"),
        ({"speed": "fast"}, "does not say how its vehicles were reached"),
        ({"connect": "somewhere"}, "does not say how its vehicles were reached"),
        ({"systems": "1 2"}, "differ in the number of vehicles"),
    ],
)
def test_one_that_was_tampered_with(
    swarmctl: Swarmctl, died: Callable[..., Path], about: dict[str, str], why: str
) -> None:
    refused(swarmctl("fly", "--resume", died({**LIVE, **about})), why)


def test_vehicles_that_are_not_there(swarmctl: Swarmctl, died: Callable[..., Path], tmp_path: Path) -> None:
    run = died(LIVE)
    before = files_below(tmp_path)
    words = ("fly", "--resume", run, "--out", tmp_path / "on", "--connect", "udpin://127.0.0.1:39872")
    result = swarmctl(*words, "--connect-timeout", "0.3")
    refused(result, "heard 0 of 3 vehicles", "39872", code=3)
    assert files_below(tmp_path) == before


@pytest.mark.parametrize(
    "option",
    ["--mission=m.yaml", "--algo=mdc", "--vehicles=3", "--seed=1", "--duration=5", "--autopilot=px4"],
)
def test_what_cannot_be_changed_in_flight(swarmctl: Swarmctl, flown: Path, option: str) -> None:
    name = option.partition("=")[0]
    refused(swarmctl("fly", "--resume", flown, option), f"{name} cannot be changed in flight", "from the run")


@pytest.mark.parametrize("option", ["--adapt", "--backend=mavsdk", "--speed=max"])
def test_what_makes_no_sense_in_flight(swarmctl: Swarmctl, flown: Path, option: str) -> None:
    refused(swarmctl("fly", "--resume", flown, option), option.partition("=")[0])
