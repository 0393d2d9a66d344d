"""The endpoints of the engine for rmw_zenoh; see `Ros2Engine` for their interfaces.

eclipse-zenoh runs Python callbacks in its own threads. A process that uses such callbacks never exits unless
it calls `Session.close`. Therefore, data is received through channels, each read by a daemon thread.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, Final, Protocol

from pipros.basics.interruptible_wait import get_within_slice
from pipros.net.shared_workers import SharedWorkers
from pipros_ros2.interface import (
    ROS2_CALLS,
    Durability,
    EndpointKind,
    EngineError,
    Reliability,
    Ros2CallFailed,
    Sample,
    TopicQos,
)
from pipros_ros2.zenoh.tokens import Arrivals, Attachment, new_attachment, parse_attachment

_LOG = logging.getLogger("pipros_ros2")
_HEARTBEAT_S: Final = 0.5
_TOKEN_S: Final = 0.5
_NO_TOKEN_S: Final = 10.0
"""Time during which a subscriber does not wait for tokens, after a publisher turned out to have none."""
_SERVICE_QOS: Final = TopicQos(depth=10)
_QUEUED: Final = 100
"""Maximum number of messages that wait for a callback, because Zenoh's queue has no limit in bytes."""


class ZenohConnection(Protocol):
    """The part of the engine that its endpoints use."""

    @property
    def session(self) -> Any: ...

    @property
    def library(self) -> Any: ...

    def start(self, name: str, run: Callable[[], None]) -> None:
        """Run a function in a daemon thread. The function must return soon after the session is closed."""

    def new_endpoint(
        self, kind: EndpointKind, name: str, type_name: str, type_hash: str, qos: TopicQos
    ) -> tuple[str, bytes, str]:
        """Return the data key, GID and liveliness token of a new endpoint. The token is not yet declared.

        Raises:
            EngineError: the engine is closed.
        """

    def declare(self, token: str) -> Any:
        """Declare a liveliness token. Its endpoint must exist, because peers may use it immediately."""

    def wait_for_endpoint(self, gid: bytes, timeout_s: float) -> bool:
        """Wait until an endpoint is known; return False after the timeout, or if the engine is closed."""

    def session_of(self, gid: bytes) -> str:
        """Return the session of a known endpoint, or an empty string."""

    def count(self, kind: EndpointKind, name: str, type_name: str) -> int:
        """Return the number of other sessions' endpoints with this kind, name and type."""


class ZenohPublisher:
    def __init__(
        self, connection: ZenohConnection, topic: str, type_name: str, type_hash: str, qos: TopicQos
    ) -> None:
        zenoh, ext = connection.library, connection.library.ext
        self._connection = connection
        self._names = topic, type_name
        self._lock = threading.Lock()
        self._sequences = itertools.count(1)
        key, self._gid, token = connection.new_endpoint(
            EndpointKind.PUBLISHER, topic, type_name, type_hash, qos
        )
        options: dict[str, Any] = {"congestion_control": zenoh.CongestionControl.DROP}
        if qos.durability is Durability.TRANSIENT_LOCAL:
            options["cache"] = ext.CacheConfig(max_samples=max(1, qos.depth))
            options["publisher_detection"] = True
            if qos.reliability is Reliability.RELIABLE:
                options["sample_miss_detection"] = ext.MissDetectionConfig(sporadic_heartbeat=_HEARTBEAT_S)
            self._publisher = ext.declare_advanced_publisher(connection.session, key, **options)
        else:
            self._publisher = connection.session.declare_publisher(key, **options)
        self._token = connection.declare(token)

    def publish(self, payload: bytes) -> None:
        with self._lock:  # sequence numbers must be sent in order
            attachment = new_attachment(next(self._sequences), self._gid)
            try:
                self._publisher.put(payload, attachment=attachment.to_bytes())
            except self._connection.library.ZError as error:
                raise EngineError(f"cannot publish [{self._names[0]}]: {error}") from None

    @property
    def subscriber_count(self) -> int:
        return self._connection.count(EndpointKind.SUBSCRIBER, *self._names)

    @property
    def dropped(self) -> int:
        return 0  # eclipse-zenoh does not report lost messages

    def close(self) -> None:
        _undeclare(self._connection.library, self._token, self._publisher)


class ZenohSubscriber:
    def __init__(
        self,
        connection: ZenohConnection,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> None:
        zenoh, ext = connection.library, connection.library.ext
        self._connection = connection
        self._callback = callback
        self._arrivals = Arrivals()
        self._wait_from_s = 0.0
        # In Lyrical, publishers use the plain key only while there is a subscriber's token.
        key, _, token = connection.new_endpoint(EndpointKind.SUBSCRIBER, topic, type_name, type_hash, qos)
        channel = zenoh.handlers.RingChannel(max(1, min(qos.depth, _QUEUED)))
        if qos.durability is Durability.TRANSIENT_LOCAL:
            self._subscriber = ext.declare_advanced_subscriber(
                connection.session,
                key,
                channel,
                history=ext.HistoryConfig(detect_late_publishers=True),
                recovery=ext.RecoveryConfig(heartbeat=True),
            )
        else:
            self._subscriber = connection.session.declare_subscriber(key, channel)
        self._token = connection.declare(token)
        connection.start(topic, self._run)

    def _run(self) -> None:
        for sample in received(self._connection.library, self._subscriber.handler):
            attached = None if sample.attachment is None else parse_attachment(sample.attachment.to_bytes())
            if sample.kind != self._connection.library.SampleKind.PUT or attached is None:
                continue
            if self._arrivals.add(attached.gid, attached.sequence) and time.monotonic() >= self._wait_from_s:
                self._await_token(attached.gid)
            try:
                self._callback(Sample(sample.payload.to_bytes(), attached.gid))
            except Exception:
                _LOG.exception("a callback for ROS 2 failed")

    def _await_token(self, gid: bytes) -> None:
        """Wait until a new publisher is known: its token may arrive after its first message."""
        if not self._connection.wait_for_endpoint(gid, _TOKEN_S):
            self._wait_from_s = time.monotonic() + _NO_TOKEN_S

    @property
    def dropped(self) -> int:
        return self._arrivals.missing

    def close(self) -> None:
        _undeclare(self._connection.library, self._token, self._subscriber)


class ZenohServer:
    def __init__(
        self,
        connection: ZenohConnection,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes | None],
    ) -> None:
        self._connection = connection
        self._answer = answer
        self._key, _, token = connection.new_endpoint(
            EndpointKind.SERVER, service, type_name, type_hash, _SERVICE_QOS
        )
        self._workers = SharedWorkers("zenoh service", ROS2_CALLS, ROS2_CALLS)
        self.dropped = 0
        # A full FIFO would block the whole session. A full ring drops the oldest request.
        channel = connection.library.handlers.RingChannel(ROS2_CALLS)
        self._queryable = connection.session.declare_queryable(self._key, channel, complete=True)
        self._token = connection.declare(token)
        connection.start(service, self._run)

    def _run(self) -> None:
        for query in received(self._connection.library, self._queryable.handler):
            attached = None if query.attachment is None else parse_attachment(query.attachment.to_bytes())
            user = self._connection.session_of(attached.gid) if attached else ""  # unknown GIDs share a share
            if attached is None or not self._workers.run(user, self._handle, query, attached):
                self.dropped += 1
                query.drop()

    def _handle(self, query: Any, attached: Attachment) -> None:
        try:
            self._reply(query, attached)
        except Exception:
            _LOG.exception("a service for ROS 2 failed")
        finally:
            query.drop()  # no further reply follows

    def _reply(self, query: Any, attached: Attachment) -> None:
        if query.payload is None:
            return
        if (reply := self._answer(query.payload.to_bytes())) is not None:
            attachment = new_attachment(attached.sequence, attached.gid)
            query.reply(self._key, reply, attachment=attachment.to_bytes())

    def close(self) -> None:
        _undeclare(self._connection.library, self._token, self._queryable)
        self._workers.close()


class ZenohClient:
    def __init__(self, connection: ZenohConnection, service: str, type_name: str, type_hash: str) -> None:
        self._connection = connection
        self._names = service, type_name
        self._sequences = itertools.count(1)
        self._key, self._gid, token = connection.new_endpoint(
            EndpointKind.CLIENT, service, type_name, type_hash, _SERVICE_QOS
        )
        self._token = connection.declare(token)

    def call(self, request: bytes, timeout_s: float) -> bytes:
        zenoh, name = self._connection.library, self._names[0]
        attachment = new_attachment(next(self._sequences), self._gid)
        replies: SimpleQueue[Any] = SimpleQueue()
        end = object()  # after the last reply
        is_answered = threading.Event()

        def take(reply: Any) -> None:
            if reply.ok is not None and not is_answered.is_set():  # a server may send any number
                is_answered.set()
                replies.put(reply)

        try:
            self._connection.session.get(
                self._key,
                zenoh.handlers.Callback(take, lambda: replies.put(end)),
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=timeout_s,
                payload=request,
                attachment=attachment.to_bytes(),
            )
            # The session may keep a query whose server ended.
            while (reply := get_within_slice(replies, timeout_s)) is not end:
                if reply is None and not self.is_available:
                    break
                if reply is not None:
                    return bytes(reply.ok.payload.to_bytes())
        except zenoh.ZError as error:
            raise Ros2CallFailed(f"the ROS 2 service {name} failed: {error}") from error
        reason = f"did not answer within {timeout_s} s" if self.is_available else "is not available"
        raise Ros2CallFailed(f"the ROS 2 service {name} {reason}")

    @property
    def is_available(self) -> bool:
        return self._connection.count(EndpointKind.SERVER, *self._names) > 0

    def close(self) -> None:
        _undeclare(self._connection.library, self._token)


def received(zenoh: Any, handler: Any) -> Any:
    """Yield the items of a channel until it is closed."""
    while True:
        try:
            yield handler.recv()
        except zenoh.ZError:
            return


def _undeclare(zenoh: Any, *entities: Any) -> None:
    """Undeclare entities, ignoring any that were closed with their session."""
    for entity in entities:
        try:
            entity.undeclare()
        except zenoh.ZError:
            continue
