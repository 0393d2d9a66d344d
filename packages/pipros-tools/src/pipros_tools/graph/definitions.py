"""Find the definitions of topic and service types, in installed packages or by querying a peer."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from pipros.basics.errors import PiprosError, ProtocolError
from pipros.msg import load_service_class
from pipros.msg.class_finder import ClassFinder, installed_class
from pipros.net import tcpros_client
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_async_client import call_async
from pipros.node import Node
from pipros.node.open_calls import OpenCalls
from pipros.wire.handshake import ANY, WireType, request_topic_link
from pipros_tools.graph.node_queries import NodeQueries
from pipros_tools.graph.services import header_of

HEADER_S: Final = 5.0
"""Timeout for the connection header of a publisher."""
LATCHING_PUBLISHERS: Final = 20
"""Maximum number of a topic's publishers that are queried to find out whether they latch messages."""
RETRY_S: Final = 10.0
"""Time after which a peer that did not send its definition is queried again."""
CORRECTION_S: Final = 10.0
"""Minimum time between two replacements of a definition, if publishers have different definitions."""

PROBE_SUFFIX: Final = "_types"
"""Appended to the node's name in queries to publishers. Genuine rospy drops the older of two connections with
the same caller ID: with the node's own name, a query would end the node's subscription to the topic."""

Key = tuple[str, str, tuple[str, ...]]
"""Name, type (of topics) and nodes of a topic or service."""


@dataclass(frozen=True, slots=True)
class Definition:
    """A topic type.

    Attributes:
        text: the definition, followed by the definitions of all embedded types.
    """

    type: str
    md5sum: str
    text: str = field(repr=False)


@dataclass(frozen=True, slots=True)
class ServiceDefinition:
    """A service type. The definitions have the same form as `Definition.text`."""

    type: str
    md5sum: str
    request_text: str = field(repr=False)
    response_text: str = field(repr=False)


class TopicDefinitions:
    """Finds definitions. Thread-safe.

    The methods that return definitions, and `is_latched`, may block, unless `queries` is given.
    """

    def __init__(
        self, node: Node, loop: BackgroundLoop, calls: OpenCalls, queries: NodeQueries | None = None
    ) -> None:
        """Create a finder.

        Args:
            loop: runs queries to publishers.
            calls: can interrupt queries to services.
            queries: runs queries to all peers. Until a peer has responded, the methods return None or, if the
                nodes of a topic have changed, its last definition.
        """
        self._node = node
        self._queries = queries
        self._latest: dict[str, Definition] = {}
        self._loop = loop
        self._calls = calls
        self._classes = ClassFinder()
        self._installed: dict[str, Definition | None] = {}
        self._asked: dict[Key, tuple[float, Any]] = {}
        self._corrected: dict[str, tuple[float, Definition]] = {}
        self._lock = threading.Lock()

    def of_topic(self, topic: str, kind: str, publishers: Sequence[str]) -> Definition | None:
        """Return the definition of a topic's type, or None if it cannot be determined."""
        with self._lock:
            corrected = self._corrected.get(topic)
        if corrected is not None and corrected[1].type == kind:
            return corrected[1]
        if kind not in self._installed:
            of_kind = installed_class(kind)
            self._installed[kind] = Definition(kind, of_kind._md5sum, of_kind._full_text) if of_kind else None
        found = self._installed[kind] or self._ask((topic, kind, tuple(publishers)), self._topic_of_publisher)
        if self._queries is None:
            return found
        if found is None and (last := self._latest.get(topic)) is not None and last.type == kind:
            return last
        if found is not None:
            self._latest[topic] = found
        return found

    def is_latched(self, topic: str, publishers: Sequence[str]) -> bool:
        """Return True if one of a topic's publishers responds and latches its messages."""
        return bool(self._ask((topic, "latching", tuple(publishers)), self._latching))

    def of_service(self, name: str, providers: Sequence[str]) -> ServiceDefinition | None:
        """Return a service's definition.

        Return None if no provider responds, or if its type is not installed or differs from the installed
        type.
        """
        found: ServiceDefinition | None = self._ask((name, "", tuple(providers)), self._service_of_provider)
        return found

    def correct(self, topic: str, header: Mapping[str, str]) -> bool:
        """Use a publisher's definition for a topic from now on.

        Return False if the definition is invalid, or if the last correction was less than `CORRECTION_S` ago.
        """
        kind, md5sum, text = (header.get(name, "") for name in ("type", "md5sum", "message_definition"))
        now_s = time.monotonic()
        with self._lock:
            if now_s - self._corrected.get(topic, (-CORRECTION_S,))[0] < CORRECTION_S:
                return False
        definition = self._checked(kind, md5sum, text)
        if definition is None:
            return False
        with self._lock:
            self._corrected[topic] = now_s, definition
        return True

    def forget_all_but(self, keys: set[str]) -> None:
        """Forget all topics and services whose names are not in `keys`."""
        with self._lock:
            self._corrected = {name: kept for name, kept in self._corrected.items() if name in keys}
        # Copy first: other threads add entries, and copying a dictionary is atomic, unlike iterating over it.
        self._latest = {name: kept for name, kept in self._latest.copy().items() if name in keys}
        self._asked = {key: kept for key, kept in self._asked.copy().items() if key[0] in keys}
        if self._queries is not None:
            self._queries.forget_all_but(lambda key: key[0] in keys)

    def _ask(self, key: Key, ask: Any) -> Any:
        """Query a peer, and cache its response for as long as the same nodes are registered."""
        if self._queries is not None:
            if (answer := self._queries.answer(key)) is None:
                self._queries.ask(key, partial(ask, key))
            return answer
        asked_s, answer = self._asked.get(key, (0.0, None))
        if answer is None and time.monotonic() - asked_s > RETRY_S:
            answer = ask(key)
            self._asked[key] = time.monotonic(), answer
        return answer

    def _latching(self, key: Key) -> bool | None:
        headers = list(self._headers(key[0], key[2][:LATCHING_PUBLISHERS]))
        return any(header.get("latching") == "1" for header in headers) if headers else None

    def _headers(self, topic: str, publishers: Sequence[str]) -> Iterator[Mapping[str, str]]:
        """Yield the connection headers of the publishers that respond."""
        for publisher in publishers:
            try:
                uri = self._node.master.lookup_node(publisher)
                yield self._loop.run(self._header(uri, topic), 2 * HEADER_S)
            except asyncio.CancelledError:  # the loop has stopped
                return
            except (PiprosError, ValueError, TimeoutError):
                continue

    def _topic_of_publisher(self, key: Key) -> Definition | None:
        topic, kind, publishers = key
        for header in self._headers(topic, publishers[:3]):
            if header.get("type") == kind:
                text = header.get("message_definition", "")
                return self._checked(kind, header.get("md5sum", ""), text)
        return None

    async def _header(self, uri: str, topic: str) -> Mapping[str, str]:
        """Request the connection header of a publisher, without receiving messages."""
        name = self._node.name + PROBE_SUFFIX
        answer = await call_async(uri, "requestTopic", name, topic, [["TCPROS"]], timeout_s=HEADER_S)
        match answer:
            case [1, _, ["TCPROS", str(host), int(port)]]:
                wanted = request_topic_link(topic, name, WireType(ANY, ANY), tcp_nodelay=False)
                connection = await tcpros_client.connect(host, port, wanted)
                connection.sock.close()
                return connection.fields
        raise ProtocolError(f"{uri} does not offer [{topic}]")

    def _checked(self, kind: str, md5sum: str, text: str) -> Definition | None:
        """Return a peer's definition, or None if it is invalid, too large or does not match the md5 sum."""
        try:
            found = self._classes.find(kind, md5sum, text)
        except PiprosError:
            return None
        return Definition(kind, md5sum, found._full_text) if found._md5sum == md5sum else None

    def _service_of_provider(self, key: Key) -> ServiceDefinition | None:
        try:
            header = header_of(self._node.master, key[0], self._calls)
            found: Any = load_service_class(header.get("type", "")) if header is not None else None
        except (PiprosError, ValueError):
            return None
        if header is None or header.get("md5sum") != found._md5sum:
            return None
        request, response = found._request_class, found._response_class
        return ServiceDefinition(found._type, found._md5sum, request._full_text, response._full_text)
