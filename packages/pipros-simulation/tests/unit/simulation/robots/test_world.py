"""Worlds from maps, and the places in them where a robot fits."""

from __future__ import annotations

import math
from array import array

import numpy as np
import pytest

from pipros_libraries.maps.map_file import Grid, MapDescription
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.ray_casting import Array, cast_rays, distances_to_discs
from pipros_simulation.robots.world import OUTSIDE, WALL, World


def test_the_occupied_cells_of_a_map_are_walls_and_unknown_ones_are_free() -> None:
    description = MapDescription("map.pgm", 0.5, (-1.0, 2.0, 0.0))

    world = World.from_grid(Grid(description, 3, 2, array("b", [0, 100, -1, 64, 65, 0])))

    assert world.walls.tolist() == [[False, True, False], [False, True, False]]
    assert world.size == (1.5, 1.0)
    assert world.free_cells().tolist() == [[-0.75, 2.25], [0.25, 2.25], [-0.75, 2.75], [0.25, 2.75]]


def test_a_rotated_map_is_refused() -> None:
    description = MapDescription("map.pgm", 0.5, (0.0, 0.0, 0.1))

    with pytest.raises(InvalidSettings, match=r"yaw of the map's origin must be 0, got 0\.1"):
        World.from_grid(Grid(description, 1, 1, array("b", [0])))


def test_jumps_never_reach_a_wall() -> None:
    random = np.random.default_rng(3)
    walls = random.random((90, 70)) < 0.002
    world = World.from_cells(walls, 1.0)
    blocked = world.jumps < 0
    for row, column in zip(*np.nonzero(world.jumps > 0), strict=True):
        jump = world.jumps[row, column]
        assert not blocked[row - jump : row + jump + 1, column - jump : column + jump + 1].any()
    assert (world.jumps[0] == OUTSIDE).all()
    assert np.count_nonzero(world.jumps == WALL) == np.count_nonzero(walls)
    assert world.jumps.max() >= 8


def test_a_disc_fits_where_it_touches_no_wall_and_no_edge() -> None:
    walls = np.zeros((40, 40), bool)
    walls[20, 20] = True
    world = World.from_cells(walls, 0.1, (-2.0, -2.0))  # the wall is the square from (0, 0) to (0.1, 0.1)

    assert world.is_free(-0.31, 0.05, 0.3)
    assert not world.is_free(-0.29, 0.05, 0.3)
    assert world.is_free(-0.22, -0.22, 0.3)  # beside the corner
    assert not world.is_free(-0.2, -0.2, 0.3)
    assert world.is_free(-1.69, 1.0, 0.3)
    assert not world.is_free(-1.71, 1.0, 0.3)
    assert not world.is_free(50.0, 0.0, 0.3)
    assert not world.is_free(float("nan"), 0.0, 0.3)


# Ranges of lasers, compared with closed forms and with a search in small steps.


CELL_M = 0.05


def room(width: int = 200, height: int = 160) -> World:
    """Return a room of 9.9 x 7.9 m inside its walls, with the lower left corner of the grid at (-1, -2)."""
    walls = np.zeros((height, width), bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    return World.from_cells(walls, CELL_M, (-1.0, -2.0))


def scan(world: World, x: float, y: float, angle: Array, limit: float = 100.0) -> Array:
    everywhere = np.ones(angle.shape)
    return cast_rays(world, x * everywhere, y * everywhere, angle, limit * everywhere)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (3.3, 1.7), (-0.93, -1.94), (8.9, 5.9), (4.0, 2.0)])
def test_ranges_in_a_room_equal_the_distances_to_its_walls(x: float, y: float) -> None:
    angle = np.linspace(-math.pi, math.pi, 721) + 1e-4
    across = np.where(np.cos(angle) > 0, (8.95 - x) / np.cos(angle), (-0.95 - x) / np.cos(angle))
    up = np.where(np.sin(angle) > 0, (5.95 - y) / np.sin(angle), (-1.95 - y) / np.sin(angle))

    ranges = scan(room(), x, y, angle)

    assert ranges == pytest.approx(np.minimum(across, up), abs=1e-9)


def test_ranges_among_random_walls_equal_a_search_in_small_steps() -> None:
    random = np.random.default_rng(7)
    walls = random.random((60, 80)) < 0.02
    walls[[0, -1]] = walls[:, [0, -1]] = True
    world = World.from_cells(walls, CELL_M)
    x, y = random.choice(world.free_cells(), 50).T
    angle = random.uniform(-math.pi, math.pi, 50)

    ranges = cast_rays(world, x, y, angle, np.full(50, 10.0))

    steps = np.arange(0, 6, 0.0005)
    for ray in range(50):
        columns = ((x[ray] + steps * math.cos(angle[ray])) / CELL_M).astype(int)
        rows = ((y[ray] + steps * math.sin(angle[ray])) / CELL_M).astype(int)
        first = steps[np.argmax(walls[rows.clip(0, 59), columns.clip(0, 79)])]
        # A ray may touch a corner between two steps of the search.
        assert ranges[ray] == pytest.approx(first, abs=CELL_M)
        assert ranges[ray] <= first + 1e-9


@pytest.mark.parametrize("angle", [0.0, math.pi / 2, math.pi, -math.pi / 2, math.pi / 4, 1e-13])
def test_rays_along_the_axes_and_diagonals_end(angle: float) -> None:
    (distance,) = scan(room(), 0.0, 0.0, np.array([angle]))

    assert math.isfinite(distance)


def test_every_ray_ends_wherever_it_starts() -> None:
    random = np.random.default_rng(5)
    world = room()
    x, y = random.choice(world.free_cells(), 20_000).T + random.uniform(-CELL_M / 2, CELL_M / 2, (2, 20_000))

    ranges = cast_rays(world, x, y, random.uniform(-4, 4, 20_000), np.full(20_000, 20.0))

    assert np.isfinite(ranges).all()


def test_rays_without_a_wall_are_infinite() -> None:
    empty = World.from_cells(np.zeros((20, 20), bool), CELL_M)
    angle = np.linspace(0, 6, 50)

    assert np.isinf(scan(empty, 0.5, 0.5, angle)).all()
    assert np.isinf(scan(room(), 4.0, 2.0, angle, limit=1.0)).all()
    assert np.isinf(scan(room(), 50.0, 50.0, angle)).all()


def test_discs_hide_what_is_behind_them() -> None:
    discs = np.array([[2.0, 0.0, 0.5], [5.0, 0.0, 1.0], [0.0, -3.0, 1.0], [0.1, 0.0, 0.5]])

    ranges = distances_to_discs(0.0, 0.0, np.array([0.0, math.pi, -math.pi / 2, math.pi / 2]), discs)

    assert ranges == pytest.approx([1.5, math.inf, 2.0, math.inf])
    assert np.isinf(distances_to_discs(0.0, 0.0, np.zeros(3), np.zeros((0, 3)))).all()
