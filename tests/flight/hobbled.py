"""Stub vehicles with something wrong: proxies between a sound stub and the controller."""

from collections.abc import Callable, Sequence

from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.vehicle import StubVehicle
from swarmctl.core.arrays import Records
from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav

Hobble = Callable[[StubFleet], "Meddled"]
LOITER_MODE = (4, 3)  # PX4: AUTO, LOITER
OTHER_STATION = 254


class Proxy:
    """One vehicle that loses frames: ``hears`` and ``says`` tell by message id and time which pass."""

    def __init__(
        self, vehicle: StubVehicle, hears: Callable[[int, bytes, float], bool],
        says: Callable[[int, float], bool],
    ) -> None:  # fmt: skip
        self._vehicle, self._hears, self._says = vehicle, hears, says
        self._decoder = Decoder()
        self.now = 0.0

    def receive(self, data: bytes, now: float) -> None:
        """Pass on what it hears."""
        if self._hears(message_id(data), data, now):
            self._vehicle.receive(data, now)

    def outgoing(self) -> list[bytes]:
        """What it says."""
        return [frame for frame in self._vehicle.outgoing() if self._says(message_id(frame), self.now)]


def message_id(frame: bytes) -> int:
    """A MAVLink 2 frame's message id."""
    return int.from_bytes(frame[7:10], "little")


class Meddled:
    """A fleet in which one vehicle has a proxy, or to which something is done at a time."""

    def __init__(self, fleet: StubFleet) -> None:
        self._fleet = fleet
        self.vehicles: Sequence[Proxy | StubVehicle] = list(fleet.vehicles)
        self._deeds: list[tuple[float, Callable[[float], None]]] = []

    @property
    def truth(self) -> Records:
        """Where they are."""
        return self._fleet.truth

    def advance(self, now: float) -> None:
        """Do what is due, then let all move."""
        for vehicle in self.vehicles:
            vehicle.now = now
        for deed in [deed for deed in self._deeds if deed[0] <= now]:
            self._deeds.remove(deed)
            deed[1](now)
        self._fleet.advance(now)

    def stub(self, system: int) -> StubVehicle:
        """The vehicle with this system id."""
        return self._fleet.vehicles[system - 1]

    def at(self, time_s: float, deed: Callable[[float], None]) -> None:
        """Have something done at a time."""
        self._deeds.append((time_s, deed))

    def replace(self, system: int, proxy: Proxy) -> None:
        """Put a proxy before one vehicle."""
        self.vehicles = [*self.vehicles[: system - 1], proxy, *self.vehicles[system:]]


def everything(*_: object) -> bool:
    """Nothing is lost."""
    return True


def is_arming(message: int, frame: bytes) -> bool:
    """Whether a frame is the order to arm."""
    if message != mav.MAVLINK_MSG_ID_COMMAND_LONG:
        return False
    (decoded,) = Decoder().feed(frame)
    return bool(decoded.fields.command == mav.MAV_CMD_COMPONENT_ARM_DISARM and decoded.fields.param1 == 1.0)


def never_arms(fleet: StubFleet) -> Meddled:
    """Vehicle 2 does not hear the order to arm."""
    swarm = Meddled(fleet)
    swarm.replace(2, Proxy(swarm.stub(2), lambda m, data, now: not is_arming(m, data), everything))
    return swarm


def never_speaks(fleet: StubFleet) -> Meddled:
    """Nothing ever comes from vehicle 2."""
    swarm = Meddled(fleet)
    swarm.replace(2, Proxy(swarm.stub(2), everything, lambda m, now: False))
    return swarm


def never_is_ready(fleet: StubFleet) -> Meddled:
    """Vehicle 2 never says how it is, so nobody knows whether it could be armed."""
    swarm = Meddled(fleet)
    says = mav.MAVLINK_MSG_ID_SYS_STATUS
    swarm.replace(2, Proxy(swarm.stub(2), everything, lambda m, now: m != says))
    return swarm


def motors_stop(at_s: float) -> Hobble:
    """Vehicle 2's motors stop in the air."""

    def hobble(fleet: StubFleet) -> Meddled:
        swarm = Meddled(fleet)
        swarm.at(at_s, lambda now: swarm.stub(2).disarm())
        return swarm

    return hobble


def goes_silent(at_s: float, *messages: int, back_at_s: float = float("inf")) -> Hobble:
    """Vehicle 2's messages of these ids (all if none is given) do not come between two times."""

    def hobble(fleet: StubFleet) -> Meddled:
        swarm = Meddled(fleet)

        def says(message: int, now: float) -> bool:
            return not at_s <= now < back_at_s or bool(messages and message not in messages)

        swarm.replace(2, Proxy(swarm.stub(2), everything, says))
        return swarm

    return hobble


def mode_is_changed(at_s: float, mode: tuple[int, int] = LOITER_MODE) -> Hobble:
    """Another ground station changes vehicle 2's mode."""

    def hobble(fleet: StubFleet) -> Meddled:
        swarm = Meddled(fleet)
        message = mav.MAVLink_command_long_message(
            2, 1, mav.MAV_CMD_DO_SET_MODE, 0, 1.0, float(mode[0]), float(mode[1]), 0.0, 0.0, 0.0, 0.0
        )
        frame = Encoder(OTHER_STATION, 190).encode(message)
        swarm.at(at_s, lambda now: swarm.stub(2).receive(frame, now))
        return swarm

    return hobble
