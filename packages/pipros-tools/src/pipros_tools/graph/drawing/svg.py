"""Writes a drawing as a standalone SVG that follows the desktop's light or dark mode.

Libraries such as svgwrite build the same text from one object per element. This module uses one f-string per
element instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from pipros_tools.graph.drawing.layered_layout import Box
from pipros_tools.graph.drawing.node_graph import Arrow, Vertex
from pipros_tools.graph.drawing.scene import FONT_SIZE, Scene

_STYLE = f"""
svg {{ background: #ffffff; color: #1c2733; font: {FONT_SIZE}px ui-sans-serif, system-ui, sans-serif; }}
.node {{ fill: #e8f1fc; stroke: #2f6fb3; stroke-width: 1.4; }}
.topic {{ fill: #f5f2e8; stroke: #8a7a44; stroke-width: 1.2; }}
.unreachable {{ fill: #fdeceb; stroke: #c0392b; stroke-dasharray: 5 3; }}
.arrow {{ fill: none; stroke: #6b7785; stroke-width: 1.3; }}
.head {{ fill: #6b7785; }}
.arrow.wrong {{ stroke: #c0392b; stroke-dasharray: 5 3; }}
.band {{ fill: #8895a3; fill-opacity: .08; stroke: #8895a3; stroke-opacity: .5; }}
.name {{ fill: currentColor; opacity: .75; font-size: {FONT_SIZE - 1}px; }}
text {{ fill: currentColor; }}
@media (prefers-color-scheme: dark) {{
svg {{ background: #14191f; color: #e4eaf0; }}
.node {{ fill: #1d3350; stroke: #6ba7e8; }}
.topic {{ fill: #33301f; stroke: #c7b46a; }}
.unreachable {{ fill: #43201e; stroke: #ef7b6f; }}
.arrow {{ stroke: #93a1b0; }}
.arrow.wrong {{ stroke: #ef7b6f; }}
.head {{ fill: #93a1b0; }}
}}
"""


def to_svg(scene: Scene) -> str:
    """Return the drawing as an SVG document."""
    width, height = round(scene.width), round(scene.height)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}">',
        f"<style>{_STYLE}</style>",
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="8" markerHeight="8" '
        'orient="auto"><path class="head" d="M0,0.5 L8,4 L0,7.5 Z"/></marker></defs>',
    ]
    parts += [_band(name, box) for name, box in scene.bands.items()]
    parts += [_arrow(arrow, route, text) for arrow, route, text in scene.arrows]
    parts += [_vertex(vertex, box, text) for vertex, box, text in scene.boxes]
    return "\n".join([*parts, "</svg>"]) + "\n"


def path(route: Sequence[tuple[float, float]], *, is_vertical: bool = False) -> str:
    """Return the SVG path data of a smooth line, horizontal (or vertical) at each of its points."""
    (x, y), *rest = route
    commands = [f"M{x:.1f},{y:.1f}"]
    for next_x, next_y in rest:
        middle = (y + next_y) / 2 if is_vertical else (x + next_x) / 2
        first, second = ((x, middle), (next_x, middle)) if is_vertical else ((middle, y), (middle, next_y))
        places = first, second, (next_x, next_y)
        commands.append("C" + " ".join(f"{across:.1f},{down:.1f}" for across, down in places))
        x, y = next_x, next_y
    return " ".join(commands)


def _band(name: str, box: Box) -> str:
    left, top = box.x - box.width / 2, box.y - box.height / 2
    return (
        f'<rect class="band" x="{left:.1f}" y="{top:.1f}" '
        f'width="{box.width:.1f}" height="{box.height:.1f}" rx="8"/>'
        f'<text class="name" x="{left + 8:.1f}" y="{top + 14:.1f}">{escape(name)}</text>'
    )


def _arrow(arrow: Arrow, route: Sequence[tuple[float, float]], text: str) -> str:
    kind = "arrow wrong" if arrow.wrong else "arrow"
    line = f'<path class="{kind}" d="{path(route)}" marker-end="url(#head)"/>'
    if not text:
        return line
    x, y = middle_of(route)
    return f'{line}<text class="name" x="{x:.1f}" y="{y - 5:.1f}" text-anchor="middle">{escape(text)}</text>'


def middle_of(route: Sequence[tuple[float, float]], part: float = 0.4) -> tuple[float, float]:
    """Return the position for an arrow's label.

    The label is nearer to the start, so that labels of opposite arrows do not overlap.

    Args:
        part: position on the middle segment, from 0 at its start to 1 at its end.
    """
    index = (len(route) - 1) // 2
    (x, y), (next_x, next_y) = route[index], route[index + 1]
    return x + (next_x - x) * part, y + (next_y - y) * part * part * (3 - 2 * part)


def _vertex(vertex: Vertex, box: Box, text: str) -> str:
    kind = vertex.kind if vertex.is_reachable else f"{vertex.kind} unreachable"
    if vertex.kind == "node":
        shape = (
            f'<ellipse class="{kind}" cx="{box.x:.1f}" cy="{box.y:.1f}" '
            f'rx="{box.width / 2:.1f}" ry="{box.height / 2:.1f}"/>'
        )
    else:
        left, top = box.x - box.width / 2, box.y - box.height / 2
        shape = (
            f'<rect class="{kind}" x="{left:.1f}" y="{top:.1f}" '
            f'width="{box.width:.1f}" height="{box.height:.1f}" rx="3"/>'
        )
    label = (
        f'<text x="{box.x:.1f}" y="{box.y:.1f}" text-anchor="middle" dominant-baseline="central">'
        f"{escape(text)}</text>"
    )
    return shape + label
