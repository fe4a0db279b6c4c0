"""The command `sim-vehicle-stub`: a fleet of stub vehicles on UDP ports of this machine."""

import asyncio
import contextlib

import click

DEFAULT_PORT, OWN_PORT_OFFSET = 14540, 40
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


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--vehicles",
    type=click.IntRange(1, OWN_PORT_OFFSET),
    default=1,
    show_default=True,
    help="How many; system ids count from 1.",
)
@click.option(
    "--autopilot", type=click.Choice(["px4"]), default="px4", show_default=True, help="The firmware to play."
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
    type=click.IntRange(1024, 65535 - 2 * OWN_PORT_OFFSET),
    default=DEFAULT_PORT,
    show_default=True,
    help="Vehicle i, from 0, sends to 127.0.0.1:PORT+i from PORT+40+i.",
)
@click.option(
    "--home",
    callback=parse_home,
    default=DEFAULT_HOME,
    show_default=True,
    metavar="LAT,LON,ALT",
    help="Where the first vehicle stands; the others stand 20 m apart to its east.",
)
def main(vehicles: int, autopilot: str, speed: float, port: int, home: tuple[float, float, float]) -> None:
    """Play multicopters that speak MAVLink 2, until Ctrl-C."""
    # Imported here, so that --help and mistakes are answered before the compiler is loaded.
    from .fleet import StubFleet
    from .links import serve

    pads = [(SPACING_M * index, 0.0) for index in range(vehicles)]
    fleet = StubFleet(vehicles, origin=home, pads_m=pads, autopilot=autopilot)
    own_port = port + OWN_PORT_OFFSET
    click.echo(
        f"{vehicles} {autopilot} vehicle(s): from udp port {own_port} on, to {port} on; Ctrl-C ends.",
        err=True,
    )
    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(serve(fleet, port, own_port, speed))
    except OSError as error:
        raise click.UsageError(f"cannot use the ports from {own_port} on: {error.strerror}") from None


if __name__ == "__main__":
    main()
