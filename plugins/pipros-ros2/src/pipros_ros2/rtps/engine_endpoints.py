"""Endpoints of the RTPS engine, and endpoints of other participants with their ROS 2 names and QoS."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

from pipros.basics.errors import PiprosError
from pipros_ros2.interface import Endpoint, EndpointKind, EngineError, Ros2CallFailed, gateway_of_node
from pipros_ros2.qos_table import qos_of_dds
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData, entries
from pipros_ros2.rtps.qos import QosPolicy
from pipros_ros2.rtps.service_client import RtpsClient
from pipros_ros2.rtps.service_styles import PIPROS_MARK, style_of
from pipros_ros2.rtps.services import RtpsServer
from pipros_ros2.rtps.topics import RtpsTopicWriter, TopicReader
from pipros_rosbag2.names import service_of_dds, topic_of_dds, type_of_dds

NO_GATEWAY: Final = "1"
"""Value of `PIPROS_MARK` for participants that are not gateways."""
_REQUEST: Final = "_Request"
_UNKNOWN_STYLE: Final = "the form of service requests is unknown for its DDS implementation"


class Engine(Protocol):
    """The engine that owns endpoints."""

    def forget(self, owner: OwnEndpoint) -> None:
        """Remove a closed endpoint from the node."""


class OwnEndpoint:
    """An endpoint of the engine."""

    def __init__(
        self, engine: Engine, ends: Sequence[TopicReader | RtpsTopicWriter | RtpsServer | RtpsClient]
    ) -> None:
        self._engine = engine
        self._ends = ends

    @property
    def dropped(self) -> int:
        return sum(
            end.dropped if isinstance(end, TopicReader) else end.refused
            for end in self._ends
            if isinstance(end, TopicReader | RtpsServer)
        )

    def guids(self) -> list[bytes]:
        return [guid for end in self._ends for guid in _guids(end)]

    def close(self) -> None:
        for end in self._ends:
            end.close()
        self._engine.forget(self)


class EnginePublisher(OwnEndpoint):
    def __init__(self, engine: Engine, writer: RtpsTopicWriter) -> None:
        super().__init__(engine, [writer])
        self._writer = writer

    def publish(self, payload: bytes) -> None:
        try:
            self._writer.write(payload)
        except TimeoutError as error:
            raise EngineError(str(error)) from None

    @property
    def subscriber_count(self) -> int:
        return len(self._writer.readers())

    @property
    def dropped(self) -> int:
        return self._writer.lost


class EngineCaller(OwnEndpoint):
    def __init__(self, engine: Engine, client: RtpsClient) -> None:
        super().__init__(engine, [client])
        self._client = client

    def call(self, request: bytes, timeout_s: float) -> bytes:
        try:
            return self._client.call(request, timeout_s)
        except (PiprosError, TimeoutError) as error:
            raise Ros2CallFailed(str(error)) from error

    @property
    def is_available(self) -> bool:
        return self._client.wait_for_server(0.0)


def _guids(end: TopicReader | RtpsTopicWriter | RtpsServer | RtpsClient) -> Sequence[bytes]:
    return end.guids if isinstance(end, (RtpsServer, RtpsClient)) else (end.guid,)


def hash_entry(type_hash: str) -> bytes:
    return f"typehash={type_hash};".encode() if type_hash else b""


def mismatch_reason(remote: EndpointData, policy: QosPolicy | None) -> str:
    """Return why a peer's endpoint does not match."""
    if policy is None:
        return f"its type is {type_of_dds(remote.type_name) or remote.type_name}"
    return policy.reason


def endpoint_of(peer: ParticipantData, data: EndpointData, node: str) -> Endpoint | None:
    """Return an endpoint with its ROS 2 names, or None for non-ROS 2 topics and for service replies."""
    topic, service, kind = topic_of_dds(data.topic), service_of_dds(data.topic), type_of_dds(data.type_name)
    if kind is None:
        return None
    gateway = entries(peer.user_data).get(PIPROS_MARK, "")
    gateway = gateway_of_node(node) if gateway in ("", NO_GATEWAY) else gateway
    type_hash, process = entries(data.user_data).get("typehash", ""), data.guid[:12].hex()
    qos = qos_of_dds(data.qos)
    if topic is not None:
        what = EndpointKind.PUBLISHER if data.is_writer else EndpointKind.SUBSCRIBER
        return Endpoint(data.guid, what, topic, kind, type_hash, qos, node, gateway, "", process)
    if service is None or not data.topic.startswith("rq/") or not kind.endswith(_REQUEST):
        return None
    what = EndpointKind.CLIENT if data.is_writer else EndpointKind.SERVER
    kind, problem = kind[: -len(_REQUEST)], "" if style_of(peer, data) else _UNKNOWN_STYLE
    return Endpoint(data.guid, what, service, kind, type_hash, qos, node, gateway, problem, process)
