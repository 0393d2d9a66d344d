"""Random access to a file, with errors that name the position.

Files are read at given positions, without the file's own position, which threads and forked processes share.
"""

from __future__ import annotations

import io
import os
import sys
from threading import Lock
from typing import Protocol

from pipros_tools.bag.errors import BagFormatError, ClosedBag
from pipros_tools.bag.records import Fields, check_header_size, parse_fields

BAG_CONNECTION_BYTES = 16 * 1024 * 1024
"""Limit: a connection header, or the list of a chunk's connections, in a bag. Beyond it, the record is
refused, with its position.
"""


BAG_RECORD_BYTES = 2048 * 1024 * 1024
"""Limit: one message or attachment, or one compressed chunk, in a bag or MCAP file. Beyond it, the record is
refused, with its position.
"""


class SeekableFile(Protocol):
    """The file methods that are used for reading."""

    def read(self, size: int = ..., /) -> bytes: ...
    def seek(self, offset: int, whence: int = ..., /) -> int: ...


_AT_ONCE = 1 << 30
"""Maximum number of bytes that one system call reads. Linux reads at most 2 GiB at once."""


class Source:
    """Random access to a file.

    Threads may share it, and forked processes, if the system has positioned reads (all but Windows) and the
    file is one of the system. Any other file-like object must not be used by anything else.

    Attributes:
        name: the file's name, for error messages.
        size: file size in bytes when the source was created or last refreshed.
    """

    def __init__(self, file: SeekableFile, name: str) -> None:
        self._file = file
        raw = getattr(file, "raw", file)
        self._raw = raw if isinstance(raw, io.FileIO) and hasattr(os, "pread") else None
        self._lock = Lock()
        self.name = name
        self.size = 0
        self.refresh()

    def refresh(self) -> None:
        self.size = self._file.seek(0, os.SEEK_END)

    def at(self, position: int) -> str:
        """Describe a position in the file, for error messages."""
        return f"{self.name}, byte {position}"

    def read(self, position: int, size: int) -> bytes:
        """Return exactly `size` bytes.

        Raises:
            BagFormatError: the file is too short.
            ClosedBag: the file is closed.
        """
        self._check(position, size)
        data = self._read(position, size)
        if len(data) != size:
            raise BagFormatError(f"{self.at(position)}: {size} bytes must follow, got {len(data)}")
        return data

    def read_into(self, buffer: bytearray | memoryview, position: int) -> None:
        """Fill `buffer` with the bytes that start at `position`; see `read` for errors."""
        size, done = len(buffer), 0
        self._check(position, size)
        if self._raw is not None and hasattr(os, "preadv"):
            done = os.preadv(self._descriptor(self._raw), [buffer], position)
        if done < size:
            buffer[done:] = self.read(position + done, size - done)

    def _read(self, position: int, size: int) -> bytes:
        """Return up to `size` bytes; fewer only at the end of the file."""
        if sys.platform == "win32" or self._raw is None:
            with self._lock:
                self._file.seek(position)
                return self._file.read(size)
        data = os.pread(self._descriptor(self._raw), min(size, _AT_ONCE), position)
        if len(data) == size or not data:
            return data
        return data + self._read(position + len(data), size - len(data))

    def _descriptor(self, raw: io.FileIO) -> int:
        try:
            return raw.fileno()
        except ValueError:
            raise ClosedBag(f"{self.name} is closed") from None

    def _check(self, position: int, size: int) -> None:
        if size < 0 or position + size > self.size:
            raise BagFormatError(
                f"{self.at(position)}: {size} bytes must follow, got {max(0, self.size - position)}; "
                "the file is truncated or damaged"
            )
        if size > BAG_RECORD_BYTES:
            raise BagFormatError(
                f"{self.at(position)}: a record must be at most {BAG_RECORD_BYTES} bytes long, got {size}"
            )

    def header(self, position: int) -> tuple[Fields, int, int]:
        """Return the header of the record at `position`, and the position and size of its data.

        The data may be truncated; only their length must be present.

        Raises:
            BagFormatError: there is no valid header.
        """
        start = self._start(position)
        size = int.from_bytes(start[:4], "little")
        if len(start) < 4:
            raise BagFormatError(
                f"{self.at(position)}: the file ends within the length field of a record's header"
            )
        check_header_size(size, self.at(position))
        whole = start if len(start) >= size + 8 else start[:4] + self.read(position + 4, size + 4)
        data_size = int.from_bytes(whole[4 + size : 8 + size], "little")
        return parse_fields(whole[4 : 4 + size], self.at(position)), position + 8 + size, data_size

    def data(self, position: int, size: int) -> bytes:
        """Return the data of a record that is neither a message nor a chunk.

        Raises:
            BagFormatError: the data are truncated, or larger than allowed.
        """
        if size > BAG_CONNECTION_BYTES:
            raise BagFormatError(
                f"{self.at(position)}: the record must be at most {BAG_CONNECTION_BYTES} "
                f"bytes long, got {size}"
            )
        return self.read(position, size)

    def _start(self, position: int) -> bytes:
        """Read the start of a record in one call, with enough bytes for most headers."""
        if position >= self.size:
            raise BagFormatError(
                f"{self.at(position)}: a record must follow, but the file ends at {self.size}"
            )
        return self._read(position, 128)
