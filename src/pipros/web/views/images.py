"""Live images: `rqt_image_view`. The browser converts pixels and decodes compressed images."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from typing import Any

from pipros.basics.printable import printable
from pipros.msg import load_message_class
from pipros.node.any_msg import AnyMsg
from pipros.web.known_topic import LONGEST_NAME
from pipros.web.server import RequestRefused
from pipros.web.topic_watch import TopicWatch
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

SEND_INTERVAL_S = 0.1
LARGEST_BYTES = 2_000_000
"""Size above which raw images are subsampled to every second, third, … row and column."""
IMAGE_TYPES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")

BYTES_PER_PIXEL = {
    "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1, "8UC1": 1, "8UC3": 3, "8UC4": 4,
    "mono16": 2, "16UC1": 2, "32FC1": 4,
    "bayer_rggb8": 1, "bayer_bggr8": 1, "bayer_gbrg8": 1, "bayer_grbg8": 1,
    "yuv422": 2, "yuv422_yuy2": 2,
}  # fmt: skip


class ImageViews:
    """The view of the Images tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def image(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the newest image of a topic, at most ten per second: a JSON header, a newline, the pixels."""
        with self._system.topics.watch(topic_name(arguments)) as watch:
            number = -1
            while True:
                newest = watch.newest
                if newest is not None and newest.number != number:
                    number = newest.number
                    head, pixels = await self._system.computations.run(decoded_image, watch, newest.message)
                    yield json.dumps({**head, **watch.figures()}).encode() + b"\n" + pixels
                await asyncio.sleep(SEND_INTERVAL_S)


def decoded_image(watch: TopicWatch, message: AnyMsg) -> tuple[Mapping[str, Any], bytes]:
    """Decode the image in a message. Refuses other types, and definitions other than the installed one."""
    kind = message.header.get("type", "")
    if kind not in IMAGE_TYPES:
        raise RequestRefused(f"topic type must be {' or '.join(IMAGE_TYPES)}, got {printable(kind)}")
    return packed(watch.decode_as(message, load_message_class(kind)))


def packed(message: Any) -> tuple[Mapping[str, Any], bytes]:
    """Encode a `sensor_msgs/Image` or `CompressedImage` for the browser: a header, and the pixels.

    Raises:
        RequestRefused: the encoding is unknown, or pixels are missing.
    """
    if message._type == "sensor_msgs/CompressedImage":
        kind = "png" if "png" in message.format.lower() else "jpeg"
        return {"compressed": kind, "format": message.format[:LONGEST_NAME]}, bytes(message.data)
    size = BYTES_PER_PIXEL.get(message.encoding)
    if size is None:
        known = ", ".join(BYTES_PER_PIXEL)
        raise RequestRefused(f"image encoding must be one of {known}, got {printable(message.encoding)}")
    width, height, step = message.width, message.height, message.step
    if width * size > step or step * height > len(message.data):
        raise RequestRefused(
            f"{width} x {height} pixels of {message.encoding} in rows of {step} bytes "
            f"need {step * height} bytes, got {len(message.data)}"
        )
    every = _step(message.encoding, width * height * size)
    data = memoryview(message.data)
    tops = range(0, height * step, step * every) if width else ()
    pixels = b"".join(_thinned(data[top : top + width * size], size, every) for top in tops)
    head = {
        "encoding": message.encoding,
        "big": bool(message.is_bigendian),
        "width": len(range(0, width, every)),
        "height": len(range(0, height, every)),
        "full": [width, height],
        "frame": message.header.frame_id[:LONGEST_NAME],
    }
    return head, pixels


def _step(encoding: str, size: int) -> int:
    if encoding.startswith(("bayer", "yuv")):  # keep whole groups of neighbouring pixels
        return 1
    every = 1
    while size // every**2 > LARGEST_BYTES:
        every += 1
    return every


def _thinned(row: memoryview, size: int, every: int) -> bytes:
    if every == 1:
        return bytes(row)
    if size == 1:
        return bytes(row[::every])
    return b"".join(row[left : left + size] for left in range(0, len(row), size * every))
