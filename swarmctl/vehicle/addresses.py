"""Connect URLs: where vehicles are spoken to.

udpin://HOST:PORT     wait there for vehicles, answer each at the address it sends from
udpin://HOST:A-B      the same on every port from A to B
udp://:PORT           short for udpin://0.0.0.0:PORT
udpout://HOST:PORT    speak first
tcp://HOST:PORT       connect to a server
serial:///dev/X:BAUD  a serial line
"""

import re
from dataclasses import dataclass

KINDS = ("udpin", "udpout", "tcp", "serial")
_URL = re.compile(r"(?P<kind>udp|udpin|udpout|tcp)://(?P<host>[^:/\s]*):(?P<first>\d+)(-(?P<last>\d+))?")
_SERIAL = re.compile(r"serial://(?P<device>/[^:\s]+):(?P<baud>\d+)")
MOST_PORTS = 1000


class AddressError(ValueError):
    """A connect URL that cannot be used; the message says why and what would do."""


@dataclass(frozen=True)
class Address:
    """One place to speak to vehicles: a host and port, or a device and its baud rate."""

    kind: str
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.kind}://{self.host}:{self.port}"


def parse(url: str) -> list[Address]:
    """The addresses a connect URL names, one or, for a range of ports, several.  Raises AddressError."""
    serial = _SERIAL.fullmatch(url)
    if serial:
        return [Address("serial", serial["device"], int(serial["baud"]))]
    match = _URL.fullmatch(url)
    if match is None:
        raise AddressError(
            f"{url!r} is no connect URL (udpin://0.0.0.0:14540, udpin://0.0.0.0:14540-14545, "
            "udpout://HOST:PORT, tcp://HOST:PORT, serial:///dev/ttyX:57600)"
        )
    kind = "udpin" if match["kind"] == "udp" else match["kind"]
    host = match["host"] or ("0.0.0.0" if kind == "udpin" else "127.0.0.1")
    first, last = int(match["first"]), int(match["last"] or match["first"])
    if not 1 <= first <= last <= 65535 or last - first >= MOST_PORTS:
        raise AddressError(
            f"{url!r}: ports must be 1 to 65535, a range ascending and at most {MOST_PORTS} long"
        )
    return [Address(kind, host, port) for port in range(first, last + 1)]
