"""Chunked HTTP bodies, and errors in HTTP messages."""

from __future__ import annotations

import re
from typing import Final

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros.basics.limits import limit_text

_SIZE_LINE = rb"([0-9A-Fa-f]{1,8})[ \t]*(?:;[^\r\n]*)?\r"
_LINE_LIMIT: Final = 256
CHUNKS_LIMIT: Final = 2_000
"""Maximum number of chunks and trailer lines in one body. Each chunk takes time, even if it is a single byte.
Clients usually send chunks of thousands of bytes.
"""


class HttpError(ProtocolError):
    """A message violates HTTP, or uses an HTTP feature that is not supported.

    Attributes:
        status: the status code with which a server responds.
    """

    def __init__(self, status: int, text: str) -> None:
        self.status = status
        super().__init__(text)


class HttpLimitExceeded(HttpError, LimitExceeded):
    """The size of a head, the received or announced size of a body, or the number of chunks is too large."""


def check_body_length(length: int, limit: int, limit_name: str) -> None:
    """Raise `HttpLimitExceeded` if `length` exceeds `limit`, which is named `limit_name` in `Limits`."""
    if length > limit:
        raise HttpLimitExceeded(
            413, f"the HTTP body has {length} bytes or more; {limit_text(limit_name, limit)}"
        )


class ChunkedBody:
    """Assembles a body from chunks, each of which is preceded by a line with its size.

    >>> bytes(ChunkedBody(limit_bytes=100).feed(bytearray(b"2\\r\\nhi\\r\\n0\\r\\n\\r\\nrest")))
    b'hi'
    """

    def __init__(self, limit_bytes: int, limit_name: str = "body_bytes") -> None:
        self._limit_bytes = limit_bytes
        self._limit_name = limit_name
        self._body = bytearray()
        self._chunk_count = 0
        self._is_in_trailer = False

    @property
    def held_bytes(self) -> int:
        return len(self._body)

    def feed(self, buffer: bytearray) -> bytearray | None:
        """Remove complete chunks from the front of `buffer`.

        Return the body if it is complete, otherwise None.

        Raises:
            HttpError: the bytes are not a chunk, or the body exceeds a limit.
        """
        while (line_end := buffer.find(b"\n", 0, _LINE_LIMIT)) >= 0:
            line = bytes(buffer[:line_end])
            if self._is_in_trailer:
                del buffer[: line_end + 1]
                if line in (b"", b"\r"):
                    return self._finish()
            elif not self._cut_chunk(buffer, line):
                return None
            self._chunk_count += 1
            if self._chunk_count > CHUNKS_LIMIT:
                raise HttpLimitExceeded(
                    413, f"an HTTP body must have at most {CHUNKS_LIMIT} chunks and trailer lines"
                )
        if len(buffer) >= _LINE_LIMIT:
            raise HttpError(400, "an HTTP chunk must begin with a size")
        return None

    def _cut_chunk(self, buffer: bytearray, line: bytes) -> bool:
        """Remove the chunk that starts with `line`; return False if it is incomplete."""
        size_text = re.fullmatch(_SIZE_LINE, line)
        if size_text is None:
            raise HttpError(400, f"an HTTP chunk must begin with a size, got {line[:40]!r}")
        size = int(size_text[1], 16)
        check_body_length(len(self._body) + size, self._limit_bytes, self._limit_name)
        start = len(line) + 1
        if not size:
            self._is_in_trailer = True
            del buffer[:start]
            return True
        end = start + size
        if len(buffer) < end + 2:
            return False
        if buffer[end : end + 2] != b"\r\n":
            raise HttpError(400, "HTTP chunk is longer than its declared size")
        self._body += buffer[start:end]
        del buffer[: end + 2]
        return True

    def _finish(self) -> bytearray:
        body, self._body = self._body, bytearray()
        self._chunk_count = 0
        self._is_in_trailer = False
        return body
