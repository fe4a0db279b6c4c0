"""Connect URLs as INTERFACE has them."""

import pytest

from swarmctl.vehicle.addresses import Address, AddressError, parse


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("udpin://0.0.0.0:14540", [Address("udpin", "0.0.0.0", 14540)]),
        ("udp://:14540", [Address("udpin", "0.0.0.0", 14540)]),
        ("udpout://10.0.0.2:14550", [Address("udpout", "10.0.0.2", 14550)]),
        ("tcp://127.0.0.1:5760", [Address("tcp", "127.0.0.1", 5760)]),
        ("serial:///dev/ttyUSB0:57600", [Address("serial", "/dev/ttyUSB0", 57600)]),
        ("udpin://127.0.0.1:5-7", [Address("udpin", "127.0.0.1", port) for port in (5, 6, 7)]),
    ],
)
def test_reads(url: str, expected: list[Address]) -> None:
    assert parse(url) == expected


@pytest.mark.parametrize(
    "url",
    [
        "",
        "14540",
        "udpin://0.0.0.0",
        "http://a:1",
        "udpin://a:0",
        "udpin://a:70000",
        "udpin://a:9-8",
        "serial://ttyX:9",
    ],
)
def test_refuses_and_says_what_would_do(url: str) -> None:
    with pytest.raises(AddressError, match=r"ports must be|no connect URL") as caught:
        parse(url)
    assert repr(url) in str(caught.value)
