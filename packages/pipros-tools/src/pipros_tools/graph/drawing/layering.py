"""Assign the vertices of a directed graph to layers. Vertices are numbered from 0."""

from __future__ import annotations

from collections.abc import Sequence


def back_arrows(count: int, arrows: Sequence[tuple[int, int]]) -> set[int]:
    """Return the indices of the arrows to a vertex on the current path of a depth-first search."""
    leaving: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    incoming = [0] * count
    for index, (start, end) in enumerate(arrows):
        if start != end:
            leaving[start].append((index, end))
            incoming[end] += 1
    closing = set()
    state = [0] * count  # 1: on the path, 2: done
    for first in sorted(range(count), key=lambda vertex: (incoming[vertex] > 0, vertex)):
        if state[first]:
            continue
        state[first] = 1
        way = [(first, iter(leaving[first]))]
        while way:
            vertex, rest = way[-1]
            for index, end in rest:
                if state[end] == 1:
                    closing.add(index)
                elif not state[end]:
                    state[end] = 1
                    way.append((end, iter(leaving[end])))
                    break
            else:
                state[vertex] = 2
                way.pop()
    return closing


def layers_of(count: int, arrows: Sequence[tuple[int, int]]) -> list[int]:
    """Return the layer of each vertex, from left to right. The arrows must close no cycle.

    Each vertex is to the right of its predecessors, and each source is directly before its nearest
    successor.
    """
    after: list[list[int]] = [[] for _ in range(count)]
    missing = [0] * count
    for start, end in arrows:
        after[start].append(end)
        missing[end] += 1
    layer = [0] * count
    ready = [vertex for vertex in range(count) if not missing[vertex]]
    is_source = [not missing[vertex] for vertex in range(count)]
    order = []
    while ready:
        vertex = ready.pop()
        order.append(vertex)
        for end in after[vertex]:
            layer[end] = max(layer[end], layer[vertex] + 1)
            missing[end] -= 1
            if not missing[end]:
                ready.append(end)
    for vertex in reversed(order):  # a source is placed just before its nearest successor
        if is_source[vertex] and after[vertex]:
            layer[vertex] = min(layer[end] for end in after[vertex]) - 1
    return layer


def nearest_layers(count: int, arrows: Sequence[tuple[int, int]]) -> list[int]:
    """Return layers by the distance from the nearest vertex without predecessors."""
    after: list[list[int]] = [[] for _ in range(count)]
    is_source = [True] * count
    for start, end in arrows:
        after[start].append(end)
        is_source[end] = False
    layer = [-1] * count
    starts = [
        [vertex for vertex in range(count) if is_source[vertex]],
        *([vertex] for vertex in range(count)),
    ]
    for reached in starts:
        reached = [vertex for vertex in reached if layer[vertex] < 0]
        distance = 0
        while reached:
            for vertex in reached:
                layer[vertex] = distance
            distance += 1
            reached = sorted({end for vertex in reached for end in after[vertex] if layer[end] < 0})
    return layer
