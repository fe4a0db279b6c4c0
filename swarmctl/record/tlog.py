"""flight.tlog: every MAVLink frame of the flight, as ground stations record them.

A frame is stored as eight bytes of big-endian microseconds followed by its raw bytes; there is no header.
Stamps are flight time, from 0, so that the same flight gives the same file.  pymavlink takes the two lowest
bits of a stamp as the number of a link, so they are kept at 0: stamps are multiples of 4 µs.
"""

from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self

from .errors import RunFolderError

BLOCK_BYTES = 64 * 1024
LINK_BITS = 0b11


class TlogWriter:
    """Appends frames to a new .tlog file, in blocks.

    Raises :class:`RunFolderError`, here and in every method, where the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._buffer = bytearray()
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise RunFolderError.writing(path, error) from None

    def write(self, time_s: float, frames: Iterable[bytes]) -> None:
        """Add whole frames, all stamped with the flight time ``time_s`` (seconds, 0 or more)."""
        stamp = (round(time_s * 1e6) & ~LINK_BITS).to_bytes(8, "big")
        joined = stamp.join(frames)
        if joined:
            self._buffer += stamp
            self._buffer += joined
            if len(self._buffer) >= BLOCK_BYTES:
                self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system."""
        try:
            while self._buffer:
                del self._buffer[: self._file.write(self._buffer)]
        except OSError as error:
            raise RunFolderError.writing(self._path, error) from None

    def close(self) -> None:
        """Write what is left; the file is closed even if that fails."""
        try:
            if not self._file.closed:
                self.flush()
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
