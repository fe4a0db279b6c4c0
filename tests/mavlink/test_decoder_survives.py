"""What a link does to frames: cuts them, corrupts them, mixes in garbage, repeats and loses them."""

import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.mavlink.codec import Decoder, Encoder, Frame
from swarmctl.mavlink.dialect import mav


def frames_of(count: int, encoder: Encoder | None = None) -> list[bytes]:
    """Frames of mixed kinds, hot and not, one sequence."""
    encoder = encoder or Encoder(3, 1)
    makers = (
        lambda n: encoder.global_position_int(n, 473977000, 85456000, 488000, n, -n, n, 0, 65535),
        lambda n: encoder.heartbeat(2, 12, 209, n, 4),
        lambda n: encoder.encode(mav.MAVLink_statustext_message(6, f"line {n}".encode())),
    )
    return [makers[n % 3](n) for n in range(count)]


def raws(frames: list[Frame]) -> list[bytes]:
    return [frame.raw for frame in frames]


def test_every_cut_of_the_stream_gives_the_same_frames() -> None:
    sent = frames_of(30)
    stream = b"".join(sent)
    for step in (1, 2, 7, 19, 100, len(stream)):
        decoder = Decoder()
        got = [f for at in range(0, len(stream), step) for f in decoder.feed(stream[at : at + step])]
        assert raws(got) == sent
        assert (decoder.frames, decoder.bad, decoder.lost) == (30, 0, 0)


def test_a_truncated_datagram_does_not_cost_the_next_one() -> None:
    sent = frames_of(3)
    decoder = Decoder()
    assert decoder.feed(sent[0][:-5]) == []
    assert raws(decoder.feed(sent[1])) == [sent[1]]
    assert raws(decoder.feed(sent[2])) == [sent[2]]
    assert decoder.bad == 1


def test_a_truncated_frame_in_one_stream_does_not_cost_the_next_one() -> None:
    sent = frames_of(40)
    decoder = Decoder()
    got = decoder.feed(sent[0] + sent[1][:-7] + b"".join(sent[2:]))
    assert raws(got) == [sent[0], *sent[2:]]
    assert (decoder.bad, decoder.lost) == (1, 1)


@pytest.mark.parametrize("at", [1, 4, 5, 7, 12, -1])
def test_a_corrupt_byte_costs_that_frame_only(at: int) -> None:
    sent = frames_of(30)
    broken = bytearray(sent[4])
    broken[at] ^= 0x40
    decoder = Decoder()
    got = decoder.feed(b"".join(sent[:4]) + bytes(broken) + b"".join(sent[5:]))
    assert raws(got) == sent[:4] + sent[5:]
    assert (decoder.bad, decoder.lost) == (1, 1)


def test_a_bad_checksum_in_a_datagram_of_its_own_is_counted_and_forgotten() -> None:
    sent = frames_of(2)
    decoder = Decoder()
    assert decoder.feed(sent[0][:-1] + bytes([sent[0][-1] ^ 1])) == []
    assert raws(decoder.feed(sent[1])) == [sent[1]]
    assert decoder.bad == 1


@settings(max_examples=150, deadline=None)
@given(
    garbage=st.lists(st.binary(max_size=40), min_size=6, max_size=6),
    step=st.integers(1, 60),
)
def test_garbage_between_frames_never_costs_a_frame(garbage: list[bytes], step: int) -> None:
    sent = frames_of(6)
    stream = b"".join(part for pair in zip(garbage, sent, strict=True) for part in pair)
    # Enough frames behind it that any frame length claimed by garbage is fulfilled.
    tail = frames_of(20, Encoder(9, 1))
    stream += b"".join(tail)
    decoder = Decoder()
    got = [f for at in range(0, len(stream), step) for f in decoder.feed(stream[at : at + step])]
    assert [raw for raw in raws(got) if raw in sent] == sent


@settings(max_examples=100, deadline=None)
@given(st.lists(st.binary(max_size=400), max_size=5))
def test_garbage_alone_raises_nothing_and_is_not_kept_for_ever(chunks: list[bytes]) -> None:
    decoder = Decoder()
    for chunk in chunks:
        decoder.feed(chunk)
    assert len(decoder._pending) < 1200
    sent = frames_of(1)
    assert raws(decoder.feed(sent[0])) == sent


UNKNOWN = 65000


def unknown_frame(payload: bytes) -> bytes:
    """A MAVLink 2 frame of a message that the dialect does not have (CURRENT_MODE is one such)."""
    body = bytes([len(payload), 0, 0, 5, 3, 1]) + UNKNOWN.to_bytes(3, "little") + payload
    return b"\xfd" + body + b"\x12\x34"


def test_an_unknown_message_passes_with_its_number() -> None:
    sent = frames_of(1)[0]
    got = Decoder().feed(sent + unknown_frame(b"abc") + sent)
    assert [frame.message_id for frame in got] == [33, UNKNOWN, 33]
    assert got[1].raw == unknown_frame(b"abc")


def test_unknown_messages_pass_in_datagrams_of_their_own_and_byte_by_byte() -> None:
    sent = [*frames_of(2), unknown_frame(b"abc"), unknown_frame(b"d"), *frames_of(2, Encoder(9, 1))]
    decoder = Decoder()
    assert raws([f for raw in sent for f in decoder.feed(raw)]) == sent
    assert decoder.bad == 0
    assert raws([f for byte in b"".join(sent) for f in decoder.feed(bytes([byte]))]) == sent


def test_a_run_of_unknown_messages_is_not_kept_for_ever() -> None:
    decoder = Decoder()
    decoder.feed(frames_of(1)[0])
    got = [frame for _ in range(20) for frame in decoder.feed(unknown_frame(b"abc"))]
    assert len(got) > 15


def test_what_looks_like_a_long_unknown_message_does_not_swallow_frames() -> None:
    sent = frames_of(30)
    start = b"\xfd\xc8\x00\x00\x00\x03\x01\xe8\xfd\x00"
    assert raws(Decoder().feed(sent[0] + start + b"".join(sent[1:]))) == sent


def test_mavlink_1_and_signed_frames_are_read() -> None:
    link = mav.MAVLink(None, 4, 1)
    first = mav.MAVLink_heartbeat_message(2, 3, 0, 5, 3, 3).pack(link, force_mavlink1=True)
    link.seq = 1
    link.signing.secret_key, link.signing.sign_outgoing = bytes(32), True
    second = mav.MAVLink_heartbeat_message(2, 3, 0, 6, 3, 3).pack(link)
    decoder = Decoder()
    got = decoder.feed(first + second) + decoder.feed(second)
    assert [(f.system, f.sequence, f.fields.custom_mode) for f in got] == [(4, 0, 5), (4, 1, 6), (4, 1, 6)]
    assert raws(got) == [first, second, second]


def test_losses_are_counted_per_sender_and_repeats_and_late_frames_are_not() -> None:
    ours, other = frames_of(300, Encoder(3, 1)), frames_of(10, Encoder(4, 1))
    decoder = Decoder()
    for index, raw in enumerate(ours):
        if index % 10 != 7:
            decoder.feed(raw)
        if index < 10:
            decoder.feed(other[index])
    assert decoder.lost == 30
    decoder.feed(ours[-1])
    decoder.feed(ours[-3])
    assert decoder.lost == 30


def test_heavy_loss_and_corruption_together() -> None:
    rng = random.Random(5)
    sent = frames_of(600)
    decoder = Decoder()
    kept: list[Any] = []
    got: list[Frame] = []
    for raw in sent:
        fate = rng.random()
        if fate < 0.2:
            continue
        if fate < 0.4:
            got += decoder.feed(raw[: rng.randrange(1, len(raw))])
        else:
            kept.append(raw)
            got += decoder.feed(raw)
    assert raws(got) == kept
    assert decoder.frames == len(kept)
