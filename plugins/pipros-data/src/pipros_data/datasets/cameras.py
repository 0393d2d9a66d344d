"""Read the pictures of a camera one by one, and write them as a video."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.safe.settings import BadSettings
from pipros_data.datasets.signals import RecordedTopic, batches, recorded, times_of
from pipros_data.extras import library
from pipros_libraries.pictures.encodings import COLORS
from pipros_libraries.pictures.errors import PictureError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros_data.bags import Bags
    from pipros_data.datasets.config import CameraSource

DATASET_PIXELS = 64 * 1024 * 1024
"""Maximum number of pixels in a picture of a data set. Beyond it, `pipros dataset` counts the picture as
damaged.
"""

_FORMATS = {"rgb8": "rgb24", "bgr8": "bgr24", "rgba8": "rgba", "bgra8": "bgra", "mono8": "gray"}
_FORMATS |= {name: name for name in COLORS if name.startswith("bayer") and name.endswith("8")}

Picture = Any
"""The bytes of a JPEG or PNG picture, or an `av.VideoFrame`."""


def read_times(bags: Bags, source: CameraSource, start: int, end: int) -> RecordedTopic:
    """Return the times of a camera's messages, with checksums of the pictures as values.

    An uncompressed picture that is damaged is left out and reported as a bad message, as if it was lost.

    Raises:
        BadSettings: the description does not fit the bag.
        PictureError: all pictures are damaged, or have an encoding that is not supported.
    """
    sums: list[float] = []
    times = []
    reason = ""
    for table in batches(bags, source, start, end):
        if table.type not in ("sensor_msgs/Image", "sensor_msgs/CompressedImage"):
            raise BadSettings(
                f"{source.place}.topic: must be sensor_msgs/Image or CompressedImage, got {table.type}"
            )
        if source.store == "jpeg" and table.type == "sensor_msgs/Image":
            raise BadSettings(f"{source.place}.store: jpeg needs CompressedImage. Use store: video")
        for row, cell in enumerate(table["data"]):
            damage = "" if "encoding" not in table else damage_of(table, row)
            if damage and bags.on_bad_message is not None:
                bags.on_bad_message(table.topic, damage)
            reason = damage or reason
            sums.append(zlib.crc32(cell) if not damage else math.nan)
        times.append(times_of(table, source))
    found = recorded(times, np.array(sums, np.float64).reshape(-1, 1), ("picture",))
    is_good = ~np.isnan(found.values[:, 0])
    if reason and not is_good.any():
        raise PictureError(reason)
    return replace(found, times=found.times[is_good], values=found.values[is_good], rows=found.rows[is_good])


def damage_of(table: Any, row: int) -> str:
    """Return why an uncompressed picture cannot be used; empty if it can."""
    kind = table["encoding"][row]
    if kind not in _FORMATS:
        return f"the encoding on {table.topic} must be one of {', '.join(_FORMATS)}, got {kind}"
    try:
        return "" if table["_image"][row].size else "a picture has no pixels"
    except PictureError as error:
        return str(error)


def pictures(
    bags: Bags, source: CameraSource, start: int, end: int, wanted: NDArray[np.int64]
) -> Iterator[Picture]:
    """Yield the pictures of the messages with the indices `wanted`, which must be sorted and may repeat.

    The pictures must be among those of `read_times`.
    """
    at = done = 0
    for table in batches(bags, source, start, end):
        last: tuple[int, Picture] = (-1, None)
        while at < len(wanted) and wanted[at] < done + table.rows:
            number = int(wanted[at])
            if number != last[0]:
                last = number, picture_of(table, number - done)
            yield last[1]
            at += 1
        done += table.rows


def picture_of(table: Any, row: int) -> Picture:
    if "encoding" not in table:
        return table["data"][row]
    pixels = np.ascontiguousarray(table["_image"][row])
    return library("av", "a picture").VideoFrame.from_ndarray(pixels, format=_FORMATS[table["encoding"][row]])


def decoded(picture: Picture) -> Any:
    """Decode a picture. Return None if it is damaged, too large, or neither JPEG nor PNG."""
    if not isinstance(picture, bytes):
        return picture
    av = library("av", "a picture")
    codec = av.CodecContext.create("png" if picture.startswith(b"\x89PNG") else "mjpeg", "r")
    codec.thread_count = 1
    codec.options = {"max_pixels": str(DATASET_PIXELS)}
    try:
        return codec.decode(av.Packet(picture))[0]
    except (av.FFmpegError, IndexError):
        return None


def steady(found: Iterator[Picture], broken: list[Picture]) -> Iterator[Any]:
    """Yield a frame for each picture. Damaged pictures are appended to `broken`.

    A damaged picture is replaced by the previous frame or, at the start, by the first valid frame.

    Raises:
        PictureError: no picture is valid.
    """
    waiting, last = 0, None
    for picture in found:
        frame = decoded(picture)
        if frame is None:
            broken.append(picture)
        last = last if frame is None else frame
        waiting += 1
        if last is not None:
            yield from repeat(last, waiting)
            waiting = 0
    if last is None:
        raise PictureError("the episode has no valid picture")


def write_video(file: object, found: Iterator[Picture], rate: float, threads: int) -> int:
    """Write pictures as a video: H.264 in MP4, with the preset `fast`. Return the number of damaged pictures.

    Sizes are rounded down to even numbers. All pictures are scaled to the size of the first one.
    """
    broken: list[Picture] = []
    stream: Any = None
    ticks = Fraction(rate).limit_denominator(100_000)
    with library("av", "a video").open(file, "w", format="mp4") as container:
        for number, frame in enumerate(steady(found, broken)):
            if stream is None:
                stream = container.add_stream("libx264", rate=ticks, options={"preset": "fast"})
                stream.width, stream.height = max(frame.width & ~1, 2), max(frame.height & ~1, 2)
                stream.pix_fmt, stream.thread_count = "yuv420p", threads
            size = (stream.width, stream.height, "yuv420p")
            scaled = frame.reformat(*size, src_color_range="JPEG", dst_color_range="MPEG")
            scaled.pts, scaled.time_base = number, 1 / ticks
            container.mux(stream.encode(scaled))
        container.mux(stream.encode(None))
    return len(broken)
