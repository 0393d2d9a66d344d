"""Writes the graph in Graphviz's DOT language, without a layout.

The packages graphviz and pydot are not used: they build the same lines from objects, and mainly serve to run
Graphviz, which is not needed here.
"""

from __future__ import annotations

from pipros_tools.graph.drawing.node_graph import Arrow, Key, NodeGraph, Vertex


def to_dot(graph: NodeGraph) -> str:
    """Return a digraph with nodes as ellipses, topics as boxes and namespaces as clusters."""
    lines = ["digraph graph_of_nodes {", "  rankdir=LR;", "  compound=True;"]
    groups: dict[str, list[Vertex]] = {}
    for vertex in graph.vertices.values():
        groups.setdefault(vertex.group, []).append(vertex)
    for group, vertices in groups.items():
        if not group:
            lines += [f"  {_statement(vertex)}" for vertex in vertices]
            continue
        lines += [f"  subgraph {_quoted('cluster_' + group)} {{", f"    label={_quoted(group)};"]
        lines += [f"    {_statement(vertex)}" for vertex in vertices]
        lines.append("  }")
    has_topics = any(vertex.kind == "topic" for vertex in graph.vertices.values())
    lines += [f"  {_edge(arrow, is_labelled=not has_topics)}" for arrow in graph.arrows]
    return "\n".join([*lines, "}"]) + "\n"


def _statement(vertex: Vertex) -> str:
    attributes = f"label={_quoted(vertex.name)}, shape={'ellipse' if vertex.kind == 'node' else 'box'}"
    if not vertex.is_reachable:
        attributes += ", color=red"
    return f"{_id(vertex.key)} [{attributes}];"


def _edge(arrow: Arrow, *, is_labelled: bool) -> str:
    attributes = [f"label={_quoted(arrow.topic)}"] if is_labelled else []
    attributes += ["color=red", "style=dashed"] if arrow.wrong else []
    listing = f" [{', '.join(attributes)}]" if attributes else ""
    return f"{_id(arrow.start)} -> {_id(arrow.end)}{listing};"


def _id(key: Key) -> str:
    return _quoted(f"{key.kind} {key.name}")


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
