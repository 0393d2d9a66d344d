"""The walls of a Stage world: the first bitmap, and the bitmaps and blocks of all other models.

As in Stage, a model without a bitmap and blocks is a box of its size, and the polygons of a model's blocks
are scaled together to the model's size. Heights are ignored: a robot and a laser meet every wall.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_libraries.maps.picture import read_picture
from pipros_simulation.robots.drive import Pose, combined
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.stage_model import Model, numbers, pose_of, single
from pipros_simulation.robots.world import World

DARK_BELOW: Final = 127
"""Pixels with a grey value below this are walls."""
CELL_M: Final = 0.05
"""Size of a cell if no model has a bitmap."""
MARGIN_M: Final = 2.0
"""Free space around all models if no model has a bitmap."""
MAX_CELLS: Final = 25_000_000
MAX_PIXELS: Final = 50_000
"""Maximum number of dark pixels in a bitmap that is not the first."""
MAX_OUTLINES: Final = 200_000
MAX_WORK: Final = 10_000_000_000
"""Maximum number of cells times corners, which all outlines together cover; takes about ten seconds."""

Points = NDArray[np.float64]
_BOX: Final = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))


def world_of(models: Sequence[Model], robots: Iterable[Pose]) -> World:
    """Return the walls of top-level models. `robots` are places that must be inside the world.

    Raises:
        InvalidSettings: there are no walls, or a model is invalid.
        MapError: a bitmap cannot be read.
    """
    plan = next((model for model in models if "bitmap" in model.values and _is_wall(model)), None)
    others = [model for model in models if model is not plan and _is_wall(model)]
    parts = [part for part in plan.parts if _is_wall(part)] if plan is not None else []
    found = (shape for model in others for shape in _shapes(model, Pose()))
    of_plan = (shape for part in parts for shape in _shapes(part, pose_of(plan))) if plan is not None else ()
    shapes = list(islice(chain(found, of_plan), MAX_OUTLINES + 1))
    if len(shapes) > MAX_OUTLINES:
        raise InvalidSettings(f"the blocks and dark pixels of models must be at most {MAX_OUTLINES}")
    if plan is not None:
        walls, resolution, left, bottom = _plan(plan)
    elif shapes:
        walls, resolution, left, bottom = _free_space(shapes, robots)
    else:
        raise InvalidSettings("a world needs walls: a model with a bitmap or blocks")
    work = 0
    for shape in shapes:
        work += _fill(walls, (shape - (left, bottom)) / resolution, MAX_WORK - work)
    return World.from_cells(walls, resolution, (left, bottom))


def _is_wall(model: Model) -> bool:
    return model.kind not in ("position", "window", "block") and bool(single(model, "obstacle_return", 1.0))


def _picture(model: Model) -> NDArray[np.bool_]:
    """Return the dark pixels of a model's bitmap, with the lowest row first."""
    picture = read_picture(os.path.join(str(model.values["folder"]), str(model.values["bitmap"])))
    shape = len(picture.colors), picture.height, picture.width
    grey = np.frombuffer(b"".join(picture.colors), np.uint8).reshape(shape).mean(axis=0)
    walls: NDArray[np.bool_] = grey[::-1] < DARK_BELOW
    return walls


def _plan(plan: Model) -> tuple[NDArray[np.bool_], float, float, float]:
    """Return the cells of the first bitmap, their size, and x and y of the lower left corner."""
    picture = _picture(plan)
    rows, columns = picture.shape
    width, height, *_ = numbers(plan, "size", [1.0, 1.0, 1.0])
    centre = combined(pose_of(plan), pose_of(plan, "origin"))
    turn = math.degrees(centre.yaw) / 90
    if abs(turn - round(turn)) > 1e-6:
        raise InvalidSettings(f"the bitmap can only be rotated by multiples of 90 degrees, got {turn * 90:g}")
    resolution = width / columns
    if resolution <= 0 or abs(height / rows / resolution - 1) > 0.02:
        raise InvalidSettings(
            "size must be > 0 and match the aspect ratio of the bitmap "
            f"({columns} x {rows} pixels), got {width} x {height} m"
        )
    # With the lowest row first, a positive rotation of the array is clockwise.
    walls = np.rot90(picture, -round(turn)).copy()
    if single(plan, "boundary", 0.0):
        walls[[0, -1]] = walls[:, [0, -1]] = True
    rows, columns = walls.shape
    return walls, resolution, centre.x - columns * resolution / 2, centre.y - rows * resolution / 2


def _free_space(
    shapes: Sequence[Points], robots: Iterable[Pose]
) -> tuple[NDArray[np.bool_], float, float, float]:
    places = np.concatenate([*shapes, *(np.array([[each.x, each.y]]) for each in robots)])
    low, high = places.min(axis=0) - MARGIN_M, places.max(axis=0) + MARGIN_M
    columns, rows = np.ceil((high - low) / CELL_M)
    if not rows * columns <= MAX_CELLS:
        raise InvalidSettings(
            f"the world must have at most {MAX_CELLS} cells of {CELL_M} m, got {columns:g} x {rows:g}"
        )
    return np.zeros((int(rows), int(columns)), bool), CELL_M, float(low[0]), float(low[1])


def _shapes(model: Model, parent: Pose) -> Iterator[Points]:
    """Yield the outlines of a model and its parts in the map frame, each of the shape (n, 2), in metres."""
    pose = combined(parent, pose_of(model))
    centre = combined(pose, pose_of(model, "origin"))
    size = np.array(numbers(model, "size", [1.0, 1.0, 1.0])[:2])
    cosine, sine = math.cos(centre.yaw), math.sin(centre.yaw)
    rotation = np.array([[cosine, sine], [-sine, cosine]])
    for outline in _outlines(model):
        yield (outline * size) @ rotation + (centre.x, centre.y)
    for part in model.parts:
        if _is_wall(part):
            yield from _shapes(part, pose)


def _outlines(model: Model) -> list[Points]:
    """Return the outlines of a model's blocks, or of the dark pixels of its bitmap, in a square of side 1."""
    if "bitmap" in model.values:
        walls = _picture(model)
        corners = np.array(_BOX) + 0.5
        pixels = np.argwhere(walls)[:, ::-1]
        if len(pixels) > MAX_PIXELS:
            raise InvalidSettings(f"bitmaps after the first must have at most {MAX_PIXELS} dark pixels")
        return [(pixel + corners) / walls.shape[::-1] - 0.5 for pixel in pixels]
    blocks = [_points(part) for part in model.parts if part.kind == "block"]
    if not blocks:
        return [np.array(_BOX)]
    corners = np.concatenate(blocks)
    low, extent = corners.min(axis=0), np.ptp(corners, axis=0)
    extent[extent == 0] = 1.0
    return [(block - low) / extent - 0.5 for block in blocks]


def _points(block: Model) -> Points:
    count = round(single(block, "points", 0.0))
    points = [numbers(block, f"point[{index}]", [0.0, 0.0])[:2] for index in range(min(count, 1000))]
    if len(points) < 3:
        raise InvalidSettings(f"a block must have 3 to 1000 points, got {count}")
    return np.array(points)


def _fill(walls: NDArray[np.bool_], outline: Points, most: int) -> int:
    """Set the cells whose centres are inside an outline, and those that its edges touch.

    Return the number of cells around it times its corners. Raise InvalidSettings if it exceeds `most`.

    Args:
        outline: corners in cells from the lower left corner of the grid.
    """
    rows, columns = walls.shape
    # An edge on the boundary between two cells does not touch the outer one.
    outline = outline + 1e-6 * (outline.mean(axis=0) - outline)
    first = np.maximum(np.floor(outline.min(axis=0)), 0).astype(int)
    last = np.minimum(np.floor(outline.max(axis=0)) + 1, (columns, rows)).astype(int)
    if (last <= first).any():
        return 0
    work: int = math.prod((last - first).tolist()) * len(outline)
    if work > most:
        raise InvalidSettings("the blocks of models have too many corners, or are too large")
    following = np.roll(outline, -1, axis=0)
    x = np.arange(first[0], last[0])[None, :] + 0.5
    y = np.arange(first[1], last[1])[:, None] + 0.5
    inside = np.zeros((last[1] - first[1], last[0] - first[0]), bool)
    for (x0, y0), (x1, y1) in zip(outline, following, strict=True):
        if y0 != y1:  # the rule of even and odd crossings
            inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    walls[first[1] : last[1], first[0] : last[0]] |= inside
    for start, end in zip(outline, following, strict=True):
        steps = min(int(2 * np.abs(end - start).max()) + 2, 4 * (rows + columns))
        column, row = np.floor(np.linspace(start, end, steps)).astype(int).T
        on_grid = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        walls[row[on_grid], column[on_grid]] = True
    return work
