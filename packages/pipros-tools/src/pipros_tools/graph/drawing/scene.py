"""A drawing as plain values: the boxes, lines and labels that SVG, PNG, PDF and the page share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pipros.basics.printable import printable
from pipros_tools.graph.drawing.folded_layout import folded, scale_on
from pipros_tools.graph.drawing.layered_layout import LAYER_GAP, Box, GraphLayout, layered_layout
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex

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
NARROW = 480.0
"""Width in pixels of rows of vertices without arrows where arrows lead downwards: what fits on a phone."""
SCREEN = 1390.0, 780.0
"""Width and height in pixels on which a drawing with traffic should be readable."""
_MAX_LABEL_CHARACTERS = 60
_MAX_TYPE_CHARACTERS = 22


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
    """Lay out the graph.

    Args:
        with_traffic: reserve room for rates on the arrows, and break drawings wider than `SCREEN` into
            rows, or turn them, if their names are larger then.
        is_vertical: whether arrows lead downwards.
    """
    texts = {key: _label(vertex) for key, vertex in graph.vertices.items()}
    has_topics = any(vertex.kind not in ("node", "frame") for vertex in graph.vertices.values())
    sizes = {key: _size(vertex, texts[key]) for key, vertex in graph.vertices.items()}
    groups = {key: vertex.group for key, vertex in graph.vertices.items()}
    joined = _join_parallel(graph.arrows) if not has_topics else dict.fromkeys(graph.arrows, "")
    for arrow, text in joined.items():
        if arrow.wrong:
            sent, wanted = (_cut(each) for each in (arrow.wrong.sent, arrow.wrong.wanted))
            joined[arrow] = f"{text}  sent {sent}, wanted {wanted}".strip()
    ends = [(arrow.start, arrow.end) for arrow in joined]
    rooms = [_room(arrow, text, with_traffic) for arrow, text in joined.items()]

    def upright(width: float) -> GraphLayout[Key]:
        """The layout runs to the right: it gets heights as widths, and is turned."""
        turned = {key: (height, width) for key, (width, height) in sizes.items()}
        return _turned(layered_layout(turned, ends, groups, gap=VERTICAL_GAP, tallest=width))

    if is_vertical:
        layout = upright(NARROW)
    else:
        layout = layered_layout(sizes, ends, groups, gap=LAYER_GAP, rooms=rooms)
        if with_traffic and scale_on(SCREEN, layout) < 1:
            layout = folded(layout, SCREEN)
            other = upright(SCREEN[0])
            is_vertical = scale_on(SCREEN, other) > scale_on(SCREEN, layout)
            layout = other if is_vertical else layout
    return Scene(
        [(vertex, _with_margin(layout.boxes[key]), texts[key]) for key, vertex in graph.vertices.items()],
        [
            (arrow, [(x + MARGIN, y + MARGIN) for x, y in route], joined[arrow])
            for arrow, route in zip(joined, layout.routes, strict=True)
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


def _cut(name: str) -> str:
    """Shorten the name of a type in its middle."""
    part = _MAX_TYPE_CHARACTERS // 2
    return printable(name if len(name) <= 2 * part else f"{name[:part]}…{name[-part:]}")


def _room(arrow: Arrow, text: str, with_traffic: bool) -> float:
    """Return the length of an arrow with its label. Arrows from topics and of wrong types have no rates."""
    has_rate = with_traffic and not arrow.wrong and arrow.start.kind != "topic"
    return (TRAFFIC_WIDTH if has_rate else LAYER_GAP) + CHARACTER_WIDTH * len(text)


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
