"""CVE-2020-16124: lengths and integers beyond 32 bits wrapped around in the XML-RPC library of ROS."""

from __future__ import annotations

import pytest

from pipros.basics.errors import ProtocolError
from pipros.wire.http import HttpError, RequestReader, ResponseReader
from pipros.wire.xmlrpc import decode_call

TOO_LARGE = [2**31, 2**32 - 1, 2**32, 2**63, 2**64, 10**30]


@pytest.mark.parametrize("number", [*TOO_LARGE, *(-number for number in TOO_LARGE[1:])])
def test_an_integer_beyond_the_range_raises_instead_of_wrapping(number: int) -> None:
    value = f"<value><i4>{number}</i4></value>"
    call = f"<methodCall><methodName>m</methodName><params><param>{value}</param></params></methodCall>"
    with pytest.raises(ProtocolError):
        decode_call(call.encode())


@pytest.mark.parametrize(
    "length", [*map(str, TOO_LARGE), "-1", "-2147483648", "0x7fffffff", "1e9", "+5", " ", ""]
)
def test_an_impossible_length_is_refused_before_a_byte_is_stored(length: str) -> None:
    reader = RequestReader()
    reader.feed(f"POST / HTTP/1.1\r\nContent-Length: {length}\r\n\r\n".encode())
    with pytest.raises(HttpError):
        reader.next_request()
    with pytest.raises(HttpError):
        ResponseReader().feed(f"HTTP/1.1 200 OK\r\nContent-Length: {length}\r\n\r\n".encode())
