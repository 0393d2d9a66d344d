"""Make graphs smaller: draw related topics, or each namespace of a large graph, as one box."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex

MAX_BOXES = 150
"""In graphs with more nodes and topics than this, namespaces are collapsed."""

_ACTION_TOPICS = ("goal", "cancel", "status", "feedback", "result")
_TRANSPORTS = ("compressed", "compressedDepth", "theora", "zstd")
_TF_TOPICS = ("/tf", "/tf_static")


@dataclass(frozen=True, slots=True)
class Grouping:
    """Options for grouping.

    Attributes:
        actions: whether to draw the five topics of an action as one box.
        images: whether to draw an image topic and its compressed topics as one box.
        tf: whether to draw `/tf` and `/tf_static` as one box.
        opened: comma-separated namespaces that stay open in a large graph.
    """

    actions: bool = False
    images: bool = False
    tf: bool = False
    opened: str = ""


def grouped(graph: NodeGraph, topics: Collection[str], grouping: Grouping) -> NodeGraph:
    """Return a graph in which each topic group is one box. Namespaces are collapsed if the graph is large.

    Args:
        topics: all topics of the system, to distinguish actions from other topics named `goal`.
    """
    group_of = _topic_groups(graph, topics, grouping)
    graph = _merged(graph, lambda vertex: group_of.get(vertex.name) if vertex.kind == "topic" else None)
    if len(graph.vertices) <= MAX_BOXES:
        return graph
    opened = {name.strip() for name in grouping.opened.split(",")}
    counts = Counter(ns for vertex in graph.vertices.values() for ns in _namespaces(vertex.name))

    def namespace_of(vertex: Vertex) -> Vertex | None:
        closed = next((ns for ns in _namespaces(vertex.name) if ns not in opened), "")
        if counts[closed] < 2:
            return None
        return Vertex(Key("namespace", closed), "" if closed.count("/") < 2 else vertex.group)

    return _merged(graph, namespace_of)


def marked(graph: NodeGraph, removed: Collection[tuple[str, str]]) -> NodeGraph:
    """Return a graph in which the vertices with a kind and name in `removed` are marked as removed."""
    if not removed:
        return graph
    vertices = {
        key: replace(vertex, is_gone=True) if tuple(key) in removed else vertex
        for key, vertex in graph.vertices.items()
    }
    return NodeGraph(vertices, graph.arrows)


def _topic_groups(graph: NodeGraph, topics: Collection[str], grouping: Grouping) -> Mapping[str, Vertex]:
    known = frozenset(topics)
    shown = [vertex for vertex in graph.vertices.values() if vertex.kind == "topic"]
    found = {}
    for vertex in shown:
        base, _, last = vertex.name.rpartition("/")
        if grouping.tf and vertex.name in _TF_TOPICS:
            name = "tf"
        elif grouping.actions and base and {f"{base}/{part}" for part in _ACTION_TOPICS} <= known:
            name = f"{base} (action)" if last in _ACTION_TOPICS else ""
        elif grouping.images and last in _TRANSPORTS and base in known:
            name = f"{base} (image)"
        elif grouping.images and any(f"{vertex.name}/{transport}" in known for transport in _TRANSPORTS):
            name = f"{vertex.name} (image)"
        else:
            name = ""
        if name:
            found[vertex.name] = Vertex(Key("group", name), vertex.group)
    sizes = Counter(group.key for group in found.values())
    return {topic: group for topic, group in found.items() if sizes[group.key] > 1}


def _merged(graph: NodeGraph, group_of: Callable[[Vertex], Vertex | None]) -> NodeGraph:
    """Replace vertices by their groups. Drop arrows within a group, and merge parallel arrows."""
    key_of: dict[Key, Key] = {}
    vertices: dict[Key, Vertex] = {}
    members: dict[Key, list[str]] = {}
    for key, vertex in graph.vertices.items():
        group = group_of(vertex)
        if group is None:
            vertices[key], key_of[key] = vertex, key
            continue
        key_of[key] = group.key
        vertices.setdefault(group.key, replace(group, is_gone=True))
        if not vertex.is_gone:
            vertices[group.key] = replace(group, is_gone=False)
        members.setdefault(group.key, []).extend(vertex.members or (vertex.name,))
    if not members:
        return graph
    for key, names in members.items():
        vertices[key] = replace(vertices[key], members=tuple(names))
    arrows = [
        arrow
        for arrow in graph.arrows
        if key_of[arrow.start] == arrow.start and key_of[arrow.end] == arrow.end
    ]
    joined: dict[tuple[Key, Key], Arrow] = {}
    for arrow in graph.arrows:
        start, end = key_of[arrow.start], key_of[arrow.end]
        is_joined = (start in members or end in members) and start != end
        if is_joined and (arrow.wrong or (start, end) not in joined):
            joined[start, end] = Arrow(start, end, arrow.topic, arrow.wrong)
    return NodeGraph(vertices, (*arrows, *joined.values()))


def _namespaces(name: str) -> Iterable[str]:
    """Yield the namespaces of a name, outermost first: `/a` and `/a/b` for `/a/b/c`."""
    end = name.find("/", 1)
    while end > 0:
        yield name[:end]
        end = name.find("/", end + 1)
