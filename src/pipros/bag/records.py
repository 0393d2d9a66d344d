"""Records of bags, format 2.0 and 1.2: bytes to fields and back (http://wiki.ros.org/Bags/Format/2.0).

A record is a header and data, each after its length in four bytes. A header is a run of fields, each after
its length: `name=value`, where values are bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from struct import Struct

from pipros.bag.errors import BagFormatError

MAGIC = b"#ROSBAG V2.0\n"
FILE_HEADER_BYTES = 4096
"""Header and data of the file header record have this size, so that it can be rewritten when there is an
index."""

U32 = Struct("<I")
U64 = Struct("<Q")
TIME = Struct("<II")

Fields = dict[str, bytes]


class Op(IntEnum):
    """The kind of a record: its field `op`."""

    MESSAGE_DEFINITION = 1  # of format 1.2 only
    MESSAGE = 2
    FILE_HEADER = 3
    INDEX = 4
    CHUNK = 5
    CHUNK_INFO = 6
    CONNECTION = 7


@dataclass(frozen=True, slots=True)
class Version:
    """The version of a file's format: 2.0 is `Version(2, 0)`, 200 as a number."""

    major: int
    minor: int

    @property
    def number(self) -> int:
        return self.major * 100 + self.minor


def parse_version(line: bytes) -> Version | None:
    """The version in the first line of a file, or None if it is not a bag.

    >>> parse_version(b"#ROSBAG V2.0")
    Version(major=2, minor=0)
    """
    for prefix in (b"#ROSBAG V", b"#ROSRECORD V"):
        if line.startswith(prefix):
            major, dot, minor = line[len(prefix) :].rstrip(b"\r").partition(b".")
            if dot and major.isdigit() and minor.isdigit() and len(major) < 6 and len(minor) < 6:
                return Version(int(major), int(minor))
    return None


def parse_fields(header: bytes, where: str) -> Fields:
    """The fields of a header.

    Raises:
        BagFormatError: a field is longer than the header, or has no name.
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
                f"{where}: a field must fit into its header, got {size} bytes where {end - position} are left"
            )
        name, equals, value = header[position : position + size].partition(b"=")
        if not equals:
            raise BagFormatError(f"{where}: a header field must have the form name=value, got {name[:40]!r}")
        fields[name.decode("utf-8", "replace")] = value
        position += size
    return fields


def field_bytes(fields: Mapping[str, bytes] | Iterable[tuple[str, bytes]]) -> bytes:
    """The bytes of fields in a header."""
    pairs = fields.items() if isinstance(fields, Mapping) else fields
    parts: list[bytes] = []
    for name, value in pairs:
        encoded = name.encode()
        parts += (U32.pack(len(encoded) + 1 + len(value)), encoded, b"=", value)
    return b"".join(parts)


def record_bytes(fields: Mapping[str, bytes], data: bytes) -> bytes:
    """A whole record."""
    header = field_bytes(fields)
    return b"".join((U32.pack(len(header)), header, U32.pack(len(data)), data))


def op_of(fields: Fields, where: str) -> int:
    """The field `op`.

    Raises:
        BagFormatError: it is missing, or is not one byte.
    """
    return number(fields, "op", 1, where)


def number(fields: Fields, name: str, size: int, where: str) -> int:
    """The unsigned number of `size` bytes in a field.

    Raises:
        BagFormatError: the field is missing, or has another size.
    """
    value = fields.get(name)
    if value is None:
        raise BagFormatError(f"{where}: the field [{name}] is missing")
    if len(value) != size:
        raise BagFormatError(f"{where}: the field [{name}] must have {size} bytes, got {len(value)}")
    return int.from_bytes(value, "little")


def time_of(fields: Fields, name: str, where: str) -> tuple[int, int]:
    """Seconds and nanoseconds of a field.

    Raises:
        BagFormatError: the field is missing, or does not have 8 bytes.
    """
    both = number(fields, name, 8, where)
    return both & 0xFFFFFFFF, both >> 32


def text_of(value: bytes) -> str:
    """A field as text; bytes that are not UTF-8 are replaced."""
    return value.decode("utf-8", "replace")


def file_header(index_position: int, connections: int, chunks: int) -> bytes:
    """The file header record of format 2.0, padded to its fixed size."""
    header = field_bytes(
        {
            "op": bytes([Op.FILE_HEADER]),
            "index_pos": U64.pack(index_position),
            "conn_count": U32.pack(connections),
            "chunk_count": U32.pack(chunks),
        }
    )
    padding = FILE_HEADER_BYTES - len(header)
    return U32.pack(len(header)) + header + U32.pack(padding) + b" " * padding
