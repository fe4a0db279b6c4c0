"""The budget of each wire: how many bytes a second cross it both ways, and at which rates they fit.

What is asked of a vehicle and what it is sent is known beforehand: rates times the sizes of the frames, each at
its longest (MAVLink 2 leaves out zeros at a payload's end, which is not counted on), with its signature if there
is one, and an allowance for commands, their answers and texts.  UDP and TCP are taken to carry it.  A serial
line carries a byte in ten bits; both ways count against four fifths of it, because most lines as thin as that
are radios, which speak one way at a time, and the rest is for fences, parameters and what gets lost.

If that is not enough, everything is asked for and sent less often, for all vehicles alike, since one loop flies
them.  The lowest setpoint rate is 4 Hz: PX4 gives up a second after the last setpoint, and then three in a row may
get lost.  The lowest position rate is 2 Hz: a position counts as lost after two seconds.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import SIGNATURE_BYTES
from swarmctl.mission.model import Mission
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.autopilots.registry import ADAPTERS
from swarmctl.vehicle.transports import BITS_PER_BYTE

from .errors import RefusedError

FRAME_BYTES = 12
USED = 0.8
LOWER_HZ = (10.0, 5.0, 4.0)
"""Setpoint rates to fall back on."""
LEAST_POSITIONS_HZ = 2.0
STATUS_HZ, LEAST_STATUS_HZ = 2.0, 1.0
BEATS_HZ = 1.0
"""Heartbeats and pings, ours and theirs, and the home that PX4 tells unasked."""
COMMANDS_HZ, TEXTS_HZ = 1.0, 0.5
"""The allowance for commands with their answers, and for texts."""


@dataclass(frozen=True)
class Rates:
    """How often a vehicle is sent setpoints, and asked for positions and for its status; Hz."""

    setpoints: float
    positions: float
    status: float

    def __str__(self) -> str:
        return f"setpoints at {self.setpoints:g} Hz, positions at {self.positions:g} Hz, status at {self.status:g} Hz"


@dataclass(frozen=True)
class Load:
    """What crosses one wire: bytes a second from and to its vehicles; ``most``: what it can carry, None: plenty."""

    address: Address
    vehicles: int
    from_vehicles: float
    to_vehicles: float
    most: float | None

    @property
    def fits(self) -> bool:
        """Whether the wire carries it."""
        return self.most is None or self.from_vehicles + self.to_vehicles <= self.most

    def __str__(self) -> str:
        total = self.from_vehicles + self.to_vehicles
        limit = f"of {self.most:.0f} ({USED:.0%} of the line)" if self.most is not None else ""
        return (
            f"  {self.address}: {self.vehicles} vehicle{'s' if self.vehicles > 1 else ''}, "
            f"{self.from_vehicles:.0f} from, {self.to_vehicles:.0f} to, {total:.0f} {limit}".rstrip()
        )


@dataclass(frozen=True)
class Budget:
    """The rates that all wires carry, and what then crosses each."""

    rates: Rates
    wanted: Rates
    loads: Sequence[Load]

    def __str__(self) -> str:
        lowered = "" if self.rates == self.wanted else f"; lowered from {self.wanted}"
        head = f"link budget, bytes a second at most: {self.rates}{lowered}"
        return "\n".join((head, *map(str, self.loads)))


def plan(mission: Mission, heard_on: Sequence[Address], signed: bool, speed: float) -> Budget:
    """The budget of a flight whose vehicles were heard on these addresses, one each, ``speed`` times as fast.

    Raises RefusedError for a wire that cannot carry its vehicles at any rate.
    """
    vehicles = Counter(heard_on)
    steps = list(_steps(mission))
    for rates in steps:
        loads = _loads(vehicles, rates, signed, speed)
        if all(load.fits for load in loads):
            return Budget(rates, steps[0], loads)
    raise RefusedError("\n".join(_too_thin(load, rates) for load in loads if not load.fits))


def lowered(mission: Mission, rates: Rates) -> Mission:
    """The mission with the setpoint rate that its wires carry."""
    setpoints = mission.setpoints.model_copy(update={"rate_hz": rates.setpoints})
    return mission.model_copy(update={"setpoints": setpoints})


def stale_s(rates: Rates) -> float:
    """How much older than at the usual rate a position is on average, and as much more at most; seconds."""
    return max(0.0, 0.5 / rates.positions - 0.5 / LOWER_HZ[0])


def _steps(mission: Mission) -> Iterator[Rates]:
    """From the rates wanted to the lowest; a planner's period stays a whole number of setpoints."""
    wanted, period_s = mission.setpoints.rate_hz, mission.planner.period_s
    yield Rates(wanted, wanted, STATUS_HZ)
    rates = [wanted, *(hz for hz in LOWER_HZ if hz < wanted and (period_s * hz).is_integer())]
    for hz in rates:
        yield Rates(hz, hz, LEAST_STATUS_HZ)
    if rates[-1] > LEAST_POSITIONS_HZ:
        yield Rates(rates[-1], LEAST_POSITIONS_HZ, LEAST_STATUS_HZ)


def _loads(vehicles: Mapping[Address, int], rates: Rates, signed: bool, speed: float) -> list[Load]:
    down, up = speed * _from_vehicle(rates, signed), speed * _to_vehicle(rates, signed)
    return [
        Load(address, count, count * down, count * up, _most(address)) for address, count in vehicles.items()
    ]


def _most(address: Address) -> float | None:
    """Bytes a second that a wire carries both ways together."""
    return USED * address.port / BITS_PER_BYTE if address.kind == "serial" else None


def _from_vehicle(rates: Rates, signed: bool) -> float:
    """Bytes a second of what one vehicle is asked for, whichever firmware it has, and of its answers."""
    extra: dict[int, float] = {}
    for make in ADAPTERS.values():
        extra |= make().extra_rates
    return _bytes(
        {
            **extra,
            mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: rates.positions,
            mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: rates.status,
            mav.MAVLINK_MSG_ID_SYS_STATUS: rates.status,
            mav.MAVLINK_MSG_ID_HEARTBEAT: BEATS_HZ,
            mav.MAVLINK_MSG_ID_TIMESYNC: BEATS_HZ,
            mav.MAVLINK_MSG_ID_HOME_POSITION: BEATS_HZ,
            mav.MAVLINK_MSG_ID_COMMAND_ACK: COMMANDS_HZ,
            mav.MAVLINK_MSG_ID_STATUSTEXT: TEXTS_HZ,
        },
        signed,
    )


def _to_vehicle(rates: Rates, signed: bool) -> float:
    """Bytes a second of what one vehicle is sent."""
    return _bytes(
        {
            mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: rates.setpoints,
            mav.MAVLINK_MSG_ID_HEARTBEAT: BEATS_HZ,
            mav.MAVLINK_MSG_ID_TIMESYNC: BEATS_HZ,
            mav.MAVLINK_MSG_ID_COMMAND_LONG: COMMANDS_HZ,
        },
        signed,
    )


def _bytes(rates: Mapping[int, float], signed: bool) -> float:
    """Bytes a second of messages at these rates (Hz), each at its longest."""
    overhead = FRAME_BYTES + (SIGNATURE_BYTES if signed else 0)
    sizes: dict[int, int] = {i: mav.mavlink_map[i].unpacker.size for i in rates}
    return sum(hz * (sizes[i] + overhead) for i, hz in rates.items())


def _too_thin(load: Load, rates: Rates) -> str:
    needed = load.from_vehicles + load.to_vehicles
    return (
        f"{load.address} carries {load.most:.0f} bytes a second ({USED:.0%} of the line), and {load.vehicles} "
        f"vehicle{'s' if load.vehicles > 1 else ''} on it need {needed:.0f} even with {rates} "
        "(put fewer on it, or make it faster)"
    )
