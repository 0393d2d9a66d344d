"""Pure Python decoder for LZ4 frames, for machines without the `lz4` library. It decodes 20 to 35 MB/s.

If the library (`pipros[lz4]`) is installed, it is used instead, and decodes several GB/s. On platforms for
which the library has no wheel, such as 32-bit ARM, installing it requires a compiler. This decoder verifies
checksums. For the format, see https://github.com/lz4/lz4/blob/dev/doc/lz4_Frame_format.md.
"""

from __future__ import annotations

from struct import Struct

from pipros_tools.bag.errors import BagFormatError

_MAGIC = 0x184D2204
_LANES = Struct("<4I")
_P1, _P2, _P3, _P4, _P5 = 2654435761, 2246822519, 3266489917, 668265263, 374761393
_MASK = 0xFFFFFFFF


def decompress_frame(data: bytes, limit_bytes: int, where: str) -> bytes:
    """Return the content of one frame, at most `limit_bytes`.

    Raises:
        BagFormatError: the frame is damaged or truncated, needs a dictionary, or is larger than the limit.
    """
    try:
        return _frame(data, limit_bytes)
    except (ValueError, IndexError) as error:
        raise BagFormatError(f"{where}: the lz4 data are damaged: {error}") from None


def _frame(data: bytes, limit: int) -> bytes:
    if int.from_bytes(data[:4], "little") != _MAGIC:
        raise ValueError("an lz4 frame must begin with its magic number")
    flags, block_byte = data[4], data[5]
    if flags >> 6 != 1:
        raise ValueError(f"the version of an lz4 frame must be 1, got {flags >> 6}")
    if flags & 1:
        raise ValueError("lz4 frames with dictionaries are not supported")
    if not 4 <= block_byte >> 4 & 7 <= 7:
        raise ValueError("the block size code must be from 4 to 7")
    block_limit = 1 << (8 + 2 * (block_byte >> 4 & 7))
    position = 6 + (8 if flags & 8 else 0)
    if xxh32(data[4:position]) >> 8 & 0xFF != data[position]:
        raise ValueError("the header checksum is wrong")
    position += 1
    out = bytearray()
    while size := _u32(data, position):
        position += 4
        is_plain, size = size >> 31, size & 0x7FFFFFFF
        block = data[position : position + size]
        if len(block) < size:
            raise ValueError("truncated")
        position += size
        if flags & 16:
            if xxh32(block) != _u32(data, position):
                raise ValueError("a block checksum is wrong")
            position += 4
        begin = 0 if not flags & 32 else len(out)  # linked blocks may copy from earlier blocks
        left = min(block_limit, limit - len(out))
        if is_plain:
            out += block
        else:
            _block(block, out, begin, len(out) + left)
        if len(out) > limit:
            raise ValueError(f"the content must be at most {limit} bytes long")
    position += 4
    if flags & 4 and xxh32(out) != _u32(data, position):
        raise ValueError("the content checksum is wrong")
    return bytes(out)


def _u32(data: bytes, position: int) -> int:
    if position + 4 > len(data):
        raise ValueError("truncated")
    return int.from_bytes(data[position : position + 4], "little")


def _block(block: bytes, out: bytearray, begin: int, end: int) -> None:
    """Append a decoded block to `out`, up to the position `end`. The block may copy from `out[begin:]`."""
    position, size = 0, len(block)
    while position < size:
        token = block[position]
        position += 1
        literals = token >> 4
        if literals == 15:
            while True:
                more = block[position]
                position += 1
                literals += more
                if more != 255:
                    break
        if position + literals > size:
            raise ValueError("truncated")
        out += block[position : position + literals]
        position += literals
        if position >= size:
            break
        distance = block[position] | block[position + 1] << 8
        position += 2
        length = (token & 15) + 4
        if length == 19:
            while True:
                more = block[position]
                position += 1
                length += more
                if more != 255:
                    break
        start = len(out) - distance
        if not distance or start < begin:
            raise ValueError(f"the distance of a copy must be 1 to {len(out) - begin} bytes, got {distance}")
        if len(out) + length > end:
            raise ValueError("a block has more bytes than allowed")
        if distance >= length:
            out += out[start : start + length]
        else:
            pattern = out[start:]
            out += (pattern * (length // distance + 1))[:length]
    if len(out) > end:
        raise ValueError("a block has more bytes than allowed")


def xxh32(data: bytes | bytearray) -> int:
    """Return the checksum XXH32 with seed 0.

    >>> hex(xxh32(b""))
    '0x2cc5d05'
    """
    size = len(data)
    whole = size & ~15
    if whole:
        a, b, c, d = (_P1 + _P2) & _MASK, _P2, 0, -_P1 & _MASK
        for w, x, y, z in _LANES.iter_unpack(memoryview(data)[:whole]):
            a = (a + w * _P2) & _MASK
            a = ((a << 13 | a >> 19) * _P1) & _MASK
            b = (b + x * _P2) & _MASK
            b = ((b << 13 | b >> 19) * _P1) & _MASK
            c = (c + y * _P2) & _MASK
            c = ((c << 13 | c >> 19) * _P1) & _MASK
            d = (d + z * _P2) & _MASK
            d = ((d << 13 | d >> 19) * _P1) & _MASK
        value = _rotate(a, 1) + _rotate(b, 7) + _rotate(c, 12) + _rotate(d, 18)
    else:
        value = _P5
    value = (value + size) & _MASK
    position = whole
    while position + 4 <= size:
        value = (value + int.from_bytes(data[position : position + 4], "little") * _P3) & _MASK
        value = _rotate(value, 17) * _P4 & _MASK
        position += 4
    for byte in data[position:]:
        value = _rotate((value + byte * _P5) & _MASK, 11) * _P1 & _MASK
    value = (value ^ value >> 15) * _P2 & _MASK
    value = (value ^ value >> 13) * _P3 & _MASK
    return value ^ value >> 16


def _rotate(value: int, bits: int) -> int:
    return (value << bits | value >> 32 - bits) & _MASK
