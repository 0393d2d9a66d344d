"""Grids of costs, lines and polygons, compared with plain loops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pipros_robot.navigation.costmap.grid import CostGrid, line_cells


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
