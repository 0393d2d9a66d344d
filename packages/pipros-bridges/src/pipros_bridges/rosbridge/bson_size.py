"""Estimate the memory that a BSON document needs once it is decoded, without decoding it.

Decoding holds the interpreter's lock, and an empty embedded document of 8 bytes becomes an object of 64
bytes, so a small document could fill the memory and stop all threads. Source: https://bsonspec.org/spec.html.
"""

from __future__ import annotations

import struct
from typing import Final

from pipros_bridges.rosbridge.text_input import BadInput

_SIZE = struct.Struct("<i")
_SIZES: Final = {
    0x01: 8,
    0x06: 0,
    0x07: 12,
    0x08: 1,
    0x09: 8,
    0x0A: 0,
    0x10: 4,
    0x11: 8,
    0x12: 8,
    0x13: 16,
    0x7F: 0,
    0xFF: 0,
}
"""Sizes of values with a fixed size, by element type."""
_TEXTS: Final = frozenset((0x02, 0x0D, 0x0E))
_DOCUMENTS: Final = frozenset((0x03, 0x04))
_BINARY: Final = 0x05
_CHECKED_BYTES: Final = 4096
_ELEMENT_BYTES: Final = 120
_DOCUMENT_BYTES: Final = 250


def parsed_bson_bytes(data: bytes, limit: float) -> int:
    """Return an upper bound for the memory of a document's values; 0 for a short document.

    Stop counting once the result exceeds `limit`.

    Raises:
        BadInput: the document violates the specification, or has elements of a type that no message needs.
    """
    if len(data) <= _CHECKED_BYTES:
        return 0
    needed = 2 * len(data)
    position = _SIZE.size
    try:
        while position < len(data) and needed <= limit:
            kind = data[position]
            position += 1
            if not kind:  # the end of a document
                continue
            position = data.index(0, position) + 1
            needed += _ELEMENT_BYTES
            if kind in _DOCUMENTS:
                needed += _DOCUMENT_BYTES
                position += _SIZE.size
            elif kind in _TEXTS or kind == _BINARY:
                size = _SIZE.unpack_from(data, position)[0]
                position += _SIZE.size + (kind == _BINARY) + max(size, 0)
            else:
                position += _SIZES[kind]
    except (ValueError, KeyError, struct.error):
        raise BadInput("the data is not BSON, or contains elements of an unsupported type") from None
    return needed
