"""Cases computed by hand: points of moving scanners, shapes in another frame, and assembled scans."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_libraries.transforms.errors import TransformException
from pipros_robot.perception.laser.assembler import Assembler, StoredScan
from pipros_robot.perception.laser.cloud_to_scan import CloudToScan, InvalidScanSettings
from pipros_robot.perception.laser.depth_to_scan import DepthToScan, InvalidDepthImage, view_of
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


# Cases computed by hand; tests.golden.navigation.test_laser_as_genuine compares with the genuine node.


FOUR = CloudToScan(min_height=-1.0, max_height=1.0, angle_min=-2.0, angle_max=2.0, angle_increment=1.0)


def ranges(one: CloudToScan, *points: tuple[float, float, float]) -> list[float]:
    return list(map(float, one.ranges(np.array(points, np.float32).reshape(-1, 3))))


def test_a_beam_has_the_nearest_point_between_the_heights() -> None:
    found = ranges(FOUR, (3, 1, 0), (2, 0.5, 0), (1, 0.1, 2), (-1, 0, 0), (0, -2, 0.5))
    assert found == [2.0, math.inf, pytest.approx(math.hypot(2, 0.5)), math.inf]


def test_points_at_height_0_are_dropped_by_default() -> None:
    one = CloudToScan()
    assert (one.beams(), set(ranges(one, (1, 0, 0)))) == (360, {math.inf})
    assert ranges(one, (1, 0, 1e-6))[180] == 1.0


def test_empty_beams_may_be_finite_and_invalid_points_do_not_count() -> None:
    one = CloudToScan(min_height=-1.0, range_max=5.0, range_min=1.0, use_inf=False, angle_increment=3.0)
    nan = math.nan
    assert ranges(one, (nan, 1, 0), (1, nan, 0), (1, 1, nan), (6, 0, 0), (0.5, 0, 0)) == [6.0, 6.0, 6.0]


@pytest.mark.parametrize("increment", [0.0, -0.1, 1e-9, math.nan])
def test_impossible_numbers_of_beams_are_errors(increment: float) -> None:
    with pytest.raises(InvalidScanSettings, match=r"must give 0 to 1000000 beams"):
        CloudToScan(angle_increment=increment).beams()


# Cases computed by hand; tests.golden.navigation.test_laser_as_genuine compares with the genuine node.


def camera(focal: float = 2.0) -> Any:
    """Return the information about a camera with 5 x 3 pixels, whose centre is at (2, 1)."""
    info: Any = load_message_class("sensor_msgs/CameraInfo")()
    info.K, info.R = [focal, 0, 2, 0, focal, 1, 0, 0, 1], [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [focal, 0, 2, 0, 0, focal, 1, 0, 0, 0, 1, 0]
    return info


def image(rows: Any, encoding: str = "32FC1") -> Any:
    depths = np.array(rows, np.float32 if encoding == "32FC1" else np.uint16)
    made: Any = load_message_class("sensor_msgs/Image")()
    made.height, made.width = depths.shape
    made.encoding, made.step, made.data = encoding, depths.strides[0], depths.tobytes()
    return made


def test_the_first_beam_is_the_rightmost_column() -> None:
    view = view_of(camera(), 5)
    assert (view.angle_min, view.angle_max) == pytest.approx((-math.pi / 4, math.pi / 4))
    middle = [1.0, 2.0, 3.0, math.nan, 5.0]
    found = DepthToScan().ranges(image([[9] * 5, middle, [9] * 5]), view)
    assert (found[0], found[2]) == (pytest.approx(5 * math.sqrt(2)), 3.0)
    assert np.nanmin(found[3:]) == pytest.approx(math.sqrt(2))  # the edge of two beams
    assert math.isnan(found[1])


def test_of_several_rows_the_nearest_valid_depth_counts() -> None:
    rows = [[9, 9, 4, 9, 9], [9, 9, math.inf, 9, 9], [0, 0, 0, 0, 0]]
    found = DepthToScan(scan_height=3).ranges(image(rows), view_of(camera(), 5))
    assert found[2] == 4.0
    alone = [[math.nan] * 5, [math.inf] * 5, [math.nan] * 5]
    assert DepthToScan().ranges(image(alone), view_of(camera(), 5))[2] == math.inf


def test_depths_of_16_bits_are_millimetres() -> None:
    found = DepthToScan(range_max=3.0).ranges(
        image([[0] * 5, [0, 0, 2500, 0, 9000], [0] * 5], "16UC1"), view_of(camera(), 5)
    )
    assert found[2] == np.float32(2.5)
    assert np.isnan(found[[0, 1, 3, 4]]).all()


def test_what_cannot_become_a_scan_is_an_error() -> None:
    view = view_of(camera(), 5)
    good = image([[1] * 5] * 3)
    with pytest.raises(InvalidDepthImage, match=r"scan_height \(4 pixels\) is too large"):
        DepthToScan(scan_height=4).ranges(good, view)
    good.encoding = "bgr8"
    with pytest.raises(InvalidDepthImage, match="must be 16UC1 or 32FC1, got bgr8"):
        DepthToScan().ranges(good, view)
    good.encoding, good.data = "32FC1", b""
    with pytest.raises(InvalidDepthImage, match="got 0"):
        DepthToScan().ranges(good, view)
    good.width, good.height, good.step = 2**29, 0, 2**31
    with pytest.raises(InvalidDepthImage, match=r"an image of 536870912 x 0"):
        DepthToScan().ranges(good, replace(view, center_y=0.0))
    with pytest.raises(InvalidDepthImage, match="too large for the image height"):
        DepthToScan().ranges(good, replace(view, center_y=math.nan))
    with pytest.raises(InvalidDepthImage, match="not calibrated"):
        view_of(camera(0.0), 5)
    bent = camera()
    bent.D = [0.1]
    with pytest.raises(InvalidDepthImage, match="number of distortion coefficients"):
        view_of(bent, 5)
