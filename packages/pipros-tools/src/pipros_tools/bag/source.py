"""Random access to a file, with errors that name the position."""

from __future__ import annotations

import os
from typing import Protocol

from pipros.bag.errors import BagFormatError
from pipros.bag.records import Fields, parse_fields
from pipros.basics.limits import Limits


class SeekableFile(Protocol):
    """The file methods that are used for reading."""

    def read(self, size: int = ..., /) -> bytes: ...
    def seek(self, offset: int, whence: int = ..., /) -> int: ...


class Source:
    """Random access to a file.

    Attributes:
        name: the file's name, for error messages.
        size: file size in bytes when the source was created or last refreshed.
    """

    def __init__(self, file: SeekableFile, name: str, limits: Limits) -> None:
        self._file = file
        self._limits = limits
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
        """
        self._seek(position, size)
        data = self._file.read(size)
        if len(data) != size:
            raise BagFormatError(f"{self.at(position)}: {size} bytes must follow, got {len(data)}")
        return data

    def read_into(self, buffer: bytearray | memoryview, position: int) -> None:
        """Fill `buffer` with the bytes that start at `position`; see `read` for errors."""
        self._seek(position, len(buffer))
        readinto = getattr(self._file, "readinto", None)
        if readinto is None or readinto(buffer) != len(buffer):
            buffer[:] = self.read(position, len(buffer))

    def _seek(self, position: int, size: int) -> None:
        if size < 0 or position + size > self.size:
            raise BagFormatError(
                f"{self.at(position)}: {size} bytes must follow, got {max(0, self.size - position)}; "
                "the file is truncated or damaged"
            )
        self._file.seek(position)

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
        if size > self._limits.bag_header_bytes:
            raise BagFormatError(
                f"{self.at(position)}: a record's header must be at most {self._limits.bag_header_bytes} "
                f"bytes long, got {size}"
            )
        whole = start if len(start) >= size + 8 else start[:4] + self.read(position + 4, size + 4)
        data_size = int.from_bytes(whole[4 + size : 8 + size], "little")
        return parse_fields(whole[4 : 4 + size], self.at(position)), position + 8 + size, data_size

    def data(self, position: int, size: int) -> bytes:
        """Return the data of a record that is neither a message nor a chunk.

        Raises:
            BagFormatError: the data are truncated, or larger than allowed.
        """
        if size > self._limits.bag_connection_bytes:
            raise BagFormatError(
                f"{self.at(position)}: the record must be at most {self._limits.bag_connection_bytes} "
                f"bytes long, got {size}"
            )
        return self.read(position, size)

    def _start(self, position: int) -> bytes:
        """Read the start of a record in one call, with enough bytes for most headers."""
        if position >= self.size:
            raise BagFormatError(
                f"{self.at(position)}: a record must follow, but the file ends at {self.size}"
            )
        self._file.seek(position)
        return self._file.read(128)
