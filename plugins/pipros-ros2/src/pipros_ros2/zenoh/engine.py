"""The engine for ROS 2 nodes that use rmw_zenoh."""

from __future__ import annotations

import atexit
import itertools
import json
import logging
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from typing import Any, Final

from pipros.basics.budget import Budget
from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command
from pipros.basics.printable import printable
from pipros_ros2.interface import (
    NO_HASHES,
    ZENOH_MESSAGE_BYTES,
    Endpoint,
    EndpointKind,
    EngineError,
    EngineProblem,
    PartHashes,
    Ros2Caller,
    Ros2Publisher,
    Ros2Subscription,
    Sample,
    TopicQos,
)
from pipros_ros2.zenoh.endpoints import ZenohClient, ZenohPublisher, ZenohServer, ZenohSubscriber, received
from pipros_ros2.zenoh.tokens import (
    NO_HASH,
    NodeIdentity,
    endpoint_token,
    gid_of_hash,
    graph_key,
    node_token,
    parse_token,
)
from pipros_rosbag2.names import zenoh_key

ROS2_GRAPH_BYTES = 16 * 1024 * 1024
"""Limit: all endpoints of other processes that a gateway on Zenoh stores; a process can use at most half of
the memory that others leave free. Beyond it, further ROS 2 endpoints are ignored, with a warning.
"""

ROUTER: Final = "tcp/localhost:7447"
"""The default address of rmw_zenoh's router."""

_LOG = logging.getLogger("pipros_ros2")
_CLOSE_S: Final = 1.0
_GRAPH_CHANGES: Final = 4096
_TOKEN_BYTES: Final = 1000
"""Approximate memory of a parsed token, besides its text."""


def zenoh_libraries() -> tuple[Any, Any]:
    """Return the modules zenoh and xxhash.

    Raises:
        MissingExtra: one of them is not installed.
    """
    try:
        import xxhash
        import zenoh
        import zenoh.ext
    except ImportError:
        raise MissingExtra(
            f"rmw_zenoh needs eclipse-zenoh and xxhash: {install_command('pipros-ros2[zenoh]')}"
        ) from None
    return zenoh, xxhash


class ZenohEngine:
    """A session with a Zenoh router, and one node. See `Ros2Engine`.

    Args:
        node: full name of the node that owns all endpoints.
        routers: endpoints of routers, such as `tcp/localhost:7447`.
        timeout_s: timeout for connecting to a router.

    Attributes:
        session, library: for the endpoints; see `ZenohConnection`.

    Raises:
        MissingExtra: eclipse-zenoh or xxhash is not installed.
        EngineError: no router answers.
    """

    def __init__(
        self,
        domain: int,
        node: str,
        routers: Sequence[str] = (ROUTER,),
        *,
        timeout_s: float = 5.0,
    ) -> None:
        self.library, self._xxhash = zenoh_libraries()
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._numbers = itertools.count(1)
        self._known: dict[str, Endpoint] = {}
        self._gids: dict[bytes, str] = {}  # the sessions of known endpoints
        self._counts: Counter[tuple[EndpointKind, str, str]] = Counter()
        self._known_bytes = Budget(ROS2_GRAPH_BYTES)
        self._shares: dict[str, Budget] = {}
        self._ignored = 0
        self._is_closed = False
        self._threads: list[threading.Thread] = []
        try:
            self.session = self.library.open(_config(self.library, routers, timeout_s))
        except self.library.ZError as error:
            reason = str(error).partition(" at /")[0]  # omit the location in the library's source
            raise EngineError(f"no Zenoh router answers at {', '.join(routers)}: {reason}") from error
        namespace, _, name = node.rpartition("/")
        self._zid = str(self.session.zid())
        self.node = NodeIdentity(domain, self._zid, namespace, name)
        self._tokens = self.session.liveliness()
        self._node_token = self._tokens.declare_token(node_token(self.node))
        changes = self.library.handlers.FifoChannel(_GRAPH_CHANGES)
        self._graph = self._tokens.declare_subscriber(graph_key(domain), changes, history=True)
        self.start("graph", self._watch_graph)
        # A thread that is waiting in the library when Python exits aborts the process.
        atexit.register(self.close)

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        return ZenohPublisher(self, topic, type_name, type_hash, qos)

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Ros2Subscription:
        return ZenohSubscriber(self, topic, type_name, type_hash, qos, callback)

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes | None],
        parts: PartHashes = NO_HASHES,
    ) -> Ros2Subscription:
        del parts
        return ZenohServer(self, service, type_name, type_hash, answer)

    def caller(
        self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES
    ) -> Ros2Caller:
        del parts
        return ZenohClient(self, service, type_name, type_hash)

    def lacks(self, type_name: str) -> str:
        del type_name
        return ""

    def endpoints(self) -> Sequence[Endpoint]:
        with self._lock:
            return list(self._known.values())

    def problems(self) -> Sequence[EngineProblem]:
        return ()

    def close(self) -> None:
        with self._lock:
            if self._is_closed:
                return
            self._is_closed = True
            self._changed.notify_all()
        atexit.unregister(self.close)
        try:
            self.session.close()
        except self.library.ZError as error:  # raised after 10 s
            _LOG.warning("the Zenoh session was not closed in time: %s", error)
        with self._lock:
            threads = self._threads
        for thread in threads:
            if thread is not threading.current_thread():
                thread.join(_CLOSE_S)

    def start(self, name: str, run: Callable[[], None]) -> None:
        thread = threading.Thread(target=run, name=f"zenoh {name}", daemon=True)
        thread.start()
        with self._lock:  # after the start, because `close` can join only started threads
            self._threads = [each for each in self._threads if each.is_alive()] + [thread]

    def new_endpoint(
        self, kind: EndpointKind, name: str, type_name: str, type_hash: str, qos: TopicQos
    ) -> tuple[str, bytes, str]:
        with self._lock:
            if self._is_closed:
                raise EngineError("the Zenoh session is closed")
        key = zenoh_key(self.node.domain, name, type_name, type_hash or NO_HASH)
        text = endpoint_token(self.node, next(self._numbers), kind, name, type_name, type_hash, qos)
        return key, self._gid(text), text

    def declare(self, token: str) -> Any:
        return self._tokens.declare_token(token)

    def _gid(self, token: str) -> bytes:
        return gid_of_hash(self._xxhash.xxh3_128_intdigest(token.encode()))

    def wait_for_endpoint(self, gid: bytes, timeout_s: float) -> bool:
        def is_over() -> bool:
            return self._is_closed or gid in self._gids

        with self._changed:
            return self._changed.wait_for(is_over, timeout_s) and not self._is_closed

    def session_of(self, gid: bytes) -> str:
        return self._gids.get(gid, "")

    def count(self, kind: EndpointKind, name: str, type_name: str) -> int:
        return self._counts[kind, name, type_name]

    def _watch_graph(self) -> None:
        for change in received(self.library, self._graph.handler):
            token = str(change.key_expr)
            is_new = change.kind == self.library.SampleKind.PUT
            parsed = parse_token(token)
            if parsed is None or parsed[0] == self._zid:
                continue
            endpoint = replace(parsed[1], key=self._gid(token)) if is_new else None
            with self._changed:
                self._change(token, parsed[0], endpoint)
                self._changed.notify_all()

    def _change(self, token: str, session: str, endpoint: Endpoint | None) -> None:
        cost = 2 * len(token) + _TOKEN_BYTES
        share = self._shares.get(session) or Budget(inf, self._known_bytes, part=0.5)
        if (before := self._known.pop(token, None)) is not None:
            share.give_back(cost)
            self._gids.pop(before.key, None)
            name = before.kind, before.name, before.type
            self._counts[name] -= 1
            if not self._counts[name]:
                del self._counts[name]
        if endpoint is not None and share.take(cost):
            self._known[token] = endpoint
            self._gids[endpoint.key] = session
            self._counts[endpoint.kind, endpoint.name, endpoint.type] += 1
        elif endpoint is not None:
            self._ignored += 1
            level = logging.WARNING if self._ignored == 1 else logging.DEBUG
            _LOG.log(level, "too many endpoints in ROS 2: %s is ignored", printable(endpoint.name))
        self._shares.pop(session, None)
        if share.used:
            self._shares[session] = share


def _config(zenoh: Any, routers: Sequence[str], timeout_s: float) -> Any:
    """Return a session's configuration, which sets every value whose default varies between versions."""
    config = zenoh.Config()
    values: dict[str, Any] = {
        "mode": "client",
        "connect/endpoints": list(routers),
        "connect/timeout_ms": int(timeout_s * 1000),
        "connect/exit_on_failure": True,
        "listen/endpoints": [],
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "timestamping/enabled": True,
        "transport/shared_memory/enabled": False,
        "transport/link/rx/max_message_size": ZENOH_MESSAGE_BYTES,
    }
    for key, value in values.items():
        config.insert_json5(key, json.dumps(value))
    return config
