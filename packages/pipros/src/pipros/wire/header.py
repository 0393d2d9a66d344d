"""TCPROS connection headers: a block of `key=value` fields, each with its own length.

Source: http://wiki.ros.org/ROS/Connection%20Header
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

from pipros.basics.errors import LimitExceeded, ProtocolError

HEADER_BYTES = 1024 * 1024
"""Limit: size of a TCPROS connection header. Beyond it, the connection is closed."""

HEADER_FIELDS = 1000
"""Limit: fields of a header, which are decoded in the event loop; genuine headers have fewer than ten."""

_LENGTH = struct.Struct("<I")


def encode_header(fields: Mapping[str, str]) -> bytes:
    """Return the header in wire format: its total length, then the fields.

    >>> encode_header({"type": "a/B"})
    b'\\x0c\\x00\\x00\\x00\\x08\\x00\\x00\\x00type=a/B'
    """
    encoded = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(_LENGTH.pack(len(item)) + item for item in encoded)
    return _LENGTH.pack(len(body)) + body


def decode_header(body: bytes) -> dict[str, str]:
    """Return the fields of a header, which is given without its total length. A value may contain `=`.

    Raises:
        ProtocolError: a field is longer than the rest of the header, has no `=`, or is not UTF-8.
        LimitExceeded: the header has more than `HEADER_FIELDS` fields.
    """
    fields: dict[str, str] = {}
    at = count = 0
    while at < len(body):
        count += 1
        if count > HEADER_FIELDS:
            raise LimitExceeded(f"a connection header must have at most {HEADER_FIELDS} fields")
        if at + 4 > len(body):
            raise ProtocolError(f"connection header ends inside a field length, at byte {at} of {len(body)}")
        (length,) = _LENGTH.unpack_from(body, at)
        at += 4
        if at + length > len(body):
            raise ProtocolError(
                f"connection header field claims {length} bytes, but only {len(body) - at} are left"
            )
        key, separator, value = body[at : at + length].partition(b"=")
        if not separator:
            raise ProtocolError(f"connection header field {key[:40]!r} has no '='")
        try:
            fields[key.decode()] = value.decode()
        except UnicodeDecodeError:
            raise ProtocolError(f"connection header field {key[:40]!r} is not UTF-8") from None
        at += length
    return fields


class HeaderReader:
    """Collects one connection header from an incoming byte stream.

    Feed it the bytes from the socket until `fields` is set; bytes after the header are in `rest`.
    """

    __slots__ = ("_buffer", "fields", "limit_bytes", "rest")

    def __init__(self, limit_bytes: int | None = None) -> None:
        """Limit the header to `limit_bytes` (default: the process-wide `HEADER_BYTES`)."""
        self.limit_bytes = HEADER_BYTES if limit_bytes is None else limit_bytes
        self.fields: dict[str, str] | None = None
        self.rest = b""
        self._buffer = bytearray()

    def feed(self, data: bytes) -> dict[str, str] | None:
        """Add received bytes. Return the fields if the header is complete, otherwise None.

        Raises:
            LimitExceeded: the announced length exceeds the limit. This is raised before the rest arrives.
            ProtocolError: the header is malformed.
        """
        self._buffer += data
        if len(self._buffer) < 4:
            return None
        (length,) = _LENGTH.unpack_from(self._buffer)
        if length > self.limit_bytes:
            limit = f"the limit is {self.limit_bytes} bytes"
            raise LimitExceeded(f"a connection header of {length} bytes was announced; {limit}")
        if len(self._buffer) < 4 + length:
            return None
        self.fields = decode_header(bytes(self._buffer[4 : 4 + length]))
        self.rest = bytes(self._buffer[4 + length :])
        self._buffer.clear()
        return self.fields
