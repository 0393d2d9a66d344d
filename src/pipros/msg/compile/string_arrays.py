"""Reading of string arrays: the names of joints, of controllers, of topics."""

from __future__ import annotations

import struct

TYPE_CHECKING = False  # true for type checkers; importing `typing` would double the time of a first import
if TYPE_CHECKING:
    from pipros.msg.base import Buffer

TOO_SHORT = "the data is too short for the message"

KEPT_LIMIT_BYTES = 4096
"""A longer array is not kept: it is likely data rather than names, and unlikely to come again."""

KEPT_LIMIT = 16
"""The number of arrays kept for a field."""

_KEY_BYTES = 32
"""Kept arrays are found by this many of their first bytes; arrays that are not longer are not kept."""

_read_length = struct.Struct("<I").unpack_from
# One call reads a short string together with the length of the next.
_readers = [struct.Struct(f"<{length}sI").unpack_from for length in range(64)]


def read_strings(data: Buffer, offset: int, count: int, errors: str) -> tuple[list[str], int]:
    """`count` strings that begin at `offset`, and the offset of their end.

    Args:
        errors: how bytes that are not UTF-8 are handled, as in `bytes.decode`.

    Raises:
        UnicodeDecodeError: there are such bytes, and `errors` is `strict`.
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
            pass  # a long string: it and the strings after it are read below
        offset -= 4
    for _ in range(count - len(strings)):
        (length,) = _read_length(data, offset)
        offset += 4
        add(str(data[offset : (offset := offset + length)], "utf-8", errors))
    if offset > len(data):
        raise struct.error(TOO_SHORT)
    return strings, offset


class RepeatedStrings:
    """Reads a field that is an array of strings.

    Most publishers send the same array again and again, so the last few are kept, and are found by their
    bytes. May be used from several threads.
    """

    def __init__(self, errors: str) -> None:
        self._errors = errors
        self._kept: dict[bytes, tuple[int, bytes, tuple[str, ...]]] = {}

    def read(self, data: Buffer, offset: int, count: int) -> tuple[list[str], int]:
        """As `read_strings`."""
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
