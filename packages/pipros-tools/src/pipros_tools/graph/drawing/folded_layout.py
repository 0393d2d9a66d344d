"""Break a wide layout into rows, like the lines of a text, so that a long chain fills a screen.

Layers keep their order and distances. An arrow to the next row runs through the space between both rows.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
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
    rows: list[list[Point]] = [[] for _ in range(len(breaks) + 1)]  # the points of boxes and arrows
    crossings = [0] * len(breaks)
    for box in layout.boxes.values():
        corners = ((box.x + side * box.width / 2, box.y + side * box.height / 2) for side in (-1, 1))
        rows[bisect_left(breaks, box.x)] += corners
    for route in layout.routes:
        for point in route:
            rows[bisect_left(breaks, point[0])].append(point)
        for (start, _), (end, _) in pairwise(route):
            first, last = sorted((bisect_left(breaks, start), bisect_left(breaks, end)))
            if last - first > 1:
                return None
            if last > first:
                crossings[first] += 1
    if max(crossings, default=0) > MOST_CROSSING:
        return None
    indent = _EDGE + _ARROW_GAP * max(crossings, default=0)
    shifts: list[Point] = []
    gutters: list[float] = []
    bottom = 0.0
    for row, points in enumerate(rows):
        top = bottom - min(y for _, y in points)
        shifts.append((indent - min(x for x, _ in points), top))
        bottom = top + max(y for _, y in points)
        gutters.append(bottom + _ROW_GAP / 2)
        bottom += _ROW_GAP + _ARROW_GAP * (crossings[row] if row < len(crossings) else 0)
    inner = max(max(x for x, _ in points) + shift[0] for points, shift in zip(rows, shifts, strict=True))

    def moved(point: Point) -> Point:
        shift = shifts[bisect_left(breaks, point[0])]
        return point[0] + shift[0], point[1] + shift[1]

    turned = [0] * len(breaks)

    def moved_route(route: Sequence[Point]) -> Sequence[Point]:
        points = [moved(route[0])]
        for start, end in pairwise(route):
            first, last = (bisect_left(breaks, x) for x, _ in (start, end))
            if first != last:
                row = min(first, last)
                away = _EDGE + _ARROW_GAP * turned[row]
                y = gutters[row] + _ARROW_GAP * turned[row]
                turned[row] += 1
                right, left = inner + away, indent - away
                before, after = (right, left) if first < last else (left, right)
                points += [(before, moved(start)[1]), (before, y), (after, y), (after, moved(end)[1])]
            points.append(moved(end))
        return points

    boxes = {key: Box(*moved((box.x, box.y)), box.width, box.height) for key, box in layout.boxes.items()}
    routes = [moved_route(route) for route in layout.routes]
    return GraphLayout(boxes, routes, {}, inner + indent, bottom - _ROW_GAP)
