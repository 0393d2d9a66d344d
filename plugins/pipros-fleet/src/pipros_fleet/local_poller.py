"""Poll the local master for its names, and for the types of its topics and services."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.open_calls import OpenCalls
from pipros_fleet import keys
from pipros_fleet.fleet_rules import FleetFile
from pipros_fleet.local_graph import LocalGraph, graph_of
from pipros_fleet.zenoh_session import ZenohQuestion
from pipros_tools.graph.definitions import TopicDefinitions
from pipros_tools.graph.node_queries import NodeQueries
from pipros_tools.graph.services import header_at, uri_of
from pipros_tools.graph.system_state import read_state

_ANSWERS_S: Final = 0.3
"""Maximum time that `poll` waits for nodes to respond."""


class LocalPoller:
    """Reader of the local master's state. The methods may block for seconds, but not after `close`."""

    def __init__(self, node: Node, member: str, file: FleetFile) -> None:
        self._node = node
        self._member = member
        self._file = file
        self._calls: OpenCalls = OpenCalls()
        self._loop = BackgroundLoop(f"definitions of {node.name}")
        self._queries = NodeQueries(f"queries of {node.name}")
        self._definitions = TopicDefinitions(node, self._loop, self._calls, self._queries)

    def start(self) -> None:
        self._loop.start()

    def close(self) -> None:
        """Interrupt all running calls."""
        self._queries.close()
        self._calls.interrupt()
        self._loop.stop()

    def poll(self, others: Iterable[str]) -> LocalGraph | None:
        """Return the topics and services that this member offers, except names in namespaces of `others`.

        Topics and services whose nodes do not answer within `_ANSWERS_S` are offered later. Return None if
        the master does not answer.
        """
        found = read_state(self._node.master)
        if found is None:
            return None
        self._definitions.forget_all_but({*found[0].topics(), *found[0].services})

        def known() -> LocalGraph:
            return graph_of(
                *found, self._file, self._member, others, self._definitions.of_topic, self._service_header
            )

        graph = known()
        if self._queries.is_running:
            self._queries.wait(_ANSWERS_S)
            graph = known()
        return graph

    def answer_definition(self, question: ZenohQuestion, local: LocalGraph) -> None:
        """Reply with the requested type's definition, if this member shares a topic of that type."""
        kind = keys.unmangled(question.key.rpartition("/")[2])[1:]
        entry = next((each for each in local.shared if each.type == kind), None)
        if entry is not None:
            nodes = local.state.publishers.get(entry.name, ())
            found = self._definitions.of_topic(entry.name, kind, list(nodes))
            if found is not None:
                question.answer(json.dumps([found.md5sum, found.text]).encode())

    def _service_header(self, name: str, nodes: Sequence[str]) -> tuple[str, str] | None:
        """Return a service's type and MD5 sum, or None if its server has not answered yet."""
        key = name, tuple(nodes)
        answer: tuple[str, str] | None = self._queries.answer(key)
        if answer is None:
            self._queries.ask(key, partial(self._query_header, name))
        return answer

    def _query_header(self, name: str) -> tuple[str, str] | None:
        try:
            uri = uri_of(self._node.master, name)
            header = header_at(uri, name, self._node.name, self._calls) if uri is not None else {}
        except PiprosError:
            return None
        return (header["type"], header["md5sum"]) if {"type", "md5sum"} <= header.keys() else None
