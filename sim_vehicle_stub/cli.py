"""The command `sim-vehicle-stub`: a fleet of stub vehicles on UDP, TCP or pseudo-terminals of this machine."""

import asyncio
import contextlib
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .faults import FAULTS, parse_order

if TYPE_CHECKING:
    from .fleet import StubFleet
    from .links import Opener

DEFAULT_PORT, OWN_PORT_OFFSET = 14540, 40
AUTOPILOTS = ("px4", "ardupilot", "ardupilot-4.6")
TCP_SPACING = 10
MOST_VEHICLES = 250
STRONGEST_MPS = 100.0
DEFAULT_HOME = "47.3977,8.5456,488"
SPACING_M = 20.0
FASTEST = 100.0


def parse_home(context: click.Context, option: click.Parameter, text: str) -> tuple[float, float, float]:
    """Read LAT,LON,ALT; degrees and metres above sea level."""
    try:
        lat, lon, alt = (float(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r} is not LAT,LON,ALT, as in {DEFAULT_HOME}") from None
    if not (abs(lat) <= 89.0 and abs(lon) <= 180.0 and abs(alt) <= 9000.0):
        raise click.BadParameter(
            f"{text!r} is no place to fly: latitude within ±89°, longitude ±180°, altitude ±9000 m"
        )
    return lat, lon, alt


def parse_speed(context: click.Context, option: click.Parameter, speed: float) -> float:
    """A factor that time can be multiplied by; NaN passes every comparison of a range."""
    if not 0.0 < speed <= FASTEST:
        raise click.BadParameter(f"{speed} is not between 0 and {FASTEST:g}")
    return speed


def parse_autopilots(context: click.Context, option: click.Parameter, text: str) -> list[str]:
    """Read names of firmwares."""
    names = text.split(",")
    for name in names:
        if name not in AUTOPILOTS:
            raise click.BadParameter(f"{name!r} is none of {', '.join(AUTOPILOTS)}")
    return names


def parse_wind(context: click.Context, option: click.Parameter, text: str) -> tuple[float, float]:
    """Read EAST,NORTH; m/s."""
    try:
        east, north = (float(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r} is not EAST,NORTH, as in 3,-1.5") from None
    if not abs(east) + abs(north) <= STRONGEST_MPS:
        raise click.BadParameter(f"{text!r} is more than {STRONGEST_MPS:g} m/s")
    return east, north


def read_key(context: click.Context, option: click.Parameter, path: Path | None) -> bytes | None:
    """Read the key to sign with."""
    if path is None:
        return None
    from swarmctl.mavlink.signing import parse_key

    try:
        return parse_key(path.read_bytes())
    except (OSError, ValueError) as error:
        raise click.BadParameter(f"{path}: {error}") from None


GROUND_STATIONS = """
\b
Point a ground station at it:
  QGroundControl finds vehicles at UDP port 14550 by itself:
    sim-vehicle-stub --shared --port 14550
  MAVProxy, over each kind of link:
    sim-vehicle-stub --shared --port 14550   mavproxy.py --master=udpin:127.0.0.1:14550
    sim-vehicle-stub --tcp 5760              mavproxy.py --master=tcp:127.0.0.1:5760
    sim-vehicle-stub --pty                   mavproxy.py --master=/dev/pts/N,57600

\b
ArduPilot needs 41 s after boot until it can be armed in GUIDED, PX4 5 s.
Over UDP a vehicle answers the first who speaks to it, and nobody else.
"""


@click.command(context_settings={"help_option_names": ["-h", "--help"]}, epilog=GROUND_STATIONS)
@click.option(
    "--vehicles",
    type=click.IntRange(1, MOST_VEHICLES),
    default=1,
    show_default=True,
    help=f"How many; system ids count from 1. With the UDP ports as given at most {OWN_PORT_OFFSET}.",
)
@click.option(
    "--autopilot",
    "autopilots",
    callback=parse_autopilots,
    default="px4",
    show_default=True,
    metavar="NAME[,NAME...]",
    help=f"The firmware to play, one for all or one each: {', '.join(AUTOPILOTS)}.",
)
@click.option(
    "--speed",
    type=float,
    callback=parse_speed,
    default=1.0,
    show_default=True,
    help=f"How many times faster than real time, up to {FASTEST:g}.",
)
@click.option(
    "--port",
    type=click.IntRange(1024, 65535 - OWN_PORT_OFFSET - MOST_VEHICLES),
    default=DEFAULT_PORT,
    show_default=True,
    help="Vehicle i, from 0, sends to UDP port PORT+i of this machine, from PORT+40+i.",
)
@click.option("--shared", is_flag=True, help="All vehicles send to PORT.")
@click.option(
    "--ports",
    type=click.IntRange(1, MOST_VEHICLES),
    default=MOST_VEHICLES,
    metavar="N",
    help="At most N ports from PORT on: vehicles beyond share the last, as with PX4's 10.",
)
@click.option(
    "--from",
    "own_port",
    type=click.IntRange(0, 65535 - MOST_VEHICLES),
    metavar="PORT",
    help="Vehicle i sends from this PORT+i (PX4's link for ground stations: --shared --port 14550 --from 18570); "
    "0: from any free one, as ArduPilot.",
)
@click.option(
    "--tcp",
    type=click.IntRange(1024, 65535),
    metavar="P",
    help="Instead of UDP: vehicle i listens on TCP port P+10·i, and boots when a client comes.",
)
@click.option(
    "--pty", is_flag=True, help="Instead of UDP: each vehicle on a pseudo-terminal, whose path is printed."
)
@click.option(
    "--home",
    callback=parse_home,
    default=DEFAULT_HOME,
    show_default=True,
    metavar="LAT,LON,ALT",
    help="Where the first vehicle stands; the others stand 20 m apart to its east.",
)
@click.option(
    "--wind", callback=parse_wind, default="0,0", metavar="EAST,NORTH", help="A steady wind in m/s."
)
@click.option(
    "--seed",
    type=int,
    help="Scatter altitudes and local origins as they differ between real vehicles; throw the faults' dice.",
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="NAME@T",
    help="Let something fail T s after boot, as [ID:]NAME[=VALUE]@T[+SECONDS]; may be given again. "
    f"NAME: {', '.join(FAULTS)}.",
)
@click.option(
    "--signing-key",
    "key",
    callback=read_key,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Sign every frame, and drop and count what is not: 64 hex digits, base64 or 32 raw bytes.",
)
def main(
    vehicles: int,
    autopilots: list[str],
    speed: float,
    port: int,
    shared: bool,
    ports: int,
    own_port: int | None,
    tcp: int | None,
    pty: bool,
    home: tuple[float, float, float],
    wind: tuple[float, float],
    seed: int | None,
    faults: tuple[str, ...],
    key: bytes | None,
) -> None:
    """Play multicopters that speak MAVLink 2, until Ctrl-C."""
    if len(autopilots) not in (1, vehicles):
        raise click.UsageError(f"--autopilot names {len(autopilots)} firmwares for {vehicles} vehicles")
    own_port = port + OWN_PORT_OFFSET if own_port is None else own_port
    if shared + (tcp is not None) + pty > 1:
        raise click.UsageError("only one of --shared, --tcp and --pty can be used")
    if tcp is not None:
        check_tcp_ports(vehicles, tcp)
    elif not pty:
        check_udp_ports(vehicles, port, 1 if shared else ports, own_port)
    # Imported here and below, so that --help and mistakes are answered before the compiler is loaded.
    from . import links

    each = autopilots * vehicles if len(autopilots) == 1 else autopilots
    fleet = make_fleet(each, home, wind, seed, faults, key)
    opener, where, first = choose_links(port, own_port, shared, ports, tcp, pty)
    click.echo(
        f"{vehicles} {', '.join(dict.fromkeys(autopilots))} vehicle(s): {where}; Ctrl-C ends.", err=True
    )
    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(links.serve(fleet, opener, speed))
        tell_refused(fleet)
    except OSError as error:
        raise click.UsageError(f"cannot use the ports from {first} on: {error.strerror}") from None


def make_fleet(
    autopilots: list[str],
    home: tuple[float, float, float],
    wind: tuple[float, float],
    seed: int | None,
    faults: tuple[str, ...],
    key: bytes | None,
) -> "StubFleet":
    """The vehicles, and what is to go wrong with them; raises BadParameter for a fault that cannot be."""
    from .fleet import StubFleet

    pads = [(SPACING_M * index, 0.0) for index in range(len(autopilots))]
    fleet = StubFleet(
        len(autopilots), origin=home, pads_m=pads, autopilot=autopilots, wind_mps=wind, seed=seed,
        key=key, date_s=time.time(),
    )  # fmt: skip
    try:
        for fault in faults:
            fleet.order(parse_order(fault))
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--fault") from None
    return fleet


def choose_links(
    port: int, own_port: int, shared: bool, ports: int, tcp: int | None, pty: bool
) -> tuple["Opener", str, int]:
    """What opens the links, what to say of them, and the first port that they take."""
    from . import links

    if tcp is not None:
        return links.tcp(tcp, TCP_SPACING), f"tcp ports from {tcp} on", tcp
    if pty:
        return links.pty(say_terminal), "pseudo-terminals", 0
    own = f"udp port {own_port} on" if own_port else "any free udp port"
    where = f"from {own}, to {port}{'' if shared else ' on'}"
    return links.udp(port, own_port, shared, ports), where, own_port


def check_tcp_ports(vehicles: int, tcp: int) -> None:
    """Raise UsageError if there are not enough of them."""
    if tcp + TCP_SPACING * (vehicles - 1) > 65535:
        raise click.UsageError(f"--tcp {tcp} leaves no ports for {vehicles} vehicles")


def check_udp_ports(vehicles: int, port: int, ports: int, own_port: int) -> None:
    """Raise UsageError if a vehicle would send from a port that one sends to."""
    last = port + min(vehicles, ports) - 1
    if own_port and port < own_port + vehicles and own_port <= last:
        raise click.UsageError(
            f"--vehicles {vehicles} would send from UDP ports that others send to, from {own_port} on: "
            "use --shared, --ports, --from, --tcp or --pty"
        )


def tell_refused(fleet: "StubFleet") -> None:
    """What each vehicle dropped for its signature, of those that dropped anything."""
    for vehicle in fleet.vehicles:
        refused = vehicle.keyring.refused
        if any(refused.values()):
            counts = ", ".join(f"{count} {verdict.value}" for verdict, count in refused.items())
            click.echo(f"vehicle {vehicle.system} dropped {counts}", err=True)


def say_terminal(system: int, path: str) -> None:
    """Tell where a vehicle can be reached."""
    click.echo(f"vehicle {system}: {path}", err=True)


if __name__ == "__main__":
    main()
