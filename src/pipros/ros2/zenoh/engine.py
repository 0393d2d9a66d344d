"""The engine for ROS 2 nodes that use rmw_zenoh.

eclipse-zenoh runs Python callbacks in its own threads. A process that uses such callbacks never exits unless
it calls `Session.close`. Therefore, data is received through channels, each read by a daemon thread: one per
subscription.
"""

from __future__ import annotations

import atexit
import itertools
import json
import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command
from pipros.basics.limits import Limits, process_limits
from pipros.net.workers import Workers
from pipros.ros2.engine import (
    NO_HASHES,
    Announcement,
    Caller,
    CallFailed,
    Durability,
    Endpoint,
    EndpointKind,
    EngineError,
    PartHashes,
    Reliability,
    Sample,
    Subscription,
    TopicQos,
)
from pipros.ros2.names import zenoh_key
from pipros.ros2.zenoh.tokens import (
    NO_HASH,
    Arrivals,
    NodeIdentity,
    endpoint_token,
    gid_of_hash,
    graph_key,
    new_attachment,
    node_token,
    parse_attachment,
    parse_token,
)

ROUTER: Final = "tcp/localhost:7447"
"""Where rmw_zenoh's router listens."""

_LOG = logging.getLogger("pipros.ros2")
_HEARTBEAT_S: Final = 0.5
_CLOSE_S: Final = 1.0
_REQUESTS: Final = 64
"""Requests that a service handles, and those that wait for it."""
_WORKERS: Final = 16
"""Requests that a service handles at a time."""
_GRAPH_CHANGES: Final = 4096
_TOKEN_BYTES: Final = 1000
"""Approximate memory of a parsed token, beside its text."""
_SERVICE_QOS: Final = TopicQos(depth=10)


def zenoh_libraries() -> tuple[Any, Any]:
    """Return the modules zenoh and xxhash.

    Raises:
        MissingExtra: they are not installed.
    """
    try:
        import xxhash
        import zenoh
        import zenoh.ext
    except ImportError:
        raise MissingExtra(f"rmw_zenoh needs eclipse-zenoh: {install_command('zenoh')}") from None
    return zenoh, xxhash


class ZenohEngine:
    """A session with a Zenoh router, and one node. See `Ros2Engine`.

    Args:
        node: full name of the node that owns all endpoints.
        routers: endpoints of routers, such as `tcp/localhost:7447`.
        timeout_s: timeout of the connection to a router.
        limits: defaults to the process-wide limits.

    Raises:
        MissingExtra: eclipse-zenoh is not installed.
        EngineError: no router answers.
    """

    def __init__(
        self,
        domain: int,
        node: str,
        routers: Sequence[str] = (ROUTER,),
        *,
        timeout_s: float = 5.0,
        limits: Limits | None = None,
    ) -> None:
        self._zenoh, self._xxhash = zenoh_libraries()
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._known: dict[str, Endpoint] = {}
        self._known_bytes = 0
        limits = limits or process_limits()
        self._graph_limit_bytes = limits.ros2_graph_bytes
        self._is_closed = False
        self._threads: list[threading.Thread] = []
        try:
            self._session = self._zenoh.open(_config(self._zenoh, routers, timeout_s, limits))
        except self._zenoh.ZError as error:
            reason = str(error).partition(" at /")[0]  # without the source location in the library
            raise EngineError(f"no Zenoh router answers at {', '.join(routers)}: {reason}") from error
        namespace, _, name = node.rpartition("/")
        self._zid = str(self._session.zid())
        self.node = NodeIdentity(domain, self._zid, namespace, name)
        self._tokens = self._session.liveliness()
        self._node_token = self._tokens.declare_token(node_token(self.node))
        changes = self._zenoh.handlers.FifoChannel(_GRAPH_CHANGES)
        self._graph = self._tokens.declare_subscriber(graph_key(domain), changes, history=True)
        self.start("graph", self._watch_graph)
        # A thread that is waiting in the library when Python exits aborts the process.
        atexit.register(self.close)

    def announce(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Announcement:
        return _Publisher(self, topic, type_name, type_hash, qos)

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Subscription:
        return _Subscriber(self, topic, type_name, type_hash, qos, callback)

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes],
        parts: PartHashes = NO_HASHES,
    ) -> Subscription:
        del parts
        return _Server(self, service, type_name, type_hash, answer)

    def caller(self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES) -> Caller:
        del parts
        return _Client(self, service, type_name, type_hash)

    def endpoints(self) -> Sequence[Endpoint]:
        with self._lock:
            return list(self._known.values())

    def problems(self) -> Mapping[str, str]:
        return {}

    def close(self) -> None:
        with self._lock:
            if self._is_closed:
                return
            self._is_closed = True
        atexit.unregister(self.close)
        self._session.close()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_CLOSE_S)

    # For the endpoints of this module ---------------------------------------------------------------------

    @property
    def session(self) -> Any:
        return self._session

    @property
    def library(self) -> Any:
        return self._zenoh

    def start(self, name: str, run: Callable[[], None]) -> None:
        """Run a function in a daemon thread, which must end soon after the session."""
        thread = threading.Thread(target=run, name=f"zenoh {name}", daemon=True)
        self._threads = [each for each in self._threads if each.is_alive()] + [thread]
        thread.start()

    def new_endpoint(
        self, kind: EndpointKind, name: str, type_name: str, type_hash: str, qos: TopicQos
    ) -> tuple[str, bytes, str]:
        """Return the key of an endpoint's data, its GID, and its token, which is not yet declared.

        Raises:
            EngineError: the engine is closed.
        """
        with self._lock:
            if self._is_closed:
                raise EngineError("the Zenoh session is closed")
        key = zenoh_key(self.node.domain, name, type_name, type_hash or NO_HASH)
        text = endpoint_token(self.node, next(self._numbers), kind, name, type_name, type_hash, qos)
        return key, self._gid(text), text

    def declare(self, token: str) -> Any:
        """Declare a token. Peers may use the endpoint at once, so it must already exist."""
        return self._tokens.declare_token(token)

    def _gid(self, token: str) -> bytes:
        return gid_of_hash(self._xxhash.xxh3_128_intdigest(token.encode()))

    def count(self, kind: EndpointKind, name: str, type_name: str) -> int:
        """Return the number of other sessions' endpoints of a kind, for a name and type."""
        return sum((each.kind, each.name, each.type) == (kind, name, type_name) for each in self.endpoints())

    def _watch_graph(self) -> None:
        for change in _received(self._zenoh, self._graph.handler):
            token = str(change.key_expr)
            is_new = change.kind == self._zenoh.SampleKind.PUT
            parsed = parse_token(token)
            if parsed is None or parsed[0] == self._zid:
                continue
            endpoint = replace(parsed[1], key=self._gid(token)) if is_new else None
            with self._lock:
                self._change(token, endpoint)

    def _change(self, token: str, endpoint: Endpoint | None) -> None:
        cost = 2 * len(token) + _TOKEN_BYTES
        if self._known.pop(token, None) is not None:
            self._known_bytes -= cost
        if endpoint is None:
            return
        if self._known_bytes + cost > self._graph_limit_bytes:
            _LOG.warning("too many endpoints in ROS 2 (ros2_graph_bytes): %s is ignored", endpoint.name)
            return
        self._known[token] = endpoint
        self._known_bytes += cost


class _Publisher:
    def __init__(
        self, engine: ZenohEngine, topic: str, type_name: str, type_hash: str, qos: TopicQos
    ) -> None:
        zenoh, ext = engine.library, engine.library.ext
        self._engine = engine
        self._names = topic, type_name
        self._lock = threading.Lock()
        self._sequences = itertools.count(1)
        key, self._gid, token = engine.new_endpoint(EndpointKind.PUBLISHER, topic, type_name, type_hash, qos)
        options: dict[str, Any] = {"congestion_control": zenoh.CongestionControl.DROP}
        if qos.durability is Durability.TRANSIENT_LOCAL:
            options["cache"] = ext.CacheConfig(max_samples=max(1, qos.depth))
            options["publisher_detection"] = True
            if qos.reliability is Reliability.RELIABLE:
                options["sample_miss_detection"] = ext.MissDetectionConfig(sporadic_heartbeat=_HEARTBEAT_S)
            self._publisher = ext.declare_advanced_publisher(engine.session, key, **options)
        else:
            self._publisher = engine.session.declare_publisher(key, **options)
        self._token = engine.declare(token)

    def publish(self, payload: bytes) -> None:
        with self._lock:  # sequences must arrive in their order
            attachment = new_attachment(next(self._sequences), self._gid)
            self._publisher.put(payload, attachment=attachment.to_bytes())

    @property
    def subscriber_count(self) -> int:
        return self._engine.count(EndpointKind.SUBSCRIBER, *self._names)

    @property
    def dropped(self) -> int:
        return 0  # eclipse-zenoh does not report them

    def close(self) -> None:
        _undeclare(self._engine.library, self._token, self._publisher)


class _Subscriber:
    def __init__(
        self,
        engine: ZenohEngine,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> None:
        zenoh, ext = engine.library, engine.library.ext
        self._engine = engine
        self._callback = callback
        self._arrivals = Arrivals()
        # Publishers of Lyrical use the plain key only while a token of a subscriber is known.
        key, _, token = engine.new_endpoint(EndpointKind.SUBSCRIBER, topic, type_name, type_hash, qos)
        channel = zenoh.handlers.RingChannel(max(1, qos.depth))
        if qos.durability is Durability.TRANSIENT_LOCAL:
            self._subscriber = ext.declare_advanced_subscriber(
                engine.session,
                key,
                channel,
                history=ext.HistoryConfig(detect_late_publishers=True),
                recovery=ext.RecoveryConfig(heartbeat=True),
            )
        else:
            self._subscriber = engine.session.declare_subscriber(key, channel)
        self._token = engine.declare(token)
        engine.start(topic, self._run)

    def _run(self) -> None:
        for sample in _received(self._engine.library, self._subscriber.handler):
            attached = None if sample.attachment is None else parse_attachment(sample.attachment.to_bytes())
            if sample.kind != self._engine.library.SampleKind.PUT or attached is None:
                continue
            self._arrivals.add(attached.gid, attached.sequence)
            try:
                self._callback(Sample(sample.payload.to_bytes(), attached.gid))
            except Exception:
                _LOG.exception("a callback for ROS 2 failed")

    @property
    def dropped(self) -> int:
        return self._arrivals.missing

    def close(self) -> None:
        _undeclare(self._engine.library, self._token, self._subscriber)


class _Server:
    def __init__(
        self,
        engine: ZenohEngine,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes],
    ) -> None:
        self._engine = engine
        self._answer = answer
        self._key, _, token = engine.new_endpoint(
            EndpointKind.SERVER, service, type_name, type_hash, _SERVICE_QOS
        )
        self._workers = Workers("zenoh service", _WORKERS)
        self._lock = threading.Lock()
        self._open = 0
        self.dropped = 0
        # A full FIFO would block the whole session. A full ring drops the oldest request.
        channel = engine.library.handlers.RingChannel(_REQUESTS)
        self._queryable = engine.session.declare_queryable(self._key, channel, complete=True)
        self._token = engine.declare(token)
        engine.start(service, self._run)

    def _run(self) -> None:
        for query in _received(self._engine.library, self._queryable.handler):
            with self._lock:
                self._open += 1
                is_admitted = self._open <= _REQUESTS
                self.dropped += not is_admitted
            if is_admitted:
                self._workers.run(self._handle, query)
            else:
                self._finish(query)

    def _handle(self, query: Any) -> None:
        try:
            self._reply(query)
        except Exception:
            _LOG.exception("a service for ROS 2 failed")
        finally:
            self._finish(query)

    def _finish(self, query: Any) -> None:
        """Notify the client that no further reply follows."""
        query.drop()
        with self._lock:
            self._open -= 1

    def _reply(self, query: Any) -> None:
        attached = None if query.attachment is None else parse_attachment(query.attachment.to_bytes())
        if attached is None or query.payload is None:
            return
        reply = self._answer(query.payload.to_bytes())
        attachment = new_attachment(attached.sequence, attached.gid)
        query.reply(self._key, reply, attachment=attachment.to_bytes())

    def close(self) -> None:
        _undeclare(self._engine.library, self._token, self._queryable)
        self._workers.close()


class _Client:
    def __init__(self, engine: ZenohEngine, service: str, type_name: str, type_hash: str) -> None:
        self._engine = engine
        self._names = service, type_name
        self._sequences = itertools.count(1)
        self._key, self._gid, token = engine.new_endpoint(
            EndpointKind.CLIENT, service, type_name, type_hash, _SERVICE_QOS
        )
        self._token = engine.declare(token)

    def call(self, request: bytes, timeout_s: float) -> bytes:
        zenoh, name = self._engine.library, self._names[0]
        attachment = new_attachment(next(self._sequences), self._gid)
        try:
            replies = self._engine.session.get(
                self._key,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=timeout_s,
                payload=request,
                attachment=attachment.to_bytes(),
            )
            for reply in replies:
                if reply.ok is not None:
                    return bytes(reply.ok.payload.to_bytes())
        except zenoh.ZError as error:
            raise CallFailed(f"the ROS 2 service {name} failed: {error}") from error
        reason = f"did not answer within {timeout_s} s" if self.is_available else "is not available"
        raise CallFailed(f"the ROS 2 service {name} {reason}")

    @property
    def is_available(self) -> bool:
        return self._engine.count(EndpointKind.SERVER, *self._names) > 0

    def close(self) -> None:
        _undeclare(self._engine.library, self._token)


def _config(zenoh: Any, routers: Sequence[str], timeout_s: float, limits: Limits) -> Any:
    """Return the configuration of a session, with every value whose default changes between versions."""
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
        "transport/link/rx/max_message_size": limits.bridge_message_bytes,
    }
    for key, value in values.items():
        config.insert_json5(key, json.dumps(value))
    return config


def _received(zenoh: Any, handler: Any) -> Any:
    """Yield the items of a channel until it is closed."""
    while True:
        try:
            yield handler.recv()
        except zenoh.ZError:
            return


def _undeclare(zenoh: Any, *entities: Any) -> None:
    """Undeclare entities, which may have ended with their session."""
    for entity in entities:
        try:
            entity.undeclare()
        except zenoh.ZError:
            continue
