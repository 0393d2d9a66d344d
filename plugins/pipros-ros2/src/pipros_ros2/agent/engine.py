"""The engine that uses the rclpy of another Python: its middleware, its security and its settings."""

from __future__ import annotations

import itertools
import json
import logging
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar

from pipros.net.workers import Workers
from pipros_ros2.agent.process import AgentProcess, Frame
from pipros_ros2.agent.rclpy_agent import GID_BYTES, Kind
from pipros_ros2.inbox import OVERHEAD_BYTES, ROS2_INBOX_BYTES, Inbox
from pipros_ros2.interface import (
    NO_HASHES,
    ROS2_CALLS,
    Endpoint,
    EndpointKind,
    EngineError,
    EngineProblem,
    PartHashes,
    Ros2Caller,
    Ros2CallFailed,
    Ros2Publisher,
    Ros2Subscription,
    Sample,
    TopicQos,
    gateway_of_node,
)
from pipros_ros2.qos_table import dds_qos, qos_of_rclpy, rclpy_qos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.qos import QosPolicy, mismatch
from pipros_rosbag2.names import checked_name

_LOG = logging.getLogger("pipros_ros2")
QUEUED_BYTES: Final = 32 * 1024 * 1024
"""Maximum size of a publisher's messages that wait until the agent reads them."""
_SERVER_S: Final = 0.05
"""Interval between attempts to call a service that is not available."""
_OPEN_S: Final = 10.0
_ROLES: Final = {
    "publisher": EndpointKind.PUBLISHER,
    "subscription": EndpointKind.SUBSCRIBER,
    "service": EndpointKind.SERVER,
}
_FACED: Final = {
    EndpointKind.PUBLISHER: EndpointKind.SUBSCRIBER,
    EndpointKind.SUBSCRIBER: EndpointKind.PUBLISHER,
    EndpointKind.CLIENT: EndpointKind.SERVER,
    EndpointKind.SERVER: EndpointKind.CLIENT,
}


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

    def _next(self) -> Frame | None:
        payload = self._inbox.pop()
        if self._inbox:
            self._engine.process.send_later(self._next)
        return None if payload is None else (Kind.PUBLISH, self._number, 0, payload)

    @property
    def subscriber_count(self) -> int:
        return self._engine.matches(self.own)

    @property
    def dropped(self) -> int:
        return self._inbox.dropped


class AgentSubscriber(AgentEnd):
    def __init__(
        self, engine: RclpyEngine, number: int, own: Endpoint, callback: Callable[[Sample], None]
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
        self, engine: RclpyEngine, number: int, own: Endpoint, answer: Callable[[bytes], bytes | None]
    ) -> None:
        super().__init__(engine, number, own)
        self.dropped = 0
        self._answer = answer
        self._workers = Workers("rclpy service", ROS2_CALLS)
        self._slots = threading.BoundedSemaphore(ROS2_CALLS)

    def on_frame(self, number: int, body: bytes) -> None:
        if self._slots.acquire(blocking=False):
            self._workers.run(self._handle, number, body)
        else:
            self.dropped += 1

    def _handle(self, number: int, request: bytes) -> None:
        try:
            if (response := self._answer(request)) is not None:
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


_End = TypeVar("_End", bound=AgentEnd)


class RclpyEngine:
    """A node of rclpy in another process. See `Ros2Engine`.

    Args:
        node: full name of the node that owns all endpoints.
        python: the interpreter that can import rclpy.
        on_end: called with the reason if the process ends before `close`.

    Attributes:
        rmw: the name of the middleware.
        pid: the number of the process.

    Raises:
        EngineError: rclpy cannot be started, or cannot connect.
    """

    def __init__(
        self,
        discovery: Discovery,
        node: str,
        python: str,
        *,
        variables: Mapping[str, str] = os.environ,
        on_end: Callable[[str], object] = lambda _: None,
    ) -> None:
        self._numbers = itertools.count(1)
        self._ends: dict[int, AgentEnd] = {}
        self._missing: dict[str, str] = {}
        self._endpoints: Sequence[Endpoint] = ()
        self.process = AgentProcess(python, discovery, node, variables, self._on_frame, on_end)
        self.rmw, self.pid = self.process.rmw, self.process.pid

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        own = Endpoint(b"", EndpointKind.PUBLISHER, topic, type_name, type_hash, qos)
        return self._open(AgentPublisher, "publisher", own)

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Ros2Subscription:
        own = Endpoint(b"", EndpointKind.SUBSCRIBER, topic, type_name, type_hash, qos)
        return self._open(AgentSubscriber, "subscription", own, callback)

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes | None],
        parts: PartHashes = NO_HASHES,
    ) -> Ros2Subscription:
        del type_hash, parts
        own = Endpoint(b"", EndpointKind.SERVER, service, type_name)
        return self._open(AgentServer, "service", own, answer)

    def caller(
        self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES
    ) -> Ros2Caller:
        del type_hash, parts
        return self._open(AgentCaller, "client", Endpoint(b"", EndpointKind.CLIENT, service, type_name))

    def lacks(self, type_name: str) -> str:
        if type_name not in self._missing:
            self._missing[type_name] = self._ask(0, {"role": "type", "type": type_name})
        return self._missing[type_name]

    def endpoints(self) -> Sequence[Endpoint]:
        return self._endpoints

    def problems(self) -> Sequence[EngineProblem]:
        return [
            EngineProblem(each.kind, each.name, policy.reason, each.node)
            for end in self._ends.copy().values()
            for each, policy in self._facing(end.own)
            if policy is not None
        ]

    def close(self) -> None:
        self.process.close()

    # -- for the endpoints

    def matches(self, own: Endpoint) -> int:
        """Return the number of a publisher's subscribers, or of a client's servers, in other nodes."""
        return sum(policy is None for _, policy in self._facing(own))

    def close_end(self, number: int) -> None:
        if self._ends.pop(number, None) is not None:
            self.process.send(Kind.CLOSE, number)

    def _facing(self, own: Endpoint) -> Iterator[tuple[Endpoint, QosPolicy | None]]:
        """Yield the endpoints of other nodes that face an own one, and the policies that separate them."""
        wanted = _FACED[own.kind], own.name, own.type
        for each in self._endpoints:
            if (each.kind, each.name, each.type) == wanted:
                ends = (own, each) if own.kind is EndpointKind.PUBLISHER else (each, own)
                yield each, mismatch(*(dds_qos(end.qos) for end in ends))

    def _open(self, make: Callable[..., _End], role: str, own: Endpoint, *more: object) -> _End:
        spec = {"role": role, "name": checked_name(own.name), "type": own.type}
        if role in ("publisher", "subscription"):
            spec |= {"hash": own.type_hash, **rclpy_qos(own.qos)}
        number = next(self._numbers)
        end = self._ends[number] = make(self, number, own, *more)
        error = self._ask(number, spec)
        if error:
            end.close()
            raise EngineError(f"{own.name}: {error}")
        return end

    def _ask(self, number: int, spec: Mapping[str, Any]) -> str:
        """Send an OPEN frame, and return its error, or an empty text."""
        try:
            error = self.process.ask(Kind.OPEN, number, json.dumps(spec).encode(), _OPEN_S)
        except EngineError as failure:
            return str(failure)
        return f"rclpy did not respond within {_OPEN_S:.0f} s" if error is None else error.decode()

    def _on_frame(self, kind: int, end_number: int, number: int, body: bytes) -> None:
        if kind == Kind.GRAPH:
            self._endpoints = [
                Endpoint(
                    *(bytes.fromhex(each["key"]), _ROLES[each["role"]], each["name"], each["type"]),
                    type_hash=each.get("hash", ""),
                    qos=qos_of_rclpy(each),
                    node=each["node"],
                    gateway=gateway_of_node(each["node"]),
                )
                for each in json.loads(body)
            ]
        elif (end := self._ends.get(end_number)) is not None:
            end.on_frame(number, body)
