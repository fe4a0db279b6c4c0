"""Memory is restored from a recording that is cut off anywhere: as it was after the last whole planner tick."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from swarmctl.record import mcap_read, rows
from swarmctl.record.errors import LogError
from swarmctl.record.mcap_log import McapLog
from swarmctl.record.mcap_read import Log
from swarmctl.record.replay import open_world, restore
from swarmctl.record.searched import searched

from .flown import fly
from .rewritten import rewrite, unchanged

VEHICLES, TARGETS = 3, 80
CUTS = 24
STEERED = ("errands", "setpoints", "sent")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 70 planner ticks, each message in a chunk of its own."""
    path = tmp_path_factory.mktemp("whole")
    flown = fly(path)
    fine = path / "fine.mcap"
    rewrite(flown.folder.mcap, fine, unchanged, chunk_bytes=1)
    return fine


@pytest.fixture(scope="module")
def cuts(whole: Path) -> list[Path]:
    """The recording cut off at places all over it."""
    data = whole.read_bytes()
    paths = []
    for k in range(1, CUTS):
        paths.append(whole.with_name(f"cut-{k}.mcap"))
        paths[-1].write_bytes(data[: len(data) * k // CUTS])
    return paths


def planned(log: Log) -> Iterator[tuple[int, bool]]:
    """The planner ticks on record, and whether the setpoint tick that they belong to is there too."""
    tick = -1
    for message in log.rows("/decisions", "/ticks"):
        if message.topic == "/decisions":
            tick = message.tick
        elif tick >= 0:
            yield tick, True
            tick = -1
    if tick >= 0:
        yield tick, False


def test_cut_off_anywhere_it_is_what_was_decided_last(whole: Path, cuts: list[Path]) -> None:
    decided = {m.tick: m.rows.tobytes() for m in mcap_read.read(whole).rows("/decisions")}
    half, counts = 0, []
    for cut in cuts:
        log = mcap_read.read(cut)
        assert log.truncated
        try:
            restored = restore(log)
        except LogError as error:
            assert "the recording ended before it began" in str(error)
            continue
        done = list(planned(log))
        half += bool(done) and not done[-1][1]
        assert restored.ticks == max((tick + 1 for tick, is_whole in done if is_whole), default=0)
        assert restored.exact
        if restored.ticks:
            assert rows.decisions(restored.world).tobytes() == decided[restored.ticks - 1]
        counts.append(restored.ticks)
    assert half and len(set(counts)) > CUTS // 3 and max(counts) > 60


def test_memory_is_to_the_bit_that_of_the_next_snapshot(whole: Path, tmp_path: Path) -> None:
    """Cut off just before a snapshot, ten planner ticks are done again from the one before."""
    log = mcap_read.read(whole)
    snapshots = {m.tick: m.rows.tobytes() for m in log.rows("/state")}
    for tick in (10, 30, 60):
        restored = restore(_until(log, tick, tmp_path / f"{tick}.mcap"))
        assert restored.ticks == tick and restored.exact
        expected = open_world(log)
        rows.load_state(expected, snapshots[tick])
        for world in (expected, restored.world):
            for name in STEERED:
                getattr(world, name)[...] = np.zeros((), getattr(world, name).dtype)
        assert rows.dump_state(restored.world) == rows.dump_state(expected)


def _until(log: Log, tick: int, path: Path) -> Log:
    """A recording that ends before the snapshot of planner tick ``tick``."""
    with McapLog(path) as copy:
        for name, values in log.metadata.items():
            copy.metadata(name, values)
        for message in log.rows():
            if message.topic == "/state" and message.tick == tick:
                break
            copy.write_rows(
                copy.channel(message.topic, message.rows.dtype), message.tick, message.time_s, message.rows
            )
    return mcap_read.read(path)


def test_whatever_is_on_record_is_found_and_no_tick_is_counted_twice(whole: Path, cuts: list[Path]) -> None:
    full = searched(mcap_read.read(whole), VEHICLES, TARGETS)
    for cut in cuts[5:]:
        log = mcap_read.read(cut)
        ticks = restore(log).ticks
        part = searched(log, VEHICLES, TARGETS, ticks)
        seen = part.first_seen >= 0
        assert (part.first_seen[seen] == full.first_seen[seen]).all()
        assert not (full.first_seen[~seen & (full.first_seen >= 0)] < ticks).any()
        again = searched(_beyond(mcap_read.read(whole), ticks, cut.with_suffix(".rest")), VEHICLES, TARGETS)
        assert part.in_range + again.in_range == full.in_range
        assert (part.alarms + again.alarms == full.alarms).all()


def _beyond(log: Log, tick: int, path: Path) -> Log:
    """The observations from planner tick ``tick`` on."""
    with McapLog(path) as copy:
        for message in log.rows("/observations"):
            if message.tick >= tick:
                channel = copy.channel(message.topic, message.rows.dtype)
                copy.write_rows(channel, message.tick, message.time_s, message.rows)
    return mcap_read.read(path)


def test_decisions_that_do_not_come_out_again_are_told(whole: Path, tmp_path: Path) -> None:
    def spoil(message: mcap_read.Rows) -> None:
        if message.topic == "/decisions" and message.tick == 68:
            message.rows["v_east"] += 1e-9

    rewrite(whole, tmp_path / "spoilt.mcap", spoil)
    assert not restore(mcap_read.read(tmp_path / "spoilt.mcap")).exact
