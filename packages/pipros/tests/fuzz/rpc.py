"""Any bytes sent to an XML-RPC server are calls, or raise the documented errors.

An input is the stream of one connection. It is read in one piece and byte by byte, with the same
result. Each body is read by the fast and by the complete reader, which must not disagree. Each value that is
read must be the same after writing and reading it again.

python -m tests.fuzz.rpc --seconds 60
"""

import sys
from contextlib import suppress
from typing import Any

from pipros.basics.errors import ProtocolError
from pipros.wire import xmlrpc_expat, xmlrpc_fast
from pipros.wire.http import HttpError, Request, RequestReader, ResponseReader
from pipros.wire.xmlrpc import (
    NESTING_LIMIT,
    Fault,
    decode_call,
    decode_response,
    encode_call,
    encode_response,
)
from tests.fuzz import mutation

WORDS = [
    *(
        b"\r\n", b"\n", b"\r\n\r\n", b"POST / HTTP/1.1\r\n", b"HTTP/1.1 200 OK\r\n", b"Content-Length: ",
        b"0\r\n",
    ),
    *(b"Transfer-Encoding: chunked\r\n", b"Expect: 100-continue\r\n", b"Connection: close\r\n", b": ", b";"),
    *(
        b"<value>", b"</value>", b"<int>", b"</int>", b"<i4>5</i4>", b"<string>", b"</string>",
        b"<double>1e9</double>",
    ),
    *(
        b"<boolean>1</boolean>", b"<array><data>", b"</data></array>", b"<struct>", b"</struct>",
        b"<base64>aGk=</base64>",
    ),
    *(
        b"<member><name>a</name>", b"</member>", b"<params>", b"<param>", b"<nil/>", b"<!DOCTYPE a>",
        b"<![CDATA[", b"]]>",
    ),
    *(
        b"&amp;", b"&#65;", b"&a;", b"<!--", b"-->", b"<?xml version='1.0'?>", b"<dateTime.iso8601>",
        b"<fault>", b"-", b"9",
    ),
]  # fmt: skip


def target(stream: bytes) -> None:
    whole, whole_status = read_requests([stream])
    pieces, pieces_status = read_requests([bytes([byte]) for byte in stream])
    assert (pieces, pieces_status) == (whole, whole_status)
    for request in whole:
        examine(request.body)
    examine(stream)
    responses = ResponseReader(head_limit=500, body_limit=2000)
    with suppress(HttpError):
        while response := responses.feed(b""):
            examine(response.body)
        if response := responses.feed(stream) or responses.end():
            examine(response.body)


def read_requests(pieces: list[bytes]) -> tuple[list[Request], int]:
    """Return the requests, and the status of the refusal that ended them (0 for none)."""
    reader = RequestReader(head_limit=500, body_limit=2000)
    found: list[Request] = []
    try:
        for piece in [*pieces, b""]:
            reader.feed(piece)
            while request := reader.next_request():
                found.append(request)
    except HttpError as error:
        return found, error.status
    return found, 0


def examine(body: bytes) -> None:
    with suppress(ProtocolError):
        method, params = decode_call(body)
        assert repr(decode_call(encode_call(method, params))) == repr((method, params)) or _has_objects(
            params
        )
        agree(xmlrpc_fast.decode_call, xmlrpc_expat.decode_call, body)
    with suppress(ProtocolError, Fault):
        value = decode_response(body)
        assert repr(decode_response(encode_response(value))) == repr(value) or _has_objects(value)


def agree(quick: Any, thorough: Any, body: bytes) -> None:
    with suppress(xmlrpc_fast.NeedsExpat):
        assert repr(quick(body, NESTING_LIMIT)) == repr(thorough(body, NESTING_LIMIT))


def _has_objects(value: Any) -> bool:
    """Normalise Binary and dates, whose `repr` has an address, and carriage returns."""
    return " at 0x" in repr(value) or "\\r" in repr(value)


if __name__ == "__main__":
    sys.exit(mutation.main(target, "rpc", WORDS))
