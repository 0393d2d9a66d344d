"""Drawings of the graph, shared by all browsers that use the same options."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from dataclasses import dataclass, field

from pipros_tools.graph.drawing.grouping import Grouping, grouped, marked
from pipros_tools.graph.drawing.node_graph import GraphOptions, NodeGraph, node_graph
from pipros_tools.graph.drawing.scene import Scene
from pipros_tools.graph.observer import GraphObservation

MAX_OPTIONS = 32
"""Maximum number of cached drawings, each for a different combination of options."""

Draw = Callable[[NodeGraph, bool], Awaitable[Scene]]
"""Draws a graph, from top to bottom if the second argument is true."""


@dataclass(slots=True)
class _Drawing:
    """A cached drawing, with the observation for which it was last requested.

    Attributes:
        drawn: the parts of that observation that a graph has; all others, such as rates, change each second.
    """

    observation: GraphObservation | None = None
    drawn: object = None
    graph: NodeGraph = field(default_factory=NodeGraph)
    scene: asyncio.Future[Scene] | None = None


class GraphDrawings:
    """Cache of drawings. For use in one event loop."""

    def __init__(self, draw: Draw) -> None:
        """Create an empty cache. `draw` computes the drawing of a graph that is not in the cache."""
        self._draw = draw
        self._drawings: dict[tuple[GraphOptions, Grouping], _Drawing] = {}

    def graph(
        self,
        observation: GraphObservation,
        options: GraphOptions,
        grouping: Grouping | None = None,
        removed: Collection[tuple[str, str]] = (),
    ) -> NodeGraph:
        """Return the graph of an observation: the same object while the graph is cached and unchanged.

        Args:
            removed: kinds and names of the nodes and topics in the observation that no longer exist.
        """
        grouping = grouping or Grouping()
        drawing = self._drawings.pop((options, grouping), None) or _Drawing()
        self._drawings[options, grouping] = drawing  # the most recently used are last
        while len(self._drawings) > MAX_OPTIONS:
            del self._drawings[next(iter(self._drawings))]
        if drawing.observation is not observation:
            drawing.observation = observation
            state, connections = observation.state, observation.connections
            drawn = state, connections.keys(), observation.unreachable, observation.wrong_types, {*removed}
            if drawn != drawing.drawn:
                drawing.drawn = drawn
                graph = node_graph(
                    state, connections, observation.unreachable, options, observation.wrong_types
                )
                graph = grouped(marked(graph, removed), state.topics(), grouping)
                if graph != drawing.graph:
                    drawing.graph, drawing.scene = graph, None
        return drawing.graph

    async def scene(self, graph: NodeGraph, options: GraphOptions, grouping: Grouping | None = None) -> Scene:
        """Return the drawing of a graph that `graph` returned for these options."""
        drawing = self._drawings.get((options, grouping or Grouping()))
        if drawing is None or drawing.graph is not graph:
            return await self._draw(graph, options.vertical)  # the cached graph has been replaced or evicted
        if drawing.scene is None or (drawing.scene.done() and drawing.scene.exception()):
            drawing.scene = asyncio.ensure_future(self._draw(graph, options.vertical))
        return await asyncio.shield(drawing.scene)
