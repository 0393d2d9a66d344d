"""Poll the local master for its names, and for the types of its topics and services."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.fleet import keys
from pipros.fleet.fleet_file import FleetFile
from pipros.fleet.local_graph import LocalGraph, graph_of
from pipros.fleet.zenoh_session import ZenohQuestion
from pipros.graph.definitions import TopicDefinitions
from pipros.graph.services import header_at, uri_of
from pipros.graph.system_state import read_state
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.open_calls import OpenCalls

_MAX_HEADERS: Final = 10_000
"""Maximum number of services whose types are cached."""


class LocalPoller:
    """Reader of the local master's state. The methods may block for seconds, but not after `close`."""

    def __init__(self, node: Node, member: str, file: FleetFile) -> None:
        self._node = node
        self._member = member
        self._file = file
        self._calls: OpenCalls = OpenCalls()
        self._loop = BackgroundLoop(f"definitions of {node.name}")
        self._definitions = TopicDefinitions(node, self._loop, self._calls)
        self._headers: dict[tuple[str, tuple[str, ...]], tuple[str, str]] = {}

    def start(self) -> None:
        self._loop.start()

    def close(self) -> None:
        """Interrupt all running calls."""
        self._calls.interrupt()
        self._loop.stop()

    def poll(self, others: Iterable[str]) -> LocalGraph | None:
        """Return the topics and services that this member offers, except names in namespaces of `others`.

        Return None if the master does not answer.
        """
        found = read_state(self._node.master)
        if found is None:
            return None
        return graph_of(
            *found, self._file, self._member, others, self._definitions.of_topic, self._service_header
        )

    def answer_definition(self, question: ZenohQuestion, local: LocalGraph) -> None:
        """Reply with the requested type's definition, if this member shares a topic of that type."""
        try:
            match keys.parts(question.key):
                case (_, "definition", [part]):
                    kind = keys.unmangled(part)[1:]
                    entry = next((each for each in local.shared if each.type == kind), None)
                    if entry is None:
                        return
                    nodes = local.state.publishers.get(entry.name, ())
                    found = self._definitions.of_topic(entry.name, kind, list(nodes))
                    if found is not None:
                        question.answer(json.dumps([found.md5sum, found.text]).encode())
        finally:
            question.close()

    def _service_header(self, name: str, nodes: Sequence[str]) -> tuple[str, str] | None:
        key = name, tuple(nodes)
        if key not in self._headers:
            try:
                uri = uri_of(self._node.master, name)
                header = header_at(uri, name, self._node.name, self._calls) if uri is not None else {}
            except PiprosError:
                return None
            if "type" not in header or "md5sum" not in header:
                return None
            if len(self._headers) >= _MAX_HEADERS:
                self._headers.clear()
            self._headers[key] = header["type"], header["md5sum"]
        return self._headers[key]
