"""Encoding of submessages (OMG DDSI-RTPS 2.3, section 9.4), little-endian.

Apart from `datagram_head`, each function returns one submessage, or only the part before its payload, to
avoid copying the payload.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from struct import Struct
from typing import Final

from pipros_ros2.rtps.identity import OWN_VENDOR, PROTOCOL_VERSION
from pipros_ros2.rtps.submessages import (
    ACKNACK,
    DATA,
    DATA_FRAG,
    FINAL,
    GAP,
    HAS_DATA,
    HAS_KEY,
    HEARTBEAT,
    INFO_DST,
    INFO_TS,
    INLINE_QOS,
    LITTLE,
    MAGIC,
    MAX_SET,
    NACK_FRAG,
)

_LENGTH = Struct("<H")
_WORD = Struct("<I")
_COUNT = Struct("<i")
_INFO_TS = Struct("<BBHII")
_DATA_HEAD = Struct("<BBHHH4s4siI")
_FRAG_HEAD = Struct("<BBHHH4s4siIIHHI")
_HEARTBEAT_WHOLE = Struct("<BBH4s4siIiIi")
_DATA_FIXED: Final = 20
_FRAG_FIXED: Final = 32


def datagram_head(own_prefix: bytes, destination: bytes | None = None) -> bytes:
    """Return the start of a datagram: the header and, if a destination is given, INFO_DST."""
    head = MAGIC + PROTOCOL_VERSION + OWN_VENDOR + own_prefix
    return head if destination is None else head + bytes((INFO_DST, LITTLE, 12, 0)) + destination


def info_ts(stamp_ns: int) -> bytes:
    """Return the submessage with the time of the samples after it, in ns since 1970."""
    seconds, rest_ns = divmod(stamp_ns, 1_000_000_000)
    return _INFO_TS.pack(INFO_TS, LITTLE, 8, seconds & 0xFFFFFFFF, (rest_ns << 32) // 1_000_000_000)


def data_head(
    reader: bytes,
    writer: bytes,
    sequence: int,
    payload_bytes: int,
    inline: bytes = b"",
    *,
    is_key: bool = False,
) -> bytes:
    """Return a DATA submessage up to its payload, whose size must be a multiple of four bytes."""
    flags = LITTLE | (HAS_KEY if is_key else HAS_DATA) | (INLINE_QOS if inline else 0)
    length = _DATA_FIXED + len(inline) + payload_bytes
    if length > 0xFFFF:
        length = 0  # the submessage extends to the end of the datagram
    head = _DATA_HEAD.pack(DATA, flags, length, 0, 16, reader, writer, sequence >> 32, sequence & 0xFFFFFFFF)
    return head + inline


def data_frag_head(
    reader: bytes,
    writer: bytes,
    sequence: int,
    number: int,
    fragment_bytes: int,
    sample_bytes: int,
    payload_bytes: int,
    inline: bytes = b"",
) -> bytes:
    """Return a DATA_FRAG submessage for one fragment, up to its payload."""
    flags = LITTLE | (INLINE_QOS if inline else 0)
    length = _FRAG_FIXED + len(inline) + payload_bytes
    if length > 0xFFFF:
        length = 0
    head = _FRAG_HEAD.pack(
        DATA_FRAG,
        flags,
        length,
        0,
        28,
        reader,
        writer,
        sequence >> 32,
        sequence & 0xFFFFFFFF,
        number,
        1,
        fragment_bytes,
        sample_bytes,
    )
    return head + inline


def heartbeat(
    reader: bytes, writer: bytes, first: int, last: int, count: int, *, is_final: bool = False
) -> bytes:
    """Return a HEARTBEAT submessage. A reader must respond unless `is_final` is true."""
    flags = LITTLE | (FINAL if is_final else 0)
    return _HEARTBEAT_WHOLE.pack(
        HEARTBEAT,
        flags,
        28,
        reader,
        writer,
        first >> 32,
        first & 0xFFFFFFFF,
        last >> 32,
        last & 0xFFFFFFFF,
        count & 0x7FFFFFFF,
    )


def _bitmap(base: int, members: Sequence[int]) -> bytes:
    """Encode a set as its number of bits and its bitmap. Members beyond `MAX_SET` are left out."""
    inside = [member - base for member in members if 0 <= member - base < MAX_SET]
    size = max(inside, default=-1) + 1
    words = [0] * ((size + 31) // 32)
    for bit in inside:
        words[bit // 32] |= 1 << (31 - bit % 32)
    return b"".join(_WORD.pack(word) for word in (size, *words))


def _number_set(base: int, members: Sequence[int]) -> bytes:
    return Struct("<iI").pack(base >> 32, base & 0xFFFFFFFF) + _bitmap(base, members)


def _whole(kind: int, flags: int, *parts: bytes) -> bytes:
    body = b"".join(parts)
    return bytes((kind, flags | LITTLE)) + _LENGTH.pack(len(body)) + body


def acknack(
    reader: bytes, writer: bytes, base: int, missing: Sequence[int], count: int, *, is_final: bool
) -> bytes:
    """Return an ACKNACK submessage; see `AckNack`. A writer need not respond if `is_final` is true."""
    numbers = _number_set(base, missing)
    flags = FINAL if is_final else 0
    return _whole(ACKNACK, flags, reader, writer, numbers, _COUNT.pack(count & 0x7FFFFFFF))


def gap(reader: bytes, writer: bytes, start: int, base: int, others: Iterable[int] = ()) -> bytes:
    """Return a GAP submessage; see `Gap`."""
    first = Struct("<iI").pack(start >> 32, start & 0xFFFFFFFF)
    return _whole(GAP, 0, reader, writer, first, _number_set(base, tuple(others)))


def nack_frag(reader: bytes, writer: bytes, sequence: int, missing: Sequence[int], count: int) -> bytes:
    """Return a NACK_FRAG submessage for the fragments in `missing`, which must not be empty."""
    base = missing[0]
    number = Struct("<iII").pack(sequence >> 32, sequence & 0xFFFFFFFF, base)
    return _whole(
        NACK_FRAG, 0, reader, writer, number, _bitmap(base, missing), _COUNT.pack(count & 0x7FFFFFFF)
    )
