"""The engine that uses the rclpy of another Python: its middleware, its security and its settings."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, TypeVar

from pipros_ros2.agent.endpoints import AgentCaller, AgentEnd, AgentPublisher, AgentServer, AgentSubscriber
from pipros_ros2.agent.process import AgentProcess
from pipros_ros2.agent.rclpy_agent import Kind
from pipros_ros2.interface import (
    NO_HASHES,
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
    gateway_of_node,
)
from pipros_ros2.qos_table import dds_qos, qos_of_rclpy, rclpy_qos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.qos import QosPolicy, mismatch
from pipros_rosbag2.names import checked_name

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
        answer: Callable[[bytes], bytes],
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
            EngineProblem(each.kind, each.name, f"its QoS is incompatible ({policy.value})", each.node)
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
