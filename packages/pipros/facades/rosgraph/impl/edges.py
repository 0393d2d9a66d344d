"""Graph edges and edge sets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar


class Edge:
    """An edge from one node or topic to another.

    Attributes:
        key, rkey: keys in an `EdgeList`, which consist of the label and the start (`key`) or the end
            (`rkey`).
    """

    __slots__ = ("end", "key", "label", "rkey", "start")
    __hash__: ClassVar[None]  # type: ignore[assignment]  # equal edges may have different labels

    def __init__(self, start: str, end: str, label: str = "") -> None:
        self.start = start
        self.end = end
        self.label = label
        self.key = f"{start}|{label}"
        self.rkey = f"{end}|{label}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Edge) and (self.start, self.end) == (other.start, other.end)

    def __str__(self) -> str:
        return f"{self.start}->{self.end}"


def edge_args(start: str, dest: str, direction: str, label: str) -> list[tuple[str, str, str]]:
    """Return the edges of a connection as (start, end, label).

    `direction` is "o" (outbound from `start`), "i" (inbound) or "b" (both).
    """
    edges = []
    if direction in ("o", "b"):
        edges.append((start, dest, label))
    if direction in ("i", "b"):
        edges.append((dest, start, label))
    return edges


class EdgeList:
    """A set of edges, indexed by start and end."""

    def __init__(self) -> None:
        self.edges_by_start: dict[str, list[Edge]] = {}
        self.edges_by_end: dict[str, list[Edge]] = {}

    def __iter__(self) -> Iterator[Edge]:
        return iter([edge for edges in self.edges_by_start.values() for edge in edges])

    def has(self, edge: Edge) -> bool:
        return edge in self.edges_by_start.get(edge.key, ())

    __contains__ = has

    def add(self, edge: Edge) -> bool:
        """Add an edge. Return True if it is new."""
        if edge in self:
            return False
        self.edges_by_start.setdefault(edge.key, []).append(edge)
        self.edges_by_end.setdefault(edge.rkey, []).append(edge)
        return True

    def add_edges(self, start: str, dest: str, direction: str, label: str = "") -> bool:
        """Add the edges of a connection. Return True if any of them is new."""
        added = [self.add(Edge(*arguments)) for arguments in edge_args(start, dest, direction, label)]
        return any(added)

    def delete(self, edge: Edge) -> None:
        """Delete an edge, if present."""
        for edges, key in ((self.edges_by_start, edge.key), (self.edges_by_end, edge.rkey)):
            left = [other for other in edges.get(key, ()) if other != edge]
            if left:
                edges[key] = left
            else:
                edges.pop(key, None)

    def delete_all(self, node: str) -> None:
        """Delete all edges that start or end at a node."""
        for edge in self:
            if node in (edge.start, edge.end):
                self.delete(edge)
