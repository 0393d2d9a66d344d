"""The definitions that a bag carries with its messages (http://wiki.ros.org/Bags/Format/2.0)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from pipros.cli.program import CommandError

MAGIC = b"#ROSBAG V2.0\n"
OP_BAG_HEADER = b"\x03"
OP_CONNECTION = b"\x07"

RECORD_LIMIT_BYTES = 16 * 1024 * 1024
"""No connection record is larger; one that claims to be is broken."""


def bag_definitions(path: Path) -> dict[str, str]:
    """The full text of every message type in a bag, by type name.

    Raises:
        CommandError: the file does not exist, is not a bag, or was not closed and has no index.
    """
    if not path.is_file():
        raise CommandError(f"bag file [{path}] does not exist")
    with path.open("rb") as file:
        try:
            return dict(_definitions(file, path))
        except EOFError:
            raise CommandError(f"bag file [{path}] is cut off") from None


def _definitions(file: BinaryIO, path: Path) -> Iterator[tuple[str, str]]:
    if file.read(len(MAGIC)) != MAGIC:
        raise CommandError(f"[{path}] is not a bag file of version 2.0")
    header, _ = _record(file)
    position = int.from_bytes(header.get(b"index_pos", b""), "little")
    if header.get(b"op") != OP_BAG_HEADER or not position:
        raise CommandError(f"bag file [{path}] has no index. Run rosbag reindex")
    file.seek(position)
    while True:
        header, data = _record(file)
        if header.get(b"op") != OP_CONNECTION:
            return
        fields = _fields(data)
        text = fields.get(b"message_definition", b"").decode("utf-8", "replace")
        yield fields.get(b"type", b"").decode("utf-8", "replace"), text


def _record(file: BinaryIO) -> tuple[dict[bytes, bytes], bytes]:
    """The header and the data of the next record; both empty at the end of the file."""
    start = file.read(4)
    if not start:
        return {}, b""
    header = _exactly(file, int.from_bytes(start, "little"))
    return _fields(header), _exactly(file, int.from_bytes(_exactly(file, 4), "little"))


def _fields(data: bytes) -> dict[bytes, bytes]:
    fields: dict[bytes, bytes] = {}
    while data:
        length = int.from_bytes(data[:4], "little")
        name, _, value = data[4 : 4 + length].partition(b"=")
        fields[name] = value
        data = data[4 + length :]
    return fields


def _exactly(file: BinaryIO, size: int) -> bytes:
    if size > RECORD_LIMIT_BYTES:
        raise EOFError
    data = file.read(size)
    if len(data) < size:
        raise EOFError
    return data
