"""The part of HTTP/1.1 that XML-RPC needs: bytes in, messages out.

Theory of operation: a reader waits either for a head (everything up to the blank line) or for a body. The end
of a body is given by `Content-Length`, by chunks or, for responses only, by the end of the connection. Memory
grows with the bytes that have arrived, never with the length that a peer announces. An announced length
beyond the limit is refused before the body is received.

h11 implements all of HTTP, but takes 17 ms to import and 40 us per request; this module takes 1 ms and 8 us.
The master answers a request in less time than h11 needs to read it. A test compares this reader with h11
(`tests/unit/wire/test_http_against_h11.py`).

The output is compatible with XmlRpc++ (roscpp), which looks for `Content-length: ` in upper or lower case,
and supports neither chunks nor compression.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from pipros.basics.limits import limit_text, process_limits
from pipros.wire.http_body import ChunkedBody, HttpError, HttpLimitExceeded, check_body_length

__all__ = [
    "CONTINUE",
    "HttpError",
    "HttpLimitExceeded",
    "Request",
    "RequestReader",
    "Response",
    "ResponseReader",
    "build_request",
    "build_response",
]

HEAD_LIMIT_BYTES: Final = 16 * 1024
"""Maximum size of a head. ROS peers send heads of 100 to 300 bytes."""

_REASONS: Final = {
    200: "OK",
    400: "Bad Request",
    403: "Forbidden",
    405: "Method Not Allowed",
    408: "Request Timeout",
    411: "Length Required",
    413: "Content Too Large",
    415: "Unsupported Media Type",
    431: "Request Header Fields Too Large",
    500: "Internal Server Error",
    503: "Service Unavailable",
    505: "HTTP Version Not Supported",
}


class Request(NamedTuple):
    """One request. Header names are lower case; the values of repeated headers are joined by commas."""

    method: str
    target: str
    headers: dict[str, str]
    body: bytes | bytearray
    keep_alive: bool


class Response(NamedTuple):
    """One response. `keep_alive` is True if the connection may be used for another request."""

    status: int
    reason: str
    headers: dict[str, str]
    body: bytes | bytearray
    keep_alive: bool


def build_request(host: str, target: str, body: bytes) -> bytes:
    """Return a POST request with an XML-RPC document. `host` is the `Host` header, like `localhost:11311`."""
    return request_head(host, target, len(body)) + body


def request_head(host: str, target: str, length: int) -> bytes:
    """Return the head of a request with a body of `length` bytes.

    Callers that send head and body separately avoid copying a large body.
    """
    return (
        f"POST {target} HTTP/1.1\r\nHost: {host}\r\nUser-Agent: pipros\r\n"
        f"Content-Type: text/xml\r\nContent-length: {length}\r\n\r\n"
    ).encode()


def build_response(
    body: bytes, *, status: int = 200, keep_alive: bool = True, send_keep_alive: bool = False
) -> bytes:
    """Return a response that contains an XML-RPC document, or plain text if `status` is not 200.

    HTTP/1.0 clients that asked to keep the connection open need a header as confirmation (`send_keep_alive`).
    """
    return response_head(len(body), status, keep_alive=keep_alive, send_keep_alive=send_keep_alive) + body


def response_head(
    length: int, status: int = 200, *, keep_alive: bool = True, send_keep_alive: bool = False
) -> bytes:
    """Return the head of a response with a body of `length` bytes.

    Callers that send head and body separately avoid copying a large body.
    """
    connection = "Connection: close\r\n"
    if keep_alive:
        connection = "Connection: keep-alive\r\n" if send_keep_alive else ""
    content = "text/xml" if status == 200 else "text/plain"
    return (
        f"HTTP/1.1 {status} {_REASONS.get(status, 'Error')}\r\nServer: pipros\r\n{connection}"
        f"Content-Type: {content}\r\nContent-length: {length}\r\n\r\n"
    ).encode("latin-1")


CONTINUE: Final = b"HTTP/1.1 100 Continue\r\n\r\n"

_END_OF_HEAD = re.compile(rb"\r?\n\r?\n")
_CONTROL = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]|\r(?!\n)").search
"""Control characters that a head must not contain, because implementations differ in how they interpret
them.
"""
_TOKEN = re.compile(r"[!#$%&'*+.^_`|~0-9A-Za-z-]+").fullmatch
_STATUS_LINE = re.compile(r"HTTP/(\d)\.(\d) (\d{3})(?: ([^\r\n]*))?").fullmatch
# compiled on first use, because only servers need it
_REQUEST_LINE = r"([A-Z]{1,20}) ([!-~]{1,2000}) HTTP/(\d)\.(\d)"
_LENGTH_DIGITS: Final = 15

_UNTIL_END: Final = -1
_CHUNKED: Final = -2


class _Reader:
    """Base class of both readers, which read a head and then a body."""

    def __init__(self, *, head_limit: int, body_limit: int, limit_name: str) -> None:
        """Limit the size of heads and bodies.

        `limit_name` is the body limit's name in `Limits`, used in error messages.
        """
        self._head_limit = head_limit
        self._body_limit = body_limit
        self._limit_name = limit_name
        self._buffer = bytearray()
        self._searched = 0
        self._start: re.Match[str] | None = None
        self._headers: dict[str, str] = {}
        self._length = 0
        self._chunks = ChunkedBody(body_limit, limit_name)

    @property
    def is_idle(self) -> bool:
        """Whether the reader is between two messages and has no bytes of the next message."""
        return self._start is None and not self._buffer

    @property
    def held_bytes(self) -> int:
        """The number of bytes received so far of an incomplete message."""
        return len(self._buffer) + self._chunks.held_bytes

    def _read_head(self) -> bool:
        """Remove a head from the buffer; return False if it is incomplete."""
        buffer = self._buffer
        if not self._searched:  # skip blank lines before a start line, as RFC 9112, 2.2 recommends
            del buffer[: len(buffer) - len(buffer.lstrip(b"\r\n"))]
            # not HTTP but, for example, TLS, so do not wait for more bytes
            if buffer and not 0x41 <= buffer[0] <= 0x5A:
                raise HttpError(400, f"this is not an HTTP message: it begins with {bytes(buffer[:20])!r}")
        end = _END_OF_HEAD.search(buffer, max(0, self._searched - 3))
        # the last three bytes may be the start of the marker that ends the head
        if (end.start() if end else len(buffer) - 3) > self._head_limit:
            raise HttpLimitExceeded(431, f"an HTTP head must have at most {self._head_limit} bytes")
        if end is None:
            self._searched = len(buffer)
            return False
        head = bytes(buffer[: end.start()])
        if control := _CONTROL(head):
            raise HttpError(400, f"an HTTP head must not contain control characters, got {control[0]!r}")
        lines = head.decode("latin-1").replace("\r\n", "\n").split("\n")
        del buffer[: end.end()]
        self._searched = 0
        self._headers = _parse_headers(lines)
        self._start = self._parse_start_line(lines[0])
        self._length = self._body_length()
        if self._length > self._body_limit:
            limit = limit_text(self._limit_name, self._body_limit)
            raise HttpLimitExceeded(413, f"an HTTP body of {self._length} bytes is announced; {limit}")
        return True

    def _read_body(self) -> bytes | bytearray | None:
        """Remove a body from the buffer and return it. Return None if the body is incomplete."""
        if self._length == _CHUNKED:
            return self._chunks.feed(self._buffer)
        if self._length == _UNTIL_END:
            check_body_length(len(self._buffer), self._body_limit, self._limit_name)
            return None
        if len(self._buffer) < self._length:
            return None
        behind = len(self._buffer) - self._length
        if behind < self._length:  # copy the smaller part, because the other may be large
            body, self._buffer = self._buffer, self._buffer[self._length :]
            del body[self._length :]
            return body
        front = bytes(self._buffer[: self._length])
        del self._buffer[: self._length]
        return front

    def _declared_length(self) -> int | None:
        """Return the length that the headers announce, or None if they do not announce a length."""
        headers = self._headers
        if headers.get("content-encoding", "identity").lower() != "identity":
            raise HttpError(
                415, f"an HTTP body must not be compressed, got {headers['content-encoding'][:40]!r}"
            )
        length = headers.get("content-length")
        if "transfer-encoding" in headers:
            if length is not None:
                raise HttpError(400, "Content-Length and Transfer-Encoding must not be combined")
            if headers["transfer-encoding"].lower() != "chunked":
                raise HttpError(
                    400, f"Transfer-Encoding must be chunked, got {headers['transfer-encoding'][:40]!r}"
                )
            return _CHUNKED
        if length is None:
            return None
        if not (length.isdecimal() and length.isascii() and len(length) <= _LENGTH_DIGITS):
            raise HttpError(
                400, f"Content-Length must have 1 to {_LENGTH_DIGITS} digits, got {length[:40]!r}"
            )
        return int(length)

    def _keep_alive(self, start: re.Match[str], major: int, minor: int) -> bool:
        connection = self._headers.get("connection", "").lower()
        options = [option.strip() for option in connection.split(",")]
        if start[major] == "1" and start[minor] != "0":
            return "close" not in options
        return "keep-alive" in options

    def _parse_start_line(self, line: str) -> re.Match[str]:
        raise HttpError(400, f"this is not an HTTP message: {line[:40]!r}")

    def _body_length(self) -> int:
        return 0


class RequestReader(_Reader):
    """Splits the byte stream from a client into requests.

    Feed it the bytes from the socket, and take the complete requests in order, one at a time.

    >>> reader = RequestReader()
    >>> reader.feed(b"POST / HTTP/1.1\\r\\nContent-Length: 2\\r\\n\\r\\nh")
    >>> reader.next_request()
    >>> reader.feed(b"i")
    >>> bytes(reader.next_request().body)
    b'hi'
    """

    _failure: HttpError | None = None

    def __init__(self, *, head_limit: int = HEAD_LIMIT_BYTES, body_limit: int | None = None) -> None:
        """Limit bodies to `body_limit` bytes (default: the process-wide `Limits.body_bytes`)."""
        limit = process_limits().body_bytes if body_limit is None else body_limit
        super().__init__(head_limit=head_limit, body_limit=limit, limit_name="body_bytes")

    def feed(self, data: bytes) -> None:
        self._buffer += data

    def next_request(self) -> Request | None:
        """Remove and return the next request. Return None if no request is complete.

        Raises:
            HttpError: the bytes are not a request, or the request has no length, has a compressed body, uses
                a method other than POST, comes from a web page, or exceeds a limit. The connection cannot be
                used afterwards.
        """
        if self._failure:
            raise self._failure
        try:
            if self._start is None and not (self._buffer and self._read_head()):
                return None
            body = self._read_body()
        except HttpError as error:
            self._failure = error
            raise
        if body is None:
            return None
        start = self._start
        assert start is not None  # noqa: S101  # _read_head() has set it
        self._start = None
        return Request(start[1], start[2], self._headers, body, self._keep_alive(start, 3, 4))

    def wants_continue(self) -> bool:
        """Return True, once per request, if the client waits for `100 Continue` before it sends the body."""
        return self._start is not None and self._headers.pop("expect", "").lower() == "100-continue"

    def _parse_start_line(self, line: str) -> re.Match[str]:
        match = re.fullmatch(_REQUEST_LINE, line)
        if match is None:
            raise HttpError(400, f"this is not an HTTP request: it begins with {line[:40]!r}")
        if match[3] != "1":
            raise HttpError(505, f"HTTP/{match[3]} is not supported, only HTTP/1")
        if match[1] != "POST":
            raise HttpError(
                405, f"requests to an XML-RPC server must use POST, got {match[1]} {match[2][:80]}"
            )
        return match

    def _body_length(self) -> int:
        if "origin" in self._headers:
            # Only browsers send Origin. Without this check, a web page could call servers bound to loopback.
            raise HttpError(
                403, f"requests from web pages are not allowed; Origin: {self._headers['origin'][:80]}"
            )
        length = self._declared_length()
        if length is None:
            raise HttpError(411, "the request must have a Content-Length header")
        return length


class ResponseReader(_Reader):
    """Splits the byte stream from a server into responses; the counterpart of `RequestReader`.

    Interim responses (`100 Continue`) are skipped. Call `end()` when the server closes the connection.
    """

    def __init__(self, *, head_limit: int = HEAD_LIMIT_BYTES, body_limit: int | None = None) -> None:
        """Limit bodies to `body_limit` bytes (default: the process-wide `Limits.answer_bytes`)."""
        limit = process_limits().answer_bytes if body_limit is None else body_limit
        super().__init__(head_limit=head_limit, body_limit=limit, limit_name="answer_bytes")

    def feed(self, data: bytes) -> Response | None:
        """Return the response if it is complete, otherwise None. Later bytes are kept for the next call.

        Raises:
            HttpError: the response is malformed, or exceeds a limit.
        """
        self._buffer += data
        while self._start is not None or (self._buffer and self._read_head()):
            if self._start is not None and self._start[3].startswith("1"):
                self._start = None
                continue
            body = self._read_body()
            return None if body is None else self._finish(body)
        return None

    def end(self) -> Response | None:
        """Handle the end of the connection. Return the response that it completes, if any.

        Raises:
            HttpError: the connection ended in the middle of a response.
        """
        if self.is_idle:
            return None
        if self._start is None or self._length != _UNTIL_END:
            raise HttpError(400, "the connection ended in the middle of a response")
        body, self._buffer = self._buffer, bytearray()
        return self._finish(body)

    def _finish(self, body: bytes | bytearray) -> Response:
        start = self._start
        assert start is not None  # noqa: S101  # only called with a head
        self._start = None
        keep_alive = self._length != _UNTIL_END and self._keep_alive(start, 1, 2)
        return Response(int(start[3]), start[4] or "", self._headers, body, keep_alive)

    def _parse_start_line(self, line: str) -> re.Match[str]:
        match = _STATUS_LINE(line)
        if match is None or match[1] != "1":
            raise HttpError(400, f"this is not an HTTP response: it begins with {line[:40]!r}")
        return match

    def _body_length(self) -> int:
        assert self._start is not None  # noqa: S101  # only called with a head
        if self._start[3].startswith("1") or self._start[3] in ("204", "304"):
            return 0
        length = self._declared_length()
        return _UNTIL_END if length is None else length


def _parse_headers(lines: list[str]) -> dict[str, str]:
    headers: dict[str, str] = {}
    for line in lines[1:]:
        name, colon, value = line.partition(":")
        if not colon or not _TOKEN(name):
            raise HttpError(400, f"malformed HTTP header line: {line[:40]!r}")
        name = name.lower()
        value = value.strip(" \t")
        if name in headers:
            if name == "content-length" and headers[name] != value:
                raise HttpError(400, "the values of several Content-Length headers must be equal")
            if name != "content-length":
                headers[name] += ", " + value
        else:
            headers[name] = value
    return headers
