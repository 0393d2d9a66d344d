"""Writes a drawing as PNG. Requires Pillow (`pipros[pictures]`)."""

from __future__ import annotations

import io
import itertools
from collections.abc import Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.extras import install_command
from pipros_tools.graph.drawing.scene import FONT_SIZE, Scene
from pipros_tools.graph.drawing.svg import middle_of

_SCALE = 2
_SMOOTHING = 2
"""Factor by which the picture is drawn larger and then scaled down, because Pillow does not antialias."""
_MAX_PIXELS = 60_000_000
_CURVE_STEPS = 24

Colours = dict[str, Any]
_PAPER, _INK, _LINE, _PALE = "#ffffff", "#1c2733", "#6b7785", "#5c6773"
_NODE: Colours = {"fill": "#e8f1fc", "outline": "#2f6fb3"}
_TOPIC: Colours = {"fill": "#f5f2e8", "outline": "#8a7a44"}
_UNREACHABLE: Colours = {"fill": "#fdeceb", "outline": "#c0392b"}


class PictureFailed(PiprosError):
    """The image cannot be created."""


def to_png(scene: Scene) -> bytes:
    """Return the drawing as a PNG file, at twice its size in pixels.

    Raises:
        PictureFailed: Pillow is not installed, or the image is too large. SVG has no such limit.
    """
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError:
        raise PictureFailed(
            f"PNG pictures need Pillow, which is not installed. Try: {install_command('pictures')}, or use "
            "--svg"
        ) from None
    scale = _SCALE * _SMOOTHING
    width, height = round(scene.width * scale), round(scene.height * scale)
    if width * height > _MAX_PIXELS * _SMOOTHING**2:
        raise PictureFailed(
            f"the picture ({width // _SMOOTHING} x {height // _SMOOTHING} pixels) is too large for PNG; "
            "use --svg, or show less of the graph"
        )
    image = Image.new("RGB", (width, height), _PAPER)
    canvas = ImageDraw.Draw(image)
    font = ImageFont.load_default(FONT_SIZE * scale)
    small = ImageFont.load_default((FONT_SIZE - 1) * scale)
    for name, box in scene.bands.items():
        corners = [value * scale for value in _corners(box)]
        canvas.rounded_rectangle(corners, 8 * scale, fill="#f4f6f8", outline="#c3cad1", width=scale)
        canvas.text((corners[0] + 8 * scale, corners[1] + 4 * scale), name, _PALE, small)
    for _, route, text in scene.arrows:
        points = [(x * scale, y * scale) for x, y in route]
        _draw_arrow(canvas, points, scale)
        if text:
            x, y = middle_of(points)
            canvas.text((x, y - 5 * scale), text, _PALE, small, anchor="mb")
    for vertex, box, text in scene.boxes:
        colours = _UNREACHABLE if not vertex.is_reachable else _NODE if vertex.kind == "node" else _TOPIC
        corners = [value * scale for value in _corners(box)]
        if vertex.kind == "node":
            canvas.ellipse(corners, **colours, width=round(1.4 * scale))
        else:
            canvas.rounded_rectangle(corners, 3 * scale, **colours, width=round(1.2 * scale))
        canvas.text((box.x * scale, box.y * scale), text, _INK, font, anchor="mm")
    smaller = image.resize((width // _SMOOTHING, height // _SMOOTHING), Image.Resampling.LANCZOS)
    file = io.BytesIO()
    smaller.save(file, "PNG", optimize=True)
    return file.getvalue()


def _corners(box: Any) -> tuple[float, float, float, float]:
    return (
        box.x - box.width / 2,
        box.y - box.height / 2,
        box.x + box.width / 2,
        box.y + box.height / 2,
    )


def _draw_arrow(canvas: Any, points: Sequence[tuple[float, float]], scale: int) -> None:
    line = [points[0]]
    for (x, y), (next_x, next_y) in itertools.pairwise(points):
        middle = (x + next_x) / 2
        line += [
            _bezier((x, y), (middle, y), (middle, next_y), (next_x, next_y), step / _CURVE_STEPS)
            for step in range(1, _CURVE_STEPS + 1)
        ]
    canvas.line(line, _LINE, width=round(1.3 * scale), joint="curve")
    x, y = line[-1]
    sign = 1 if line[-1][0] >= line[-2][0] else -1
    length, half = 8 * scale * sign, 3.5 * scale
    canvas.polygon([(x, y), (x - length, y - half), (x - length, y + half)], fill=_LINE)


def _bezier(*arguments: Any) -> tuple[float, float]:
    *points, part = arguments
    weights = ((1 - part) ** 3, 3 * part * (1 - part) ** 2, 3 * part**2 * (1 - part), part**3)
    x, y = (
        sum(weight * point[axis] for weight, point in zip(weights, points, strict=True)) for axis in (0, 1)
    )
    return x, y
