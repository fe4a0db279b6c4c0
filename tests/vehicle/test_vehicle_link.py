"""Which frames pass the link: every one once, and of a state only the newest."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.link import LATE_FRAMES, Link

TEXT = mav.MAVLink_statustext_message(6, b"text")
STATE = mav.MAVLink_extended_sys_state_message(0, 1)


def frames(count: int, message: object, first: int = 0) -> list[bytes]:
    encoder = Encoder(1, 1)
    encoder.sequence = first
    return [encoder.encode(message) for _ in range(count)]


def passed(link: Link, data: list[bytes]) -> list[int]:
    return [frame.sequence for one in data for frame in link.take(one)]


def test_every_number_of_the_first_frame_is_taken() -> None:
    for first in range(256):
        assert passed(Link(1), frames(3, STATE, first)) == [(first + k) & 0xFF for k in range(3)]


def test_an_overtaken_frame_passes_once_unless_it_tells_the_state() -> None:
    text, state = frames(4, TEXT), frames(4, STATE)
    assert passed(Link(1), [text[0], text[2], text[1], text[1], text[3]]) == [0, 2, 1, 3]
    assert passed(Link(1), [state[0], state[2], state[1], state[3]]) == [0, 2, 3]


@given(st.lists(st.integers(0, LATE_FRAMES - 1), min_size=1, max_size=80), st.integers(0, 255))
def test_no_frame_passes_twice_and_none_is_missing(order: list[int], first: int) -> None:
    sent = frames(LATE_FRAMES, TEXT, first)
    link = Link(1)
    got = passed(link, [sent[k] for k in order])
    assert sorted(got) == sorted({(first + k) & 0xFF for k in order})
    assert link.received == len(order)


@pytest.mark.parametrize("missing", [1, 50, 200])
def test_a_gap_does_not_confuse(missing: int) -> None:
    sent = frames(missing + 4, TEXT)
    link = Link(1)
    assert passed(link, [sent[0], sent[1], sent[missing + 2], sent[missing + 3], sent[missing + 2]]) == [
        f[4] for f in (sent[0], sent[1], sent[missing + 2], sent[missing + 3])
    ]
    assert link.late == 1


def test_after_a_silence_any_number_is_new() -> None:
    sent = frames(30, STATE)
    link = Link(1)
    passed(link, sent)
    assert passed(link, sent[:1]) == []
    link.expect_any()
    assert passed(link, sent[:2]) == [0, 1]


def test_outgoing_and_traffic_are_given_out_once() -> None:
    link = Link(1)
    (incoming,) = frames(1, TEXT)
    link.send(b"out")
    link.take(incoming)
    assert link.outgoing() == [b"out"] and link.outgoing() == []
    assert link.traffic() == [b"out", incoming] and link.traffic() == []


def test_late_news_is_outdated_only_by_its_own_kind() -> None:
    """A heartbeat that a position overtook still tells the mode; one that a heartbeat overtook does not."""
    encoder = Encoder(1, 1)
    beats = [encoder.heartbeat(2, 12, 1, mode, 4) for mode in (10, 11)]
    position = encoder.global_position_int(1, 2, 3, 4, 5, 6, 7, 8, 9)
    for order, modes in (((0, 1), [10, 11]), ((1, 0), [11])):
        link = Link(1)
        passed_on = [frame for i in (position, *(beats[k] for k in order)) for frame in link.take(i)]
        assert [f.fields.custom_mode for f in passed_on[1:]] == modes
