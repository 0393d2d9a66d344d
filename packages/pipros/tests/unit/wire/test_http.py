"""HTTP without I/O: requests and responses are split from any byte stream, or refused with a reason."""

import itertools
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.errors import LimitExceeded
from pipros.wire.http import (
    HttpError,
    HttpLimitExceeded,
    Request,
    RequestReader,
    ResponseReader,
    build_request,
    build_response,
)
from pipros.wire.http_body import ChunkedBody


def request(*headers: str, body: bytes = b"", start: str = "POST /RPC2 HTTP/1.1") -> bytes:
    return "\r\n".join([start, *headers, "", ""]).encode() + body


def read(stream: bytes, reader: RequestReader | None = None) -> list[Request]:
    """Feed a stream, and return all requests that it completes."""
    reader = reader or RequestReader()
    reader.feed(stream)
    return list(iter(reader.next_request, None))


def test_requests_and_responses_have_the_headers_that_genuine_parsers_expect() -> None:
    assert build_request("h:1", "/", b"hi") == (
        b"POST / HTTP/1.1\r\nHost: h:1\r\nUser-Agent: pipros\r\n"
        b"Content-Type: text/xml\r\nContent-length: 2\r\n\r\nhi"
    )
    assert build_response(b"hi") == (
        b"HTTP/1.1 200 OK\r\nServer: pipros\r\nContent-Type: text/xml\r\nContent-length: 2\r\n\r\nhi"
    )
    assert build_response(b"no", status=413, keep_alive=False) == (
        b"HTTP/1.1 413 Content Too Large\r\nServer: pipros\r\nConnection: close\r\n"
        b"Content-Type: text/plain\r\nContent-length: 2\r\n\r\nno"
    )


@given(st.lists(st.binary(max_size=50)), st.data())
def test_requests_are_the_same_for_any_split_of_the_stream(bodies: list[bytes], data: st.DataObject) -> None:
    stream = b"".join(build_request("h:1", "/", body) for body in bodies)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=5)))
    reader = RequestReader()
    got = []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        got += read(stream[start:end], reader)
    assert [found.body for found in got] == bodies


def test_requests_before_garbage_are_returned_before_it_is_refused() -> None:
    reader = RequestReader()
    reader.feed(build_request("h:1", "/", b"good") + b"\x00garbage")
    assert reader.next_request().body == b"good"
    for _ in range(2):
        with pytest.raises(HttpError):
            reader.next_request()


def test_chunked_bodies_are_put_together() -> None:
    stream = request("Transfer-Encoding: chunked", body=b"3\r\nabc\r\n2;x=y\r\nde\r\n0\r\nTrailer: t\r\n\r\n")
    for size in (1, 2, 7, len(stream)):
        reader = RequestReader()
        pieces = [stream[at : at + size] for at in range(0, len(stream), size)]
        got = [found for piece in pieces for found in read(piece, reader)]
        assert [found.body for found in got] == [b"abcde"]
        assert reader.is_idle


@pytest.mark.parametrize(("start", "header", "keep_alive"), [
    ("POST / HTTP/1.1", "X: y", True), ("POST / HTTP/1.1", "Connection: close", False),
    ("POST / HTTP/1.0", "X: y", False), ("POST / HTTP/1.0", "Connection: Keep-Alive", True),
])  # fmt: skip
def test_keep_alive_is_what_version_and_header_say(start: str, header: str, keep_alive: bool) -> None:
    [found] = read(request(header, "Content-Length: 0", start=start))
    assert found.keep_alive is keep_alive


def test_bare_newlines_and_blank_lines_before_a_request_are_accepted() -> None:
    [found] = read(b"\r\n\nPOST / HTTP/1.1\nContent-Length: 1\n\nx")
    assert found.body == b"x"


@pytest.mark.parametrize(("stream", "status"), [
    (b"\x16\x03\x01", 400), (b"HELO\r\n\r\n", 400), (request(start="GET / HTTP/1.1"), 405),
    (request(start="POST / HTTP/2.0"), 505), (request(start="POST  / HTTP/1.1"), 400), (request(), 411),
    (request("Origin: http://evil.example", "Content-Length: 0"), 403), (request("Content-Length: x"), 400),
    (request("Content-Length: -1"), 400), (request("Content-Length: 1", "Content-Length: 2"), 400),
    (request("Content-Length: 1", "Transfer-Encoding: chunked"), 400),
    (request("Transfer-Encoding: gzip"), 400), (request("Content-Length: 1", "Content-Encoding: gzip"), 415),
    (request("no colon"), 400), (request("Content-Length : 1"), 400), (request("A: b", " folded: c"), 400),
    (request("Transfer-Encoding: chunked", body=b"zz\r\n"), 400),
    (request("Transfer-Encoding: chunked", body=b"-1\r\n"), 400),
    (request("Transfer-Encoding: chunked", body=b";\r\n"), 400),
    (request("Transfer-Encoding: chunked", body=b"123456789\r\n"), 400),
    (request("Transfer-Encoding: chunked", body=b"1\r\nabc\r\n"), 400),
    (request("Transfer-Encoding: chunked", body=b"1" * 300), 400),
])  # fmt: skip
def test_a_request_for_another_server_is_refused_with_the_right_status(stream: bytes, status: int) -> None:
    with pytest.raises(HttpError) as caught:
        read(stream)
    assert caught.value.status == status


@pytest.mark.parametrize(("stream", "status"), [
    (request("Content-Length: 1000000000"), 413), (request("Content-Length: 101"), 413),
    (request("Transfer-Encoding: chunked", body=b"65\r\n"), 413),
    (request("Transfer-Encoding: chunked", body=b"64\r\n" + b"x" * 100 + b"\r\n1\r\n"), 413),
    (request("Transfer-Encoding: chunked", body=b"0\r\n" + b"x:\r\n" * 2_001), 413),
    (request("X: " + "y" * 500), 431), (b"POST / HTTP/1.1\r\nX: " + b"y" * 500, 431),
])  # fmt: skip
def test_requests_beyond_a_limit_are_refused_before_their_bytes_arrive(stream: bytes, status: int) -> None:
    with pytest.raises(LimitExceeded) as caught:
        read(stream, RequestReader(head_limit=300, body_limit=100))
    assert isinstance(caught.value, HttpError)
    assert caught.value.status == status


def test_a_body_as_large_as_the_limit_is_read() -> None:
    [found] = read(request("Content-Length: 100", body=b"x" * 100), RequestReader(body_limit=100))
    assert len(found.body) == 100


def test_a_body_in_very_many_chunks_is_refused() -> None:
    head = request("Transfer-Encoding: chunked")
    [found] = read(head + b"1\r\nx\r\n" * 1_999 + b"0\r\n\r\n")
    assert len(found.body) == 1_999
    with pytest.raises(LimitExceeded, match="must have at most 2000 chunks"):
        read(head + b"1\r\nx\r\n" * 2_001)


def test_a_client_that_waits_for_100_continue_gets_it_once() -> None:
    reader = RequestReader()
    assert read(request("Expect: 100-continue", "Content-Length: 1"), reader) == []
    assert reader.wants_continue()
    assert not reader.wants_continue()
    assert [found.body for found in read(b"x", reader)] == [b"x"]


@pytest.mark.parametrize("stream", [
    b"HTTP/1.1 200 OK\r\nContent-length: 2\r\n\r\nhi",
    b"HTTP/1.1 100 Continue\r\n\r\n"
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\nhi\r\n0\r\n\r\n",
    b"HTTP/1.0 200\r\nConnection: keep-alive\r\nContent-Length: 2\r\n\r\nhi",
])  # fmt: skip
def test_responses_are_read_in_every_form(stream: bytes) -> None:
    for size in (1, 3, len(stream)):
        reader = ResponseReader()
        got = [reader.feed(stream[at : at + size]) for at in range(0, len(stream), size)]
        assert [(found.status, found.body, found.keep_alive) for found in got if found] == [
            (200, b"hi", True)
        ]
        assert got[-1] is not None


def test_a_response_without_length_ends_with_the_connection() -> None:
    reader = ResponseReader()
    assert reader.feed(b"HTTP/1.1 200 OK\r\n\r\nhi") is None
    found = reader.end()
    assert (found.body, found.keep_alive) == (b"hi", False)


def test_a_response_without_a_body_needs_no_length() -> None:
    found = ResponseReader().feed(b"HTTP/1.1 204 No Content\r\n\r\n")
    assert (found.status, found.body, found.keep_alive) == (204, b"", True)


@pytest.mark.parametrize(
    "stream", [b"HTTP/1.1 200 OK\r\n", b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhi"]
)
def test_a_connection_that_ends_in_the_middle_of_a_response_is_an_error(stream: bytes) -> None:
    reader = ResponseReader()
    assert reader.feed(stream) is None
    with pytest.raises(HttpError, match="in the middle"):
        reader.end()


@pytest.mark.parametrize("stream", [
    b"SSH-2.0-OpenSSH\r\n\r\n", b"HTTP/2.0 200 OK\r\n\r\n",
    b"HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 1\r\n\r\n",
])  # fmt: skip
def test_an_invalid_response_is_refused(stream: bytes) -> None:
    with pytest.raises(HttpError):
        ResponseReader().feed(stream)


def test_a_response_that_never_ends_is_refused_at_the_limit() -> None:
    with pytest.raises(LimitExceeded):
        ResponseReader(body_limit=10).feed(b"HTTP/1.1 200 OK\r\n\r\n" + b"x" * 11)


@pytest.mark.parametrize(
    ("feed", "name"),
    [
        (lambda: read(request("Content-Length: 101"), RequestReader(body_limit=100)), "body_bytes"),
        (
            lambda: read(
                request("Transfer-Encoding: chunked", body=b"65\r\n"), RequestReader(body_limit=100)
            ),
            "body_bytes",
        ),
        (
            lambda: ResponseReader(body_limit=100).feed(b"HTTP/1.1 200 OK\r\nContent-Length: 101\r\n\r\n"),
            "answer_bytes",
        ),
    ],
)
def test_a_body_above_the_limit_says_which_limit_to_raise(feed: Callable[[], object], name: str) -> None:
    with pytest.raises(HttpLimitExceeded, match=rf"the limit is \d+ \({name} in PIPROS_LIMITS\)"):
        feed()


@pytest.mark.parametrize("stream", [
    request("Content-Length: 2\r", body=b"hi"), request("Content-Length: 2", "X: a\rb", body=b"hi"),
    request("Content-Length: 2", "X: a\x00", body=b"hi"),
    request("Transfer-Encoding: chunked", body=b"2\nhi\r\n0\r\n\r\n"),
])  # fmt: skip
def test_line_ends_that_others_read_otherwise_are_refused(stream: bytes) -> None:
    with pytest.raises(HttpError) as refused:
        read(stream)
    assert refused.value.status == 400


@pytest.mark.parametrize(
    ("value", "keep_alive"), [("close", False), ("TE, Close", False), ("disclose", True), (": close", True)]
)
def test_a_connection_option_is_a_whole_word(value: str, keep_alive: bool) -> None:
    [found] = read(request("Content-Length: 0", f"Connection: {value}"))
    assert found.keep_alive is keep_alive


# Chunked bodies: assembled from any pieces, bounded in bytes and in chunks.


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
    assert (body.held_bytes, bytes(buffer)) == (3, b"5\r\nde")
