"""The picture on which pens draw: pixels in memory, without numpy or Pillow.

The colour sensor of a turtle reads the picture at 62.5 Hz, so reading a pixel must be cheap. Lines are filled
row by row, so that a line across the whole picture takes well under a millisecond.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pipros_libraries.pictures.png import png

SIDE = 500
"""Width and height, in pixels."""

_CHANNELS = 3

Point = tuple[float, float]
"""Point in pixels, x to the right and y downwards. The pixel (0, 0) is the square around the origin."""


@dataclass(frozen=True, slots=True)
class TurtleColor:
    """A colour with 8 bits per channel."""

    r: int
    g: int
    b: int


class TurtlePicture:
    """A picture of `SIDE` x `SIDE` pixels."""

    def __init__(self, background: TurtleColor) -> None:
        self._pixels = bytearray()
        self.fill(background)

    def fill(self, color: TurtleColor) -> None:
        """Set all pixels to one colour."""
        self._pixels = bytearray(_bytes_of(color) * (SIDE * SIDE))

    def color_at(self, point: Point) -> TurtleColor:
        """Return the colour of the nearest pixel; black outside the picture."""
        x, y = math.floor(point[0] + 0.5), math.floor(point[1] + 0.5)
        if not (0 <= x < SIDE and 0 <= y < SIDE):
            return TurtleColor(0, 0, 0)
        start = (y * SIDE + x) * _CHANNELS
        return TurtleColor(*self._pixels[start : start + _CHANNELS])

    def draw_line(self, start: Point, end: Point, color: TurtleColor, width: int) -> None:
        """Draw a straight line with square ends; parts outside the picture are clipped.

        The line is a rectangle, extended by half of `width` at both ends. It intersects each row of pixels in
        one interval, between the smallest and the largest x at which the row crosses its edges.
        """
        half = max(width, 1) / 2
        length = math.hypot(end[0] - start[0], end[1] - start[1])
        along = ((end[0] - start[0]) / length, (end[1] - start[1]) / length) if length else (1.0, 0.0)
        ax, ay = along[0] * half, along[1] * half
        corners = (
            (start[0] - ax - ay, start[1] - ay + ax),
            (end[0] + ax - ay, end[1] + ay + ax),
            (end[0] + ax + ay, end[1] + ay - ax),
            (start[0] - ax + ay, start[1] - ay - ax),
        )
        edges = tuple(zip(corners, (*corners[1:], corners[0]), strict=True))
        first = max(0, math.ceil(min(y for _, y in corners)))
        last = min(SIDE - 1, math.floor(max(y for _, y in corners)))
        filling = _bytes_of(color)
        for row in range(first, last + 1):
            crossings = [
                x0 + (row - y0) * (x1 - x0) / (y1 - y0)
                for (x0, y0), (x1, y1) in edges
                if y0 != y1 and min(y0, y1) <= row <= max(y0, y1)
            ]
            if not crossings:
                continue
            left = max(0, math.ceil(min(crossings)))
            right = min(SIDE - 1, math.floor(max(crossings)))
            if left <= right:
                begin = (row * SIDE + left) * _CHANNELS
                count = right + 1 - left
                self._pixels[begin : begin + count * _CHANNELS] = filling * count

    def to_png(self) -> bytes:
        """Return the picture as a PNG file."""
        stride = SIDE * _CHANNELS
        rows = (self._pixels[start : start + stride] for start in range(0, len(self._pixels), stride))
        return png(SIDE, SIDE, _CHANNELS, 8, rows, level=1)


def _bytes_of(color: TurtleColor) -> bytes:
    return bytes((color.r, color.g, color.b))
