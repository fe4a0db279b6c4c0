"""The second replay: everything the controller sent goes to fresh stub vehicles, and their tracks are compared.

For a recording made with stubs the tracks are identical to the last digit; for real vehicles the differences
say how far the stub's motion is from theirs.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import yaml

from swarmctl.core.arrays import Records
from swarmctl.mavlink.codec import Decoder, Frame
from swarmctl.mavlink.dialect import mav

from . import mcap_read
from .errors import LogError
from .folder import RunFolder
from .replay import open_world
from .searched import CONTINUES
from .tlog_read import read_frames

GROUND_SYSTEM = 255
POSITION: int = mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
METRES_A_DEGREE = 111_320.0


class Vehicles(Protocol):
    """Fresh vehicles: moved on by ``advance``, spoken to through ``vehicles``."""

    @property
    def vehicles(self) -> Sequence[Any]:
        """One a system id."""

    def advance(self, now: float) -> None:
        """Move all of them on."""


class MakeVehicles(Protocol):
    """Makes fresh vehicles as a recording's were."""

    def __call__(
        self, vehicles: Records, origin: tuple[float, float, float], endurance_s: Sequence[float | None],
        interval_s: float, *, autopilots: Sequence[str], wind_mps: tuple[float, float],
    ) -> Vehicles:  # fmt: skip
        """On the pads of ``vehicles`` about ``origin``."""


@dataclass(frozen=True)
class Compared:
    """Positions that both flights reported, how many are identical, and how far the others are apart."""

    positions: int
    identical: int
    missing: int
    rms_m: float
    max_m: float

    @property
    def same(self) -> bool:
        """Whether both flights reported the same positions throughout."""
        return self.positions > 0 and self.missing == 0 and self.identical == self.positions

    def as_json(self) -> dict[str, Any]:
        """The content of ``replay --stub --json``."""
        return asdict(self)

    def as_text(self) -> str:
        """One line for a person."""
        return (
            f"{self.identical} of {self.positions} positions identical, {self.missing} missing; "
            f"apart by {self.rms_m:.3f} m RMS, {self.max_m:.3f} m at most"
        )


def replay_stub(folder: RunFolder, make_vehicles: MakeVehicles) -> Compared:
    """Fly the recorded commands and setpoints again.  Raises LogError for a damaged recording."""
    log = mcap_read.read(folder.mcap)
    world = open_world(log)
    if CONTINUES in log.metadata:
        raise LogError(
            f"{folder.mcap}: resumed a flight, and began in the air: fresh stubs stand on the ground"
        )
    interval = float(world.rules[0]["interval"])
    about = yaml.safe_load(log.attachments.get("mission.yaml", "{}"))
    origin = about["origin"]
    endurance = [float(s) for s in log.metadata["flight"].get("endurance_s", "").split()]
    if len(endurance) != len(world.fleet):
        raise LogError(f"{folder.mcap}: does not say how long its vehicles can fly")
    flown = log.metadata["flight"]
    east, north = (float(part) for part in flown.get("wind_mps", "0 0").split())
    place = (origin["lat"], origin["lon"], origin["alt_m"])
    autopilots = flown.get("autopilots", "px4").split()
    vehicles = make_vehicles(
        world.fleet, place, endurance, interval, autopilots=autopilots, wind_mps=(east, north)
    )
    orders: dict[int, list[Frame]] = defaultdict(list)
    recorded: dict[tuple[int, int], tuple[int, ...]] = {}
    last = 0
    for time_s, frame in read_frames(folder.tlog):
        tick = last = round(time_s / interval)
        if frame.system == GROUND_SYSTEM:
            orders[tick].append(frame)
        elif frame.message_id == POSITION:
            recorded[tick, frame.system] = _position(frame)
    reported = _fly(vehicles, orders, last, interval)
    if log.truncated:  # the last tick may have been cut in two
        recorded = {key: value for key, value in recorded.items() if key[0] < last}
        reported = {key: value for key, value in reported.items() if key[0] < last}
    return _compare(recorded, reported)


def _position(frame: Frame) -> tuple[int, ...]:
    f = frame.fields
    return (f.lat, f.lon, f.relative_alt, f.vx, f.vy, f.vz)


def _fly(
    vehicles: Vehicles, orders: dict[int, list[Frame]], last: int, interval: float
) -> dict[tuple[int, int], tuple[int, ...]]:
    """What the vehicles report, by tick and system id, when given the recorded orders."""
    rate = round(1.0 / interval, 9)
    decoders = [Decoder() for _ in vehicles.vehicles]
    reported: dict[tuple[int, int], tuple[int, ...]] = {}
    for tick in range(last + 1):
        now = tick / rate
        vehicles.advance(now)
        for decoder, vehicle in zip(decoders, vehicles.vehicles, strict=True):
            for datagram in vehicle.outgoing():
                for frame in decoder.feed(datagram):
                    if frame.message_id == POSITION:
                        reported[tick, frame.system] = _position(frame)
        for frame in orders.get(tick, ()):
            target = getattr(frame.fields, "target_system", 0)
            for system, vehicle in enumerate(vehicles.vehicles, start=1):
                if target in (0, system):
                    vehicle.receive(frame.raw, now)
    return reported


def _compare(
    recorded: dict[tuple[int, int], tuple[int, ...]], reported: dict[tuple[int, int], tuple[int, ...]]
) -> Compared:
    both = recorded.keys() & reported.keys()
    squares = [_apart_squared(recorded[key], reported[key]) for key in both]
    return Compared(
        positions=len(both),
        identical=sum(recorded[key] == reported[key] for key in both),
        missing=len(recorded.keys() ^ reported.keys()),
        rms_m=math.sqrt(sum(squares) / len(squares)) if squares else 0.0,
        max_m=math.sqrt(max(squares, default=0.0)),
    )


def _apart_squared(a: tuple[int, ...], b: tuple[int, ...]) -> float:
    """Squared distance (m²) of two reported positions."""
    north = (a[0] - b[0]) * 1e-7 * METRES_A_DEGREE
    east = (a[1] - b[1]) * 1e-7 * METRES_A_DEGREE * math.cos(math.radians(a[0] * 1e-7))
    up = (a[2] - b[2]) * 1e-3
    return north * north + east * east + up * up
