"""The engine that uses the rclpy of another Python: its middleware, its security and its settings."""

from __future__ import annotations

import itertools
import json
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from queue import Empty, SimpleQueue
from typing import Any, Final, TypeVar

from pipros_ros2.agent.endpoints import (
    AgentCaller,
    AgentEnd,
    AgentPublisher,
    AgentServer,
    AgentSubscriber,
    cost_bytes,
)
from pipros_ros2.agent.process import AgentProcess
from pipros_ros2.agent.rclpy_agent import Kind
from pipros_ros2.inbox import ROS2_INBOX_BYTES, Inbox
from pipros_ros2.interface import (
    NO_HASHES,
    Durability,
    Endpoint,
    EndpointKind,
    EngineError,
    EngineProblem,
    PartHashes,
    Reliability,
    Ros2Caller,
    Ros2Publisher,
    Ros2Subscription,
    Sample,
    TopicQos,
    gateway_of_node,
)
from pipros_ros2.rtps.domain import Discovery
from pipros_rosbag2.names import checked_name

_OPEN_S: Final = 10.0
ROLES: Final = {
    "publisher": EndpointKind.PUBLISHER,
    "subscription": EndpointKind.SUBSCRIBER,
    "service": EndpointKind.SERVER,
}
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
        self._limit_bytes = ROS2_INBOX_BYTES
        self._on_end = on_end
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._ends: dict[int, AgentEnd] = {}
        self._others: Sequence[Mapping[str, Any]] = ()
        self._opening: dict[int, SimpleQueue[str]] = {}
        self._missing: dict[str, str] = {}
        self._endpoints: Sequence[Endpoint] = ()
        self._end_reason = ""
        self._process = AgentProcess(python, discovery, node, variables, self._on_frame, self._fail)
        self.rmw, self.pid = self._process.rmw, self._process.pid

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        return self._open(AgentPublisher, _topic("publisher", topic, type_name, type_hash, qos))

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Ros2Subscription:
        spec = _topic("subscription", topic, type_name, type_hash, qos)
        return self._open(AgentSubscriber, spec, Inbox(qos.depth, self._limit_bytes, cost_bytes), callback)

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes],
        parts: PartHashes = NO_HASHES,
    ) -> Ros2Subscription:
        del type_hash, parts
        spec = {"role": "service", "name": checked_name(service), "type": type_name}
        return self._open(AgentServer, spec, answer)

    def caller(
        self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES
    ) -> Ros2Caller:
        del type_hash, parts
        return self._open(AgentCaller, {"role": "client", "name": checked_name(service), "type": type_name})

    def lacks(self, type_name: str) -> str:
        if type_name not in self._missing:
            spec = {"role": "type", "name": "", "type": type_name}
            self._missing[type_name] = self._ask(next(self._numbers), spec)
        return self._missing[type_name]

    def endpoints(self) -> Sequence[Endpoint]:
        return self._endpoints

    def problems(self) -> Sequence[EngineProblem]:
        with self._lock:
            own = [end.spec for end in self._ends.values()]
        return [
            EngineProblem(
                ROLES[other["role"]], other["name"], f"its QoS is incompatible ({policy})", other["node"]
            )
            for spec in own
            for other in self._others
            if (policy := mismatch(spec, other) or mismatch(other, spec))
        ]

    def close(self) -> None:
        self._process.close()

    # -- for the endpoints; see `Connection`

    def send(self, kind: Kind, number: int, *parts: bytes) -> None:
        self._process.send(kind, number, *parts)

    def send_later(self, make: Callable[[], Sequence[bytes]]) -> None:
        self._process.send_later(make)

    def matches(self, spec: Mapping[str, Any]) -> int:
        if spec["role"] == "client":
            wanted = ("service", spec["name"], spec["type"])
            return sum((each["role"], each["name"], each["type"]) == wanted for each in self._others)
        return sum(mismatch(spec, each) == "" for each in self._others)

    def close_end(self, number: int) -> None:
        with self._lock:
            is_open = self._ends.pop(number, None) is not None
        if is_open:
            self.send(Kind.CLOSE, number)

    def _open(self, make: Callable[..., _End], spec: Mapping[str, Any], *more: object) -> _End:
        number = next(self._numbers)
        end = make(self, number, spec, *more)
        with self._lock:
            self._ends[number] = end
        error = self._ask(number, spec)
        if error:
            end.close()
            raise EngineError(f"{spec['name']}: {error}")
        return end

    def _ask(self, number: int, spec: Mapping[str, Any]) -> str:
        """Send an OPEN frame, and return its error, or an empty text."""
        errors = self._opening[number] = SimpleQueue()
        try:
            self.send(Kind.OPEN, number, json.dumps(spec).encode())
            return self._end_reason or errors.get(timeout=_OPEN_S)
        except Empty:
            return f"rclpy did not respond within {_OPEN_S:.0f} s"
        finally:
            del self._opening[number]

    # -- the thread that reads frames

    def _on_frame(self, kind: int, number: int, body: bytes) -> None:
        if kind == Kind.GRAPH:
            self._on_graph(json.loads(body))
        elif kind == Kind.DONE:
            if (errors := self._opening.get(number)) is not None:
                errors.put(body.decode())
        elif (end := self._ends.get(number)) is not None:
            end.on_frame(body)

    def _on_graph(self, endpoints: Sequence[Mapping[str, Any]]) -> None:
        self._others = endpoints
        self._endpoints = [
            Endpoint(
                *(bytes.fromhex(each["key"]), ROLES[each["role"]], each["name"], each["type"]),
                type_hash=each.get("hash", ""),
                qos=_qos_of(each),
                node=each["node"],
                gateway=gateway_of_node(each["node"]),
            )
            for each in endpoints
        ]

    def _fail(self, reason: str) -> None:
        self._end_reason = reason
        for errors in list(self._opening.values()):
            errors.put(reason)
        for end in list(self._ends.values()):
            end.fail(reason)
        self._on_end(reason)


def mismatch(one: Mapping[str, Any], two: Mapping[str, Any]) -> str | None:
    """Return the QoS policy by which a publisher and a subscription do not match.

    It is "" if they match, and None if they are unrelated.
    """
    if (one["role"], two["role"]) != ("publisher", "subscription"):
        return None
    if (one["name"], one["type"]) != (two["name"], two["type"]):
        return None
    if (one["reliability"], two["reliability"]) == ("best_effort", "reliable"):
        return "reliability"
    return "durability" if (one["durability"], two["durability"]) == ("volatile", "transient_local") else ""


def _topic(role: str, name: str, type_name: str, type_hash: str, qos: TopicQos) -> Mapping[str, Any]:
    return {
        "role": role,
        "name": checked_name(name),
        "type": type_name,
        "hash": type_hash,
        "reliability": qos.reliability.value,
        "durability": qos.durability.value,
        "depth": qos.depth,
    }


def _qos_of(endpoint: Mapping[str, Any]) -> TopicQos:
    is_best_effort = endpoint.get("reliability") == "best_effort"
    is_latched = endpoint.get("durability") == "transient_local"
    return TopicQos(
        Reliability.BEST_EFFORT if is_best_effort else Reliability.RELIABLE,
        Durability.TRANSIENT_LOCAL if is_latched else Durability.VOLATILE,
    )
