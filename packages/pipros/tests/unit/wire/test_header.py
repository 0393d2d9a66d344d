"""Connection headers, byte for byte, and malformed ones."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros.wire.header import HeaderReader, decode_header, encode_header

KEYS = st.text(st.characters(exclude_characters="=", exclude_categories=["Cs"]), min_size=1)
VALUES = st.text(st.characters(exclude_categories=["Cs"]))


def test_a_header_on_the_wire() -> None:
    assert encode_header({"topic": "/a", "x": "1=2"}) == (
        b"\x15\x00\x00\x00\x08\x00\x00\x00topic=/a\x05\x00\x00\x00x=1=2"
    )


@given(st.dictionaries(KEYS, VALUES))
def test_headers_survive_a_round_trip(fields: dict[str, str]) -> None:
    assert decode_header(encode_header(fields)[4:]) == fields


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        (b"\x01\x00", "ends inside a field length"),
        (b"\x09\x00\x00\x00a=b", "claims 9 bytes, but only 3 are left"),
        (b"\x03\x00\x00\x00abc", "has no '='"),
        (b"\x03\x00\x00\x00a=\xff", "is not UTF-8"),
    ],
)
def test_a_malformed_header_is_refused(body: bytes, problem: str) -> None:
    with pytest.raises(ProtocolError, match=problem):
        decode_header(body)


def test_a_header_byte_by_byte_leaves_the_following_bytes() -> None:
    reader = HeaderReader()
    stream = encode_header({"a": "b"})
    for byte in stream[:-1]:
        assert reader.feed(bytes([byte])) is None
    assert reader.feed(stream[-1:] + b"rest") == {"a": "b"}
    assert reader.rest == b"rest"


def test_a_header_above_the_limit_is_refused_at_once() -> None:
    with pytest.raises(LimitExceeded, match="2000 bytes was announced; the limit is 1000"):
        HeaderReader(limit_bytes=1000).feed(struct.pack("<I", 2000))
