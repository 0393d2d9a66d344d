"""Draw the graph with its traffic, show details of a node, and export the drawing as a file."""

from __future__ import annotations

import json
import time
from collections.abc import AsyncIterator, Mapping
from dataclasses import fields
from typing import Any, cast

from pipros.basics.errors import PiprosError
from pipros_page.bounded_list import bounded_list
from pipros_page.graph_drawings import GraphDrawings
from pipros_page.traffic import topic_traffic
from pipros_page.views.graph_values import (
    MAX_DRAWN,
    can_be_drawn,
    hidden_count,
    node_values,
    scene_values,
    traffic_values,
)
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph import params
from pipros_tools.graph.drawing.dot import to_dot
from pipros_tools.graph.drawing.grouping import Grouping, grouped
from pipros_tools.graph.drawing.node_graph import MODES, GraphOptions, Mode, NodeGraph, node_graph
from pipros_tools.graph.drawing.scene import Scene, draw
from pipros_tools.graph.drawing.svg import to_svg
from pipros_tools.graph.message_tree import message_tree
from pipros_tools.graph.nodes import kill
from pipros_tools.graph.observer import GraphObservation

_GROUP = "group_"
LONGEST_FILTER = 1000
MAX_PARAMETERS = 200
"""Maximum number of parameters listed for a node."""


def options_from(arguments: Mapping[str, Any]) -> tuple[GraphOptions, Grouping]:
    """Parse the options sent by a browser. The names of `Grouping` options have the prefix `group_`.

    Raises:
        RequestRefused: an option is unknown, or a value has the wrong type.
    """
    known = {field.name: field.default for field in fields(GraphOptions)}
    known |= {f"{_GROUP}{field.name}": field.default for field in fields(Grouping)}
    for name, value in arguments.items():
        if name not in known:
            raise RequestRefused(f"unknown option {name!r:.100}; the options are {', '.join(known)}")
        if type(value) is not type(known[name]):
            kind = "true or false" if isinstance(known[name], bool) else "a string"
            raise RequestRefused(f"{name} must be {kind}, got {value!r:.100}")
        if isinstance(value, str) and len(value) > LONGEST_FILTER:
            raise RequestRefused(f"{name} must have at most {LONGEST_FILTER} characters, got {len(value)}")
    mode = cast("Mode", arguments.get("mode", "active"))
    if mode not in MODES:
        raise RequestRefused(f"mode must be one of {', '.join(MODES)}, got {mode!r}")
    grouping = {
        name.removeprefix(_GROUP): value for name, value in arguments.items() if name.startswith(_GROUP)
    }
    shown = {name: value for name, value in arguments.items() if not name.startswith(_GROUP)}
    return GraphOptions(**shown), Grouping(**grouping)


class GraphViews:
    """The views of the Graph tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._drawings = GraphDrawings(self._draw)
        self._extended = GraphObservation(), GraphObservation()

    async def graph(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the drawing as `scene` whenever it changes, and the traffic on its edges periodically."""
        options, grouping = options_from(arguments)
        changes = self._system.changes
        shown: NodeGraph | None = None
        scene = Scene()
        async for observation in self._system.observations():
            removed = changes.removed()
            graph = self._drawings.graph(self._with_removed(observation), options, grouping, removed)
            if graph is not shown:
                shown = graph
                is_small = can_be_drawn(graph)
                scene = await self._drawings.scene(graph, options, grouping) if is_small else Scene()
                too_many = 0 if is_small else len(graph.vertices)
                yield {
                    "scene": scene_values(scene),
                    "too_many": too_many,
                    "most": MAX_DRAWN,
                    "names": bounded_list([*observation.state.nodes(), *observation.state.topics()]),
                    "hidden": hidden_count(observation, graph),
                }
            yield {
                "traffic": traffic_values(
                    observation, scene, topic_traffic(observation, self._system.topics.watches())
                ),
                "error": observation.error,
                "nodes": len(observation.nodes),
                "topics": len(observation.state.topics()),
                "removed": bounded_list(
                    ({"kind": kind, "name": name, "age": max(0, round(time.time() - when_s))})
                    for (kind, name), when_s in removed.items()
                ),
            }

    async def events(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the nodes and topics added and removed in the last ten minutes, whenever the list changes."""
        shown = None
        async for _observation in self._system.observations():
            this_node = "node", self._system.node.name  # omitted, because it is registered only when needed
            found = [event for event in self._system.changes.events(time.time()) if event.part != this_node]
            if found != shown:
                shown = found
                yield {
                    "events": bounded_list(
                        {
                            "when": event.when_s,
                            "added": event.is_added,
                            "kind": event.part[0],
                            "name": event.part[1],
                        }
                        for event in found
                    )
                }

    def _with_removed(self, observation: GraphObservation) -> GraphObservation:
        """Add recently removed nodes and topics to an observation. All browsers share the result."""
        if self._extended[0] is not observation:
            self._extended = observation, self._system.changes.with_removed(observation)
        return self._extended[1]

    async def master(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the reason why the master does not respond (empty if it does), now and after each change."""
        shown = None
        async for observation in self._system.observations():
            if observation.error != shown:
                shown = observation.error
                yield {"error": shown}

    async def node(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the details of one node after each observation of the system."""
        name = str(arguments["name"])
        async for observation in self._system.observations():
            yield {
                **node_values(observation, name),
                "parameters": await self._system.questions.run(self._parameters, name),
            }

    async def kill_node(self, arguments: Mapping[str, object]) -> Any:
        """Ask a node to shut down."""
        name = topic_name(arguments)
        _, failed = await self._system.questions.run(kill, self._system.graph.master, [name])
        if failed:
            raise RequestRefused(f"cannot shut down {name}: {failed[name]}")
        return True

    async def _draw(self, graph: NodeGraph, is_vertical: bool) -> Scene:
        return await self._system.computations.run(draw, graph, with_traffic=True, is_vertical=is_vertical)

    def _parameters(self, node: str) -> list[list[str]]:
        """Return a node's private parameters: names relative to the node, and values as shortened JSON."""
        try:
            found = dict(params.leaves(node, params.read(self._system.graph.master, node)))
        except PiprosError:
            return []  # no parameters, or the master does not respond, which the observation reports
        names = sorted(found)[:MAX_PARAMETERS]
        return [
            [name.removeprefix(f"{node}/"), json.dumps(message_tree(found[name]), ensure_ascii=False)]
            for name in names
        ]

    async def picture(self, arguments: Mapping[str, object]) -> Any:
        """Return the drawing as a file in the requested `format`, `svg` or `dot`."""
        rest = dict(arguments)
        kind = rest.pop("format", "svg")
        options, grouping = options_from(rest)
        observation = self._system.observation
        graph = node_graph(
            observation.state,
            observation.connections,
            observation.unreachable,
            options,
            observation.wrong_types,
        )
        graph = grouped(graph, observation.state.topics(), grouping)
        if not can_be_drawn(graph):
            raise RequestRefused(f"the graph is too large to draw: {len(graph.vertices)} nodes and topics")
        if kind == "dot":
            return to_dot(graph)
        if kind == "svg":
            return to_svg(await self._system.computations.run(draw, graph))
        raise RequestRefused(f"format must be svg or dot, got {kind!r}")
