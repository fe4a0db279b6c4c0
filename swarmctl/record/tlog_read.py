"""Reading flight.tlog back: frames with their flight times."""

from collections.abc import Iterator
from pathlib import Path

from swarmctl.mavlink.codec import Decoder, Frame

from .errors import LogError

STAMP_BYTES = 8
HEADER_BYTES, CHECKSUM_BYTES, SIGNATURE_BYTES = 10, 2, 13
MAGIC, SIGNED = 0xFD, 1


def read_frames(path: Path) -> Iterator[tuple[float, Frame]]:
    """Every MAVLink 2 frame with its time in seconds; a cut-off last frame is left out.

    Raises LogError if the file cannot be read or holds something else.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise LogError(f"{path}: cannot read: {error.strerror or error}") from None
    decoder, at = Decoder(), 0
    while at + STAMP_BYTES + HEADER_BYTES <= len(data):
        start = at + STAMP_BYTES
        if data[start] != MAGIC:
            raise LogError(f"{path}: no MAVLink 2 frame at byte {start}; did swarmctl record this file?")
        signature = SIGNATURE_BYTES if data[start + 2] & SIGNED else 0
        end = start + HEADER_BYTES + data[start + 1] + CHECKSUM_BYTES + signature
        if end > len(data):
            return
        time_s = int.from_bytes(data[at:start], "big") / 1e6
        for frame in decoder.feed(data[start:end]):
            yield time_s, frame
        at = end
