"""Plain values for the page: a drawing of the graph, its traffic, and the details of a node."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, pairwise
from typing import Any

from pipros.basics.printable import printable
from pipros_page.bounded_list import bounded_list
from pipros_page.stale import is_stale
from pipros_page.traffic import TopicTraffic
from pipros_tools.graph.drawing.layered_layout import Box
from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph
from pipros_tools.graph.drawing.scene import Scene
from pipros_tools.graph.drawing.svg import middle_of, path
from pipros_tools.graph.observer import GraphObservation, Traffic
from pipros_tools.graph.system_state import TopicConnection, of_node

MAX_TYPES = 300
"""Maximum number of characters of the two types of an arrow between different types."""
MAX_MEMBERS = 50
"""Maximum number of names listed for a group."""
MAX_DRAWN = 3000
"""Maximum number of nodes and topics in a drawing. For larger graphs, only the number is sent."""
MAX_CHARACTERS = 300_000
"""Maximum total length of the names in a drawing, in characters."""
LETTER, LABEL_HEIGHT = 6.3, 14.0
"""Width of a letter of a label, and the label's height (pixels), as in page/graph/canvas.js."""
_RATE_LETTERS = {False: 22, True: 7}
_WRONG_LETTERS = 10
_ROW = 40.0
_OTHER_PARTS = (0.3, 0.7, 0.15, 0.85)

_Point = tuple[float, float]
_Sums = dict[tuple[Key, Key, str], list[float]]
"""What `traffic_values` returns of each edge: its ends and its topic, with its values."""


def hidden_count(observation: GraphObservation, graph: NodeGraph) -> int:
    """Return how many nodes and topics of the system are neither in the graph nor in one of its boxes."""
    inside = {name for vertex in graph.vertices.values() for name in vertex.members}
    topics = {arrow.topic for arrow in graph.arrows}
    topics |= {name for kind, name in graph.vertices if kind == "topic"}
    nodes = {name for kind, name in graph.vertices if kind == "node"}
    state = observation.state
    return len(set(state.nodes()) - nodes - inside) + len(set(state.topics()) - topics - inside)


def can_be_drawn(graph: NodeGraph) -> bool:
    """Return whether the graph is within `MAX_DRAWN` and `MAX_CHARACTERS`."""
    characters = sum(len(vertex.name) for vertex in graph.vertices.values())
    return len(graph.vertices) <= MAX_DRAWN and characters <= MAX_CHARACTERS


def scene_values(scene: Scene) -> Mapping[str, Any]:
    """Return a drawing as JSON values for the page."""
    places = _label_places(scene)
    return {
        "width": scene.width,
        "height": scene.height,
        "vertical": scene.is_vertical,
        "boxes": [
            {
                **key_values(vertex.key),
                "text": text,
                "reachable": vertex.is_reachable,
                "gone": vertex.is_gone,
                "members": vertex.members[:MAX_MEMBERS],
                "x": round(box.x, 1),
                "y": round(box.y, 1),
                "w": round(box.width, 1),
                "h": round(box.height, 1),
            }
            for vertex, box, text in scene.boxes
        ],
        "arrows": [
            {
                "start": key_values(arrow.start),
                "end": key_values(arrow.end),
                "topic": arrow.topic,
                "text": text,
                "wrong": printable(arrow.wrong.text, MAX_TYPES) if arrow.wrong else "",
                "path": path(route, is_vertical=scene.is_vertical),
                "middle": [round(value, 1) for value in place],
            }
            for (arrow, route, text), place in zip(scene.arrows, places, strict=True)
        ],
        "bands": [
            {"name": name, "x": box.x, "y": box.y, "w": box.width, "h": box.height}
            for name, box in scene.bands.items()
        ],
    }


def _label_places(scene: Scene) -> Iterator[tuple[float, float]]:
    """Yield the centre of each arrow's label: its usual place, or the next one that nothing else covers."""
    rows: dict[int, list[Box]] = {}  # boxes and labels by their y coordinates

    def add(box: Box) -> None:
        reach = (box.height + LABEL_HEIGHT) / 2
        for row in range(int((box.y - reach) // _ROW), int((box.y + reach) // _ROW) + 1):
            rows.setdefault(row, []).append(box)

    def is_free(label: Box) -> bool:
        return not any(overlap(label, each) for each in rows.get(int(label.y // _ROW), ()))

    for _, box, _ in scene.boxes:
        add(box)

    def turned(point: _Point) -> _Point:
        return (point[1], point[0]) if scene.is_vertical else point

    for arrow, route, text in scene.arrows:
        width = LETTER * label_letters(arrow, text, is_vertical=scene.is_vertical)
        parts = (0.5 if scene.is_vertical else _label_part(arrow), *_OTHER_PARTS)
        places = (middle_of(each, part) for each in _from_middle([*map(turned, route)]) for part in parts)
        labels = (Box(*turned(place), width, LABEL_HEIGHT) for place in places)
        usual = next(labels)
        chosen = next(filter(is_free, chain([usual], labels)), usual)
        if width:
            add(chosen)
        yield chosen.x, chosen.y


def overlap(one: Box, other: Box) -> bool:
    """Return whether two rectangles have an area in common."""
    apart = abs(one.x - other.x) >= (one.width + other.width) / 2
    return not apart and abs(one.y - other.y) < (one.height + other.height) / 2


def _from_middle(points: Sequence[_Point]) -> list[tuple[_Point, _Point]]:
    """Return the segments of a route, those in the middle first."""
    pairs = list(enumerate(pairwise(points)))
    return [pair for _, pair in sorted(pairs, key=lambda each: abs(each[0] - (len(pairs) - 1) // 2))]


def label_letters(arrow: Arrow, text: str, *, is_vertical: bool) -> int:
    """Return how many letters the label of an arrow may get: its text, and a rate unless a topic sends it."""
    if arrow.wrong:
        return _WRONG_LETTERS if is_vertical else len(text)
    return len(text) + (0 if arrow.start.kind == "topic" else _RATE_LETTERS[is_vertical])


def _label_part(arrow: Arrow) -> float:
    """Return the label's relative position on the arrow: near the topic, where arrows are further apart.

    At this position, a label with a rate and a bandwidth does not cover the head of the arrow.
    """
    if arrow.wrong:  # the label names both mismatched types, and is about as long as the arrow
        return 0.5
    return 0.52 if arrow.start.kind == "node" and arrow.end.kind != "node" else 0.4


def key_values(key: Key) -> Mapping[str, str]:
    return {"kind": key.kind, "name": key.name}


def traffic_values(
    observation: GraphObservation, scene: Scene, of_topics: Mapping[str, TopicTraffic] | None = None
) -> list[list[float] | None]:
    """Return each edge's messages and bytes per second, and its last message's age (s) if the edge is stale.

    The age is 0 for other edges. The value of an edge with unknown traffic is None. The edge from the only
    publisher to its topic has the traffic of the topic, if it is in `of_topics`. A fourth value means that
    the topic is latched, and that no rate is expected.
    """
    sums: _Sums = {}
    topics = {arrow.topic for arrow, _, _ in scene.arrows}
    for connection, traffic in observation.connections.items():
        if traffic is not None and connection.topic in topics:
            _add_traffic(sums, connection, traffic)
    for name, known in (of_topics or {}).items():
        publishers = observation.state.publishers.get(name, ())
        if len(publishers) == 1:
            _set_traffic(sums.get((Key("node", publishers[0]), Key("topic", name), name)), known)
    of_arrows = (sums.get((arrow.start, arrow.end, arrow.topic)) for arrow, _, _ in scene.arrows)
    return [None if each is None else [round(value, 2) for value in each] for each in of_arrows]


def _add_traffic(sums: _Sums, connection: TopicConnection, traffic: Traffic) -> None:
    """Add a connection to the edges that may draw it: in two parts, or as one between nodes."""
    publisher = Key("node", connection.publisher)
    topic = Key("topic", connection.topic)
    subscriber = Key("node", connection.subscriber)
    age_s = traffic.quiet_s if is_stale(traffic.quiet_s, traffic.interval_s) else 0.0
    for start, end in ((publisher, topic), (topic, subscriber), (publisher, subscriber)):
        total = sums.setdefault((start, end, connection.topic), [0.0, 0.0, math.inf])
        # A message from a publisher to its topic counts once, however many subscribers there are.
        joined = max if end == topic else operator.add
        total[:] = (
            joined(total[0], traffic.rate),
            joined(total[1], traffic.bandwidth),
            min(total[2], age_s),
        )


def _set_traffic(edge: list[float] | None, known: TopicTraffic) -> None:
    if edge is None:
        return
    if known.rate is not None and known.bandwidth is not None:
        edge[:2] = known.rate, known.bandwidth
    if known.is_latched and not known.rate:
        edge.append(1.0)


def _with_types(observation: GraphObservation, topics: Iterable[str]) -> list[list[str]]:
    return bounded_list(([topic, observation.types.get(topic, "*")] for topic in topics), share=4)


def _connection_values(
    observation: GraphObservation, connection: TopicConnection, traffic: Traffic | None
) -> list[Any]:
    """Return a connection's ends, topic, rate, bandwidth and transport, and whether it is stale."""
    rate, bandwidth, quiet_s, interval_s = traffic or (None, None, 0.0, None)
    transport = observation.transports.get(connection, "")
    return [*connection, rate, bandwidth, transport, is_stale(quiet_s, interval_s)]


def node_values(observation: GraphObservation, name: str) -> Mapping[str, Any]:
    """Return the information about a node from the master and from the node itself."""
    node = observation.nodes.get(name)
    state = observation.state
    return {
        "name": name,
        "known": node is not None,
        "uri": node.uri if node else "",
        "error": node.error if node else "",
        "publications": _with_types(observation, of_node(name, state.publishers)),
        "subscriptions": _with_types(observation, of_node(name, state.subscribers)),
        "services": bounded_list(of_node(name, state.services), share=4),
        "connections": bounded_list(
            (
                _connection_values(observation, connection, traffic)
                for connection, traffic in sorted(observation.connections.items(), key=lambda item: item[0])
                if name in (connection.publisher, connection.subscriber)
            ),
            share=4,
        ),
        "wrong": bounded_list(
            (
                f"{connection.topic}: {types.text}, {connection.publisher} to {connection.subscriber}"
                for connection, types in sorted(observation.wrong_types.items())
                if name in (connection.publisher, connection.subscriber)
            ),
            share=4,
        ),
    }
