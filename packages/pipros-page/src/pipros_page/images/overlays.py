"""Shapes over images: detections, and markers projected into a camera's image.

A shape is a dictionary with `color`, `lines` (x, y, x, y of each line), `circles` (x, y, radius of each) and
`texts` (`[x, y, text]` of each), in pixels of the full image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import islice, pairwise
from typing import Any, Final

from pipros_libraries.transforms.messages import pose_of, vector_of
from pipros_libraries.transforms.pose import Pose, Vector, composed, normalized, transform_point

MAX_DETECTIONS: Final = 500
MAX_MARKERS: Final = 500
MAX_PARTS: Final = 20_000
"""Maximum number of lines and circles over an image."""
LONGEST_TEXT: Final = 60
NEAR_M: Final = 0.01
"""Parts of lines that are nearer to the camera than this distance (m) are not drawn."""
DETECTION_COLOR: Final = "#ffd84a"
_ROUND: Final = 16

_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_ARROW, _CUBE, _SPHERE, _CYLINDER, _STRIP, _LIST, _CUBES, _SPHERES, _POINTS, _TEXT, _MESH, _TRIANGLES = range(
    12
)

Shape = dict[str, Any]
Lines = Iterator[tuple[Vector, Vector]]


def detection_shapes(message: Any) -> list[Shape]:
    """Return the boxes and best results of a `Detection2DArray` as shapes.

    The fields have the names in the publisher's definition, which differ between releases of vision_msgs:
    `bbox.center.x` or `bbox.center.position.x`, and `results[].id` or `results[].hypothesis.class_id`.

    Raises:
        AttributeError: the definition lacks both names of a field.
    """
    lines: list[float] = []
    texts: list[list[Any]] = []
    for detection in message.detections[:MAX_DETECTIONS]:
        box = detection.bbox
        centre = getattr(box.center, "position", box.center)
        cosine, sine = math.cos(box.center.theta), math.sin(box.center.theta)
        ends = [
            (
                centre.x + cosine * x * box.size_x / 2 - sine * y * box.size_y / 2,
                centre.y + sine * x * box.size_x / 2 + cosine * y * box.size_y / 2,
            )
            for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        if not all(math.isfinite(value) for end in ends for value in end):
            continue
        for end, following in zip(ends, ends[1:] + ends[:1], strict=True):
            lines += [*end, *following]
        texts.append([*min(ends, key=lambda end: end[1]), _result_text(detection)])
    return [
        {"color": DETECTION_COLOR, "lines": _rounded(lines), "texts": [each for each in texts if each[2]]}
    ]


def _result_text(detection: Any) -> str:
    results = [getattr(each, "hypothesis", each) for each in detection.results]
    if not results:
        return ""
    best = max(results, key=lambda each: each.score)
    name = best.class_id if hasattr(best, "class_id") else best.id
    return f"{name} {best.score:.2f}"[:LONGEST_TEXT]


class OverlayMarkers:
    """The current markers of a topic. If there are already `MAX_MARKERS`, new markers are ignored."""

    def __init__(self) -> None:
        self._markers: dict[tuple[str, int], tuple[Any, float]] = {}

    def add(self, message: object, now_s: float) -> None:
        """Add a `Marker` or `MarkerArray` that arrived at `now_s`."""
        self._markers = {key: each for key, each in self._markers.items() if now_s < each[1]}
        for marker in getattr(message, "markers", [message]):
            key = marker.ns, marker.id
            if marker.action == _DELETE_ALL:
                self._markers.clear()
            elif marker.action == _DELETE:
                self._markers.pop(key, None)
            elif key in self._markers or len(self._markers) < MAX_MARKERS:
                life_s = marker.lifetime.to_sec()
                self._markers[key] = marker, now_s + life_s if life_s > 0 else math.inf

    def shown(self, now_s: float) -> list[Any]:
        """Return the markers whose lifetime has not passed."""
        return [marker for marker, end_s in list(self._markers.values()) if now_s < end_s]


class Camera:
    """Projection from a camera's frame (x right, y down, z forward) to pixels, given by its `CameraInfo`.

    Attributes:
        frame: the camera's frame.
    """

    def __init__(self, info: Any) -> None:
        """Raise `ValueError` if the camera is not calibrated."""
        self.frame = info.header.frame_id.lstrip("/")
        self._p = p = info.P
        if not p[0] or not p[5] or not all(map(math.isfinite, p)):
            raise ValueError("the camera is not calibrated: P has no focal length")

    def pixel(self, point: Vector) -> tuple[float, float]:
        """Return the pixel of a point in front of the camera."""
        x, y, z = point
        p = self._p
        return (p[0] * x + p[2] * z + p[3]) / z, (p[5] * y + p[6] * z + p[7]) / z

    def line(self, one: Vector, other: Vector) -> list[float]:
        """Return the visible part of a line in pixels (x, y, x, y); empty if it is behind the camera."""
        if one[2] > other[2]:
            one, other = other, one
        if other[2] < NEAR_M:
            return []
        if one[2] < NEAR_M:
            part = (NEAR_M - one[2]) / (other[2] - one[2])
            one = tuple(a + part * (b - a) for a, b in zip(one, other, strict=True))  # type: ignore[assignment]
        return [*self.pixel(one), *self.pixel(other)]

    def circle(self, centre: Vector, radius: float) -> list[float]:
        """Return a sphere's centre and radius in pixels, or an empty list if it is behind the camera."""
        if centre[2] < NEAR_M:
            return []
        return [*self.pixel(centre), self._p[0] * radius / centre[2]]


def marker_shapes(markers: Sequence[Any], camera: Camera, pose_in: Callable[[str], Pose]) -> list[Shape]:
    """Return shapes for markers, projected into a camera's image.

    Args:
        pose_in: returns the pose of a frame in the camera's frame.
    """
    shapes: list[Shape] = []
    left = MAX_PARTS
    for marker in markers:
        frame = pose_in(marker.header.frame_id.lstrip("/"))
        pose = composed(frame, normalized(pose_of(marker.pose.position, marker.pose.orientation)))
        lines: list[float] = []
        for one, other in islice(_lines(marker), left):
            lines += camera.line(transform_point(pose, one), transform_point(pose, other))
        circles: list[float] = []
        for centre, radius in islice(_balls(marker), left):
            circles += camera.circle(transform_point(pose, centre), radius)
        left -= len(lines) // 4 + len(circles) // 3
        shape: Shape = {
            "color": _color(marker.color),
            "lines": _rounded(lines),
            "circles": _rounded(circles),
        }
        if marker.type == _TEXT and pose[2] >= NEAR_M:
            shape["texts"] = [[*_rounded(camera.pixel(pose[:3])), marker.text[:LONGEST_TEXT]]]
        shapes.append(shape)
        if left <= 0:
            break
    return shapes


def _lines(marker: Any) -> Lines:
    """Yield the lines of a marker, or the edges of a solid, in the marker's frame."""
    points = [vector_of(point) for point in marker.points[:MAX_PARTS]]
    x, y, z = (size / 2 for size in vector_of(marker.scale))
    if marker.type == _ARROW:
        yield (points[0], points[1]) if len(points) > 1 else ((0.0, 0.0, 0.0), (2 * x, 0.0, 0.0))
    elif marker.type in (_CUBE, _MESH):
        corners = [(a * x, b * y, c * z) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
        for at, one in enumerate(corners):
            yield from ((one, corners[at | bit]) for bit in (1, 2, 4) if not at & bit)
    elif marker.type == _CYLINDER:
        turns = [2 * math.pi * at / _ROUND for at in range(_ROUND + 1)]
        for end in (-z, z):
            ring = [(x * math.cos(turn), y * math.sin(turn), end) for turn in turns]
            yield from pairwise(ring)
        yield from (((side, 0.0, -z), (side, 0.0, z)) for side in (-x, x))
    elif marker.type == _STRIP:
        yield from pairwise(points)
    elif marker.type == _LIST:
        yield from zip(points[::2], points[1::2], strict=False)
    elif marker.type == _TRIANGLES:
        for a, b, c in zip(points[::3], points[1::3], points[2::3], strict=False):
            yield from ((a, b), (b, c), (c, a))


def _balls(marker: Any) -> Iterator[tuple[Vector, float]]:
    """Yield the centre and radius of a sphere, or of each element of a list, in the marker's frame."""
    radius = marker.scale.x / 2
    if marker.type == _SPHERE:
        yield (0.0, 0.0, 0.0), max(vector_of(marker.scale)) / 2
    elif marker.type in (_CUBES, _SPHERES, _POINTS):
        yield from ((vector_of(point), radius) for point in marker.points[:MAX_PARTS])


def _color(color: Any) -> str:
    red, green, blue = (round(255 * min(1.0, max(0.0, value))) for value in (color.r, color.g, color.b))
    return f"rgb({red} {green} {blue})"


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, 1) if math.isfinite(value) else 0.0 for value in values]
