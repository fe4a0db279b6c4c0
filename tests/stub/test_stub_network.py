"""A vehicle's bad network by itself, where one direction stands for both, and a vehicle that flies on one."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from sim_vehicle_stub.network import Network
from swarmctl.mavlink.codec import Decoder, Encoder

Make = Callable[..., Any]
DATA = [bytes([k]) * 3 for k in range(200)]


def send(seed: str = "1", **wants: float | bool) -> list[bytes]:
    network = Network(seed)
    network.impair(**wants)
    got = [data for k, sent in enumerate(DATA) for data in network.down([sent], 0.1 * k)]
    return got + network.down([], 1000.0)


def test_nothing_asked_nothing_happens() -> None:
    assert send(loss=0.0) == DATA


def test_loss_is_by_the_dice_and_the_same_for_a_seed() -> None:
    got = send(loss=0.4)
    assert 90 <= len(got) <= 150
    assert got == [data for data in DATA if data in got]
    assert got == send(loss=0.4)
    assert got != send("2", loss=0.4)


def test_duplication_and_reordering() -> None:
    doubled = send(duplication=0.3)
    assert 240 <= len(doubled) <= 280
    assert set(doubled) == set(DATA)
    moved = send(reordering=0.3)
    assert sorted(moved) == DATA
    assert moved != DATA


def test_delay_holds_back_and_keeps_the_order() -> None:
    network = Network("1")
    network.impair(delay_s=2.0)
    assert network.up([b"a", b"b"], 0.0) == []
    assert network.up([b"c"], 1.9) == []
    assert network.up([], 2.0) == [b"a", b"b"]
    assert network.up([], 4.0) == [b"c"]


def test_garbage_and_single_bytes_leave_every_frame_readable() -> None:
    encoder, network, decoder = Encoder(1, 1), Network("1"), Decoder()
    network.impair(garbage=0.5, single_bytes=True)
    frames = [encoder.heartbeat(2, 12, 0, k, 4) for k in range(100)]
    pieces = [piece for frame in frames for piece in network.down([frame], 0.0)]
    assert {len(piece) for piece in pieces} == {1}
    got = [frame.fields.custom_mode for piece in pieces for frame in decoder.feed(piece)]
    assert got == list(range(100))
    assert decoder.bad > 10


@pytest.mark.parametrize(("cut", "up", "down"), [("up_cut", [], [b"x"]), ("down_cut", [b"x"], [])])
def test_one_way(cut: str, up: list[bytes], down: list[bytes]) -> None:
    network = Network("1")
    network.impair(**{cut: True})
    assert (network.up([b"x"], 0.0), network.down([b"x"], 0.0)) == (up, down)


def test_a_vehicle_flies_on_a_bad_one(station: Make) -> None:
    s = station()
    s.vehicle.network.impair(loss=0.3, duplication=0.1, reordering=0.2, delay_s=0.3)
    s.run(6.0)
    s.run_until(lambda: s.mode == 0x2040000, 30.0, lambda: s.command(22, *[math.nan] * 6, 498.0))
    s.run_until(lambda: s.vehicle.armed, 30.0, s.arm)
    s.run(20.0)
    assert s.body["up"] == pytest.approx(10.0, abs=0.2)
