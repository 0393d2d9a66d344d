"""Read and write a map: its YAML file, and the cells in its image.

See http://wiki.ros.org/map_server#Map_format.

Cells are numbers, stored row by row from the lowest y. 0 is free, 100 is occupied, and -1 is unknown. Values
between 0 and 100 are degrees of occupancy.
"""

from __future__ import annotations

import os
from array import array
from dataclasses import dataclass
from math import isfinite
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.safe import yaml_cpp
from pipros_libraries.maps.errors import BadMapDescription, NoMapFile
from pipros_libraries.maps.picture import read_picture
from pipros_libraries.pictures.planes import Picture

MODES = ("trinary", "scale", "raw")


@dataclass(frozen=True, slots=True)
class MapDescription:
    """The contents of a YAML file.

    Attributes:
        image: path of the image file.
        resolution: metres per pixel.
        origin: pose of the lower left corner: x and y in metres, yaw in radians.
        negate: whether white means occupied.
        occupied, free: a cell is occupied if its darkness (0 to 1) is above `occupied`, and free if it is
            below `free`.
        mode: one of MODES.
    """

    image: str
    resolution: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    negate: bool = False
    occupied: float = 0.65
    free: float = 0.196
    mode: str = "trinary"


@dataclass(frozen=True, slots=True)
class Grid:
    """A map: its description, its size in cells, and the cells."""

    description: MapDescription
    width: int
    height: int
    cells: array[int]


def read_map(file: str) -> Grid:
    """Read a map from a YAML file and its image.

    Raises:
        NoMapFile: the YAML file or the image cannot be read.
        BadMapDescription: the YAML file is invalid.
        BadMapImage: the image is invalid.
    """
    description = read_description(file)
    return make_grid(description, read_picture(description.image))


def read_description(file: str) -> MapDescription:
    """Read a YAML file. A relative image path is resolved against the file's folder.

    Values are converted as in Noetic's map_server, by the rules of yaml-cpp. Unlike in Noetic, numbers must
    be finite, and the resolution must be positive.

    Raises:
        NoMapFile: the file cannot be read.
        BadMapDescription: the file is invalid.
    """
    try:
        text = read_text(file, errors="replace")
    except OSError as error:
        raise NoMapFile(f"Map_server could not open {file}: {error}") from None
    try:
        values = yaml_cpp.load(text, file)
    except PiprosError as error:
        raise BadMapDescription(str(error)) from None
    if not isinstance(values, dict):
        raise BadMapDescription(f"{file} must be a mapping with image, resolution, origin, …, got {values!r}")
    image = _value(file, values, "image")
    if not isinstance(image, str) or not image:
        raise BadMapDescription(f"{file}: image must be the path to an image file, got {image!r}")
    origin = _value(file, values, "origin")
    if not (isinstance(origin, list) and len(origin) >= 3):  # the rest is ignored
        raise BadMapDescription(f"{file}: origin must be a list of x, y and yaw, got {origin!r}")
    resolution = _number(file, "resolution", _value(file, values, "resolution"))
    if resolution <= 0.0:
        raise BadMapDescription(f"{file}: resolution must be > 0 m/pixel, got {resolution}")
    mode = values.get("mode")
    mode = mode if isinstance(mode, str) else "trinary"
    if mode not in MODES:
        raise BadMapDescription(f"{file}: mode must be one of {', '.join(MODES)}, got {mode!r}")
    x, y, yaw = (_number(file, "origin", value) for value in origin[:3])
    negate = yaml_cpp.integer(_value(file, values, "negate"), -(2**31), 2**31 - 1)
    if negate is None:
        raise BadMapDescription(f"{file}: negate must be 0 or 1, got {values['negate']!r}")
    return MapDescription(
        os.path.join(os.path.dirname(file), image),
        resolution,
        (x, y, yaw),
        bool(negate),
        _number(file, "occupied_thresh", _value(file, values, "occupied_thresh")),
        _number(file, "free_thresh", _value(file, values, "free_thresh")),
        mode,
    )


def _value(file: str, values: dict[Any, Any], key: str) -> Any:
    try:
        return values[key]
    except KeyError:
        raise BadMapDescription(f"{file}: missing required key {key!r}") from None


def _number(file: str, key: str, value: Any) -> float:
    found = yaml_cpp.number(value)
    if found is not None and isfinite(found):
        return found
    raise BadMapDescription(f"{file}: {key} must be a finite number, got {value!r}")


def make_grid(description: MapDescription, picture: Picture) -> Grid:
    """Convert an image to the cells of a map.

    As in Noetic, the grey value of a coloured pixel is the mean of its channels. In mode `trinary`, the mean
    includes alpha, and a grey picture with alpha is treated as a picture with three equal colour channels and
    alpha. In mode `scale`, transparent cells that are neither free nor occupied are unknown.
    """
    channels = picture.colors
    if picture.alpha is not None and description.mode == "trinary":
        channels = (*(channels * 3 if len(channels) == 1 else channels), picture.alpha)
    count = len(channels)
    table = [_cell(description, total / count) for total in range(255 * count + 1)]
    if count == 1:
        cells = channels[0].translate(bytes(table))
    else:
        cells = bytes(map(table.__getitem__, map(sum, zip(*channels, strict=True))))
    if picture.alpha is not None and description.mode == "scale":
        partial = range(1, 100)  # values of cells that are neither free nor occupied
        cells = bytes(
            255 if not alpha and cell in partial else cell
            for cell, alpha in zip(cells, picture.alpha, strict=True)
        )
    width = picture.width
    rows = [cells[start : start + width] for start in range(0, len(cells), width)]
    return Grid(description, width, picture.height, array("b", b"".join(reversed(rows))))


def _cell(description: MapDescription, grey: float) -> int:
    """Return the cell for a grey value (0 to 255) as a byte, in which 255 means -1."""
    if description.negate:
        grey = 255.0 - grey
    if description.mode == "raw":
        return int(grey)
    darkness = (255.0 - grey) / 255.0
    if darkness > description.occupied:
        return 100
    if darkness < description.free:
        return 0
    if description.mode == "trinary" or description.occupied <= description.free:
        return 255
    part = (darkness - description.free) / (description.occupied - description.free)
    return int(1 + 98 * part)


FREE, OCCUPIED, UNKNOWN = 254, 0, 205
"""The grey values used in a saved map."""


def grid_pixels(width: int, cells: Any, free: int, occupied: int) -> bytes:
    """Return one byte per cell, row by row from the top.

    Cells from 0 to `free` are white, cells >= `occupied` are black, and all other cells are grey.
    """
    greys = bytes(
        UNKNOWN if value > 127 else FREE if value <= free else OCCUPIED if value >= occupied else UNKNOWN
        for value in range(256)
    )
    pixels = array("b", cells).tobytes().translate(greys)
    rows = [pixels[start : start + width] for start in range(0, len(pixels), width)] if width else []
    return b"".join(reversed(rows))


def description_text(image: str, resolution: float, origin: tuple[float, float, float]) -> str:
    """Return the YAML text for a saved map, identical to the output of Noetic's map_saver."""
    x, y, yaw = origin
    return (
        f"image: {image}\nresolution: {resolution:f}\norigin: [{x:f}, {y:f}, {yaw:f}]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n\n"
    )
