"""flight.mcap: what is written is read back, by us and by a real ROS 1 decoder, whole or cut off anywhere."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros1.decoder import DecoderFactory

from swarmctl.core.state import POSE
from swarmctl.record.errors import LogError, RunFolderError
from swarmctl.record.mcap_log import McapLog
from swarmctl.record.mcap_read import Log, read
from swarmctl.record.ros1 import Dtype

from .record_types import RECORD_TYPES, filled

SHARED_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def poses(tick: int) -> np.ndarray[Any, Any]:
    return filled(POSE, 3, seed=tick)


def write_flight(path: Path, ticks: int, *, flush_every: int = 10) -> None:
    with McapLog(path) as log:
        log.attach("mission.yaml", "name: tiny\n")
        log.metadata("run", {"algorithm": "fco", "seed": "7"})
        channel = log.channel("/poses", POSE)
        for tick in range(ticks):
            log.write_rows(channel, tick, tick * 0.1, poses(tick))
            if tick % flush_every == flush_every - 1:
                log.write_json("/events", tick * 0.1, {"kind": "flushed", "tick": tick})
                log.write_bytes("/snapshots", tick, tick * 0.1, bytes([tick % 256]) * 5)
                log.flush()


@SHARED_FOLDER
@given(RECORD_TYPES, st.integers(0, 4), st.integers(0, 2**64 - 1), st.floats(0, 1e9))
def test_rows_of_any_type_come_back_bit_for_bit(
    tmp_path: Path, dtype: Dtype, count: int, tick: int, time_s: float
) -> None:
    path = tmp_path / "flight.mcap"
    rows = filled(dtype, count, seed=1)
    with McapLog(path) as log:
        log.write_rows(log.channel("/any/thing", dtype), tick, time_s, rows)
    back = read(path)
    assert not back.truncated
    assert back.topics == {"/any/thing": dtype}
    (message,) = back
    assert (message.topic, message.tick, message.time_s) == ("/any/thing", tick, time_s)
    assert message.rows.dtype == dtype
    assert message.rows.shape == (count,)
    assert message.rows.tobytes() == rows.tobytes()
    assert message.rows.flags.writeable


def plain(value: Any) -> Any:
    """A decoded ROS message, or a NumPy value, as nested lists of numbers in field order."""
    if hasattr(value, "__slots__") and not isinstance(value, np.generic):
        return [plain(getattr(value, name)) for name in value.__slots__]
    if isinstance(value, np.void):
        return [plain(value[name]) for name in value.dtype.names or ()]
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value.ravel()]
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


@settings(SHARED_FOLDER, max_examples=30)
@given(RECORD_TYPES, st.integers(0, 3))
def test_a_ros_1_decoder_reads_the_same_numbers(tmp_path: Path, dtype: Dtype, count: int) -> None:
    path = tmp_path / "flight.mcap"
    rows = filled(dtype, count, seed=2)
    with McapLog(path) as log:
        log.write_rows(log.channel("/row", dtype), 3, 0.3, rows)
    with path.open("rb") as file:
        (message,) = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
    assert message.message.log_time == 300_000_000
    assert (message.decoded_message.tick, message.decoded_message.time_s) == (3, 0.3)
    np.testing.assert_equal(plain(message.decoded_message.rows), plain(rows))


def test_events_snapshots_attachments_and_metadata_come_back(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    write_flight(path, 20)
    log = read(path)
    assert [(event.topic, event.content) for event in log.events()] == [
        ("/events", {"kind": "flushed", "tick": 9}),
        ("/events", {"kind": "flushed", "tick": 19}),
    ]
    assert [(row.tick, row.rows.tobytes()) for row in log.rows("/snapshots")] == [
        (9, b"\x09" * 5),
        (19, b"\x13" * 5),
    ]
    assert log.attachments == {"mission.yaml": "name: tiny\n"}
    assert log.metadata == {"run": {"algorithm": "fco", "seed": "7"}}
    order = [(message.topic, message.tick) for message in log]
    assert order[8:12] == [("/poses", 8), ("/poses", 9), ("/snapshots", 9), ("/poses", 10)]


def test_the_same_flight_gives_the_same_file(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_flight(tmp_path / name, 20)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def chunk_ends(data: bytes) -> Iterator[int]:
    """Where each whole chunk of a file ends."""
    at = 8
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        at += 9 + length
        if opcode == 0x06:
            yield at


def test_cut_anywhere_all_whole_chunks_are_read(tmp_path: Path) -> None:
    path, cut_path = tmp_path / "flight.mcap", tmp_path / "cut.mcap"
    write_flight(path, 30)
    data = path.read_bytes()
    ends = list(chunk_ends(data))
    assert len(ends) == 3
    for cut in range(8, len(data)):
        cut_path.write_bytes(data[:cut])
        log = read(cut_path)
        assert log.truncated
        whole = sum(end <= cut for end in ends)
        got = list(log.rows("/poses"))
        assert [message.tick for message in got] == list(range(10 * whole)), cut
        assert all(message.rows.tobytes() == poses(message.tick).tobytes() for message in got[-1:])
    cut_path.write_bytes(data)
    assert not read(cut_path).truncated


def test_what_was_flushed_is_in_the_file_before_it_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    log = McapLog(path)
    channel = log.channel("/poses", POSE)
    log.write_rows(channel, 1, 0.1, poses(1))
    log.flush()
    log.write_rows(channel, 2, 0.2, poses(2))
    crashed = read(path)
    assert crashed.truncated
    assert [message.tick for message in crashed] == [1]
    log.close()
    log.close()
    assert [message.tick for message in read(path)] == [1, 2]


def test_a_small_chunk_size_closes_chunks_by_itself(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapLog(path, chunk_bytes=1000) as log:
        channel = log.channel("/poses", POSE)
        for tick in range(50):
            log.write_rows(channel, tick, tick * 0.1, poses(tick))
    assert len(list(chunk_ends(path.read_bytes()))) > 5


def test_reading_never_fails_and_never_invents_when_bytes_flip(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    write_flight(path, 30)
    data = path.read_bytes()
    random = np.random.default_rng(5)
    first_chunk = next(chunk_ends(data))
    noticed = 0
    for _ in range(300):
        at = int(random.integers(8, first_chunk))
        broken = bytearray(data)
        broken[at] ^= 1 << int(random.integers(8))
        path.write_bytes(broken)
        log = read(path)
        ticks = [message.tick for message in log.rows("/poses")]
        assert all(message.rows.tobytes() == poses(message.tick).tobytes() for message in log.rows("/poses"))
        assert ticks == list(range(len(ticks)))
        noticed += log.truncated
    assert noticed > 150


@pytest.mark.parametrize("data", [b"", b"no log at all", b"\x89MCAP0\r"])
def test_a_file_that_is_no_log_is_told(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "flight.mcap"
    path.write_bytes(data)
    with pytest.raises(LogError, match=r"flight\.mcap: not an MCAP file"):
        read(path)


def test_a_missing_log_is_told(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"absent\.mcap: cannot read: No such file"):
        read(tmp_path / "absent.mcap")
    with pytest.raises(LogError, match="Is a directory"):
        read(tmp_path)


def foreign(path: Path, encoding: str, schema: str, data: bytes) -> Log:
    """A whole MCAP file by another program, with one message on /topic."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema_number = writer.register_schema("x/X", "ros1msg", schema.encode())
        writer.add_message(writer.register_channel("/topic", encoding, schema_number), 0, data, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    return read(path)


def test_topics_of_other_programs_are_passed_over(tmp_path: Path) -> None:
    for encoding, schema in (("cdr", "float64 x"), ("ros1", "float64 x")):
        log = foreign(tmp_path / "x.mcap", encoding, schema, b"12345678")
        assert (list(log), list(log.events()), log.topics, log.truncated) == ([], [], {}, False)


@pytest.mark.parametrize("data", [b"", bytes(19), bytes(16) + b"\x02\0\0\0" + bytes(8)])
def test_a_message_that_does_not_fit_its_schema_is_told(tmp_path: Path, data: bytes) -> None:
    log = foreign(tmp_path / "x.mcap", "ros1", "uint64 tick\nfloat64 time_s\nfloat64[] rows\n", data)
    with pytest.raises(LogError, match="/topic: a message does not fit its schema"):
        list(log)


@pytest.mark.parametrize("data", [b"", b"{", b"[1]", b"\xff"])
def test_an_event_that_is_no_object_is_told(tmp_path: Path, data: bytes) -> None:
    log = foreign(tmp_path / "x.mcap", "json", "{}", data)
    with pytest.raises(LogError, match="not a JSON object"):
        list(log.events())


def test_wrong_use_is_refused(tmp_path: Path) -> None:
    with McapLog(tmp_path / "flight.mcap") as log:
        channel = log.channel("/poses", POSE)
        assert log.channel("/poses", POSE) is channel
        with pytest.raises(ValueError, match="/poses: open with another type"):
            log.channel("/poses", np.dtype("<f8"))
        with pytest.raises(ValueError, match="/poses: rows of float64"):
            log.write_rows(channel, 0, 0.0, np.zeros(3))
        with pytest.raises(ValueError, match="no topic"):
            log.channel("/1 x", POSE)
        with pytest.raises(ValueError, match="open with another type"):
            log.write_json("/poses", 0.0, {})
        with pytest.raises(ValueError, match="JSON"):
            log.write_json("/events", 0.0, {"x": float("nan")})


def test_a_full_disk_is_told_and_the_file_closed() -> None:
    log = McapLog(Path("/dev/full"))
    channel = log.channel("/poses", POSE)
    log.write_rows(channel, 0, 0.0, poses(0))
    with pytest.raises(RunFolderError, match="/dev/full: cannot write: No space left"):
        log.flush()
    with pytest.raises(RunFolderError, match="No space left"):
        log.close()
    log.close()


def test_a_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match=r"flight\.mcap: cannot write: No such file"):
        McapLog(tmp_path / "absent" / "flight.mcap")
