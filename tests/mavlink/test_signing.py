"""Signatures: the same bytes as pymavlink's, and which frames are believed."""

import base64
import random
from typing import Any

import pytest

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import (
    KEEP_EVERY,
    STALE,
    SignedDecoder,
    Signing,
    Verdict,
    Verifier,
    parse_key,
    units,
)

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
NOON = units(1_764_072_000.0)


def signing(key: bytes = KEY, time: int = NOON, **others: Any) -> Signing:
    return Signing(key, lambda: time, **others)


def pymavlink(key: bytes, time: int, link: int) -> Any:
    """pymavlink's own end of a signed link."""
    end = mav.MAVLink(None, 7, 1)
    end.signing.secret_key, end.signing.timestamp = key, time
    end.signing.link_id, end.signing.sign_outgoing = link, True
    return end


def samples() -> list[Any]:
    return [
        mav.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3),
        mav.MAVLink_global_position_int_message(1, 2, 3, 4, 5, 6, 7, 8, 9),
        mav.MAVLink_statustext_message(6, b"a text", 0, 0),
        mav.MAVLink_command_long_message(1, 1, 400, 0, 1.0, 0, 0, 0, 0, 0, 0),
    ]


def frame(sequence: int = 0, system: int = 7) -> bytes:
    encoder = Encoder(system, 1)
    encoder.sequence = sequence
    return encoder.heartbeat(2, 12, 0, 0, 4)


def test_frames_are_signed_as_pymavlink_signs_them() -> None:
    theirs, ours, encoder = pymavlink(KEY, NOON, 3), signing(), Encoder(7, 1)
    for k, message in enumerate(samples()):
        theirs.seq = k
        assert ours.sign(encoder.encode(message), 3) == message.pack(theirs)


def test_what_pymavlink_signs_is_believed_and_the_other_way_round() -> None:
    theirs, decoder = pymavlink(KEY, NOON, 3), SignedDecoder(Verifier(signing()))
    assert [len(decoder.feed(message.pack(theirs))) for message in samples()] == [1] * 4
    ours, checker = signing(), pymavlink(KEY, NOON, 0)
    for message in samples():
        assert checker.decode(bytearray(ours.sign(Encoder(1, 1).encode(message), 9))).get_signed()


def test_unsigned_wrongly_signed_and_repeated_frames_are_dropped_and_counted() -> None:
    sender, wrong = signing(), signing(OTHER)
    verifier = Verifier(signing())
    decoder = SignedDecoder(verifier)
    first, second = sender.sign(frame(0), 1), sender.sign(frame(1), 1)
    got = [decoder.feed(data) for data in (first, frame(1), wrong.sign(frame(2), 1), first, second, first)]
    assert [[f.sequence for f in frames] for frames in got] == [[0], [], [], [], [1], []]
    assert verifier.counts == {Verdict.GOOD: 2, Verdict.UNSIGNED: 1, Verdict.WRONG: 1, Verdict.REPLAYED: 2}
    assert (decoder.frames, decoder.lost) == (2, 0), "what is dropped counts for nothing else"


@pytest.mark.parametrize("at", range(10, 34))
def test_no_bit_of_a_signed_frame_can_be_changed(at: int) -> None:
    signed = bytearray(signing().sign(frame(), 1))
    assert len(signed) == 21 + 13
    signed[at] ^= 1 << at % 8
    assert SignedDecoder(Verifier(signing())).feed(bytes(signed)) == []


def test_signed_frames_are_found_in_a_stream_that_is_cut_anyhow() -> None:
    sender, dice = signing(), random.Random(4)
    stream = b"".join(
        piece for k in range(60) for piece in (sender.sign(frame(k), 1), dice.randbytes(dice.randint(0, 9)))
    )
    decoder = SignedDecoder(Verifier(signing()))
    got, start = [], 0
    while start < len(stream):
        size = dice.randint(1, 50)
        got += decoder.feed(stream[start : start + size])
        start += size
    assert [f.sequence for f in got] == list(range(60))


def test_a_forged_time_does_not_shut_the_real_sender_out() -> None:
    verifier = Verifier(signing())
    forged = bytearray(signing().sign(frame(), 1))
    forged[-12:-6] = (NOON + 10**9).to_bytes(6, "little")
    assert verifier.judge(bytes(forged)) is Verdict.WRONG
    assert verifier.judge(signing().sign(frame(), 1)) is Verdict.GOOD


def test_a_stream_heard_first_may_be_a_minute_behind_and_no_more() -> None:
    late, too_late = signing(time=NOON - STALE), signing(time=NOON - STALE - 1)
    verifier = Verifier(signing())
    assert verifier.judge(too_late.sign(frame(), 1)) is Verdict.REPLAYED
    assert verifier.judge(late.sign(frame(), 2)) is Verdict.GOOD


def test_streams_are_told_apart_by_system_component_and_link() -> None:
    verifier = Verifier(signing())
    frames = [frame(), frame(system=8), Encoder(7, 2).heartbeat(2, 12, 0, 0, 4)]
    same_time = [signing().sign(one, link) for one in frames for link in (1, 2)]
    assert [verifier.judge(one) for one in same_time] == [Verdict.GOOD] * 6
    assert [verifier.judge(one) for one in same_time] == [Verdict.REPLAYED] * 6


def test_times_rise_whatever_the_clock_does() -> None:
    clock = [NOON]
    sender = Signing(KEY, lambda: clock[0])
    times = []
    for now in (NOON, NOON, NOON + 500, NOON - 10**7, 0):
        clock[0] = now
        times.append(int.from_bytes(sender.sign(frame(), 1)[-12:-6], "little"))
    assert times == [NOON, NOON + 1, NOON + 500, NOON + 501, NOON + 502]


def test_times_rise_beyond_what_was_believed() -> None:
    """A vehicle whose clock is ahead of ours hears nothing that is older than its own time when it is new."""
    ours = signing()
    Verifier(ours).judge(signing(time=NOON + 10**8).sign(frame(), 1))
    assert int.from_bytes(ours.sign(frame(), 1)[-12:-6], "little") == NOON + 10**8 + 1


def test_a_program_that_starts_again_goes_on_from_what_was_kept() -> None:
    kept: list[int] = []
    clock = [NOON]
    before = Signing(KEY, lambda: clock[0], keep=kept.append)
    for k in range(4):
        clock[0] = NOON + k * KEEP_EVERY // 2
        last = before.sign(frame(), 1)
    assert len(kept) == 2
    clock[0] = 0  # the clock forgot the date
    after = Signing(KEY, lambda: clock[0], newest=kept[-1] + KEEP_EVERY)
    verifier = Verifier(signing())
    assert [verifier.judge(f) for f in (last, after.sign(frame(), 1))] == [Verdict.GOOD] * 2


def test_a_radio_is_believed_unsigned_and_nothing_else_in_its_name() -> None:
    radio, vehicle = Encoder(51, 68), Encoder(7, 1)
    status = mav.MAVLink_radio_status_message(190, 180, 100, 40, 40, 0, 0)
    verifier = Verifier(signing())
    v1 = status.pack(mav.MAVLink(None, 51, 68), force_mavlink1=True)
    assert [verifier.judge(f) for f in (radio.encode(status), v1)] == [Verdict.GOOD] * 2
    others = (radio.heartbeat(2, 12, 0, 0, 4), vehicle.encode(status))
    assert [verifier.judge(f) for f in others] == [Verdict.UNSIGNED] * 2


def test_without_a_key_a_decoder_takes_signed_frames_too() -> None:
    assert len(Decoder().feed(signing().sign(frame(), 1))) == 1


@pytest.mark.parametrize(
    "content",
    [KEY, KEY.hex().encode(), KEY.hex().upper().encode() + b"\n", base64.b64encode(KEY) + b"\r\n"],
    ids=["raw", "hex", "hex with newline", "base64"],
)
def test_forms_of_a_key(content: bytes) -> None:
    assert parse_key(content) == KEY


@pytest.mark.parametrize(
    "content", [b"", b"secret", KEY[:31], KEY + b"x", b"g" * 64, b"QUJD\n", b"\xff" * 44]
)
def test_what_is_no_key(content: bytes) -> None:
    with pytest.raises(ValueError, match="64 hex digits, base64 of 32 bytes, or 32 raw bytes"):
        parse_key(content)
