"""flight.tlog is read back whole by pymavlink's own log reader, from stamps that begin at 0."""

import struct
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mav

from swarmctl.record.errors import RunFolderError
from swarmctl.record.tlog import BLOCK_BYTES, TlogWriter


def frames_at(tick: int, sender: mav.MAVLink) -> list[bytes]:
    """What two vehicles might say in one tick: a frequent message and a rare one."""
    position = mav.MAVLink_global_position_int_message(
        100 * tick, 473977000 + tick, 85456000, 0, 0, 0, 0, 0, 0
    )
    heartbeat = mav.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3)
    packed = []
    for message in (position, heartbeat):
        packed.append(bytes(message.pack(sender)))
        sender.seq = (sender.seq + 1) % 256
    return packed


def test_pymavlink_reads_every_frame_with_its_time(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    sender = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    written: list[tuple[float, bytes]] = []
    with TlogWriter(path) as log:
        for tick in range(3000):
            frames = frames_at(tick, sender)
            log.write(tick * 0.1, iter(frames))
            written += [(tick * 0.1, frame) for frame in frames]
    assert path.stat().st_size == sum(8 + len(frame) for _, frame in written) > 2 * BLOCK_BYTES
    reader = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    read = []
    while (message := reader.recv_msg()) is not None:
        read.append((message._timestamp, bytes(message.get_msgbuf())))
        assert message._link == 0
    reader.close()
    assert [frame for _, frame in read] == [frame for _, frame in written]
    assert [time_s for time_s, _ in read] == pytest.approx([time_s for time_s, _ in written], abs=4e-6)


def test_stamps_are_microseconds_big_endian_and_name_link_0(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    with TlogWriter(path) as log:
        log.write(1.000007, [b"ab", b"c"])
    stamp = struct.pack(">Q", 1_000_004)
    assert path.read_bytes() == stamp + b"ab" + stamp + b"c"


def test_a_tick_without_frames_writes_nothing(tmp_path: Path) -> None:
    with TlogWriter(tmp_path / "flight.tlog") as log:
        log.write(0.5, [])
    assert (tmp_path / "flight.tlog").read_bytes() == b""


def test_flush_hands_over_what_was_written_so_far(tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    log = TlogWriter(path)
    log.write(0.0, [b"frame"])
    log.flush()
    assert path.read_bytes().endswith(b"frame")
    log.close()
    log.close()


def test_a_full_disk_is_told_and_the_file_closed() -> None:
    log = TlogWriter(Path("/dev/full"))
    log.write(0.0, [b"frame"])
    with pytest.raises(RunFolderError, match="/dev/full: cannot write: No space left"):
        log.close()
    assert log._file.closed


def test_a_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match=r"flight\.tlog: cannot write: No such file"):
        TlogWriter(tmp_path / "absent" / "flight.tlog")
