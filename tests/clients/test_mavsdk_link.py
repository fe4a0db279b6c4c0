"""MAVSDK and the stub on the link: who finds whom, and how they lose each other.

A test named for a row shows that row of "What a MAVSDK 4.1 client needs from a vehicle".
"""

from collections.abc import Callable
from importlib.metadata import version

from mavsdk import Autopilot

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav

from .meeting import SPEED, Client, Meeting

Meet = Callable[..., Meeting]


def test_row_version_is_the_native_binding(meet: Meet) -> None:
    client = meet().client
    major, minor = (int(part) for part in version("mavsdk").split(".")[:2])
    assert (4, 1) <= (major, minor) < (5, 0)
    assert client.mavsdk.version() == f"v{version('mavsdk')}"


def test_row_discovery_is_by_a_heartbeat_of_component_1() -> None:
    client = Client("raw://")
    try:
        for component, found in ((2, False), (1, True)):
            heartbeat = Encoder(1, component).heartbeat(
                mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, 0, 0, 3
            )
            client.mavsdk.pass_received_raw_bytes(heartbeat)
            assert (client.mavsdk.first_autopilot(0.2) is not None) is found
    finally:
        client.close()


def test_row_discovery_finds_the_stub_and_its_firmware(meet: Meet, autopilot: str) -> None:
    stub, client = meet(booted_s=0.0)
    assert stub.now < 2.0
    assert client.system.get_system_id() == 1
    assert client.system.component_ids() == [1]
    firmware = {"px4": Autopilot.PX4, "ardupilot": Autopilot.ARDUPILOT}[autopilot]
    assert client.system.autopilot_type() == firmware


def test_row_discovery_is_lost_3_s_after_the_last_heartbeat_and_comes_back(meet: Meet) -> None:
    stub, client = meet()
    seen: list[tuple[float, bool]] = []
    client.system.subscribe_is_connected(lambda connected, _: seen.append((stub.wall, connected)))
    stub.do(stub.vehicle.faults.begin, "link-loss")
    cut = stub.wall
    stub.until(lambda: len(seen) == 1, 10.0 * SPEED)
    lost, connected = seen[0]
    assert not connected
    assert 3.0 - 1.0 / SPEED < lost - cut < 3.5
    client.action.arm_async(lambda *_: None)
    stub.run(1.0)
    assert not stub.vehicle.armed
    stub.do(stub.vehicle.faults.end, "link-loss")
    stub.until(lambda: len(seen) == 2)
    assert seen[1][1]
    client.action.arm()
    assert stub.vehicle.armed
