"""``swarmctl sign``: give vehicles a signing key over the link."""

import asyncio
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .console import REFUSED, plain_errors, say
from .options import PathArgument, connect_option, timeout_option

if TYPE_CHECKING:
    from .vehicle.addresses import Address


@click.command()
@connect_option
@timeout_option
@click.option("--signing-key", "path", type=PathArgument, metavar="FILE", required=True, help="The key.")
@click.option("--remove", is_flag=True, help="Have them sign no more, and take any frame.")
@click.option("--yes", is_flag=True, help="Do not ask.")
def sign(urls: tuple[str, ...], connect_timeout: float, path: Path, remove: bool, yes: bool) -> None:
    """Give every vehicle heard the signing key in FILE, disarmed and over a line that nobody listens to.

    The key crosses the link as it is: use USB, or a cable.  ArduPilot takes it; PX4 v1.17 cannot sign.
    """
    if not urls:
        raise click.UsageError("--connect says where the vehicles are")
    with plain_errors():
        from .vehicle.addresses import parse
        from .vehicle.keys import read_key

        addresses = [address for url in urls for address in parse(url)]
        key = read_key(path)
        done = asyncio.run(_sign(addresses, connect_timeout, key, remove, yes))
        sys.exit(0 if done else REFUSED)


async def _sign(addresses: list["Address"], timeout_s: float, key: bytes, remove: bool, yes: bool) -> bool:
    from .flight import clock
    from .flight.sign import KeyGiver
    from .vehicle.keys import signing_with

    with closing(KeyGiver(signing_with(key, clock.utc_s))) as giver:
        systems = await giver.find(addresses, timeout_s)
        what = "stop signing" if remove else "take this key, which crosses the link as it is"
        named = ", ".join(map(str, systems))
        say(f"vehicles {named} are to {what}" + ("" if yes else ". Type yes to go on:"))
        if not yes and (await asyncio.to_thread(sys.stdin.readline)).strip().lower() != "yes":
            say("not confirmed: nothing was changed")
            return False
        done = await giver.give(None if remove else key)
    for system, obeyed in done.items():
        said = ("it signs no more" if remove else "it signs with this key") if obeyed else "it does not do so"
        click.echo(f"vehicle {system}: {said}")
    return all(done.values())
