"""A drawing as plain values: the boxes, lines and labels that SVG, PNG, PDF and the page share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pipros.basics.printable import printable
from pipros.graph.drawing.layered_layout import Box, GraphLayout, layered_layout
from pipros.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex

CHARACTER_WIDTH = 7.4
"""Width in pixels of a character in the widest common fonts, at label size."""
FONT_SIZE = 13
NODE_HEIGHT = 40.0
TOPIC_HEIGHT = 28.0
MARGIN = 24.0
TRAFFIC_WIDTH = 190.0
"""Width reserved for a rate and a bandwidth on an arrow."""
VERTICAL_GAP = 64.0
"""Distance between layers that are below each other, with room for a rate."""
_MAX_LABEL_CHARACTERS = 60


@dataclass(frozen=True, slots=True)
class Scene:
    """A complete drawing.

    Attributes:
        boxes: vertices with their boxes and labels.
        arrows: arrows, each with the points along it and its label.
        bands: the rectangle for each namespace.
        width, height: total size including the margin; the upper left corner is (0, 0).
        is_vertical: whether arrows lead downwards instead of to the right.
    """

    boxes: Sequence[tuple[Vertex, Box, str]] = ()
    arrows: Sequence[tuple[Arrow, Sequence[tuple[float, float]], str]] = ()
    bands: Mapping[str, Box] = field(default_factory=dict)
    width: float = 2 * MARGIN
    height: float = 2 * MARGIN
    is_vertical: bool = False


def draw(graph: NodeGraph, *, with_traffic: bool = False, is_vertical: bool = False) -> Scene:
    """Lay out the graph. `with_traffic` reserves room for rates on the arrows."""
    texts = {key: _label(vertex) for key, vertex in graph.vertices.items()}
    has_topics = any(vertex.kind not in ("node", "frame") for vertex in graph.vertices.values())
    sizes = {key: _size(vertex, texts[key]) for key, vertex in graph.vertices.items()}
    groups = {key: vertex.group for key, vertex in graph.vertices.items()}
    joined = _join_parallel(graph.arrows) if not has_topics else dict.fromkeys(graph.arrows, "")
    for arrow, text in joined.items():
        if arrow.wrong:
            joined[arrow] = f"{text}  {printable(arrow.wrong.text, 2 * _MAX_LABEL_CHARACTERS)}".strip()
    arrows = list(joined)
    label_width = CHARACTER_WIDTH * max((len(text) for text in joined.values()), default=0)
    gap = max(TRAFFIC_WIDTH, label_width) if with_traffic else 60 + label_width
    if is_vertical:  # the layout runs to the right: it gets heights as widths, and is turned afterwards
        sizes, gap = {key: (height, width) for key, (width, height) in sizes.items()}, VERTICAL_GAP
    layout = layered_layout(sizes, [(arrow.start, arrow.end) for arrow in arrows], groups, gap=gap)
    if is_vertical:
        layout = _turned(layout)
    return Scene(
        [(vertex, _with_margin(layout.boxes[key]), texts[key]) for key, vertex in graph.vertices.items()],
        [
            (arrow, [(x + MARGIN, y + MARGIN) for x, y in route], joined[arrow])
            for arrow, route in zip(arrows, layout.routes, strict=True)
        ],
        {printable(group, _MAX_LABEL_CHARACTERS): _with_margin(box) for group, box in layout.bands.items()},
        layout.width + 2 * MARGIN,
        layout.height + 2 * MARGIN,
        is_vertical,
    )


def _turned(layout: GraphLayout[Key]) -> GraphLayout[Key]:
    """Exchange x and y."""
    return GraphLayout(
        {key: Box(box.y, box.x, box.height, box.width) for key, box in layout.boxes.items()},
        [[(y, x) for x, y in route] for route in layout.routes],
        {name: Box(box.y, box.x, box.height, box.width) for name, box in layout.bands.items()},
        layout.height,
        layout.width,
    )


def _label(vertex: Vertex) -> str:
    more = f": {len(vertex.members)}" if vertex.kind == "namespace" else ""
    name = vertex.name
    if vertex.group and name != vertex.group:  # the surrounding box shows the namespace
        name = name.removeprefix(f"{vertex.group.rstrip('/')}/")
    return printable(name, _MAX_LABEL_CHARACTERS) + more


def _size(vertex: Vertex, text: str) -> tuple[float, float]:
    if vertex.kind == "node":  # the text must fit inside an ellipse
        return len(text) * CHARACTER_WIDTH * 1.12 + 34, NODE_HEIGHT
    return len(text) * CHARACTER_WIDTH + 20, TOPIC_HEIGHT


def _join_parallel(arrows: Sequence[Arrow]) -> dict[Arrow, str]:
    """Merge parallel arrows into one, labelled with its first topic and the number of other topics."""
    pairs: dict[tuple[Key, Key], list[Arrow]] = {}
    for arrow in arrows:
        pairs.setdefault((arrow.start, arrow.end), []).append(arrow)
    joined = {}
    for same in pairs.values():
        same.sort(key=lambda arrow: not arrow.wrong)  # the label shows an arrow with wrong types, if any
        more = f" +{len(same) - 1}" if len(same) > 1 else ""
        joined[same[0]] = printable(same[0].topic, _MAX_LABEL_CHARACTERS // 2) + more
    return joined


def _with_margin(box: Box) -> Box:
    return Box(box.x + MARGIN, box.y + MARGIN, box.width, box.height)
