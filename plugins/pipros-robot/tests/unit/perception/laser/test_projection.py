"""Cases computed by hand: points of moving scanners, shapes in another frame, and assembled scans."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pipros_libraries.transforms.errors import TransformException
from pipros_robot.perception.laser.assembler import Assembler, StoredScan
from pipros_robot.perception.laser.filters.base import FilterFailed, FilterHost
from pipros_robot.perception.laser.filters.chain import chain_of
from pipros_robot.perception.laser.projection import channels, moving, projected, valid_beams
from pipros_robot.perception.laser.scan import Scan

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
LEFT = (2.0, 0.0, 0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
"""Two metres ahead, turned left by 90 degrees."""


def scan(*ranges: float, intensities: tuple[float, ...] = ()) -> Scan:
    """Return a scan from the right to the left."""
    count, arrays = len(ranges), (np.array(ranges, np.float32), np.array(intensities, np.float32))
    step = math.pi / max(count - 1, 1)
    return Scan("laser", 10**9, -math.pi / 2, math.pi / 2, step, 0.1, 1.0, 0.1, 10.0, *arrays)


def test_valid_beams_become_points_with_channels() -> None:
    given = scan(1, 0.05, 2, math.nan, 3, intensities=(7, 8, 9))
    beams = valid_beams(given)
    assert (beams.tolist(), valid_beams(given, 2.5).tolist()) == ([0, 2, 4], [0, 2])
    assert projected(given, beams) == pytest.approx(np.array([[0, -1, 0], [2, 0, 0], [0, 3, 0]]), abs=1e-6)
    found = channels(given, beams, dict.fromkeys(("intensity", "index", "distances", "stamps"), True))
    assert (found["index"].tolist(), found["distances"].tolist()) == ([0, 2, 4], [1, 2, 3])
    assert (found["stamps"], found["intensity"].tolist()[:2]) == (pytest.approx([0, 0.2, 0.4]), [7, 9])
    assert channels(scan(1, 2), np.array([0]), {"intensity": True}) == {}


def test_points_follow_the_motion_of_the_scanner() -> None:
    given = scan(1, 1, 1)
    beams = valid_beams(given)
    points = projected(given, beams)
    half = math.sqrt(0.5)
    expected = [[0, -1, 0], [1 + half, half, 0], [1, 0, 0]]
    assert moving(points, beams, 3, (IDENTITY, LEFT)) == pytest.approx(np.array(expected), abs=1e-6)
    opposite = (*LEFT[:3], *(-each for each in LEFT[3:]))
    assert moving(points, beams, 3, (IDENTITY, opposite)) == pytest.approx(np.array(expected), abs=1e-6)
    assert moving(points, beams, 3, (LEFT, LEFT))[0] == pytest.approx([3, 0, 0], abs=1e-6)
    assert moving(points[:1], beams[:1], 1, (LEFT, LEFT))[0] == pytest.approx([3, 0, 0], abs=1e-6)


class Listener:
    """The laser is turned left in every frame but `nowhere`."""

    def at(self, target: str, _: str, __: int, timeout_s: float = 0.0) -> Any:
        if target == "nowhere":
            raise TransformException(f"nowhere does not exist, waited {timeout_s} s")
        return IDENTITY if target == "laser" else LEFT


class Turned(FilterHost):
    @property
    def listener(self) -> Any:
        return Listener()


@pytest.mark.parametrize(("kind", "params", "removed"), [
    ("LaserScanBoxFilter", {"min_x": 2.5, "max_x": 3.5, "min_y": -1, "max_y": 1}, [0]),
    ("LaserScanBoxFilter", {"min_x": 2.5, "max_x": 3.5, "min_y": -1, "max_y": 1, "invert": True}, [1, 2]),
    ("LaserScanFootprintFilter", {"inscribed_radius": 1.5}, [2]),
    ("LaserScanPolygonFilter", {"polygon": [[1.5, 0.5], [2.5, 0.5], [2.5, 2], [1.5, 2]]}, [1]),
    ("StaticLaserScanPolygonFilter", {"polygon": [[0.5, -1], [1.5, -1], [1.5, 1], [0.5, 1]]}, [1]),
])  # fmt: skip
def test_shapes_are_in_their_frame(kind: str, params: dict[str, Any], removed: list[int]) -> None:
    """The scanner at (2, 0) looks left: its beams end at (3, 0), (2, 1) and (1, 0)."""
    frame = "laser" if kind.startswith("Static") else "base"
    given = {"box_frame": "base", "polygon_frame": frame, **params}
    description = [{"name": "one", "type": f"laser_filters/{kind}", "params": given}]
    chain = chain_of(description, Turned())
    for _ in range(2):
        assert np.flatnonzero(np.isnan(chain.update(scan(1, 1, 1)).ranges)).tolist() == removed
    with pytest.raises(FilterFailed, match="needs a node with transforms"):
        chain_of(description, FilterHost()).update(scan(1, 1, 1))


def test_a_missing_transform_drops_the_scan() -> None:
    for kind in ("LaserScanBoxFilter", "StaticLaserScanPolygonFilter"):
        params = {"box_frame": "nowhere", "polygon_frame": "base", "polygon": [[0, 0], [1, 0], [0, 1]]}
        chain = chain_of([{"name": "a", "type": f"laser_filters/{kind}", "params": params}], Turned())
        lost = Scan(**{**{name: getattr(scan(1), name) for name in Scan.__slots__}, "frame": "nowhere"})
        with pytest.raises(FilterFailed, match="filter a: nowhere does not exist"):
            chain.update(lost)


def stored(stamp_ns: int, *x: float, **more: Any) -> StoredScan:
    columns = {"x": np.array(x, np.float32), **{name: np.array(each) for name, each in more.items()}}
    return StoredScan(stamp_ns, columns)


def test_the_scans_of_an_interval_are_joined() -> None:
    memory = Assembler(3)
    for each in (stored(0, 9), stored(10, 1, 2, i=[5, 6]), stored(20, 3), stored(30, 4, i=[8])):
        memory.add(each)
    found = memory.assembled(0, 31)
    assert found is not None
    assert (found.stamp_ns, found.columns["x"].tolist()) == (30, [1, 2, 3, 4])
    assert found.columns["i"].tolist() == [5, 6, 0, 8]
    part = memory.assembled(10, 30)
    assert part is not None
    assert part.columns["x"].tolist() == [1, 2, 3]
    assert memory.assembled(31, 99) is None


def test_every_second_scan_and_point_is_used() -> None:
    memory = Assembler(9, 2)
    for at in range(5):
        memory.add(stored(at, *range(10 * at, 10 * at + 3)))
    found = memory.assembled(0, 9)
    assert found is not None
    assert found.columns["x"].tolist() == [0, 2, 20, 22, 40, 42]
