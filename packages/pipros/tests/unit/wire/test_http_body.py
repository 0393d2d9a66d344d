"""Chunked bodies: assembled from any pieces, bounded in bytes and in chunks."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.wire.http_body import CHUNKS_LIMIT, ChunkedBody, HttpError, HttpLimitExceeded


def chunked(parts: list[bytes], trailer: bytes = b"") -> bytes:
    chunks = b"".join(b"%x\r\n%s\r\n" % (len(part), part) for part in parts if part)
    return chunks + b"0\r\n" + trailer + b"\r\n"


@given(st.lists(st.binary(max_size=40), max_size=6), st.lists(st.integers(0, 300), max_size=5))
def test_a_body_is_the_same_however_it_arrives(parts: list[bytes], cuts: list[int]) -> None:
    stream = chunked(parts) + b"next"
    body = ChunkedBody(limit_bytes=1000)
    buffer = bytearray()
    found = None
    edges = sorted({min(cut, len(stream)) for cut in cuts} | {0, len(stream)})
    for start, end in itertools.pairwise(edges):
        buffer += stream[start:end]
        if found is None:
            found = body.feed(buffer)

    assert found is not None
    assert bytes(found) == b"".join(parts)
    assert bytes(buffer) == b"next"


def test_a_second_body_is_read_from_its_start() -> None:
    body = ChunkedBody(limit_bytes=10)

    assert bytes(body.feed(bytearray(chunked([b"one"]))) or b"") == b"one"
    assert bytes(body.feed(bytearray(chunked([b"two"], b"X-Sum: 1\r\n"))) or b"") == b"two"


def test_held_bytes_are_those_of_complete_chunks() -> None:
    body = ChunkedBody(limit_bytes=100)
    buffer = bytearray(b"3\r\nabc\r\n5\r\nde")

    assert body.feed(buffer) is None
    assert body.held_bytes == 3
    assert bytes(buffer) == b"5\r\nde"


def test_the_sum_of_the_chunks_is_limited_before_they_arrive() -> None:
    body = ChunkedBody(limit_bytes=5)

    with pytest.raises(HttpLimitExceeded) as refused:
        body.feed(bytearray(b"3\r\nabc\r\n3\r\n"))
    assert refused.value.status == 413


def test_chunks_are_limited_in_number() -> None:
    with pytest.raises(HttpLimitExceeded, match=f"must have at most {CHUNKS_LIMIT} chunks"):
        ChunkedBody(limit_bytes=1 << 20).feed(bytearray(b"1\r\nx\r\n" * (CHUNKS_LIMIT + 1)))


@pytest.mark.parametrize(
    "stream",
    [b"x\r\n", b"-1\r\n", b"3\nabc\r\n", b"3\r\nabcd\r\n", b"123456789\r\n", b";\r\n", b"0" * 300],
)
def test_invalid_chunks_are_refused(stream: bytes) -> None:
    with pytest.raises(HttpError) as refused:
        ChunkedBody(limit_bytes=100).feed(bytearray(stream))
    assert refused.value.status == 400
