"""The hot codec against pymavlink, for every frequent message: the same bytes out, the same fields in."""

import struct
from typing import Any, NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.mavlink import messages
from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.messages import HOT_MESSAGES, SystemTime

INTEGER_RANGES = {
    "uint8_t": (0, 0xFF),
    "uint16_t": (0, 0xFFFF),
    "uint32_t": (0, 0xFFFFFFFF),
    "uint64_t": (0, 0xFFFFFFFFFFFFFFFF),
    "int8_t": (-0x80, 0x7F),
    "int16_t": (-0x8000, 0x7FFF),
    "int32_t": (-0x80000000, 0x7FFFFFFF),
    "int64_t": (-0x8000000000000000, 0x7FFFFFFFFFFFFFFF),
}
MESSAGES = [mav.mavlink_map[message_id] for message_id in HOT_MESSAGES]


def values_of(message: Any) -> st.SearchStrategy[tuple[Any, ...]]:
    """Arguments of ``message``; zeros are frequent, so that truncation is exercised at every length."""
    fields: list[st.SearchStrategy[Any]] = []
    for kind, place in zip(message.fieldtypes, message.orders, strict=True):
        any_value = (
            st.floats(width=32)
            if kind == "float"
            else st.integers(INTEGER_RANGES[kind][0], INTEGER_RANGES[kind][1])
        )
        value, length = st.one_of(st.just(0), any_value), message.array_lengths[place]
        fields.append(st.lists(value, min_size=length, max_size=length) if length else value)
    return st.tuples(*fields)


def same(a: Any, b: Any) -> bool:
    """Equal to the bit, NaN included; a list value by value."""
    if isinstance(a, list):
        return isinstance(b, list) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return struct.pack("<d", a) == struct.pack("<d", b) and type(a) is type(b)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.msgname)
@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_packs_and_unpacks_as_pymavlink_does(message: Any, data: st.DataObject) -> None:
    values = data.draw(values_of(message))
    system, component, sequence = (data.draw(st.integers(0, 255)) for _ in range(3))
    link = mav.MAVLink(None, system, component)
    link.seq = sequence
    encoder = Encoder(system, component)
    encoder.sequence = sequence

    expected = message(*values).pack(link)
    fields = HOT_MESSAGES[message.id].fields(**dict(zip(message.fieldnames, values, strict=True)))
    frame = encoder.encode(fields)
    assert frame == expected
    assert encoder.sequence == (sequence + 1) % 256

    [decoded] = Decoder().feed(frame)
    theirs = mav.MAVLink(None).decode(bytearray(expected))
    assert decoded[:4] == (message.id, system, component, sequence)
    assert decoded.raw == expected
    assert isinstance(decoded.fields, HOT_MESSAGES[message.id].fields)
    for name in message.fieldnames:
        assert same(getattr(decoded.fields, name), getattr(theirs, name)), name


BUILT = [message for message in MESSAGES if hasattr(Encoder, message.msgname.lower())]


@pytest.mark.parametrize("message", BUILT, ids=lambda message: message.msgname)
@given(data=st.data())
def test_builders_take_the_arguments_of_pymavlink(message: Any, data: st.DataObject) -> None:
    values = data.draw(values_of(message))
    expected = message(*values).pack(mav.MAVLink(None, 1, 1))
    assert getattr(Encoder(1, 1), message.msgname.lower())(*values) == expected


def test_any_other_message_goes_through_pymavlink() -> None:
    encoder = Encoder(7, 1)
    message = mav.MAVLink_statustext_message(4, b"Arm: not ready\t")
    frame = encoder.encode(message)
    assert encoder.sequence == 1
    [decoded] = Decoder().feed(frame)
    assert decoded.fields.text == "Arm: not ready\t"
    assert (decoded.message_id, decoded.system, decoded.sequence) == (253, 7, 0)


def test_an_encoder_numbers_hot_and_other_frames_in_one_sequence_that_wraps() -> None:
    encoder, decoder = Encoder(1, 1), Decoder()
    sequences = []
    for index in range(300):
        frame = (
            encoder.heartbeat(2, 12, 0, 0, 3)
            if index % 2
            else encoder.encode(mav.MAVLink_ping_message(0, 0, 0, 0))
        )
        sequences += [frame.sequence for frame in decoder.feed(frame)]
    assert sequences == [index % 256 for index in range(300)]
    assert decoder.lost == 0


def test_a_value_that_does_not_fit_is_refused_as_pymavlink_refuses_it() -> None:
    with pytest.raises(struct.error):
        Encoder(1, 1).global_position_int(0, 0, 0, 0, 0, 40000, 0, 0, 0)
    with pytest.raises(struct.error):
        Encoder(1, 1).encode(SystemTime(0, -1))


def test_a_payload_with_fields_of_a_later_version_is_read_up_to_what_is_known() -> None:
    payload = bytes(range(1, 29)) + b"\x55\x66"
    body = bytes([len(payload), 0, 0, 9, 1, 1]) + (33).to_bytes(3, "little") + payload
    crc = mav.x25crc(body + bytes([mav.mavlink_map[33].crc_extra])).crc
    [frame] = Decoder().feed(b"\xfd" + body + struct.pack("<H", crc))
    assert tuple(frame.fields) == struct.unpack("<IiiiihhhH", payload[:28])


def test_a_dialect_may_have_more_fields_at_the_end_but_no_others() -> None:
    known = messages._hot(NamedTuple("Heartbeat", [("custom_mode", int), ("type", int)]))
    assert known.payload.format == "<1I1B"
    with pytest.raises(TypeError, match="other fields"):
        messages._hot(NamedTuple("Heartbeat", [("type", int), ("custom_mode", int)]))
