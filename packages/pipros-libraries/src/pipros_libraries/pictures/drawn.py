"""Draw images, grids, plots, clouds, scans and paths as pictures of at most `SIDE` by `SIDE` pixels.

All pictures are encoded here, so that they contain no text from the sender, such as JPEG comments. Pillow
(`pipros[pictures]`) draws and encodes them.
"""

from __future__ import annotations

import io
import math
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

from pipros.basics.extras import missing
from pipros.basics.printable import printable
from pipros_libraries.pictures.cloud_columns import cloud_columns, point_columns, thinning_step
from pipros_libraries.pictures.compressed import content_of
from pipros_libraries.pictures.encodings import Color
from pipros_libraries.pictures.errors import PictureError
from pipros_libraries.pictures.image_message import encoding_of

try:
    from PIL import Image, ImageDraw
except ImportError as error:
    raise missing("drawings need Pillow", "pictures", error) from error

if TYPE_CHECKING:
    from nav_msgs.msg import OccupancyGrid, Path
    from sensor_msgs.msg import CompressedImage, LaserScan, PointCloud, PointCloud2

SIDE: Final = 768
"""Maximum width and height of a picture."""
POINTS: Final = 60_000
"""Maximum number of points that are drawn."""
_MARGIN = 40
_COLOURS = ((31, 119, 180), (214, 39, 40), (44, 160, 44), (255, 127, 14), (148, 103, 189), (23, 190, 207))
_LUMA: Final = {Color.YUV422: 1, Color.YUV422_YUY2: 0}
"""Offset of the first luma byte in a row."""
_CODES: Final = {"8S": "b", "16U": "H", "16S": "h", "32S": "i", "32F": "f", "64F": "d"}
_FAR_M: Final = 1e6
"""Points with larger or non-finite coordinates are left out."""


@dataclass(frozen=True, slots=True)
class EncodedPicture:
    """A picture file that was encoded by this module. It contains no text from the sender.

    Attributes:
        kind: its media type.
    """

    content: bytes
    kind: str


Drawn = tuple[EncodedPicture, str, Mapping[str, Any]]
_Picture = tuple[Image.Image, str, Mapping[str, Any]]
Line = Sequence[tuple[float, float]]


def picture_of(message: Any, limit_pixels: int, limit_bytes: int) -> Drawn:
    """Return a picture of a message, a note that explains it, and facts about the message.

    Args:
        limit_pixels: maximum number of pixels of an image, or of cells of a grid.
        limit_bytes: maximum size of the encoded picture.

    Raises:
        PictureError: the message's type cannot be drawn, or the message is malformed or too large.
    """
    drawers: Mapping[str, Callable[[Any, int], _Picture]] = {
        "sensor_msgs/Image": _image,
        "sensor_msgs/CompressedImage": _compressed,
        "sensor_msgs/PointCloud": _cloud,
        "sensor_msgs/PointCloud2": _cloud,
        "sensor_msgs/LaserScan": _scan,
        "nav_msgs/OccupancyGrid": _grid,
        "nav_msgs/Path": _path,
    }
    drawer = drawers.get(message._type)
    if drawer is None:
        raise PictureError(f"cannot draw messages of the type {message._type}")
    image, note, facts = drawer(message, limit_pixels)
    return encoded(image, limit_bytes), note, {"frame": message.header.frame_id, **facts}


def encoded(image: Image.Image, limit_bytes: int) -> EncodedPicture:
    """Encode a picture as PNG, or as JPEG if the PNG is too large. Shrink the picture until it fits."""
    image.thumbnail((SIDE, SIDE))
    while True:
        for kind, options in (("png", {}), ("jpeg", {"quality": 85}), ("jpeg", {"quality": 60})):
            file = io.BytesIO()
            pixels = image if kind == "png" or image.mode in ("L", "RGB") else image.convert("RGB")
            pixels.save(file, kind.upper(), **options)
            if file.tell() <= limit_bytes:
                return EncodedPicture(file.getvalue(), f"image/{kind}")
        image = image.resize((max(image.width * 3 // 4, 1), max(image.height * 3 // 4, 1)))


def plot(lines: Mapping[str, Line], limit_bytes: int) -> EncodedPicture:
    """Draw curves over time. The axes show numbers but no names; see `colours` for each curve's colour."""
    points = [point for line in lines.values() for point in line]
    left, right = _range(x for x, _ in points)
    low, high = _range(y for _, y in points)
    image = Image.new("RGB", (SIDE, SIDE * 9 // 16), "white")
    draw = ImageDraw.Draw(image)
    width, height = image.width - 2 * _MARGIN, image.height - 2 * _MARGIN

    def place(x: float, y: float) -> tuple[float, float]:
        return (
            _MARGIN + (x - left) / (right - left) * width,
            image.height - _MARGIN - (y - low) / (high - low) * height,
        )

    draw.rectangle((_MARGIN, _MARGIN, image.width - _MARGIN, image.height - _MARGIN), outline="gray")
    draw.text((2, _MARGIN), f"{high:.5g}", "black")
    draw.text((2, image.height - _MARGIN - 10), f"{low:.5g}", "black")
    draw.text((_MARGIN, image.height - _MARGIN + 5), f"{left:.5g} s", "black")
    draw.text((image.width - 2 * _MARGIN, image.height - _MARGIN + 5), f"{right:.5g} s", "black")
    for number, line in enumerate(lines.values()):
        colour = _COLOURS[number % len(_COLOURS)]
        placed = [place(x, y) for x, y in line]
        if len(placed) == 1:
            draw.ellipse((placed[0][0] - 2, placed[0][1] - 2, placed[0][0] + 2, placed[0][1] + 2), colour)
        draw.line(placed, colour, 2)
    return encoded(image, limit_bytes)


def colours(names: Iterable[str]) -> dict[str, str]:
    """Return the colour in which `plot` draws each curve, as `#rrggbb`."""
    return {name: "#%02x%02x%02x" % _COLOURS[at % len(_COLOURS)] for at, name in enumerate(names)}  # noqa: UP031


def _range(values: Iterable[float]) -> tuple[float, float]:
    found = [each for each in values if math.isfinite(each)]
    low, high = (min(found), max(found)) if found else (0.0, 0.0)
    return (low, high) if high > low else (low - max(abs(low) * 1e-3, 0.5), low + max(abs(low) * 1e-3, 0.5))


def _image(message: Any, limit_pixels: int) -> _Picture:
    found = encoding_of(message)
    width, height = message.width, message.height
    if not width or not height or width * height > limit_pixels:
        raise PictureError(f"the image must have 1 to {limit_pixels} pixels, got {width} x {height}")
    facts = {"size": [width, height], "encoding": message.encoding}
    every = max(max(width, height) // SIDE, 1)
    is_colour = found.color in (Color.RGB, Color.BGR, Color.RGBA, Color.BGRA)
    if found.depth != "8U" and is_colour:
        raise PictureError(f"cannot show images with the encoding [{printable(message.encoding)}]")
    size = found.channels * found.bits // 8
    data = memoryview(message.data)
    tops = range(0, height * message.step, message.step * every)
    rows = [bytes(data[top : top + width * size]) for top in tops]
    if found.color in _LUMA:
        rows = [row[_LUMA[found.color] :: 2] for row in rows]
    shape = (len(range(0, width, every)), len(rows))
    if found.depth != "8U":
        code = f"{'>' if message.is_bigendian else '<'}{width}{_CODES[found.depth]}"
        values = [value for row in rows for value in struct.unpack(code, row)[::every]]
        low, high = _range(values)
        grey = bytes(_byte(value, low, high) for value in values)
        return (
            Image.frombytes("L", shape, grey),
            "The minimum is black, the maximum is white.",
            {
                **facts,
                "darkest": low,
                "brightest": high,
            },
        )
    if not is_colour:  # grey images, and Bayer patterns and YUV, which are shown in grey
        return Image.frombytes("L", shape, b"".join(row[::every] for row in rows)), "", facts
    order = (0, 1, 2) if found.color in (Color.RGB, Color.RGBA) else (2, 1, 0)
    planes = [b"".join(row[at :: size * every] for row in rows) for at in order]
    return Image.merge("RGB", [Image.frombytes("L", shape, plane) for plane in planes]), "", facts


def _compressed(message: CompressedImage, limit_pixels: int) -> _Picture:
    try:
        picture = content_of(message.format, bytes(message.data))
        with Image.open(io.BytesIO(picture), formats=("JPEG", "PNG")) as file:
            size = file.size
            if size[0] * size[1] > limit_pixels:
                shown = f"{size[0]} x {size[1]}"
                raise PictureError(f"the image must have at most {limit_pixels} pixels, got {shown}")
            file.draft("RGB", (SIDE, SIDE))
            if file.mode.startswith("I"):
                deep = file.convert("F")
                low, high = _range(cast("tuple[float, float]", deep.getextrema()))
                scale = 255 / (high - low)
                image = deep.point(lambda value: value * scale - low * scale).convert("L")
            else:
                image = file.convert("L" if file.mode in ("1", "L") else "RGB")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise PictureError(f"cannot decode the image: {error}") from None
    return image, "", {"size": list(size), "format": message.format}


def _cloud(message: PointCloud | PointCloud2, _limit: int) -> _Picture:
    columns = cloud_columns if message._type.endswith("2") else point_columns
    found = columns(message, (), POINTS)
    if found.problem:
        raise PictureError(f"cannot show the cloud: {found.problem}")
    xs, ys, zs = ([value for (value,) in struct.iter_unpack("<f", each.data)] for each in found.columns)
    return _from_above(zip(xs, ys, zs, strict=True), {"points": found.count, "shown_points": len(xs)})


def _scan(message: LaserScan, _limit: int) -> _Picture:
    ranges = message.ranges
    step = thinning_step(len(ranges), POINTS)

    def points() -> Iterator[tuple[float, float, float]]:
        for at in range(0, len(ranges), step):
            if message.range_min <= ranges[at] <= message.range_max:
                angle = message.angle_min + at * message.angle_increment
                if math.isfinite(angle):
                    yield ranges[at] * math.cos(angle), ranges[at] * math.sin(angle), 0.0

    return _from_above(points(), {"points": len(ranges)})


def _path(message: Path, _limit: int) -> _Picture:
    positions = [each.pose.position for each in message.poses[:: thinning_step(len(message.poses), POINTS)]]
    points = [(each.x, each.y, each.z) for each in positions]
    return _from_above(points, {"poses": len(message.poses)}, is_line=True)


def _from_above(
    points: Iterable[tuple[float, float, float]], facts: Mapping[str, object], *, is_line: bool = False
) -> _Picture:
    kept = [point for point in points if all(math.isfinite(each) and abs(each) < _FAR_M for each in point)]
    (left, right), (low, high), (bottom, top) = map(_range, zip((0.0, 0.0, 0.0), *kept, strict=True))
    scale = (SIDE - 1) / max(right - left, high - low)
    image = Image.new("RGB", (int((high - low) * scale) + 1, int((right - left) * scale) + 1), "black")
    draw = ImageDraw.Draw(image)
    if is_line:
        draw.line([((high - y) * scale, (right - x) * scale) for x, y, _ in kept], "white", 2)
    radius = 2 if len(kept) < 2000 else 1 if len(kept) < 20_000 else 0
    for x, y, z in kept:  # in the picture, x points up and y points left
        share = int(255 * (z - bottom) / (top - bottom))
        across, down = (high - y) * scale, (right - x) * scale
        colour = (share, 255 - abs(2 * share - 255), 255 - share)
        draw.rectangle((across - radius, down - radius, across + radius, down + radius), colour)
    place = (high * scale, right * scale)
    draw.ellipse((place[0] - 3, place[1] - 3, place[0] + 3, place[1] + 3), outline="white")
    note = "From above: x points up, y left. The circle is the origin; colours show z from blue to red."
    return image, note, {**facts, "x_m": [left, right], "y_m": [low, high], "z_m": [bottom, top]}


def _grid(message: OccupancyGrid, limit_pixels: int) -> _Picture:
    width, height = message.info.width, message.info.height
    if not width or not height or width * height != len(message.data) or width * height > limit_pixels:
        raise PictureError(
            f"the grid must have 1 to {limit_pixels} cells, and as many values, "
            f"got {width} x {height} cells and {len(message.data)} values"
        )
    every = max(max(width, height) // SIDE, 1)
    shades = bytes(_shade(value) for value in range(-128, 128))
    rows = []
    for top in reversed(range(0, height, every)):
        cells = message.data[top * width : (top + 1) * width : every]
        rows.append(bytes(shades[cell + 128] for cell in cells))
    origin = message.info.origin.position
    facts = {
        "cells": [width, height],
        "resolution_m": message.info.resolution,
        "origin_m": [origin.x, origin.y],
    }
    image = Image.frombytes("L", (len(rows[0]), len(rows)), b"".join(rows))
    return image, "White is free, black is occupied, grey is unknown. x points to the right, y up.", facts


def _shade(value: int) -> int:
    return 255 - value * 255 // 100 if 0 <= value <= 100 else 128


def _byte(value: float, low: float, high: float) -> int:
    return int(255 * (value - low) / (high - low)) if math.isfinite(value) else 0
