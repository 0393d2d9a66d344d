"""Draw the graph with its traffic, show details of a node, and export the drawing as a file."""

from __future__ import annotations

import json
import math
import operator
import time
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any, cast

from pipros.basics.errors import PiprosError
from pipros.graph import params
from pipros.graph.drawing.dot import to_dot
from pipros.graph.drawing.grouping import Grouping, grouped
from pipros.graph.drawing.node_graph import MODES, Arrow, GraphOptions, Key, Mode, NodeGraph, node_graph
from pipros.graph.drawing.scene import Scene, draw
from pipros.graph.drawing.svg import middle_of, path, to_svg
from pipros.graph.message_tree import message_tree
from pipros.graph.nodes import kill
from pipros.graph.observer import GraphObservation, Traffic
from pipros.graph.system_state import TopicConnection, of_node
from pipros.server.view_server import RequestRefused
from pipros.web.bounded_list import bounded_list
from pipros.web.graph_drawings import GraphDrawings
from pipros.web.stale import is_stale
from pipros.web.traffic import TopicTraffic, topic_traffic
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

_GROUP = "group_"
LONGEST_FILTER = 1000
MAX_PARAMETERS = 200
"""Maximum number of parameters listed for a node."""
MAX_MEMBERS = 50
"""Maximum number of names listed for a group."""
MAX_DRAWN = 3000
"""Maximum number of nodes and topics in a drawing. For larger graphs, only the number is sent."""
MAX_CHARACTERS = 300_000
"""Maximum total length of the names in a drawing, in characters."""


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
                is_small = _can_be_drawn(graph)
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
        if not _can_be_drawn(graph):
            raise RequestRefused(f"the graph is too large to draw: {len(graph.vertices)} nodes and topics")
        if kind == "dot":
            return to_dot(graph)
        if kind == "svg":
            return to_svg(await self._system.computations.run(draw, graph))
        raise RequestRefused(f"format must be svg or dot, got {kind!r}")


def hidden_count(observation: GraphObservation, graph: NodeGraph) -> int:
    """Return how many nodes and topics of the system are neither in the graph nor in one of its boxes."""
    inside = {name for vertex in graph.vertices.values() for name in vertex.members}
    topics = {arrow.topic for arrow in graph.arrows}
    topics |= {name for kind, name in graph.vertices if kind == "topic"}
    nodes = {name for kind, name in graph.vertices if kind == "node"}
    state = observation.state
    return len(set(state.nodes()) - nodes - inside) + len(set(state.topics()) - topics - inside)


def _can_be_drawn(graph: NodeGraph) -> bool:
    characters = sum(len(vertex.name) for vertex in graph.vertices.values())
    return len(graph.vertices) <= MAX_DRAWN and characters <= MAX_CHARACTERS


def scene_values(scene: Scene) -> Mapping[str, Any]:
    """Return a drawing as JSON values for the page."""
    return {
        "width": scene.width,
        "height": scene.height,
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
                "wrong": bool(arrow.wrong),
                "path": path(route, is_vertical=scene.is_vertical),
                "middle": [round(value, 1) for value in _label_place(scene, arrow, route)],
            }
            for arrow, route, text in scene.arrows
        ],
        "bands": [
            {"name": name, "x": box.x, "y": box.y, "w": box.width, "h": box.height}
            for name, box in scene.bands.items()
        ],
    }


def _label_place(scene: Scene, arrow: Arrow, route: Sequence[tuple[float, float]]) -> tuple[float, float]:
    if not scene.is_vertical:
        return middle_of(route, _label_part(arrow))
    down, along = middle_of([(y, x) for x, y in route], 0.5)
    return along, down


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
    sums: dict[tuple[Key, Key, str], list[float]] = {}
    for connection, traffic in observation.connections.items():
        if traffic is None:
            continue
        publisher, topic, subscriber = (
            Key("node", connection.publisher),
            Key("topic", connection.topic),
            Key("node", connection.subscriber),
        )
        for start, end in ((publisher, topic), (topic, subscriber), (publisher, subscriber)):
            total = sums.setdefault((start, end, connection.topic), [0.0, 0.0, math.inf])
            # A message from a publisher to its topic counts once, however many subscribers there are.
            joined = max if start == publisher and end == topic else operator.add
            age_s = traffic.quiet_s if is_stale(traffic.quiet_s, traffic.interval_s) else 0.0
            total[:] = (
                joined(total[0], traffic.rate),
                joined(total[1], traffic.bandwidth),
                min(total[2], age_s),
            )
    for name, known in (of_topics or {}).items():
        publishers = observation.state.publishers.get(name, ())
        for node in publishers if len(publishers) == 1 else ():
            edge = sums.get((Key("node", node), Key("topic", name), name))
            if edge is not None and known.rate is not None and known.bandwidth is not None:
                edge[:2] = known.rate, known.bandwidth
            if edge is not None and known.is_latched and not known.rate:
                edge.append(1.0)
    return [
        [round(value, 2) for value in found]
        if (found := sums.get((arrow.start, arrow.end, arrow.topic)))
        else None
        for arrow, _, _ in scene.arrows
    ]


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
