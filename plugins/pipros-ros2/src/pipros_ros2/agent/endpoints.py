"""The endpoints of the engine for rclpy; see `Ros2Engine` for their interfaces."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from pipros.net.workers import Workers
from pipros_ros2.agent.rclpy_agent import GID_BYTES, Kind, frame
from pipros_ros2.inbox import OVERHEAD_BYTES, ROS2_INBOX_BYTES, Inbox
from pipros_ros2.interface import Endpoint, EngineError, Ros2CallFailed, Sample

if TYPE_CHECKING:
    from pipros_ros2.agent.engine import RclpyEngine

_LOG = logging.getLogger("pipros_ros2")
QUEUED_BYTES: Final = 32 * 1024 * 1024
"""Maximum size of a publisher's messages that wait until the agent reads them."""
_SERVER_S: Final = 0.05
"""Interval between attempts to call a service that is not available."""
_REQUESTS: Final = 64
"""Maximum number of unanswered requests per service."""
_WORKERS: Final = 16


def cost_bytes(message: bytes) -> int:
    """Return the memory that a waiting message takes."""
    return len(message) + OVERHEAD_BYTES


class AgentEnd:
    """An endpoint of the agent's node."""

    def __init__(self, engine: RclpyEngine, number: int, own: Endpoint) -> None:
        self.own = own
        self._engine = engine
        self._number = number

    def on_frame(self, number: int, body: bytes, /) -> None:
        """Handle a message, or a request with its number. Must not block."""

    def close(self) -> None:
        self._engine.close_end(self._number)


class AgentPublisher(AgentEnd):
    def __init__(self, engine: RclpyEngine, number: int, own: Endpoint) -> None:
        super().__init__(engine, number, own)
        self._inbox = Inbox(0, QUEUED_BYTES, cost_bytes)

    def publish(self, payload: bytes) -> None:
        if self._inbox.push(payload):
            self._engine.process.send_later(self._next)

    def _next(self) -> Sequence[bytes]:
        payload = self._inbox.pop()
        if self._inbox:
            self._engine.process.send_later(self._next)
        return () if payload is None else frame(Kind.PUBLISH, self._number, 0, payload)

    @property
    def subscriber_count(self) -> int:
        return self._engine.matches(self.own)

    @property
    def dropped(self) -> int:
        return self._inbox.dropped


class AgentSubscriber(AgentEnd):
    def __init__(
        self,
        engine: RclpyEngine,
        number: int,
        own: Endpoint,
        callback: Callable[[Sample], None],
    ) -> None:
        super().__init__(engine, number, own)
        self._inbox = Inbox(own.qos.depth, ROS2_INBOX_BYTES, cost_bytes)
        self._callback = callback
        self._workers = Workers("rclpy topic", 1)

    def on_frame(self, _: int, body: bytes) -> None:
        if self._inbox.push(body):
            self._workers.run(self._pass_all)

    def _pass_all(self) -> None:
        while (body := self._inbox.pop()) is not None:
            try:
                self._callback(Sample(memoryview(body)[GID_BYTES:], body[:GID_BYTES]))
            except Exception:
                _LOG.exception("a callback for ROS 2 failed")

    @property
    def dropped(self) -> int:
        return self._inbox.dropped

    def close(self) -> None:
        super().close()
        while self._inbox.pop() is not None:
            continue
        self._workers.close()


class AgentServer(AgentEnd):
    def __init__(
        self, engine: RclpyEngine, number: int, own: Endpoint, answer: Callable[[bytes], bytes]
    ) -> None:
        super().__init__(engine, number, own)
        self.dropped = 0
        self._answer = answer
        self._workers = Workers("rclpy service", _WORKERS)
        self._slots = threading.BoundedSemaphore(_REQUESTS)

    def on_frame(self, number: int, body: bytes) -> None:
        if self._slots.acquire(blocking=False):
            self._workers.run(self._handle, number, body)
        else:
            self.dropped += 1

    def _handle(self, number: int, request: bytes) -> None:
        try:
            response = self._answer(request)
            self._engine.process.send(Kind.ANSWER, self._number, number, response)
        except Exception as error:
            _LOG.warning("the service %s for ROS 2 failed: %s", self.own.name, error)
        finally:
            self._slots.release()

    def close(self) -> None:
        super().close()
        self._workers.close()


class AgentCaller(AgentEnd):
    def call(self, request: bytes, timeout_s: float) -> bytes:
        end_s = time.monotonic() + timeout_s
        try:
            while (left_s := end_s - time.monotonic()) > 0:
                response = self._engine.process.ask(Kind.CALL, self._number, request, left_s)
                if response:
                    return response
                time.sleep(min(_SERVER_S, left_s))
            reason = f"did not answer within {timeout_s} s" if self.is_available else "is not available"
        except EngineError as error:
            reason = f"failed: {error}"
        raise Ros2CallFailed(f"the ROS 2 service {self.own.name} {reason}")

    @property
    def is_available(self) -> bool:
        return bool(self._engine.matches(self.own))
