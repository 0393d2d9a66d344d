"""Break a wide layout into rows, like the lines of a text, so that a long chain fills a screen.

Layers keep their order and distances. An arrow to the next row runs through the space between both rows.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from pipros_tools.graph.drawing.layered_layout import Box, GraphLayout, Key

Point = tuple[float, float]

MOST_CROSSING = 6
"""Maximum number of arrows between two rows. With more, the rows are hard to read."""
_MOST_ROWS = 16
_ROW_GAP = 30.0
_ARROW_GAP = 14.0
_EDGE = 18.0
"""Distance between the ends of a row and the first arrow that turns there."""


def scale_on(screen: Point, layout: GraphLayout[Key]) -> float:
    """Return the scale at which a layout fits on a screen of this width and height, at most 1."""
    return min(1.0, screen[0] / max(layout.width, 1.0), screen[1] / max(layout.height, 1.0))


def folded(layout: GraphLayout[Key], screen: Point) -> GraphLayout[Key]:
    """Return the layout in the number of rows with which it is largest on the screen.

    It is unchanged if it has bands, if one row is best, or if more than `MOST_CROSSING` arrows
    would lead from one row to another.
    """
    best = layout
    columns = _columns(layout.boxes)
    for count in range(2, 1 if layout.bands else min(_MOST_ROWS, len(columns)) + 1):
        if scale_on(screen, best) == 1.0:
            break
        found = _in_rows(layout, _breaks(columns, layout.width / count))
        if found is not None and scale_on(screen, found) > scale_on(screen, best):
            best = found
    return best


def _columns(boxes: Mapping[Key, Box]) -> Sequence[Point]:
    """Return the left and right ends of the layers. Boxes above each other never end up in two rows."""
    ends: list[Point] = []
    for left, right in sorted((box.x - box.width / 2, box.x + box.width / 2) for box in boxes.values()):
        if ends and left <= ends[-1][1]:
            ends[-1] = ends[-1][0], max(ends[-1][1], right)
        else:
            ends.append((left, right))
    return ends


def _breaks(columns: Sequence[Point], width: float) -> Sequence[float]:
    """Return the x coordinates between layers at which rows of about this width end."""
    breaks: list[float] = []
    begin = columns[0][0]
    for (_, right), (left, _) in pairwise(columns):
        if left - begin > width:
            breaks.append((right + left) / 2)
            begin = left
    return breaks


def _in_rows(layout: GraphLayout[Key], breaks: Sequence[float]) -> GraphLayout[Key] | None:
    """Return the layout with a new row after each of the given x coordinates; None if that is unreadable."""
    crossings = _crossings(layout.routes, breaks)
    if crossings is None or max(crossings, default=0) > MOST_CROSSING:
        return None
    rows = _Rows(layout, breaks, crossings)
    boxes = {
        key: Box(*rows.moved((box.x, box.y)), box.width, box.height) for key, box in layout.boxes.items()
    }
    routes = [rows.moved_route(route) for route in layout.routes]
    return GraphLayout(boxes, routes, {}, rows.width, rows.height)


def _crossings(routes: Iterable[Sequence[Point]], breaks: Sequence[float]) -> list[int] | None:
    """Return the number of arrows across each break; None if an arrow would skip a row."""
    crossings = [0] * len(breaks)
    for route in routes:
        for (start, _), (end, _) in pairwise(route):
            first, last = sorted((bisect_left(breaks, start), bisect_left(breaks, end)))
            if last - first > 1:
                return None
            if last > first:
                crossings[first] += 1
    return crossings


class _Rows:
    """Where the points of a layout are, after it was broken into rows."""

    def __init__(self, layout: GraphLayout[Key], breaks: Sequence[float], crossings: Sequence[int]) -> None:
        self._breaks = breaks
        self._left = _EDGE + _ARROW_GAP * max(crossings, default=0)
        self._right = 0.0
        self._shifts: list[Point] = []
        self._gutters: list[float] = []  # the y coordinate of the first arrow below each row
        self._turned = [0] * len(breaks)  # number of arrows below each row so far
        bottom = 0.0
        for points, crossing in zip(self._points(layout), (*crossings, 0), strict=True):
            xs, ys = zip(*points, strict=True)
            across, down = self._left - min(xs), bottom - min(ys)
            self._shifts.append((across, down))
            self._right = max(self._right, max(xs) + across)
            bottom = down + max(ys)
            self._gutters.append(bottom + _ROW_GAP / 2)
            bottom += _ROW_GAP + _ARROW_GAP * crossing
        self.width, self.height = self._right + self._left, bottom - _ROW_GAP

    def _row_of(self, x: float) -> int:
        return bisect_left(self._breaks, x)

    def _points(self, layout: GraphLayout[Key]) -> Sequence[Sequence[Point]]:
        """Return the corners of boxes and the points of arrows in each row."""
        rows: list[list[Point]] = [[] for _ in range(len(self._breaks) + 1)]
        for box in layout.boxes.values():
            corners = ((box.x + side * box.width / 2, box.y + side * box.height / 2) for side in (-1, 1))
            rows[self._row_of(box.x)] += corners
        for route in layout.routes:
            for point in route:
                rows[self._row_of(point[0])].append(point)
        return rows

    def moved(self, point: Point) -> Point:
        across, down = self._shifts[self._row_of(point[0])]
        return point[0] + across, point[1] + down

    def moved_route(self, route: Sequence[Point]) -> Sequence[Point]:
        points = [self.moved(route[0])]
        for start, end in pairwise(route):
            if self._row_of(start[0]) != self._row_of(end[0]):
                points += self._turn(start, end)
            points.append(self.moved(end))
        return points

    def _turn(self, start: Point, end: Point) -> Sequence[Point]:
        """Return the corners of an arrow to another row: it runs around the ends, between both rows."""
        first, last = self._row_of(start[0]), self._row_of(end[0])
        row = min(first, last)
        aside = _ARROW_GAP * self._turned[row]
        away = _EDGE + aside
        y = self._gutters[row] + aside
        self._turned[row] += 1
        right, left = self._right + away, self._left - away
        before, after = (right, left) if first < last else (left, right)
        return [(before, self.moved(start)[1]), (before, y), (after, y), (after, self.moved(end)[1])]
