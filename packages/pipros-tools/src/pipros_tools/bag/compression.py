"""Chunk compression: none, bz2 and lz4. For MCAP files, zstd can also be read.

Writing lz4 needs the `lz4` library (`pipros[lz4]`). Without this library, lz4 chunks are decompressed by
`lz4_frame.py`, which is slower.
"""

from __future__ import annotations

import bz2
from typing import Any

from pipros.basics.extras import install_command
from pipros_tools.bag.errors import BagError, BagFormatError

NONE, BZ2, LZ4 = "none", "bz2", "lz4"
COMPRESSIONS = (NONE, BZ2, LZ4)
ZSTD = "zstd"

_BZ2_BLOCK_BYTES = 8192
"""Size of the input of one call of a decompressor. After a stream, it copies what is left of the input."""


def has_lz4() -> bool:
    """Return whether chunks can be written with lz4."""
    return _lz4() is not None


def compress(compression: str, data: bytes | memoryview) -> bytes | memoryview:
    """Return the compressed data of a chunk.

    Raises:
        BagError: the compression is unknown, or the lz4 library is not installed.
    """
    if compression == NONE:
        return data
    if compression == BZ2:
        return bz2.compress(data)
    if compression != LZ4:
        raise BagError(f"compression must be one of {', '.join(COMPRESSIONS)}, got [{compression}]")
    library = _lz4()
    if library is None:
        raise BagError(
            f"writing lz4 needs the lz4 library, which is not installed. Try: {install_command('lz4')}"
        )
    packed: bytes = library.compress(
        data, block_size=library.BLOCKSIZE_MAX4MB, block_linked=False, content_checksum=True, store_size=False
    )
    return packed


def decompress(compression: str, data: bytes, size: int, where: str) -> bytes:
    """Return a chunk's decompressed data, which must be `size` bytes long.

    Decompression stops once the data exceed `size`, so that memory is bounded.

    Raises:
        BagError: the compression is zstd, and the zstandard library is not installed.
        BagFormatError: the compression is unknown, or the data are damaged or have a different size.
    """
    if compression == NONE:
        plain = data
    elif compression == BZ2:
        plain = _decompress_bz2(data, size, where)
    elif compression == LZ4:
        plain = _decompress_lz4(data, size, where)
    elif compression == ZSTD:
        plain = _decompress_zstd(data, size, where)
    else:
        raise BagFormatError(
            f"{where}: compression must be one of {', '.join(COMPRESSIONS)}, got [{compression}]"
        )
    if len(plain) != size:
        raise BagFormatError(f"{where}: the chunk must be {size} bytes long, got {len(plain)}")
    return plain


def _decompress_bz2(data: bytes, size: int, where: str) -> bytes:
    parts, left, at, begin = [], size, 0, size
    reader = bz2.BZ2Decompressor()
    while at < len(data) and left >= 0:
        block = data[at : at + _BZ2_BLOCK_BYTES]
        try:
            part = reader.decompress(block, left + 1)
        except (OSError, ValueError, EOFError) as error:
            raise BagFormatError(f"{where}: the bz2 data are damaged: {error}") from None
        parts.append(part)
        left -= len(part)
        at += len(block)
        if reader.eof:
            at -= len(reader.unused_data)
            if left == begin and at < len(data):
                raise BagFormatError(f"{where}: the bz2 data are damaged: a stream before the last is empty")
            reader, begin = bz2.BZ2Decompressor(), left
    return b"".join(parts)


def _decompress_lz4(data: bytes, size: int, where: str) -> bytes:
    library = _lz4()
    if library is None:
        from pipros_tools.bag.lz4_frame import decompress_frame

        return decompress_frame(data, size, where)
    try:
        # Request one byte more than allowed, to detect data that are too long.
        plain: bytes = library.LZ4FrameDecompressor().decompress(data, size + 1)
    except (RuntimeError, ValueError, EOFError, MemoryError) as error:
        raise BagFormatError(f"{where}: the lz4 data are damaged: {error}") from None
    return plain


def _decompress_zstd(data: bytes, size: int, where: str) -> bytes:
    try:
        import zstandard  # installed together with the mcap library
    except ImportError:
        raise BagError(
            f"{where}: reading zstd chunks needs the zstandard library, which is not installed. "
            f"Try: {install_command('mcap')}"
        ) from None
    try:
        claimed = zstandard.get_frame_parameters(data).content_size
        if claimed not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise BagFormatError(f"{where}: the chunk must be {size} bytes long, got {claimed}")
        plain: bytes = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except (zstandard.ZstdError, MemoryError) as error:
        raise BagFormatError(f"{where}: the zstd data are damaged: {error}") from None
    return plain


def _lz4() -> Any:
    """Return the `lz4.frame` module, or None if it is not installed."""
    try:
        import lz4.frame
    except ImportError:
        return None
    return lz4.frame
