"""The size of a robot, and places on a map where it fits."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.basics.errors import PiprosError
from pipros.safe import yaml


def free_pose(file: str, pose: Sequence[float], radius: float) -> list[float]:
    """Return a pose on a map if the robot fits there, otherwise a free one near the middle of the map.

    Raises:
        PiprosError: the map cannot be read, or numpy is missing.
    """
    from pipros_libraries.maps.map_file import read_map
    from pipros_simulation.robots.world import World

    world = World.from_grid(read_map(file))
    if world.is_free(pose[0], pose[1], radius):
        return list(pose)
    cells = world.free_cells()
    middle = world.left + world.size[0] / 2, world.bottom + world.size[1] / 2
    order = ((cells - middle) ** 2).sum(axis=1).argsort()
    for x, y in cells[order].tolist():
        if world.is_free(x, y, 2 * radius):
            return [round(x, 3), round(y, 3), 0.0]
    return list(pose)


def is_number(value: object) -> bool:
    """Return True for a number, also as a text."""
    if isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return False
        return True
    return isinstance(value, int | float) and not isinstance(value, bool)


def inner_radius(footprint: object) -> float | None:
    """Return the smaller half of a footprint's extents, or None if it is not a footprint."""
    try:
        corners = yaml.load(footprint) if isinstance(footprint, str) else footprint
    except PiprosError:
        return None
    if not isinstance(corners, list) or len(corners) < 3:
        return None
    if not all(isinstance(each, list) and len(each) == 2 and all(map(is_number, each)) for each in corners):
        return None
    extents = [float(max(axis) - min(axis)) for axis in zip(*corners, strict=True)]
    return min(extents) / 2
