"""Contents of `sensor_msgs/CompressedImage` messages: picture files, or depths after a header of 12 bytes."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from pipros.basics.extras import required
from pipros.basics.printable import printable
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.headers import PNG

if TYPE_CHECKING:
    from pipros_libraries.pictures.codecs import Codec

DEPTH_HEADER = struct.Struct("<iff")
"""Header of a compressed depth image: format, quotient and offset of the quantised inverse depths."""
_JPEG = b"\xff\xd8"
_KINDS = (
    (_JPEG, ".jpg"),
    (PNG, ".png"),
    (b"II*\0", ".tiff"),
    (b"MM\0*", ".tiff"),
    (b"BM", ".bmp"),
    (b"GIF8", ".gif"),
    (b"\0\0\0\x0cjP  ", ".jp2"),
    (b"\xff\x4f\xff\x51", ".j2k"),
    (b"\x76\x2f\x31\x01", ".exr"),
    (b"P5", ".pgm"),
    (b"P6", ".ppm"),
)
_ENDS = {".jpg": b"\xff\xd9", ".png": b"IEND"}
_TAIL_BYTES = 65_536
"""Maximum number of bytes after the end of a picture, such as the padding of some cameras."""


def is_depth(format_text: str) -> bool:
    """Return whether the field `format` is that of compressed_depth_image_transport."""
    return "compressedDepth" in format_text.partition(";")[2]


def content_of(format_text: str, data: bytes) -> bytes:
    """Return the picture file in a message. In depth images, it follows the header.

    Raises:
        PictureError: there is no picture, or it is compressed with RVL.
    """
    if not is_depth(format_text):
        if not data:
            raise PictureError("the image is empty")
        return data
    if len(data) <= DEPTH_HEADER.size:
        raise PictureError(f"a compressed depth image must have more than 12 bytes, got {len(data)}")
    if "rvl" in format_text.lower():
        raise PictureError("compressed depth images must be in PNG format, not RVL")
    return data[DEPTH_HEADER.size :]


def suffix_of(picture: bytes) -> str:
    """Return the suffix for a picture file, which its first bytes determine.

    Raises:
        PictureError: the format is unknown.
    """
    for start, suffix in _KINDS:
        if picture.startswith(start):
            return suffix
    if picture.startswith(b"RIFF") and picture[8:12] == b"WEBP":
        return ".webp"
    if picture[4:8] == b"ftyp" and picture[8:12] in (b"avif", b"heic"):
        return f".{picture[8:12].decode()}"
    raise PictureError(f"the image begins like no known format: {picture[:8].hex(' ')}")


def check_complete(picture: bytes) -> None:
    """Raise `PictureError` if a JPEG or PNG picture lacks its end."""
    suffix = suffix_of(picture)
    if suffix in _ENDS and _ENDS[suffix] not in picture[-_TAIL_BYTES:]:
        raise PictureError(f"the {suffix[1:]} image of {len(picture)} bytes is cut: its end is missing")


def pixels_of(format_text: str, data: bytes, codec: Codec) -> Any:
    """Decode a message to an array; colours are in the order blue, green, red.

    Depths of 16UC1 are unchanged. Those of 32FC1 are in metres, computed from quantised inverse depths; 0 is
    NaN.

    Raises:
        PictureError: the data are not a valid picture, or do not match the format.
    """
    np = required("numpy", "compressed images need numpy", "numpy")
    pixels = codec.decode(content_of(format_text, data))
    if not is_depth(format_text):
        return pixels
    name = format_text.partition(";")[0].strip()
    if pixels.ndim != 2:
        raise PictureError(f"a depth image must have one channel, got {pixels.shape[2]}")
    if name in ("16UC1", "mono16"):
        return pixels.astype(np.uint16)
    if name != "32FC1":
        raise PictureError(f"a compressed depth image must be 16UC1 or 32FC1, got [{printable(name)}]")
    _, quotient, offset = DEPTH_HEADER.unpack_from(data)
    with np.errstate(divide="ignore", invalid="ignore"):
        depths = np.float32(quotient) / (pixels.astype(np.float32) - np.float32(offset))
    return np.where(pixels == 0, np.float32(np.nan), depths)
