"""Small pictures of messages: images, laser scans, maps and paths, for a topic's panel."""

from __future__ import annotations

import base64
import itertools
import json
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros_libraries.pictures.image_message import IMAGE_TYPES
from pipros_page.images.pixels import packed

MAX_POINTS: Final = 720
MAX_CELLS: Final = 160
"""Maximum number of cells of a map along each side."""
IMAGE_BYTES: Final = 60_000
COMPRESSED_BYTES: Final = 300_000
UNKNOWN: Final = 255

Picture = Mapping[str, Any]


def message_picture(message: Any) -> Picture | None:
    """Return a picture of a message as JSON values, or None if it cannot be drawn.

    There are three kinds: `points` (x and y of each point in metres, and `joined`, which is true if they form
    a line), `grid` (cells from 0 to 100 or `UNKNOWN`, in base64, starting at the lower left corner), and
    `image` (the result of `packed`, in base64).
    """
    kind = getattr(message, "_type", "")
    draw = _PICTURES.get(kind)
    if draw is None or load_message_class(kind)._md5sum != message._md5sum:
        return None
    return draw(message)


def _scan(scan: Any) -> Picture:
    every = max(1, math.ceil(len(scan.ranges) / MAX_POINTS))
    points: list[float] = []
    for index in range(0, len(scan.ranges), every):
        distance = scan.ranges[index]
        angle = scan.angle_min + index * scan.angle_increment
        if scan.range_min <= distance <= scan.range_max and math.isfinite(distance) and math.isfinite(angle):
            points += (round(distance * math.cos(angle), 3), round(distance * math.sin(angle), 3))
    return {"kind": "points", "points": points, "joined": False}


def _path(path: Any) -> Picture:
    every = max(1, math.ceil(len(path.poses) / MAX_POINTS))
    positions = [pose.pose.position for pose in path.poses[::every]]
    places = ((place.x, place.y) for place in positions if math.isfinite(place.x) and math.isfinite(place.y))
    points: Iterable[float] = itertools.chain.from_iterable(places)
    return {"kind": "points", "points": [round(number, 3) for number in points], "joined": True}


def _map(grid: Any) -> Picture | None:
    width, height = grid.info.width, grid.info.height
    if not width or not height or len(grid.data) < width * height:
        return None
    every = max(1, math.ceil(max(width, height) / MAX_CELLS))
    cells = bytearray()
    for row in range(0, height, every):
        cells += bytes(cell & UNKNOWN for cell in grid.data[row * width : (row + 1) * width : every])
    size = {"width": len(range(0, width, every)), "height": len(range(0, height, every))}
    return {"kind": "grid", **size, "cells": base64.b64encode(cells).decode()}


def _image(image: object) -> Picture | None:
    try:
        head, pixels = packed(image, IMAGE_BYTES)
    except PiprosError:
        return None
    if len(pixels) > COMPRESSED_BYTES:
        return None
    return {"kind": "image", "data": base64.b64encode(json.dumps(head).encode() + b"\n" + pixels).decode()}


_PICTURES: Final[Mapping[str, Callable[[Any], Picture | None]]] = {
    "nav_msgs/OccupancyGrid": _map,
    "nav_msgs/Path": _path,
    "sensor_msgs/LaserScan": _scan,
    **dict.fromkeys(IMAGE_TYPES, _image),
}
