"""Select the nodes, topics and arrows to draw, by mode and filters, as in rqt_graph."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from pipros_tools.graph.drawing.name_filter import NameFilter
from pipros_tools.graph.system_state import SystemState, TopicConnection
from pipros_tools.graph.wrong_types import WrongTypes

Mode = Literal["nodes", "active", "all"]
"""Which vertices to draw: nodes, with topics as labels; nodes and connected topics; nodes and all topics."""
MODES: tuple[Mode, ...] = ("nodes", "active", "all")
Kind = Literal["node", "topic", "frame", "group", "namespace"]
"""Kinds of vertices. A group is a box for several topics; a namespace is a box for all its contents."""

_QUIET_TOPICS = frozenset({"/rosout", "/rosout_agg", "/clock", "/statistics"})
_QUIET_NODES = re.compile(
    r"/(.*/)?(rosout|rosapi|rosbridge_websocket|(rostopic|record|rqt\w*|pipros_doctor)_\d[_\d]*)"
)
MAX_GUESSED = 20_000
"""Maximum number of possible connections between nodes that did not answer. Registrations of n nodes for one
topic make up to n² of them."""
_TF_TOPICS = frozenset({"/tf", "/tf_static"})
_PARAMETER_TOPICS = ("/parameter_descriptions", "/parameter_updates")


@dataclass(frozen=True, slots=True)
class GraphOptions:
    """Selects the parts of the graph to draw, and the direction.

    Attributes:
        mode: see `Mode`.
        nodes, topics: comma-separated patterns, see `NameFilter`.
        hide_dead_sinks: whether to leave out topics that have no subscriber.
        hide_leaf_topics: whether to leave out topics that have only one neighbour.
        hide_debug: whether to leave out `/rosout`, `/clock`, `/statistics` and tools' nodes.
        hide_tf: whether to leave out `/tf` and `/tf_static`.
        hide_unreachable: whether to leave out nodes that do not answer.
        hide_parameters: whether to leave out dynamic_reconfigure's topics.
        vertical: whether arrows lead downwards instead of to the right.
    """

    mode: Mode = "active"
    nodes: str = "/"
    topics: str = "/"
    hide_dead_sinks: bool = True
    hide_leaf_topics: bool = True
    hide_debug: bool = True
    hide_tf: bool = False
    hide_unreachable: bool = False
    hide_parameters: bool = False
    vertical: bool = False


class Key(NamedTuple):
    """Identifies a vertex by kind and name, because a node and a topic can have the same name."""

    kind: Kind
    name: str


@dataclass(frozen=True, slots=True)
class Vertex:
    """A vertex of one of the kinds in `Kind`.

    Attributes:
        group: the namespace in which the vertex is drawn; empty for none.
        is_reachable: False for a node that does not answer.
        is_gone: True for a node or topic that is no longer registered.
        members: names of the nodes and topics in a vertex that represents a group or namespace.
    """

    key: Key
    group: str = ""
    is_reachable: bool = True
    is_gone: bool = False
    members: tuple[str, ...] = ()

    @property
    def kind(self) -> Kind:
        return self.key.kind

    @property
    def name(self) -> str:
        return self.key.name


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow between two vertices, and the topic of its messages.

    Attributes:
        wrong: the type that the publisher sends and the different type that the subscriber expects.
    """

    start: Key
    end: Key
    topic: str
    wrong: WrongTypes | None = None


@dataclass(frozen=True, slots=True)
class NodeGraph:
    """The vertices, keyed by kind and name, and the arrows. Both are in a stable order."""

    vertices: Mapping[Key, Vertex] = field(default_factory=dict)
    arrows: tuple[Arrow, ...] = ()


def node_graph(
    state: SystemState,
    connections: Iterable[TopicConnection],
    unreachable: Collection[str] = (),
    options: GraphOptions | None = None,
    wrong_types: Mapping[TopicConnection, WrongTypes] | None = None,
) -> NodeGraph:
    """Build the graph from the registrations and connections.

    Args:
        connections: connections reported by the nodes that answered.
        unreachable: nodes that did not answer. Possible connections between two of them are drawn.
        wrong_types: missing connections whose ends have different types; they are also drawn.
    """
    wrong = wrong_types or {}
    builder = _Builder(
        state, frozenset((*connections, *wrong)), frozenset(unreachable), options or GraphOptions(), wrong
    )
    return builder.build()


class _Builder:
    def __init__(
        self,
        state: SystemState,
        connections: frozenset[TopicConnection],
        unreachable: frozenset[str],
        options: GraphOptions,
        wrong_types: Mapping[TopicConnection, WrongTypes],
    ) -> None:
        self._state = state
        self._wrong = wrong_types
        self._wrong_ends = {(each.topic, each.subscriber): types for each, types in wrong_types.items()}
        self._connections: dict[str, list[TopicConnection]] = {}
        for each in connections:
            self._connections.setdefault(each.topic, []).append(each)
        self._pairs: dict[str, list[TopicConnection]] = {}
        self._guesses_left = MAX_GUESSED
        self._unreachable = unreachable
        self._options = options
        self._keeps_node = NameFilter(options.nodes)
        self._keeps_topic = NameFilter(options.topics)

    def build(self) -> NodeGraph:
        nodes = [node for node in self._state.nodes() if self._shows_node(node)]
        topics = self._topics(set(nodes))
        if self._options.mode == "nodes":
            arrows = [
                Arrow(Key("node", each.publisher), Key("node", each.subscriber), topic, self._wrong.get(each))
                for topic in topics
                for each in self._pairs[topic]
            ]
            shown_topics: list[str] = []
        else:
            arrows = [
                arrow
                for topic, (publishers, subscribers) in topics.items()
                for arrow in (
                    *(Arrow(Key("node", node), Key("topic", topic), topic) for node in publishers),
                    *(self._arrow_to(node, topic) for node in subscribers),
                )
            ]
            shown_topics = list(topics)
        groups = _groups(nodes)
        vertices = [
            Vertex(Key("node", node), _group_of(node, groups), node not in self._unreachable)
            for node in nodes
        ]
        vertices += [Vertex(Key("topic", topic), _group_of(topic, groups)) for topic in shown_topics]
        return NodeGraph({vertex.key: vertex for vertex in vertices}, tuple(arrows))

    def _arrow_to(self, node: str, topic: str) -> Arrow:
        return Arrow(Key("topic", topic), Key("node", node), topic, self._wrong_ends.get((topic, node)))

    def _shows_node(self, node: str) -> bool:
        options = self._options
        if options.hide_debug and _QUIET_NODES.fullmatch(node):
            return False
        if options.hide_unreachable and node in self._unreachable:
            return False
        return self._keeps_node(node)

    def _shows_topic(self, topic: str) -> bool:
        options = self._options
        if options.hide_debug and topic in _QUIET_TOPICS:
            return False
        if options.hide_tf and topic in _TF_TOPICS:
            return False
        if options.hide_parameters and topic.endswith(_PARAMETER_TOPICS):
            return False
        return self._keeps_topic(topic)

    def _topics(self, nodes: set[str]) -> dict[str, tuple[list[str], list[str]]]:
        """Return the publishers and subscribers for each topic that is shown."""
        topics = {}
        for topic in self._state.topics():
            if not self._shows_topic(topic):
                continue
            publishers = [node for node in self._state.publishers.get(topic, ()) if node in nodes]
            subscribers = [node for node in self._state.subscribers.get(topic, ()) if node in nodes]
            if self._options.mode != "all":
                publishers, subscribers = self._connected(topic, publishers, subscribers)
            elif self._is_hidden_end(publishers, subscribers):
                continue
            if publishers or subscribers:
                topics[topic] = publishers, subscribers
        return topics

    def _is_hidden_end(self, publishers: list[str], subscribers: list[str]) -> bool:
        if self._options.hide_dead_sinks and not subscribers:
            return True
        return self._options.hide_leaf_topics and len({*publishers, *subscribers}) < 2

    def _connected(
        self, topic: str, publishers: list[str], subscribers: list[str]
    ) -> tuple[list[str], list[str]]:
        first, last = ({node: at for at, node in enumerate(nodes)} for nodes in (publishers, subscribers))
        reported = [
            each
            for each in self._connections.get(topic, ())
            if each.publisher in first and each.subscriber in last
        ]
        pairs = {*reported, *self._guessed(topic, publishers, subscribers)}
        self._pairs[topic] = sorted(pairs, key=lambda each: (first[each.publisher], last[each.subscriber]))
        sending, receiving = {each.publisher for each in pairs}, {each.subscriber for each in pairs}
        return [node for node in publishers if node in sending], [
            node for node in subscribers if node in receiving
        ]

    def _guessed(
        self, topic: str, publishers: list[str], subscribers: list[str]
    ) -> Iterator[TopicConnection]:
        """Yield the possible connections between nodes that did not answer, up to `MAX_GUESSED` in total."""
        silent = [node for node in subscribers if node in self._unreachable]
        for publisher in publishers:
            if publisher not in self._unreachable:
                continue
            for subscriber in silent:
                if not self._guesses_left:
                    return
                self._guesses_left -= 1
                yield TopicConnection(publisher, topic, subscriber)


def _groups(nodes: Iterable[str]) -> set[str]:
    """Return the top-level namespaces that contain at least two nodes."""
    counts: dict[str, int] = {}
    for node in nodes:
        group = _top_namespace(node)
        counts[group] = counts.get(group, 0) + 1
    return {group for group, count in counts.items() if group and count > 1}


def _group_of(name: str, groups: set[str]) -> str:
    group = _top_namespace(name)
    return group if group in groups else ""


def _top_namespace(name: str) -> str:
    """Return the first component: `/robot` for `/robot/arm/joint`, an empty string for `/joint`."""
    end = name.find("/", 1)
    return name[:end] if end > 0 else ""
