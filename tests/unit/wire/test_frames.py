"""Frames come out whole and in order, however they arrived, and a claimed length costs nothing."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.errors import LimitExceeded
from pipros.wire.frames import FrameBuffer, FrameSplitter


def framed(*bodies: bytes) -> bytes:
    return b"".join(struct.pack("<I", len(body)) + body for body in bodies)


@given(st.lists(st.binary(max_size=300), max_size=20), st.lists(st.integers(1, 500), min_size=1))
def test_frames_come_out_as_they_went_in_wherever_the_stream_was_cut(
    bodies: list[bytes], cuts: list[int]
) -> None:
    stream, splitter, received, at, turn = framed(*bodies), FrameSplitter(), [], 0, 0
    while at < len(stream):
        size = cuts[turn % len(cuts)]
        received += splitter.feed(stream[at : at + size])
        at, turn = at + size, turn + 1
    assert received == bodies


def test_a_frame_larger_than_the_first_buffer_arrives_whole() -> None:
    body = bytes(range(256)) * 4096
    assert FrameSplitter().feed(framed(b"before", body, b"after")) == [b"before", body, b"after"]


def test_an_empty_frame_is_a_frame() -> None:
    assert FrameSplitter().feed(framed(b"", b"")) == [b"", b""]


def test_a_frame_above_the_limit_is_refused_before_it_arrives() -> None:
    with pytest.raises(LimitExceeded, match="frame of 11 bytes announced, the limit is 10"):
        FrameSplitter(limit_bytes=10).feed(struct.pack("<I", 11))


def test_memory_grows_with_what_arrives_not_with_what_is_claimed() -> None:
    buffer = FrameBuffer()
    claim = struct.pack("<I", 1 << 29)
    buffer.room()[: len(claim)] = claim
    assert list(buffer.received(len(claim))) == []
    assert len(buffer.room()) < 1 << 17


def test_room_is_used_again() -> None:
    buffer = FrameBuffer()
    first = buffer.room()
    for _ in range(1000):
        data = framed(b"x" * 1000)
        buffer.room()[: len(data)] = data
        assert [bytes(frame) for frame in buffer.received(len(data))] == [b"x" * 1000]
    assert buffer.room().obj is first.obj
