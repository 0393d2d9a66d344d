"""Chunked bodies: assembled from any pieces, bounded in bytes and in chunks."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from pipros.wire.http_body import ChunkedBody


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
