"""flight.mcap: what every vehicle saw, knew, decided and was told, tick by tick.

MCAP is a container of messages on named topics; each topic carries the schema of its messages, so a file
explains itself.  A topic of records holds one message a tick: the tick's number, its time and an array of
NumPy records, stored as they lie in memory, which is also how ROS 1 would write them (ros1.py).  Viewers such
as Foxglove open the file as it is; mcap_read.py reads it back.  Messages are collected into compressed
chunks; a chunk that was written survives a crash, so the flight calls :meth:`McapLog.flush` now and then.
"""

import json
import re
import struct
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray

from .errors import RunFolderError
from .ros1 import Dtype, rows_definition

HEADER = "uint64 tick\nfloat64 time_s\n"
HEAD = struct.Struct("<QdI")  # HEADER's fields, then the number of rows
BYTES = np.dtype(np.uint8)
TOPIC = re.compile(r"/?[A-Za-z][A-Za-z0-9_/]*", re.ASCII)
CHUNK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic that is open for writing: its number in the file and the type of its rows."""

    topic: str
    number: int
    dtype: Dtype


class McapLog:
    """Writes a new log; a chunk is closed at ``chunk_bytes`` (uncompressed) or by :meth:`flush`.

    The same calls give the same bytes: nothing in the file depends on the clock or the machine.
    Raises :class:`RunFolderError`, here and in every method, where the file cannot be written.
    """

    def __init__(self, path: Path, *, chunk_bytes: int = CHUNK_BYTES) -> None:
        self._path = path
        self._channels: dict[str, Channel] = {}
        self._json: dict[str, int] = {}
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise RunFolderError.writing(path, error) from None
        self._writer = Writer(self._file, chunk_size=chunk_bytes)
        self._writer.start(library="swarmctl")

    def channel(self, topic: str, dtype: Dtype) -> Channel:
        """Open ``topic`` for rows of ``dtype``: packed little-endian records, or plain numbers.

        Opening it again gives the same channel.  Raises ValueError for a type that ROS 1 cannot hold, for a
        name that is no topic, and for a topic that is open with another type.
        """
        known = self._channels.get(topic)
        if known is None:
            text = rows_definition(dtype, HEADER)
            known = Channel(topic, self._register(topic, "ros1", "ros1msg", text), dtype)
            self._channels[topic] = known
        if known.dtype != dtype:
            raise ValueError(f"{topic}: open with another type")
        return known

    def write_rows(self, channel: Channel, tick: int, time_s: float, rows: NDArray[Any]) -> None:
        """Add one message: any number of ``rows`` of the channel's dtype, at ``time_s`` (from 0)."""
        if rows.dtype != channel.dtype:
            raise ValueError(f"{channel.topic}: rows of {rows.dtype}, not {channel.dtype}")
        self._add(channel.number, tick, time_s, HEAD.pack(tick, time_s, rows.size) + rows.tobytes())

    def write_bytes(self, topic: str, tick: int, time_s: float, data: bytes) -> None:
        """Add one message of raw bytes, such as a snapshot of memory; it is read back as rows of uint8."""
        channel = self._channels.get(topic) or self.channel(topic, BYTES)
        self._add(channel.number, tick, time_s, HEAD.pack(tick, time_s, len(data)) + data)

    def write_json(self, topic: str, time_s: float, content: Mapping[str, object]) -> None:
        """Add one event as a JSON object.  Raises ValueError for NaN and infinity, which JSON lacks."""
        number = self._json.get(topic)
        if number is None:
            number = self._register(topic, "json", "jsonschema", '{"type": "object"}')
            self._json[topic] = number
        self._add(number, 0, time_s, json.dumps(content, allow_nan=False).encode())

    def attach(self, name: str, text: str) -> None:
        """Add a text file, such as mission.yaml."""
        try:
            self._writer.add_attachment(0, 0, name, "text/plain", text.encode())
        except OSError as error:
            raise RunFolderError.writing(self._path, error) from None

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a table of texts, such as the program's version."""
        try:
            self._writer.add_metadata(name, dict(values))
        except OSError as error:
            raise RunFolderError.writing(self._path, error) from None

    def flush(self) -> None:
        """Close the chunk in hand and give all to the operating system: a crash cannot take it back."""
        try:
            self._writer.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise RunFolderError.writing(self._path, error) from None

    def close(self) -> None:
        """Write what is left and the index; the file is closed even if that fails."""
        if self._file.closed:
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
        except OSError as error:
            raise RunFolderError.writing(self._path, error) from None
        finally:
            with suppress(OSError):
                self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _register(self, topic: str, encoding: str, schema_encoding: str, schema: str) -> int:
        """A new channel's number, after its schema, whose package is not that of the messages inside it."""
        if not TOPIC.fullmatch(topic):
            raise ValueError(f"{topic!r} is no topic: letters, digits, _ and /, a letter first")
        if topic in self._channels or topic in self._json:
            raise ValueError(f"{topic}: open with another type")
        words = re.findall("[A-Za-z0-9]+", topic)
        name = "swarmctl_log/" + "".join(word[0].upper() + word[1:] for word in words)
        schema_number = self._writer.register_schema(name, schema_encoding, schema.encode())
        return self._writer.register_channel(topic, encoding, schema_number)

    def _add(self, number: int, tick: int, time_s: float, data: bytes) -> None:
        stamp_ns = round(time_s * 1e9)
        try:
            self._writer.add_message(number, stamp_ns, data, stamp_ns, tick & 0xFFFFFFFF)
        except OSError as error:
            raise RunFolderError.writing(self._path, error) from None
