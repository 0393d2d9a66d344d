"""The endpoints of the engine for rclpy; see `Ros2Engine` for their interfaces."""

from __future__ import annotations

import itertools
import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from queue import Empty, SimpleQueue
from typing import Any, Final, Protocol

from pipros.net.workers import Workers
from pipros_ros2.agent.rclpy_agent import GID_BYTES, HEADER, NUMBER, Kind
from pipros_ros2.inbox import OVERHEAD_BYTES, Inbox
from pipros_ros2.interface import EngineError, Ros2CallFailed, Sample

_LOG = logging.getLogger("pipros_ros2")
QUEUED_BYTES: Final = 32 * 1024 * 1024
"""Maximum size of a publisher's messages that wait until the agent reads them."""
_REQUESTS: Final = 64
"""Maximum number of unanswered requests per service."""
_WORKERS: Final = 16


class AgentConnection(Protocol):
    """The part of the engine that its endpoints use."""

    def send(self, kind: Kind, number: int, *parts: bytes) -> None: ...

    def send_later(self, make: Callable[[], Sequence[bytes]]) -> None: ...

    def matches(self, spec: Mapping[str, Any]) -> int:
        """Return the number of a publisher's subscribers, or of a client's servers, in other nodes."""

    def close_end(self, number: int) -> None: ...


def cost_bytes(message: bytes) -> int:
    """Return the memory that a waiting message takes."""
    return len(message) + OVERHEAD_BYTES


class AgentEnd:
    """An endpoint of the agent's node."""

    def __init__(self, connection: AgentConnection, number: int, spec: Mapping[str, Any]) -> None:
        self.spec = spec
        self._connection = connection
        self._number = number
        self._inbox = Inbox(0, QUEUED_BYTES, cost_bytes)
        self._refused = 0

    def on_frame(self, body: bytes) -> None:
        """Handle a message, request or reply. Must not block."""

    def fail(self, reason: str) -> None:
        """End all calls, because the agent has ended."""

    @property
    def dropped(self) -> int:
        return self._inbox.dropped + self._refused

    def close(self) -> None:
        self._connection.close_end(self._number)


class AgentPublisher(AgentEnd):
    def publish(self, payload: bytes) -> None:
        if self._inbox.push(payload):
            self._connection.send_later(self._next)

    def _next(self) -> Sequence[bytes]:
        payload = self._inbox.pop()
        if self._inbox:
            self._connection.send_later(self._next)
        return () if payload is None else (HEADER.pack(len(payload), Kind.PUBLISH, self._number), payload)

    @property
    def subscriber_count(self) -> int:
        return self._connection.matches(self.spec)


class AgentSubscriber(AgentEnd):
    def __init__(
        self,
        connection: AgentConnection,
        number: int,
        spec: Mapping[str, Any],
        inbox: Inbox[bytes],
        callback: Callable[[Sample], None],
    ) -> None:
        super().__init__(connection, number, spec)
        self._inbox = inbox
        self._callback = callback
        self._workers = Workers("rclpy topic", 1)

    def on_frame(self, body: bytes) -> None:
        if self._inbox.push(body):
            self._workers.run(self._pass_all)

    def _pass_all(self) -> None:
        while (body := self._inbox.pop()) is not None:
            try:
                self._callback(Sample(memoryview(body)[GID_BYTES:], body[:GID_BYTES]))
            except Exception:
                _LOG.exception("a callback for ROS 2 failed")

    def close(self) -> None:
        super().close()
        while self._inbox.pop() is not None:
            continue
        self._workers.close()


class AgentServer(AgentEnd):
    def __init__(
        self,
        connection: AgentConnection,
        number: int,
        spec: Mapping[str, Any],
        answer: Callable[[bytes], bytes],
    ) -> None:
        super().__init__(connection, number, spec)
        self._answer = answer
        self._workers = Workers("rclpy service", _WORKERS)
        self._slots = threading.BoundedSemaphore(_REQUESTS)

    def on_frame(self, body: bytes) -> None:
        if self._slots.acquire(blocking=False):
            self._workers.run(self._handle, body)
        else:
            self._refused += 1
            self._connection.send(Kind.ANSWER, self._number, body[: NUMBER.size])

    def _handle(self, body: bytes) -> None:
        reply = b""
        try:
            reply = self._answer(body[NUMBER.size :])
        except Exception as error:
            _LOG.warning("the service %s for ROS 2 failed: %s", self.spec["name"], error)
        finally:
            self._slots.release()
            self._connection.send(Kind.ANSWER, self._number, body[: NUMBER.size], reply)

    def close(self) -> None:
        super().close()
        self._workers.close()


class AgentCaller(AgentEnd):
    def __init__(self, connection: AgentConnection, number: int, spec: Mapping[str, Any]) -> None:
        super().__init__(connection, number, spec)
        self._numbers = itertools.count(1)
        self._replies: dict[int, SimpleQueue[bytes | EngineError]] = {}

    def call(self, request: bytes, timeout_s: float) -> bytes:
        number = next(self._numbers)
        replies = self._replies[number] = SimpleQueue()
        self._connection.send(Kind.CALL, self._number, NUMBER.pack(number), request)
        try:
            reply = replies.get(timeout=timeout_s)
        except Empty:
            self._connection.send(Kind.FORGET, self._number, NUMBER.pack(number))
            reason = f"did not answer within {timeout_s} s" if self.is_available else "is not available"
            raise Ros2CallFailed(f"the ROS 2 service {self.spec['name']} {reason}") from None
        finally:
            del self._replies[number]
        if isinstance(reply, EngineError):
            raise Ros2CallFailed(f"the ROS 2 service {self.spec['name']} failed: {reply}")
        return reply

    def on_frame(self, body: bytes) -> None:
        (number,) = NUMBER.unpack_from(body)
        if (replies := self._replies.get(number)) is not None:
            replies.put(body[NUMBER.size :])

    def fail(self, reason: str) -> None:
        for replies in list(self._replies.values()):
            replies.put(EngineError(reason))

    @property
    def is_available(self) -> bool:
        return bool(self._connection.matches(self.spec))
