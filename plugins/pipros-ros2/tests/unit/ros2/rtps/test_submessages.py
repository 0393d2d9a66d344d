"""Submessages: conversion to bytes and back, in both byte orders."""

from struct import pack

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.encoding import (
    acknack,
    data_frag_head,
    data_head,
    datagram_head,
    gap,
    heartbeat,
    nack_frag,
)
from pipros_ros2.rtps.parameters import (
    SENTINEL,
    Address,
    Parameter,
    SampleIdentity,
    duration,
    ended,
    is_ended,
    locator,
    parameter,
    read_duration,
    read_locator,
    read_parameters,
    read_related_sample,
    read_text,
    related_sample,
    text,
)
from pipros_ros2.rtps.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
)

US, PEER = b"our prefix..", b"peer prefix."
READER, WRITER = b"\0\0\1\4", b"\0\0\1\3"
BIG = (1 << 40) + 7
# As far as a range or a set that starts there stays below the largest number that is read.
sequences = st.integers(1, (1 << 62) - 1000)
offsets = st.lists(st.integers(0, 255), max_size=20, unique=True).map(sorted)


def read(*parts: bytes) -> list[Submessage]:
    """The submessages of a datagram to us, which must be well-formed."""
    found = read_datagram(datagram_head(PEER, US) + b"".join(parts), US)
    assert found is not None
    assert (found.prefix, found.is_malformed) == (PEER, False)
    return found.submessages


@given(sequence=sequences, payload=st.binary(max_size=80), has_inline=st.booleans())
def test_data_is_read_back(sequence: int, payload: bytes, has_inline: bool) -> None:
    payload += bytes(-len(payload) % 4)
    identity = SampleIdentity(bytes(range(16)), sequence)
    inline = related_sample(identity) if has_inline else b""
    (data,) = read(data_head(READER, WRITER, sequence, len(payload), inline), payload)

    assert isinstance(data, Data)
    assert (data.reader, data.writer, data.sequence) == (READER, WRITER, sequence)
    assert (bytes(data.payload), data.has_payload) == (payload, True)
    assert read_related_sample(data.inline) == (identity if has_inline else None)


def test_fragments_are_read_back() -> None:
    piece = bytes(range(100))
    (fragment,) = read(data_frag_head(READER, WRITER, BIG, 3, 100, 300, 100), piece)

    assert isinstance(fragment, DataFrag)
    assert (fragment[:7], bytes(fragment.payload)) == ((READER, WRITER, BIG, 3, 1, 100, 300), piece)


@given(first=sequences, count=st.integers(0, 1000), number=st.integers(0, 1000), is_final=st.booleans())
def test_heartbeats_are_read_back(first: int, count: int, number: int, is_final: bool) -> None:
    written = heartbeat(READER, WRITER, first, first + count - 1, number, is_final=is_final)

    assert read(written) == [Heartbeat(READER, WRITER, first, first + count - 1, number, is_final)]


@given(base=sequences, bits=offsets, number=st.integers(0, 1000), is_final=st.booleans())
def test_sets_of_numbers_are_read_back(base: int, bits: list[int], number: int, is_final: bool) -> None:
    members = tuple(base + bit for bit in bits)

    assert read(acknack(READER, WRITER, base, members, number, is_final=is_final)) == [
        AckNack(READER, WRITER, base, members, number, is_final)
    ]
    assert read(gap(READER, WRITER, 1, base, members)) == [Gap(READER, WRITER, 1, base, members)]


@given(base=st.integers(1, 1 << 30), bits=offsets.filter(bool))
def test_requests_for_fragments_are_read_back(base: int, bits: list[int]) -> None:
    missing = tuple(base + bit - bits[0] for bit in bits)

    assert read(nack_frag(READER, WRITER, BIG, missing, 5)) == [NackFrag(READER, WRITER, BIG, missing, 5)]


@pytest.mark.parametrize(("body", "expected"), [
    (
        b"\x07\x00" + pack(">H4s4siIiIi", 28, READER, WRITER, 0, 5, 0, 9, 2),
        Heartbeat(READER, WRITER, 5, 9, 2, False),
    ),
    (
        b"\x06\x02" + pack(">H4s4siIIIi", 28, READER, WRITER, 0, 5, 3, 0b101 << 29, 2),
        AckNack(READER, WRITER, 5, (5, 7), 2, True),
    ),
    (
        b"\x13\x00" + pack(">H4s4siIIi", 24, READER, WRITER, 0, 5, 9, 2),
        HeartbeatFrag(READER, WRITER, 5, 9, 2),
    ),
])  # fmt: skip
def test_big_endian_submessages_are_read(body: bytes, expected: Submessage) -> None:
    assert read(body) == [expected]


def test_submessages_for_others_are_left_out() -> None:
    beat = heartbeat(READER, WRITER, 1, 1, 1)
    other = b"\x0e\x01\x0c\x00" + b"someone else"
    ours = b"\x0e\x01\x0c\x00" + bytes(12)

    assert len(read(beat, other, beat, beat, ours, beat)) == 2


def test_numbers_that_no_writer_reaches_are_malformed() -> None:
    for written in (
        heartbeat(READER, WRITER, 1, (1 << 62) + 1, 1),
        acknack(READER, WRITER, 1 << 62, (1 << 62,), 1, is_final=True),
    ):
        found = read_datagram(datagram_head(PEER, US) + written, US)

        assert found is not None
        assert (found.submessages, found.is_malformed) == ([], True)


def test_unknown_submessages_and_timestamps_are_passed_over() -> None:
    beat = heartbeat(READER, WRITER, 1, 1, 1)
    timestamp = b"\x09\x01\x08\x00" + bytes(8)

    assert len(read(timestamp, b"\x80\x01\x04\x00abcd", beat, b"\x01\x01\x00\x00", beat)) == 2


def test_the_last_submessage_may_have_no_length() -> None:
    beat = bytearray(heartbeat(READER, WRITER, 1, 4, 1))
    beat[2:4] = b"\0\0"

    assert read(bytes(beat)) == [Heartbeat(READER, WRITER, 1, 4, 1, False)]


@pytest.mark.parametrize("bad", [
    heartbeat(READER, WRITER, 9, 1, 1), heartbeat(READER, WRITER, 0, 1, 1),
    data_head(READER, WRITER, 0, 0), b"\x15\x05\x18\x00" + bytes(2) + b"\xff\x00" + bytes(20),
    data_frag_head(READER, WRITER, 1, 4, 100, 300, 0), data_frag_head(READER, WRITER, 1, 1, 0, 300, 0),
    data_frag_head(READER, WRITER, 1, 1, 100, 300, 4) + bytes(4),
    b"\x06\x01" + pack("<H4s4siIIi", 24, READER, WRITER, 0, 5, 257, 2),
])  # fmt: skip
def test_malformed_submessages_end_the_reading(bad: bytes) -> None:
    beat = heartbeat(READER, WRITER, 1, 1, 1)
    found = read_datagram(datagram_head(PEER, US) + beat + bad + beat, US)

    assert found is not None
    assert (len(found.submessages), found.is_malformed) == (1, True)


def test_a_submessage_that_is_cut_off_is_malformed() -> None:
    beat = heartbeat(READER, WRITER, 1, 9, 1)
    found = read_datagram(datagram_head(PEER, US) + beat + beat[:-4], US)

    assert found is not None
    assert (len(found.submessages), found.is_malformed) == (1, True)


@pytest.mark.parametrize("datagram", [b"", b"RTPS", b"RTPX\2\3\0\0" + bytes(12), b"RTPS\1\0\0\0" + bytes(12)])
def test_other_datagrams_are_ignored(datagram: bytes) -> None:
    assert read_datagram(datagram, US) is None


@pytest.mark.parametrize("name", [Parameter.RELATED_SAMPLE, Parameter.RELATED_SAMPLE_FAST])
def test_either_parameter_names_the_related_sample(name: Parameter) -> None:
    inline = parameter(name, bytes(range(16)) + pack("<iI", 1, 2)) + SENTINEL
    found, _ = read_parameters(inline, 0, is_little=True)

    assert read_related_sample(found) == SampleIdentity(bytes(range(16)), (1 << 32) | 2)


def test_the_end_of_an_entity_is_recognised() -> None:
    found, end = read_parameters(ended(bytes(16)), 0, is_little=True)

    assert is_ended(found)
    assert end == len(ended(bytes(16)))
    assert not is_ended(None)


@given(st.floats(0, 1e6))
def test_durations_are_read_back(seconds: float) -> None:
    assert read_duration(duration(seconds), True) == pytest.approx(seconds, abs=1e-6)


def test_special_values_are_read_back() -> None:
    assert read_duration(duration(float("inf")), True) == float("inf")
    assert read_duration(pack("<iI", -1, 0), True) is None
    assert read_text(text("grüße"), True) == "grüße"
    assert read_text(text("ab")[:-2], True) is None
    assert read_text(b"\2\0\0\0\xff\0", True) is None
    assert read_locator(locator(Address("10.1.2.3", 7410)), True) == Address("10.1.2.3", 7410)
    assert read_locator(locator(Address("0.0.0.0", 7410)), True) is None  # noqa: S104
    assert read_locator(locator(Address("10.1.2.3", 0)), True) is None
    assert read_locator(pack("<iI", 2, 7410) + bytes(16), True) is None
