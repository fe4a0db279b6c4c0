"""Reads flight.mcap back, also one that a crash, a full disk or a bad copy has spoilt.

A file is scanned once: every chunk is unpacked and its checksum tried, and what lies behind the first damage
is left alone, so that whatever is read is what was written.  Messages are then given out in file order, chunk
by chunk, each array with the type that the file's own schema describes.
"""

import json
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from .errors import LogError
from .mcap_log import HEAD, HEADER
from .ros1 import Dtype, rows_dtype

RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time and publishing time in ns
READ_HERE = (Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA)
DAMAGE = (McapError, struct.error, ValueError, TypeError, OverflowError, MemoryError, zstandard.ZstdError)


class Rows(NamedTuple):
    """One message of records: ``rows`` is a writable array of its own, of one dimension."""

    topic: str
    tick: int
    time_s: float
    rows: NDArray[Any]


class Event(NamedTuple):
    """One JSON message."""

    topic: str
    time_s: float
    content: dict[str, Any]


@dataclass
class Log:
    """A log that was scanned: iterating gives every :class:`Rows`, and opens the file anew each time.

    ``truncated``: the file ends early or is damaged; what is given out is all that lies before the damage.
    """

    path: Path
    truncated: bool = False
    attachments: dict[str, str] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    _chunks: list[tuple[int, int]] = field(default_factory=list)
    _schemas: dict[int, Schema] = field(default_factory=dict)
    _rows: dict[int, tuple[str, Dtype]] = field(default_factory=dict)
    _events: dict[int, str] = field(default_factory=dict)

    @property
    def topics(self) -> dict[str, Dtype]:
        """The topics of records, with the type of a row."""
        return dict(self._rows.values())

    def __iter__(self) -> Iterator[Rows]:
        return self.rows()

    def rows(self, *topics: str) -> Iterator[Rows]:
        """Messages of the given topics (all if none is given), in the order they were written."""
        wanted = {
            number: channel for number, channel in self._rows.items() if not topics or channel[0] in topics
        }
        for number, _, payload in self._messages():
            if number in wanted:
                yield self._unpacked(*wanted[number], payload)

    def events(self) -> Iterator[Event]:
        """Every JSON message, in the order they were written."""
        for number, stamp_ns, payload in self._messages():
            if number in self._events:
                yield Event(self._events[number], stamp_ns / 1e9, self._parsed(payload))

    def _messages(self) -> Iterator[tuple[int, int, memoryview]]:
        """Channel number, log time and data of each message."""
        with self.path.open("rb") as file:
            for start, length in self._chunks:
                file.seek(start)
                for opcode, payload in _records(_unpacked_chunk(file.read(length))):
                    if opcode == Opcode.MESSAGE:
                        number, _, stamp_ns, _ = MESSAGE_HEAD.unpack_from(payload)
                        yield number, stamp_ns, payload[MESSAGE_HEAD.size :]

    def _parsed(self, payload: memoryview) -> dict[str, Any]:
        """The object of a JSON message."""
        try:
            content = json.loads(bytes(payload))
        except ValueError:
            content = None
        if not isinstance(content, dict):
            raise LogError(f"{self.path}: an event is not a JSON object; did swarmctl record this file?")
        return content

    def _unpacked(self, topic: str, dtype: Dtype, data: memoryview) -> Rows:
        """The tick, the time and the rows of one message."""
        if len(data) >= HEAD.size:
            tick, time_s, count = HEAD.unpack_from(data)
            body = data[HEAD.size :]
            if len(body) == count * dtype.itemsize:
                return Rows(topic, tick, time_s, np.frombuffer(bytearray(body), dtype))
        raise LogError(
            f"{self.path}: {topic}: a message does not fit its schema; did swarmctl record this file?"
        )


def read(path: Path) -> Log:
    """Scan a log.  Raises :class:`LogError` if it cannot be opened or is no MCAP file at all."""
    log = Log(path)
    try:
        with path.open("rb") as file:
            if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise LogError(f"{path}: not an MCAP file (it does not begin as one)")
            log.truncated = not _scan(file, log)
    except OSError as error:
        raise LogError(f"{path}: cannot read: {error.strerror or error}") from None
    return log


def _scan(file: BinaryIO, log: Log) -> bool:
    """Note where the chunks are and what they define; whether the file is whole."""
    size = os.fstat(file.fileno()).st_size
    while len(head := file.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
        opcode, length = RECORD_HEAD.unpack(head)
        start = file.tell()
        if start + length > size:
            return False
        if opcode == Opcode.FOOTER:
            file.seek(start + length)
            return file.read() == MCAP0_MAGIC
        if opcode in READ_HERE:
            try:
                _note(opcode, file.read(length), start, log)
            except DAMAGE:
                return False
        file.seek(start + length)
    return False


def _note(opcode: int, payload: bytes, start: int, log: Log) -> None:
    """Take in one record of the file."""
    stream = ReadDataStream(BytesIO(payload))
    if opcode == Opcode.METADATA:
        table = Metadata.read(stream)
        log.metadata[table.name] = table.metadata
    elif opcode == Opcode.ATTACHMENT:
        attachment = Attachment.read(stream)
        log.attachments[attachment.name] = attachment.data.decode()
    else:
        for inner, content in list(_records(_unpacked_chunk(payload))):
            if inner == Opcode.SCHEMA:
                schema = Schema.read(ReadDataStream(BytesIO(content)))
                log._schemas[schema.id] = schema
            elif inner == Opcode.CHANNEL:
                _note_channel(Channel.read(ReadDataStream(BytesIO(content))), log)
        log._chunks.append((start, len(payload)))


def _note_channel(channel: Channel, log: Log) -> None:
    """Channels of other programs are passed over."""
    if channel.message_encoding == "json":
        log._events[channel.id] = channel.topic
    elif channel.message_encoding == "ros1":
        definition = log._schemas[channel.schema_id].data.decode()
        if definition.startswith(HEADER):
            log._rows[channel.id] = (channel.topic, rows_dtype(definition, HEADER))


def _unpacked_chunk(payload: bytes) -> memoryview:
    """A chunk's records.  Raises one of DAMAGE where its checksum or its compression is wrong."""
    chunk = Chunk.read(ReadDataStream(BytesIO(payload)))
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    return memoryview(stream.read(length))


def _records(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """The records of an unpacked chunk.  Raises ValueError where one runs over the end."""
    at = 0
    while at < len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size
        if at + length > len(data):
            raise ValueError("a record runs over the end of its chunk")
        yield opcode, data[at : at + length]
        at += length
