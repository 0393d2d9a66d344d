"""The HTTP reader and h11, a complete implementation, read the same generated messages.

The reader supports a part of HTTP, and refuses the rest, which h11 accepts, with a status. Both must refuse
streams that are not HTTP. `LENIENT` lists the cases in which the reader accepts more than h11.
"""

import re
from dataclasses import dataclass, replace
from typing import Any

import h11
from hypothesis import given, settings
from hypothesis import strategies as st

from pipros.wire.http import HttpError, RequestReader, ResponseReader

# Statuses for valid HTTP that an XML-RPC server does not support: other methods, no length, compressed
# bodies, large heads, other versions, web pages.
UNSUPPORTED = {403, 405, 411, 413, 415, 431, 505}

SUPPORTED = ("POST", "200", "500")
"""The methods and statuses of the generated messages."""

LENIENT = (
    rb"\A[\r\n]+",  # RFC 9112, 2.2: a server should skip empty lines before a request
    rb"\n\r?\n[\r\n]+",
    rb"\n[0-9A-Fa-f]+[ \t]+;",  # white space before the extension of a chunk (RFC 9112, 7.1.1)
    rb"\n0+[ \t]*(?:;[^\r\n]*)?\r\n(?!\r\n)",  # the lines of a trailer are discarded, whatever they contain
)
STRICT = (
    rb"\n[ \t]",  # obsolete folding of header lines, which a server may refuse (RFC 9112, 5.2)
    rb"\r\r\n",  # in the extension of a chunk
)


@dataclass(frozen=True)
class Read:
    """A message as parsed by a reader."""

    start: tuple[str, ...]
    headers: dict[str, str]
    body: bytes
    keep_alive: bool | None
    """None for HTTP/1.0, of which h11 keeps no connection open."""


def joined(headers: Any) -> dict[str, str]:
    """Return h11's headers in the reader's form: values of one name joined, equal lengths once."""
    found: dict[str, list[str]] = {}
    for name, value in headers:
        found.setdefault(name.decode(), []).append(value.decode("latin-1"))
    return {
        name: values[0] if name == "content-length" else ", ".join(values) for name, values in found.items()
    }


def by_h11(stream: bytes, role: Any) -> list[Read] | None:
    """Return the messages that h11 reads; None when it refuses the stream."""
    connection = h11.Connection(role, max_incomplete_event_size=1 << 20)
    found: list[Read] = []
    if role is h11.CLIENT:
        connection.send(h11.Request(method="POST", target="/", headers=[("Host", "h")]))
        connection.send(h11.EndOfMessage())
    head: Any = None
    body = b""
    try:
        connection.receive_data(stream)
        while True:
            event = connection.next_event()
            if event in (h11.NEED_DATA, h11.PAUSED):
                if event is h11.PAUSED and connection.their_state is h11.DONE:
                    if connection.our_state is h11.SEND_RESPONSE:
                        connection.send(h11.Response(status_code=200, headers=[("Content-Length", "0")]))
                        connection.send(h11.EndOfMessage())
                    if connection.our_state is not h11.DONE:
                        return found
                    connection.start_next_cycle()
                    continue
                return found
            if isinstance(event, (h11.Request, h11.Response)):
                head, body = event, b""
            elif isinstance(event, h11.Data):
                body += bytes(event.data)
            elif isinstance(event, h11.EndOfMessage):
                found.append(read_of(head, body, connection))
                if role is h11.CLIENT:
                    return found
                if connection.our_state is h11.SEND_RESPONSE:
                    connection.send(h11.Response(status_code=200, headers=[("Content-Length", "0")]))
                    connection.send(h11.EndOfMessage())
                if connection.our_state is not h11.DONE:
                    return found
                connection.start_next_cycle()
            elif isinstance(event, h11.ConnectionClosed):
                return found
    except h11.RemoteProtocolError:
        return None


def read_of(head: Any, body: bytes, connection: h11.Connection) -> Read:
    if isinstance(head, h11.Request):
        start: tuple[str, ...] = (head.method.decode(), head.target.decode())
    else:
        start = (str(head.status_code), head.reason.decode("latin-1"))
    keep_alive = connection.their_state is not h11.MUST_CLOSE if head.http_version == b"1.1" else None
    return Read(start, joined(head.headers), body, keep_alive)


def requests_by_reader(parts: list[bytes]) -> tuple[list[Read], int]:
    """Return the requests that the reader cuts out, and the status of its refusal, 0 for none."""
    reader = RequestReader(body_limit=1 << 20)
    found: list[Read] = []
    try:
        for part in parts:
            reader.feed(part)
            while request := reader.next_request():
                start = (request.method, request.target)
                found.append(Read(start, request.headers, bytes(request.body), request.keep_alive))
                if not request.keep_alive:  # a server reads no further
                    return found, 0
    except HttpError as error:
        return found, error.status
    return found, 0


def responses_by_reader(parts: list[bytes]) -> tuple[list[Read], int]:
    reader = ResponseReader(body_limit=1 << 20)
    try:
        for part in parts:
            if response := reader.feed(part):
                start = (str(response.status), response.reason)
                return [Read(start, response.headers, bytes(response.body), response.keep_alive)], 0
    except HttpError as error:
        return [], error.status
    return [], 0


token = st.text(alphabet="abcXYZ019!#$%&'*+-.^_`|~", min_size=1, max_size=12)
value = st.text(alphabet=st.characters(min_codepoint=0x20, max_codepoint=0x7E), max_size=20)
header = st.one_of(
    st.tuples(token, value),
    st.sampled_from([("Connection", "close"), ("Connection", "keep-alive"), ("Expect", "100-continue")]),
    st.sampled_from([("Content-Type", "text/xml"), ("User-Agent", "xmlrpc"), ("Accept", "a")]),
)
body = st.binary(max_size=60)


@st.composite
def framed(draw: st.DrawFn) -> bytes:
    """Headers and a body, by length or in chunks."""
    headers = [f"{name}: {text}".encode() for name, text in draw(st.lists(header, max_size=4))]
    content = draw(body)
    if draw(st.booleans()):
        headers.insert(draw(st.integers(0, len(headers))), b"Content-Length: %d" % len(content))
        return b"\r\n".join([*headers, b"", b""]) + content
    headers.insert(draw(st.integers(0, len(headers))), b"Transfer-Encoding: chunked")
    chunks = b""
    while content:
        size = draw(st.integers(1, len(content)))
        extension = draw(st.sampled_from([b"", b";a=b", b";q"]))
        chunks += b"%x%s\r\n" % (size, extension) + content[:size] + b"\r\n"
        content = content[size:]
    trailer = draw(st.sampled_from([b"", b"", b"X-Sum: 1\r\n"]))
    return b"\r\n".join([*headers, b"", b""]) + chunks + b"0\r\n" + trailer + b"\r\n"


PIECES = [b"\r", b"\n", b"\r\n", b" ", b"\t", b":", b"\x00", b"\x80", b",", b"0", b"Z", b";"]


@st.composite
def damaged(draw: st.DrawFn, streams: st.SearchStrategy[bytes]) -> bytes:
    """A stream with a few bytes changed, removed or added."""
    stream = bytearray(draw(streams))
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, len(stream)))
        kind = draw(st.integers(0, 2))
        piece = draw(st.sampled_from(PIECES))
        if kind == 0:
            stream[at:at] = piece
        else:
            stream[at : at + 1] = piece if kind == 1 else b""
    return bytes(stream)


@st.composite
def parts_of(draw: st.DrawFn, stream: bytes) -> list[bytes]:
    cuts = sorted(draw(st.lists(st.integers(0, len(stream)), max_size=4)))
    return [stream[start:end] for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True)]


request_line = st.sampled_from([b"POST / HTTP/1.1\r\nHost: a\r\n", b"POST /RPC2 HTTP/1.1\r\nHost: a\r\n"])
requests = st.builds(bytes.__add__, request_line, framed())
status_line = st.sampled_from([b"HTTP/1.1 200 OK\r\n", b"HTTP/1.0 200 OK\r\n", b"HTTP/1.1 500 Oh no\r\n"])
responses = st.builds(bytes.__add__, status_line, framed())


def lacks_host(stream: bytes) -> bool:
    """Return True if a head has no `Host`, which RFC 9112 demands and XML-RPC does not need."""
    heads = re.findall(rb"POST [^\n]*HTTP/1.*?\n\r?\n", stream, re.DOTALL)
    return any(not re.search(rb"\nhost:", head, re.IGNORECASE) for head in heads)


def check(stream: bytes, mine: list[Read], status: int, theirs: list[Read] | None) -> None:
    if theirs is None:
        is_lenient = any(re.search(pattern, stream) for pattern in LENIENT) or lacks_host(stream)
        assert status or not mine or is_lenient, "only h11 refuses it"
        return
    pairs = list(zip(mine, theirs, strict=False))
    for read, expected in pairs:
        if expected.keep_alive is None:
            expected = replace(expected, keep_alive=read.keep_alive)
        assert read == expected
    refused = theirs[len(mine) : len(mine) + 1]
    is_supported = status not in UNSUPPORTED and all(read.start[0] in SUPPORTED for read in refused)
    if is_supported and not any(re.search(pattern, stream) for pattern in STRICT):
        # The reader may refuse the following bytes before h11 has a complete head.
        assert len(mine) == len(theirs)


@given(st.lists(requests, min_size=1, max_size=3).map(b"".join), st.data())
def test_requests_are_read_alike(stream: bytes, data: st.DataObject) -> None:
    mine, status = requests_by_reader(data.draw(parts_of(stream)))
    check(stream, mine, status, by_h11(stream, h11.SERVER))


@settings(derandomize=True)
@given(damaged(requests), st.data())
def test_damaged_requests_are_read_or_refused_alike(stream: bytes, data: st.DataObject) -> None:
    mine, status = requests_by_reader(data.draw(parts_of(stream)))
    check(stream, mine, status, by_h11(stream, h11.SERVER))


@given(responses, st.data())
def test_responses_are_read_alike(stream: bytes, data: st.DataObject) -> None:
    mine, status = responses_by_reader(data.draw(parts_of(stream)))
    check(stream, mine, status, by_h11(stream, h11.CLIENT))


@settings(derandomize=True)
@given(damaged(responses), st.data())
def test_damaged_responses_are_read_or_refused_alike(stream: bytes, data: st.DataObject) -> None:
    mine, status = responses_by_reader(data.draw(parts_of(stream)))
    check(stream, mine, status, by_h11(stream, h11.CLIENT))
