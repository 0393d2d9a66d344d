"""Worlds from maps, and the places in them where a robot fits."""

from __future__ import annotations

from array import array

import numpy as np
import pytest

from pipros_libraries.maps.map_file import Grid, MapDescription
from pipros_simulation.robots.errors import InvalidSettings
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
