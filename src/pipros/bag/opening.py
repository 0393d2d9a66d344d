"""Opens bags and MCAP files: readers by a file's first bytes, writers by its name."""

from __future__ import annotations

import os
from typing import Any

from pipros.bag.reader import BagReader
from pipros.bag.writer import CHUNK_BYTES, BagWriter, MessageWriter

_MCAP = b"\x89MCAP0\r\n"


def open_bag(path: str | os.PathLike[str], *, rebuild_index: bool = False) -> BagReader:
    """The reader for a file, chosen by its first bytes.

    Raises:
        BagError: the file is neither, is damaged, or needs a library that is not installed.
        OSError: it cannot be read.
    """
    if is_mcap(path):
        from pipros.bag.mcap_files import McapReader

        return McapReader(path)
    return BagReader(path, rebuild_index=rebuild_index)


def is_mcap(path: str | os.PathLike[str]) -> bool:
    """True for a file that begins as MCAP files do. Raises `OSError` if it cannot be read."""
    with open(path, "rb") as file:
        return file.read(len(_MCAP)) == _MCAP


def writer_for(
    path: str | os.PathLike[str], file: Any, *, compression: str = "none", chunk_bytes: int = CHUNK_BYTES
) -> MessageWriter:
    """A writer into an open file, chosen by the name that the file will have.

    Raises:
        BagError: it needs a library that is not installed, or does not support the compression.
    """
    if os.fspath(path).endswith(".mcap"):
        from pipros.bag.mcap_files import McapWriter

        return McapWriter(file, compression=compression, chunk_bytes=chunk_bytes)
    return BagWriter(file, compression=compression, chunk_bytes=chunk_bytes)
