"""Filters that remove the points inside or outside a shape in another frame."""

from __future__ import annotations

from ast import literal_eval
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipros_libraries.reconfiguring.server import Setting
from pipros_libraries.transforms.errors import TransformException
from pipros_robot.perception.clouds.points import matrix_of, moved
from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.filters.base import FilterFailed, InvalidFilter, ScanFilter
from pipros_robot.perception.laser.projection import moving, poses_of_scan, projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

WAIT_S: Final = 1.0
VERTICES_LIMIT: Final = 10_000
"""Maximum number of vertices in a polygon."""


class ShapeFilter(ScanFilter):
    """Base of filters that select points by their position in another frame."""

    def points(self, scan: Scan, frame: str) -> tuple[Array, Array]:
        """Return the valid beams, and their points in `frame`, corrected for motion during the scan.

        Wait up to `WAIT_S` for the transform at the end of the scan.

        Raises:
            FilterFailed: the transform is not available.
        """
        listener, end_ns = self.place.listener, scan.beam_stamp_ns(len(scan.ranges))
        try:
            listener.at(frame.removeprefix("/"), scan.frame.removeprefix("/"), end_ns, WAIT_S)
            poses = poses_of_scan(listener, frame, scan)
        except TransformException as error:
            raise FilterFailed(f"filter {self.name}: {error}") from error
        beams = valid_beams(scan)
        return beams, moving(projected(scan, beams), beams, len(scan.ranges), poses)


class BoxFilter(ShapeFilter):
    """Removes the points inside a box in `box_frame`, or outside if `invert` is true."""

    settings = (
        Setting("box_frame", "base_link"),
        *(Setting(f"min_{axis}", -1.0, -100.0, 100.0) for axis in "xyz"),
        *(Setting(f"max_{axis}", 1.0, -100.0, 100.0) for axis in "xyz"),
        Setting("invert", False),
    )
    is_reconfigurable = True

    def update(self, scan: Scan) -> Scan:
        given = self.values
        beams, points = self.points(scan, given["box_frame"])
        low, high = ([given[f"{end}_{axis}"] for axis in "xyz"] for end in ("min", "max"))
        inside = ((points > np.array(low)) & (points < np.array(high))).all(1)
        return scan.without(beams[inside != given["invert"]])


class FootprintFilter(ShapeFilter):
    """Removes the points in a square around the origin of `base_link`.

    The sides of the square are twice as long as `inscribed_radius`.
    """

    settings = (Setting("inscribed_radius", 0.0),)
    required = ("inscribed_radius",)

    def update(self, scan: Scan) -> Scan:
        beams, points = self.points(scan, "base_link")
        return scan.without(beams[(np.abs(points[:, :2]) <= self.values["inscribed_radius"]).all(1)])


class PolygonFilter(ShapeFilter):
    """Removes the points inside a polygon in the plane of `polygon_frame`, or outside if `invert` is true.

    Attributes:
        polygon: the vertices with padding, a float32 array of shape (n, 2).
    """

    settings = (
        Setting("polygon", "[]"),
        Setting("invert", False),
        Setting("polygon_padding", 0.0, 0.0, 100.0),
    )
    fixed = (Setting("polygon_frame", ""),)
    required = ("polygon_frame",)
    is_reconfigurable = True

    def read(self, params: Mapping[str, Any]) -> None:
        self.values = {**self.values, "polygon": text_of(vertices(params.get("polygon"), self.name))}
        self.changed()

    def changed(self) -> None:
        try:
            corners = vertices(_parsed(self.values["polygon"]), self.name)
        except InvalidFilter:
            if not hasattr(self, "polygon"):
                raise
            return  # a client sent an invalid polygon: keep the last valid one
        padding = np.float32(self.values["polygon_padding"])
        self.polygon = corners + np.sign(corners) * padding

    def update(self, scan: Scan) -> Scan:
        beams, points = self.points(scan, self.values["polygon_frame"])
        return scan.without(beams[in_polygon(self.polygon, points) != self.values["invert"]])


class StaticPolygonFilter(PolygonFilter):
    """Like `PolygonFilter`, but transforms the polygon to the scan's frame, once after each change."""

    fixed = (*PolygonFilter.fixed, Setting("transform_timeout", 5.0))  # type: ignore[assignment]

    def changed(self) -> None:
        super().changed()
        self._in_scan: Any = None

    def update(self, scan: Scan) -> Scan:
        if self._in_scan is None:
            timeout_s = self.values["transform_timeout"]
            source, target = (each.removeprefix("/") for each in (self.values["polygon_frame"], scan.frame))
            try:
                pose = self.place.listener.at(target, source, 0, timeout_s)
            except TransformException as error:
                raise FilterFailed(f"filter {self.name}: {error}") from error
            corners = np.concatenate([self.polygon, np.zeros((len(self.polygon), 1))], 1)
            self._in_scan = moved(corners, matrix_of(pose, np.float64)).astype(np.float32)
        beams = np.arange(len(scan.ranges))
        inside = in_polygon(self._in_scan, projected(scan, beams))
        return scan.without(inside != self.values["invert"])


def vertices(value: Any, name: str) -> Array:
    """Convert the parameter `polygon` to a float32 array of shape (n, 2).

    Raises:
        InvalidFilter: the value is not a list of pairs of numbers, or has 1, 2 or more than `VERTICES_LIMIT`
            pairs.
    """
    is_list = isinstance(value, Sequence) and not isinstance(value, str) and len(value) <= VERTICES_LIMIT
    if not is_list or len(value) in (1, 2) or not all(_is_pair(each) for each in value):
        raise InvalidFilter(
            f"filter {name}: polygon must be empty or a list of 3 to {VERTICES_LIMIT} [x, y], "
            f"got {str(value)[:99]}"
        )
    return np.array(value, np.float32).reshape(-1, 2)


def _is_pair(value: Any) -> bool:
    return (
        isinstance(value, Sequence)
        and len(value) == 2
        and all(isinstance(each, int | float) and not isinstance(each, bool) for each in value)
    )


def _parsed(text: str) -> Any:
    try:
        return literal_eval(text[:1_000_000].strip() or "[]")
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None


def text_of(corners: Array) -> str:
    """Format vertices as a value of the setting `polygon`."""
    return str([[float(x), float(y)] for x, y in corners])


def in_polygon(corners: Array, points: Array) -> Array:
    """Return a mask of the points inside a polygon, by the even-odd rule in float32."""
    x, y = points[:, 0], points[:, 1]
    inside = np.zeros(len(points), bool)
    with np.errstate(all="ignore"):
        for index in range(len(corners)):
            (ax, ay), (bx, by) = corners[index, :2], corners[index - 1, :2]
            crosses = ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
            inside ^= crosses
    return inside
