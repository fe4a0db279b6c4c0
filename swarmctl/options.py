"""Options that several commands share, and the types of their values."""

from pathlib import Path
from typing import Any

import click

from .core.planners import MODULES

FASTEST = 100.0
PathArgument = click.Path(path_type=Path)


class SpeedType(click.ParamType):  # type: ignore[type-arg]
    """``max``, which becomes None, or a factor."""

    name = "speed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | None:
        """Read it; anything else is a bad command line."""
        if value in (None, "max"):
            return None
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not 0.0 < factor <= FASTEST:
            self.fail(f"{value!r} is neither max nor a factor up to {FASTEST:g}", param, ctx)
        return factor


algorithm_option = click.option(
    "--algo", "algorithm", type=click.Choice(list(MODULES)), help="Planner, in place of the mission's."
)
mission_option = click.option(
    "--mission", "mission_file", type=PathArgument, help="Mission file (default: the packaged paper.yaml)."
)

connect_option = click.option(
    "--connect",
    "urls",
    multiple=True,
    metavar="URL",
    help="The vehicles there, e.g. udpin://0.0.0.0:14540-14545; may be given again.",
)
timeout_option = click.option(
    "--connect-timeout",
    type=click.FloatRange(0.1),
    default=20.0,
    show_default=True,
    help="Seconds to wait for them.",
)
backend_option = click.option(
    "--backend",
    type=click.Choice(["mavlink", "mavsdk"]),
    default="mavlink",
    show_default=True,
    help="Who speaks to the vehicles by --connect: swarmctl itself, or MAVSDK.",
)
signing_option = click.option(
    "--signing-key",
    type=PathArgument,
    metavar="FILE",
    help="Sign every MAVLink frame with the key in FILE, and take no other.",
)
