"""Parse and build records for bags in formats 2.0 and 1.2 (http://wiki.ros.org/Bags/Format/2.0).

A record is a header and data, each prefixed by its length in four bytes. A header is a sequence of fields
`name=value`, each prefixed by its length; values are bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct

from pipros.msg.time import NS_PER_S
from pipros_tools.bag.errors import BagFormatError

MAGIC = b"#ROSBAG V2.0\n"
HEADER_END = len(MAGIC) + 4096 + 8
"""Byte position after the file header of the bags that rosbag writes. Other writers choose other sizes.

The size of a bag's header never changes, so that the header can be rewritten when the index is complete.
"""
LEAST_HEADER_END = len(MAGIC) + 77
"""Byte position after a file header without padding."""

U32 = Struct("<I")
U64 = Struct("<Q")
TIME = Struct("<II")
ENTRY = Struct("<III")
"""Layout of an index entry: seconds, nanoseconds, and offset of the message in the uncompressed chunk."""

TIMES_NS = (1 << 32) * NS_PER_S
"""First timestamp (ns) beyond the format's range."""

BAG_HEADER_BYTES = 1024 * 1024
"""Limit: the header of one record in a bag. Beyond it, the record is refused, with its position."""

Fields = dict[str, bytes]


class Op(IntEnum):
    """Kind of record, stored in the field `op`."""

    MESSAGE_DEFINITION = 1  # occurs only in format 1.2
    MESSAGE = 2
    FILE_HEADER = 3
    INDEX = 4
    CHUNK = 5
    CHUNK_INFO = 6
    CONNECTION = 7


@dataclass(frozen=True, slots=True)
class Version:
    """File format version. 2.0 is `Version(2, 0)`, or 200 as a number."""

    major: int
    minor: int

    @property
    def number(self) -> int:
        return self.major * 100 + self.minor


def parse_version(line: bytes) -> Version | None:
    """Parse the version in the first line of a file. Return None if the file is not a bag.

    >>> parse_version(b"#ROSBAG V2.0")
    Version(major=2, minor=0)
    """
    for prefix in (b"#ROSBAG V", b"#ROSRECORD V"):
        if line.startswith(prefix):
            major, dot, minor = line[len(prefix) :].rstrip(b"\r").partition(b".")
            if dot and major.isdigit() and minor.isdigit() and len(major) < 6 and len(minor) < 6:
                return Version(int(major), int(minor))
    return None


def check_header_size(size: int, where: str) -> None:
    """Raise `BagFormatError` if the header of a record is larger than allowed."""
    if size > BAG_HEADER_BYTES:
        raise BagFormatError(
            f"{where}: a record's header must be at most {BAG_HEADER_BYTES} bytes long, got {size}"
        )


def parse_fields(header: bytes, where: str) -> Fields:
    """Parse the fields of a header.

    Raises:
        BagFormatError: a field extends beyond the header, or does not have the form `name=value`.
    """
    fields: Fields = {}
    position, end = 0, len(header)
    while position < end:
        if end - position < 4:
            raise BagFormatError(f"{where}: the header ends within the length of a field")
        size = int.from_bytes(header[position : position + 4], "little")
        position += 4
        if size > end - position:
            raise BagFormatError(
                f"{where}: a field must fit into its header, got {size} bytes with {end - position} left"
            )
        name, equals, value = header[position : position + size].partition(b"=")
        if not equals:
            raise BagFormatError(f"{where}: a header field must have the form name=value, got {name[:40]!r}")
        fields[name.decode("utf-8", "replace")] = value
        position += size
    return fields


def parse_head(read: Callable[[int, int], bytes], position: int, where: str) -> tuple[Fields, int, int]:
    """Return the fields of the record at `position`, and the position and size of its data.

    Args:
        read: function that takes a position and a number of bytes, and returns the bytes at that position.
    """
    head_size = int.from_bytes(read(position, 4), "little")
    check_header_size(head_size, where)
    fields = parse_fields(read(position + 4, head_size), where)
    after = position + 4 + head_size
    return fields, after + 4, int.from_bytes(read(after, 4), "little")


def field_bytes(fields: Mapping[str, bytes] | Iterable[tuple[str, bytes]]) -> bytes:
    """Serialize the fields of a header."""
    pairs = fields.items() if isinstance(fields, Mapping) else fields
    parts: list[bytes] = []
    for name, value in pairs:
        encoded = name.encode()
        parts += (U32.pack(len(encoded) + 1 + len(value)), encoded, b"=", value)
    return b"".join(parts)


def record_bytes(fields: Mapping[str, bytes], data: bytes) -> bytes:
    """Serialize a record."""
    header = field_bytes(fields)
    return b"".join((U32.pack(len(header)), header, U32.pack(len(data)), data))


def op_of(fields: Fields, where: str) -> int:
    """Return the field `op`.

    Raises:
        BagFormatError: the field is missing, or is not one byte.
    """
    return number(fields, "op", 1, where)


def number(fields: Fields, name: str, size: int, where: str) -> int:
    """Return the unsigned integer in a field of `size` bytes.

    Raises:
        BagFormatError: the field is missing, or has a different size.
    """
    value = fields.get(name)
    if value is None:
        raise BagFormatError(f"{where}: the field [{name}] is missing")
    if len(value) != size:
        raise BagFormatError(f"{where}: the field [{name}] must be {size} bytes long, got {len(value)}")
    return int.from_bytes(value, "little")


def time_of(fields: Fields, name: str, where: str) -> int:
    """Return the timestamp (ns) in a field.

    Raises:
        BagFormatError: the field is missing, is not 8 bytes long, or is out of range.
    """
    both = number(fields, name, 8, where)
    return checked_time((both & 0xFFFFFFFF) * NS_PER_S + (both >> 32), where)


def is_valid_time(time_ns: int) -> bool:
    """Return whether `time_ns` is within the range of ROS times."""
    return 0 <= time_ns < TIMES_NS


def checked_time(time_ns: int, where: str) -> int:
    """Return `time_ns`. Raise `BagFormatError` if it is beyond the range of ROS times."""
    if not is_valid_time(time_ns):
        raise BagFormatError(f"{where}: timestamps must be below 2^32 s, got {time_ns} ns")
    return time_ns


def time_bytes(time_ns: int) -> bytes:
    """Serialize a timestamp."""
    return TIME.pack(*divmod(time_ns, NS_PER_S))


def entry_bytes(time_ns: int, offset: int) -> bytes:
    """Serialize an index entry."""
    return ENTRY.pack(*divmod(time_ns, NS_PER_S), offset)


def parse_entries(data: bytes, rank: int = 0) -> list[tuple[int, int, int]]:
    """Parse packed index entries. Each becomes a timestamp (ns), the given `rank`, and an offset."""
    return [
        (seconds * NS_PER_S + nanoseconds, rank, offset)
        for seconds, nanoseconds, offset in ENTRY.iter_unpack(data)
    ]


def text_of(value: bytes) -> str:
    """Decode a field as UTF-8, replacing invalid bytes."""
    return value.decode("utf-8", "replace")


def file_header(index_position: int, connections: int, chunks: int, end: int = HEADER_END) -> bytes:
    """Return the file header record for format 2.0, padded up to the byte position `end`."""
    header = field_bytes(
        {
            "op": bytes([Op.FILE_HEADER]),
            "index_pos": U64.pack(index_position),
            "conn_count": U32.pack(connections),
            "chunk_count": U32.pack(chunks),
        }
    )
    padding = end - len(MAGIC) - 8 - len(header)
    return U32.pack(len(header)) + header + U32.pack(padding) + b" " * padding
