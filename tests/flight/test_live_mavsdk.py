"""Live flights by way of MAVSDK: the same missions, the same endings, the same recordings."""

import asyncio
import json
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any, ClassVar

import pytest

from swarmctl.flight.errors import RefusedError
from swarmctl.flight.fly_live import LiveOptions, probe
from swarmctl.flight.live import FlightClock, LiveLink
from swarmctl.flight.orders import Orders
from swarmctl.live_cli import free_ports
from swarmctl.mavlink.dialect import mav
from swarmctl.mission.launch import as_found
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.backend import Begins, Mavlink, Wake
from swarmctl.vehicle.mavsdk_session import MavsdkBackend
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .flown import read_with_pymavlink, small_mission
from .paced import PacedLoop
from .processes import GROUP, MISSION, PATIENCE_S, SPEED, Start, flown, write
from .virtual import ANYWHERE, PLACES_M, Live, events, outcomes, run

THREE = GROUP.replace("count: 2", "count: 3")
SLOW: dict[str, object] = {"vehicles.speed_mps": 8}
GROUND = (255, mav.MAV_COMP_ID_MISSIONPLANNER)
LAND, TAKEOFF, ARM = (
    mav.MAV_CMD_NAV_LAND,
    mav.MAV_CMD_NAV_TAKEOFF,
    mav.MAV_CMD_COMPONENT_ARM_DISARM,
)


def by_mavsdk(path: Path, autopilots: list[str], **how: Any) -> Live:
    """A flight by way of MAVSDK in paced time, as fast as either firmware flies."""
    settings = {**SLOW, **how.pop("settings", {})}
    places, options = PLACES_M[: len(autopilots)], {"backend": MavsdkBackend}
    return Live(path, settings, autopilots, places, loop=PacedLoop, options=options, **how)


def sent_to(messages: list[Any], system: int) -> list[Any]:
    """What our side sent to one vehicle."""
    ours = (m for m in messages if (m.get_srcSystem(), m.get_srcComponent()) == GROUND)
    return [m for m in ours if getattr(m, "target_system", None) == system]


@pytest.mark.parametrize("ports", [3, 1])
def test_three_vehicles_fly_a_mission_on_ports_of_their_own_or_on_one(
    start: Start, stubs: Start, tmp_path: Path, ports: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    port = free_ports(3)
    stubs("--vehicles", 3, "--port", port, "--autopilot", "px4,ardupilot,px4", *(["--shared"] * (ports == 1)))
    code, summary = flown(
        start(
            "swarmctl", "fly", "--mission", write(tmp_path, MISSION + THREE), "--yes", "--json", "--speed", SPEED,
            "--connect", f"udpin://127.0.0.1:{port}-{port + ports - 1}", "--backend", "mavsdk",
            "--out", tmp_path / "run",
        )
    )  # fmt: skip
    assert code == 0
    assert [(v["autopilot"], v["outcome"], v["events"]) for v in summary["per_vehicle"]] == [
        ("px4", "landed", []),
        ("ardupilot", "landed", []),
        ("px4", "landed", []),
    ]
    assert summary["geofence_violations"] == 0
    messages = read_with_pymavlink(tmp_path / "run" / "flight.tlog")
    for system in (1, 2, 3):
        sent = sent_to(messages, system)
        kinds = Counter(m.get_type() for m in sent)
        assert kinds["SET_POSITION_TARGET_LOCAL_NED"] > 200
        assert kinds["MISSION_ITEM_INT"] == 4  # the fence
        commands = [m.command for m in sent if m.get_type() == "COMMAND_LONG"]
        assert commands.count(ARM) >= 1 and commands.count(TAKEOFF) >= 1 and commands.count(LAND) >= 1
        heard = Counter(m.get_type() for m in messages if m.get_srcSystem() == system)
        assert heard["GLOBAL_POSITION_INT"] > 200
        assert heard["MISSION_ITEM_INT"] == 4  # read back
    replay = start("swarmctl", "replay", tmp_path / "run", "--json")
    out, _ = replay.communicate(timeout=PATIENCE_S)
    assert replay.returncode == 0
    assert json.loads(out)["identical"] == summary["decisions"]
    assert list((tmp_path / "tmp").iterdir()) == []


def test_one_that_is_refused_keeps_all_on_the_ground(start: Start, stubs: Start, tmp_path: Path) -> None:
    port = free_ports(2)
    stubs("--port", port, "--autopilot", "px4,ardupilot", "--fault", "2:arming-refused@0")
    flight = start(
        "swarmctl", "fly", "--mission", write(tmp_path, MISSION + GROUP), "--yes", "--json", "--speed", SPEED,
        "--connect", f"udpin://127.0.0.1:{port}-{port + 1}", "--backend", "mavsdk", "--out", tmp_path / "run",
    )  # fmt: skip
    out, err = flight.communicate(timeout=PATIENCE_S)
    assert (flight.returncode, out) == (3, "")
    assert "refused: vehicle 2 gave up: ready to arm: not reached in 90 s" in err
    assert not (tmp_path / "run").exists()


def test_check_finds_by_mavsdk_what_it_finds_without(start: Start, stubs: Start, tmp_path: Path) -> None:
    port = free_ports(2)
    stubs("--port", port, "--autopilot", "px4,ardupilot")
    check = start(
        "swarmctl", "check", "--mission", write(tmp_path, MISSION + GROUP), "--connect",
        f"udpin://127.0.0.1:{port}-{port + 1}", "--backend", "mavsdk",
    )  # fmt: skip
    out, err = check.communicate(timeout=PATIENCE_S)
    assert check.returncode == 0, out + err
    rows = [line for line in out.splitlines() if "ready to arm" in line]
    assert "px4 1.17.0" in rows[0] and "12 m/s" in rows[0]
    assert "ardupilot 4.8.0" in rows[1] and "10 m/s" in rows[1]
    for row in rows:
        assert "100 %" in row and " ms" in row and "verified" in row


def test_a_failsafe_takes_a_vehicle_and_is_not_fought(tmp_path: Path) -> None:
    live = by_mavsdk(tmp_path, ["px4", "px4"], faults=["2:gps-loss@40"], settings={"duration_s": 30})
    outcome = live.fly()
    assert (outcomes(outcome), outcome.exit_code()) == (["landed", "released"], 1)
    assert "its mode became AUTO.LAND while engaged" in events(outcome, 2)
    assert live.down == [True, True]
    messages = read_with_pymavlink(live.folder.tlog)
    released = float(events(outcome, 2).split(" s:")[0])
    began = messages[0]._timestamp
    after = [m.get_type() for m in sent_to(messages, 2) if m._timestamp - began > released + 0.5]
    assert not {"SET_POSITION_TARGET_LOCAL_NED", "COMMAND_LONG"} & set(after)


class Quiet:
    """Wires on which one vehicle was heard and nothing comes any more."""

    heard: ClassVar = [1]

    def __init__(self) -> None:
        self.sent = asyncio.Event()

    async def open(self, addresses: list[Address]) -> None:
        """They are open."""

    def subscribe(self, deliver: Callable[[int, bytes], None]) -> None:
        """Nothing is delivered."""

    def address(self, system: int) -> Address:
        return ANYWHERE

    def way(self, system: int) -> str:
        return str(ANYWHERE)

    def send(self, system: int, frame: bytes) -> None:
        assert (system, frame) == (1, b"a frame")
        self.sent.set()

    def call(self, frame: bytes) -> None:
        """Nobody is called."""

    def close(self) -> None:
        """They are closed."""


class Ripe(Mavlink):
    """A backend that has a frame to send from the start, and keeps what wakes the link."""

    def session(
        self, system: int, settings: SessionSettings, now: float, wake: Wake, begins: Begins
    ) -> Session:
        self.wake = wake
        session = super().session(system, settings, now, wake, begins)
        session.outgoing = lambda: [b"a frame"]  # type: ignore[method-assign]
        return session


def test_a_frame_leaves_when_a_thread_has_made_it() -> None:
    """And not only when something arrives, or the swarm ticks."""

    async def wake() -> None:
        wires, backend = Quiet(), Ripe()
        link = LiveLink(FlightClock(1.0), wires, lambda now, sessions: None, backend)
        link.meet(await link.find([[ANYWHERE]], 20.0), SessionSettings())
        assert not wires.sent.is_set()
        Thread(target=backend.wake).start()
        await asyncio.wait_for(wires.sent.wait(), 10.0)

    asyncio.run(wake())


def test_a_silent_vehicle_is_ours_again_when_it_is_heard(tmp_path: Path) -> None:
    live = by_mavsdk(
        tmp_path, ["ardupilot", "ardupilot"], faults=["2:link-loss@75+6"],
        settings={"duration_s": 40, "safety.if_one_fails": "continue"},
    )  # fmt: skip
    outcome = live.fly()
    told = events(outcome, 2)
    assert "no heartbeat for 3 s while engaged" in told and "heartbeat again" in told
    assert outcomes(outcome) == ["landed", "landed"]
    assert outcome.summary("")["searched_s"] == 40.0
    assert live.down == [True, True]


def test_flight_after_flight_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither threads nor files, open or temporary."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    mission = as_found(small_mission(tmp_path, {**SLOW, "vehicles.count": 2}))
    left = []
    for _ in range(4):
        live = by_mavsdk(tmp_path, ["px4", "ardupilot"])
        busy: list[int] = []
        live.wires.each_step = lambda now, busy=busy: busy.append(len(os.listdir("/proc/self/task")))  # type: ignore[misc]
        options = LiveOptions(
            [[ANYWHERE]] * 2, wires=lambda signing, wires=live.wires: wires, backend=MavsdkBackend
        )  # type: ignore[misc]
        preparation, _ = run(probe(mission, options, Orders()), PacedLoop)
        assert not preparation.refusals
        left.append((len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))))
        assert max(busy) > left[-1][0], "MAVSDK has no threads: nothing is watched"
    assert left[1] == left[2] == left[3]
    assert list((tmp_path / "tmp").iterdir()) == []


def test_a_vehicle_that_mavsdk_finds_unfit_is_not_armed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The vehicle says that it is ready; MAVSDK has not heard so much."""
    monkeypatch.setattr("swarmctl.vehicle.mavsdk_client.Client.healthy", False)
    live = by_mavsdk(tmp_path, ["px4"])
    with pytest.raises(RefusedError, match="health by MAVSDK: not reached"):
        live.fly()
    assert live.down == [True]
