"""What packing and unpacking one frequent message costs, beside pymavlink: ``python benchmarks/codec.py``."""

from collections.abc import Callable
from timeit import repeat
from typing import Any

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav

CALLS = 20_000
POSITION = (123_456, 473_977_000, 85_456_000, 588_000, 100_000, 1234, -567, 3, 9000)
SETPOINT = (123_456, 1, 1, 1, 3555, 0.0, 0.0, -100.0, 12.0, -3.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def microseconds(function: Callable[[], Any]) -> float:
    """Best of five, per call."""
    return min(repeat(function, number=CALLS, repeat=5)) / CALLS * 1e6


def pymavlink_pack(message: type[Any], arguments: tuple[float, ...]) -> Callable[[], Any]:
    """A closure that builds and packs one message with pymavlink alone."""
    link = mav.MAVLink(None, 1, 1)
    return lambda: message(*arguments).pack(link)


def main() -> None:
    """Print one line a message and direction."""
    encoder, decoder, parser = Encoder(1, 1), Decoder(), mav.MAVLink(None)
    for name, arguments in (("global_position_int", POSITION), ("set_position_target_local_ned", SETPOINT)):
        build = getattr(encoder, name)
        frame = build(*arguments)
        reference = pymavlink_pack(getattr(mav, f"MAVLink_{name}_message"), arguments)
        print(
            f"{name:30}"
            f" encode {microseconds(lambda build=build, a=arguments: build(*a)):5.2f} µs"
            f" (pymavlink {microseconds(reference):5.2f})"
            f"   decode {microseconds(lambda frame=frame: decoder.feed(frame)):5.2f} µs"
            f" (pymavlink {microseconds(lambda frame=frame: parser.decode(bytearray(frame))):5.2f})"
        )


if __name__ == "__main__":
    main()
