"""Grids of costs, lines and polygons, compared with plain loops."""

import math
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.costmap.footprint import (
    as_text,
    circle,
    from_parameter,
    inscribed_radius,
    padded,
    placed,
)
from pipros_robot.navigation.costmap.grid import CostGrid, line_cells
from pipros_robot.navigation.costmap.observations import cloud_points, old_cloud_points, scan_points
from tests.support.both_costmaps import cloud_message, scan_message


def grid(width: int = 12, height: int = 8, resolution: float = 0.25) -> CostGrid:
    made = CostGrid(7)
    made.resize(width, height, resolution, -1.0, 0.5)
    return made


def test_positions_become_cells_and_back() -> None:
    some = grid()
    assert (some.world_to_cell(-1.0, 0.5), some.world_to_cell(1.99, 2.49)) == ((0, 0), (11, 7))
    assert (
        some.world_to_cell(-1.001, 1.0)
        is some.world_to_cell(2.0, 1.0)
        is some.world_to_cell(0.0, 2.5)
        is None
    )
    assert some.world_to_cell(math.nan, 1.0) is some.world_to_cell(math.inf, 1.0) is None
    assert (some.cell_to_world(0, 7), some.nearest_cell(-50.0, 50.0)) == ((-0.875, 2.375), (0, 7))
    columns, rows, inside = some.world_to_cells(np.array([0.0, 9.0, math.nan]), np.array([1.0, 1.0, 1.0]))
    assert (columns.tolist(), rows.tolist(), inside.tolist()) == ([4, 0, 0], [2, 0, 0], [True, False, False])
    assert [some.in_cells(distance) for distance in (0.0, 0.1, 0.25, 0.26)] == [0, 1, 1, 2]


@pytest.mark.parametrize(("right", "up"), [(0, 0), (3, -2), (-5, 4), (40, 0), (0, -40)])
def test_a_rolling_grid_keeps_what_overlaps(right: int, up: int) -> None:
    some = grid()
    numbers = np.random.default_rng(1).integers(0, 250, some.costs.shape)
    some.costs[...] = numbers
    middle = (-1.0 + 11.5 * 0.125, 0.5 + 7.5 * 0.125)
    some.center_on(middle[0] + right * 0.25, middle[1] + up * 0.25)

    assert (some.origin_x, some.origin_y) == (-1.0 + right * 0.25, 0.5 + up * 0.25)
    for y in range(8):
        for x in range(12):
            is_kept = 0 <= x + right < 12 and 0 <= y + up < 8
            assert some.costs[y, x] == (numbers[y + up, x + right] if is_kept else 7)


def bresenham(x0: int, y0: int, x1: int, y1: int, limit: float) -> list[tuple[int, int]]:
    """Return the cells of a line, one step at a time with an integer error term."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    is_steep = dy > dx
    major, minor = (dy, dx) if is_steep else (dx, dy)
    distance = math.hypot(dx, dy)
    steps = int(min(1.0, limit / distance) * major) if distance else 0
    error, x, y = major // 2, x0, y0
    cells = [(x, y)]
    sign_x, sign_y = (1 if x1 > x0 else -1), (1 if y1 > y0 else -1)
    for _ in range(steps):
        error += minor
        is_aside = error >= major
        error -= major * is_aside
        x += sign_x * (is_aside if is_steep else 1)
        y += sign_y * (1 if is_steep else is_aside)
        cells.append((x, y))
    return cells


def test_lines_are_those_of_bresenham() -> None:
    numbers = np.random.default_rng(2)
    ends: Any = numbers.integers(-30, 30, (300, 2))
    ends[:9] = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    for limit in (math.inf, 12.0):
        columns, rows = line_cells(3, -2, ends[:, 0] + 3, ends[:, 1] - 2, limit)
        expected = [cell for x, y in ends.tolist() for cell in bresenham(3, -2, x + 3, y - 2, limit)]
        assert list(zip(columns.tolist(), rows.tolist(), strict=True)) == expected


def test_a_polygon_is_filled_between_its_edges() -> None:
    some = grid(40, 40, 0.1)
    corners = [(0.03, 1.0), (1.2, 0.71), (2.2, 2.4), (1.0, 3.3)]
    assert some.fill_polygon(corners, 200)

    filled = {(int(x), int(y)) for y, x in np.argwhere(some.costs == 200)}
    cells = [some.world_to_cell(*corner) for corner in corners]
    outline = {
        cell
        for start, end in zip(cells, cells[1:] + cells[:1], strict=True)
        for cell in bresenham(*start, *end, math.inf)  # type: ignore[misc]
    }
    assert outline <= filled
    for x in {column for column, _ in filled}:
        rows = [row for column, row in outline if column == x]
        assert {row for column, row in filled if column == x} == set(range(min(rows), max(rows) + 1))


def test_a_polygon_that_leaves_the_grid_is_not_filled() -> None:
    some = grid()
    assert not some.fill_polygon([(0.0, 1.0), (0.5, 1.0), (0.5, 99.0)], 200)
    assert np.all(some.costs == 7)


def test_published_costs() -> None:
    some = grid(10, 1)
    some.costs[0] = [0, 1, 2, 64, 128, 200, 252, 253, 254, 255]
    assert np.frombuffer(some.published(), np.int8).tolist() == [0, 1, 1, 25, 50, 77, 98, 99, 100, -1]


# Outlines of robots.


BURGER = [(-0.105, -0.105), (-0.105, 0.105), (0.041, 0.105), (0.041, -0.105)]


def test_the_radii_of_a_burger_and_of_a_round_robot() -> None:
    assert inscribed_radius(padded(BURGER, 0.01)) == pytest.approx(0.051, abs=1e-4)
    assert inscribed_radius(circle(1.0)) == pytest.approx(math.cos(math.radians(11.25)))
    assert inscribed_radius([(1.0, 0.0), (2.0, 0.0)]) == math.inf


def test_a_coordinate_of_zero_is_not_padded() -> None:
    assert padded([(1.0, 0.0), (-1.0, -2.0)], 0.5) == [(1.5, 0.0), (-1.5, -2.5)]


def test_a_footprint_is_read_from_lists_and_texts() -> None:
    assert from_parameter([[1, 2], [3.5, 4], [5, 6]], "~footprint") == [(1, 2), (3.5, 4), (5, 6)]
    text = as_text(BURGER)
    assert text == "[[-0.105,-0.105],[-0.105,0.105],[0.041,0.105],[0.041,-0.105]]"
    read = from_parameter(f" {text} ", "~footprint")
    assert np.array_equal(read, np.float32(BURGER))
    assert read != BURGER  # corners have single precision, as in genuine costmaps


@pytest.mark.parametrize("value", [
    "", "[", "[[1, 2], [3, 4]]", "[[1, 2], [3, 4], [5]]", "[[1, 2], [3, 4], ['a', 1]]", 7, None,
    [[1, 2]] * 2000, "[" * 5000, [[1, 2], [3, 4], [math.nan, 1]], [[1, 2], [3, 4], [True, 1]],
    "__import__('os')", [[1e300, 2], [3, 4], [5, 6]],
])  # fmt: skip
def test_other_values_are_refused(value: Any) -> None:
    with pytest.raises(
        InvalidParameter, match=r"~footprint must (be a list of 3 to 1000 corners|have coordinates below)"
    ):
        from_parameter(value, "~footprint")


def test_a_footprint_turns_with_the_robot() -> None:
    ((x, y),) = placed([(1.0, 0.0)], 2.0, 3.0, math.pi / 2)
    assert (x, y) == pytest.approx((2.0, 4.0))


# Points of scans and clouds, compared with plain loops; invalid ones are refused.


def test_valid_ranges_of_a_scan_become_points() -> None:
    numbers = np.random.default_rng(1)
    ranges = [*numbers.uniform(0.05, 12.0, 40), math.inf, -math.inf, math.nan, 0.1, 10.0, 0.0, -1.0]
    scan = scan_message(ranges, 1.0)
    scan.range_min, scan.range_max = 0.25, 8.0

    expected = [
        (distance * math.cos(angle), distance * math.sin(angle), 0.0)
        for index, distance in enumerate(scan.ranges)
        for angle in [scan.angle_min + index * scan.angle_increment]
        if 0.25 <= distance < 8.0
    ]
    assert scan_points(scan).tolist() == [pytest.approx(point, abs=1e-6) for point in expected]
    with_infinity = scan_points(scan, is_infinity_valid=True)
    assert len(with_infinity) == len(expected) + 1
    assert np.hypot(*with_infinity[:, :2].T).max() == pytest.approx(7.9999, abs=1e-5)


@pytest.mark.parametrize("angle", [math.nan, math.inf, 1e30])
def test_a_scan_with_impossible_angles_has_no_points_or_finite_ones(angle: float) -> None:
    scan = scan_message([1.0] * 5, 1.0)
    scan.angle_min = scan.angle_increment = angle
    assert np.isfinite(scan_points(scan)).all()


def test_points_of_clouds_are_read_wherever_their_fields_are() -> None:
    points = np.random.default_rng(2).uniform(-3, 3, (20, 3)).astype(np.float32)
    cloud = cloud_message(points, 1.0, "camera")
    assert np.array_equal(cloud_points(cloud), points)

    swapped = np.frombuffer(cloud.data, np.uint8).reshape(20, 14).copy()
    for offset in (0, 6, 10):
        swapped[:, offset : offset + 4] = swapped[:, offset : offset + 4][:, ::-1]
    cloud.data, cloud.is_bigendian = swapped.tobytes(), True
    assert np.array_equal(cloud_points(cloud), points)
    assert cloud_points(cloud_message(points[:0], 1.0, "camera")).shape == (0, 3)

    point_class: Any = load_message_class("geometry_msgs/Point32")
    old: Any = load_message_class("sensor_msgs/PointCloud")()
    assert old_cloud_points(old).shape == (0, 3)
    old.points = [point_class(*point) for point in points.tolist()]
    assert np.array_equal(old_cloud_points(old), points)


@pytest.mark.parametrize(("change", "complaint"), [
    ({"width": 2**32 - 1, "height": 2**32 - 1}, r"4294967295 \* 14 bytes, got 28"),
    ({"width": 3}, r"width \* height \* point_step = 3 \* 1 \* 14 bytes, got 28"),
    ({"point_step": 7, "width": 4}, "field x must .* lie within the point, got type 7 at offset"),
    ({"point_step": 0}, "bytes, got 28"),
    ({"fields": []}, "field x of a cloud must exist and be of type FLOAT32"),
])  # fmt: skip
def test_invalid_clouds_are_refused(change: dict[str, Any], complaint: str) -> None:
    cloud = cloud_message([(1, 2, 3), (4, 5, 6)], 1.0, "camera")
    for name, value in change.items():
        setattr(cloud, name, value)
    with pytest.raises(ValueError, match=complaint):
        cloud_points(cloud)
