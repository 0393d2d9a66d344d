"""Open bags and MCAP files. A file's first bytes determine the reader, and its name determines the writer."""

from __future__ import annotations

import os
from typing import Any

from pipros.basics.input_file import open_file
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.layout import GIT_LFS, IS_POINTER
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.sinks import MessageWriter
from pipros_tools.bag.writer import CHUNK_BYTES, BagWriter

_MCAP = b"\x89MCAP0\r\n"


def open_bag(path: str | os.PathLike[str], *, rebuild_index: bool = False) -> BagReader:
    """Open a bag or MCAP file. Its first bytes determine the format, and thus the reader.

    `rebuild_index` has no effect on MCAP files; see `BagReader`.

    Raises:
        BagError: the file is neither a bag nor MCAP, is damaged, has no index, or needs a library that is not
            installed.
        OSError: the file cannot be read.
    """
    if is_mcap(path):
        from pipros_tools.bag.mcap_files import McapReader

        return McapReader(path)
    return BagReader(path, rebuild_index=rebuild_index)


def is_ros1_bag(path: str | os.PathLike[str]) -> bool:
    """Return whether to open a path as a ROS 1 bag.

    Return False for folders, MCAP files and SQLite databases, which may contain ROS 2 messages, and True for
    all other files.

    Raises:
        OSError: the file cannot be read.
    """
    if os.path.isdir(path) or is_mcap(path):
        return False
    return not _begins(path, b"SQLite")


def check_no_pointer(path: str | os.PathLike[str]) -> None:
    """Raise `BagError` if a file is a pointer of Git LFS, and `OSError` if it cannot be read."""
    if _begins(path, GIT_LFS):
        raise BagError(f"{os.fspath(path)} {IS_POINTER}")


def is_mcap(path: str | os.PathLike[str]) -> bool:
    """Return whether a file starts with MCAP's magic bytes. Raise `OSError` if it cannot be read."""
    return _begins(path, _MCAP)


def _begins(path: str | os.PathLike[str], magic: bytes) -> bool:
    with open_file(path) as file:
        return file.read(len(magic)) == magic


def writer_for(
    path: str | os.PathLike[str], file: Any, *, compression: str = "none", chunk_bytes: int = CHUNK_BYTES
) -> MessageWriter:
    """Return a writer for an open file, in the format determined by `path`, the file's final name.

    Raises:
        BagError: the format needs a library that is not installed, or does not support the compression.
    """
    if os.fspath(path).endswith(".mcap"):
        from pipros_tools.bag.mcap_files import McapWriter

        return McapWriter(file, compression=compression, chunk_bytes=chunk_bytes)
    return BagWriter(file, compression=compression, chunk_bytes=chunk_bytes)
