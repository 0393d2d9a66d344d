"""Read string arrays, such as the names of joints, controllers or topics."""

from __future__ import annotations

import struct

# Type checkers treat this as True. Importing `typing` would double the time of the first message import.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from pipros.msg.base import Buffer

TOO_SHORT = "the data is too short for the message"

KEPT_LIMIT_BYTES = 4096
"""Maximum length of a cached array.

A longer array is likely data rather than names, and unlikely to recur.
"""

KEPT_LIMIT = 16
"""Maximum number of cached arrays per field."""

_KEY_BYTES = 32
"""Number of leading bytes that are the key of a cached array. Only longer arrays are cached."""

_read_length = struct.Struct("<I").unpack_from
# One call reads a short string together with the length of the next string.
_readers = [struct.Struct(f"<{length}sI").unpack_from for length in range(64)]


def read_strings(data: Buffer, offset: int, count: int, errors: str) -> tuple[list[str], int]:
    """Return `count` strings that start at `offset`, and the offset of their end.

    Args:
        errors: error handler for bytes that are not UTF-8, as in `bytes.decode`.

    Raises:
        UnicodeDecodeError: there are bytes that are not UTF-8, and `errors` is `strict`.
        struct.error: there are too few bytes.
    """
    strings: list[str] = []
    add = strings.append
    if count > 1 and errors == "strict":
        readers = _readers
        (length,) = _read_length(data, offset)
        offset += 4
        try:
            for _ in range(count - 1):
                octets, following = readers[length](data, offset)
                add(octets.decode())
                offset += length + 4
                length = following
        except IndexError:
            pass  # a long string; the loop below reads it and all following strings
        offset -= 4
    for _ in range(count - len(strings)):
        (length,) = _read_length(data, offset)
        offset += 4
        add(str(data[offset : (offset := offset + length)], "utf-8", errors))
    if offset > len(data):
        raise struct.error(TOO_SHORT)
    return strings, offset


class RepeatedStrings:
    """Reader for a field that is an array of strings.

    Most publishers send the same array repeatedly, so the last few arrays are cached by their serialized
    bytes. Thread-safe.
    """

    def __init__(self, errors: str) -> None:
        self._errors = errors
        self._kept: dict[bytes, tuple[int, bytes, tuple[str, ...]]] = {}

    def read(self, data: Buffer, offset: int, count: int) -> tuple[list[str], int]:
        """Like `read_strings`, but take a repeated array from the cache."""
        key = bytes(data[offset : offset + _KEY_BYTES])
        kept = self._kept.get(key)
        if kept is not None:
            its_count, octets, strings = kept
            end = offset + len(octets)
            if its_count == count and data[offset:end] == octets:
                return list(strings), end
        found, end = read_strings(data, offset, count, self._errors)
        if _KEY_BYTES < end - offset <= KEPT_LIMIT_BYTES:
            if len(self._kept) >= KEPT_LIMIT:
                self._kept.clear()
            self._kept[key] = count, bytes(data[offset:end]), tuple(found)
        return found, end
