"""The engine for ROS 2 nodes that use DDS: a participant with ROS 2 names, types and QoS."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits
from pipros.ros2.interface import (
    NO_HASHES,
    Durability,
    Endpoint,
    EndpointKind,
    EngineError,
    EngineProblem,
    PartHashes,
    Reliability,
    Ros2Caller,
    Ros2CallFailed,
    Ros2Publisher,
    Ros2Subscription,
    Sample,
    TopicQos,
)
from pipros.ros2.names import dds_service, dds_topic, dds_type, service_of_dds, topic_of_dds, type_of_dds
from pipros.ros2.rtps import qos as dds
from pipros.ros2.rtps import reader
from pipros.ros2.rtps.announcements import EndpointData, ParticipantData, entries
from pipros.ros2.rtps.domain import Discovery
from pipros.ros2.rtps.events import Elsewhere, Event, Mismatched, OverLimit, PeerChanged
from pipros.ros2.rtps.graph_info import GidBytes, Knowledge, NodeInfo
from pipros.ros2.rtps.identity import guid_text, is_writer
from pipros.ros2.rtps.nodes import Nodes
from pipros.ros2.rtps.participant import Participant
from pipros.ros2.rtps.participant_core import ParticipantCore
from pipros.ros2.rtps.service_client import RtpsClient
from pipros.ros2.rtps.service_styles import PIPROS_MARK, style_of
from pipros.ros2.rtps.services import RtpsServer
from pipros.ros2.rtps.topics import RtpsTopicWriter, TopicReader

_LOG = logging.getLogger("pipros.ros2")
_NO_GATEWAY: Final = "1"
"""Value of `PIPROS_MARK` for participants that are not gateways."""
_REQUEST: Final = "_Request"
_UNKNOWN_STYLE: Final = "the form of service requests is unknown for its DDS implementation"
_MIXED: Final = "`ros2 node list` does not show it: Humble and later distributions share the domain"
_REPORTED: Final = 100
_Made = TypeVar("_Made")
_Owned = TypeVar("_Owned", bound="_Own")


class RtpsEngine:
    """A DDS participant with one node. See `Ros2Engine`.

    Args:
        node: full name of the node that owns all endpoints.
        gateway: identity of the gateway; empty if the participant is not a gateway.
        gid_bytes: GID size in this domain; None to learn it before the node is announced.
        limits: defaults to the process-wide limits.

    Raises:
        Unreachable: this machine has no free port in the domain.
    """

    def __init__(
        self,
        discovery: Discovery,
        node: str,
        *,
        gateway: str = "",
        gid_bytes: GidBytes | None = None,
        limits: Limits | None = None,
    ) -> None:
        self._namespace, _, self._name = node.rpartition("/")
        self._lock = threading.Lock()
        self._owners: list[_Own] = []
        self._reported: set[tuple[bytes, str]] = set()
        self._has_mismatches = False
        self._nodes: Nodes | None = None
        mark = f"enclave=/;{PIPROS_MARK}={gateway or _NO_GATEWAY};".encode()
        self._participant = Participant(discovery, mark, self._on_event, limits)
        self._nodes = Nodes(self._participant, gid_bytes)
        self._announce_node()

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        name, kind = dds_topic(topic), dds_type(type_name)
        writer = self._open(lambda: self._participant.add_writer(name, kind, _dds(qos), _entry(type_hash)))
        return self._owned(_Publisher(self, writer))

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Ros2Subscription:
        def pass_on(sample: reader.RtpsSample) -> None:
            callback(Sample(sample.payload, sample.writer))

        name, kind, entry = dds_topic(topic), dds_type(type_name), _entry(type_hash)
        found = self._open(lambda: self._participant.add_reader(name, kind, _dds(qos), pass_on, entry))
        return self._owned(_Own(self, [found]))

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes],
        parts: PartHashes = NO_HASHES,
    ) -> Ros2Subscription:

        def handle(request: bytes) -> bytes | None:
            try:
                return answer(request)
            except Exception as error:
                _LOG.warning("the service %s for ROS 2 failed: %s", service, error)
                return None

        del type_hash
        dds_service(service)  # raises if the name is not legal
        kind = dds_type(type_name)[:-1]
        server = self._open(
            lambda: RtpsServer(
                self._participant,
                service,
                f"{kind}_Request_",
                f"{kind}_Response_",
                handle,
                _entry(parts.request),
                _entry(parts.response),
            )
        )
        return self._owned(_Own(self, [server]))

    def caller(
        self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES
    ) -> Ros2Caller:
        del type_hash
        dds_service(service)
        kind = dds_type(type_name)[:-1]
        client = self._open(
            lambda: RtpsClient(
                self._participant,
                service,
                f"{kind}_Request_",
                f"{kind}_Response_",
                _entry(parts.request),
                _entry(parts.response),
            )
        )
        return self._owned(_Client(self, client))

    @property
    def has_peers(self) -> bool:
        """Whether other participants are known."""
        return self._participant.ask(lambda core: len(core.peers) > 0)

    def endpoints(self) -> Sequence[Endpoint]:
        self._warn_of_mismatches()
        nodes = self._node_names()

        def read(core: ParticipantCore) -> list[Endpoint]:
            found = []
            for peer in core.peers:
                for data in peer.endpoints.values():
                    endpoint = _endpoint(peer.data, data, nodes.get(data.guid, ""))
                    if endpoint is not None:
                        found.append(endpoint)
            return found

        return self._participant.ask(read)

    def _node_names(self) -> dict[bytes, str]:
        """Return the name of the node that owns each remote endpoint, by the endpoint's GUID."""
        return {
            guid: f"{node.namespace.rstrip('/')}/{node.name}"
            for info in (self._nodes.others() if self._nodes is not None else ())
            for node in info.nodes
            for guid in (*node.readers, *node.writers)
        }

    def problems(self) -> Sequence[EngineProblem]:
        nodes = self._node_names()
        found = []
        for _, remote, policy in self._participant.ask(ParticipantCore.mismatched)[:_REPORTED]:
            topic = topic_of_dds(remote.topic)
            if topic is not None:
                kind = EndpointKind.PUBLISHER if remote.is_writer else EndpointKind.SUBSCRIBER
                node = nodes.get(remote.guid) or guid_text(remote.guid)
                found.append(EngineProblem(kind, topic, _reason(remote, policy), node))
        if self._nodes is not None and self._nodes.knowledge is Knowledge.MIXED:
            found.append(EngineProblem(None, f"{self._namespace}/{self._name}", _MIXED))
        return found

    def close(self) -> None:
        self._participant.close()

    # Called by the endpoints in this module.

    def forget(self, owner: _Own) -> None:
        """Remove a closed endpoint from the node."""
        with self._lock:
            if owner not in self._owners:
                return
            self._owners.remove(owner)
        self._announce_node()

    def _open(self, make: Callable[[], _Made]) -> _Made:
        try:
            return make()
        except PiprosError as error:
            raise EngineError(str(error)) from error

    def _owned(self, owner: _Owned) -> _Owned:
        with self._lock:
            self._owners.append(owner)
        self._announce_node()
        return owner

    def _announce_node(self) -> None:
        with self._lock:
            guids = [guid for owner in self._owners for guid in owner.guids()]
        if self._nodes is not None:
            node = NodeInfo(
                self._namespace or "/",
                self._name,
                tuple(guid for guid in guids if not is_writer(guid)),
                tuple(guid for guid in guids if is_writer(guid)),
            )
            try:
                self._nodes.announce([node])
            except (PiprosError, TimeoutError) as error:
                _LOG.debug("the node was not announced: %s", error)

    def _on_event(self, event: Event) -> None:
        match event:
            case PeerChanged(peer, False) if self._nodes is not None:
                self._nodes.forget(peer.prefix)
            case Mismatched():
                self._has_mismatches = True
            case OverLimit(prefix):
                self._warn(
                    prefix,
                    "a ROS 2 participant has announced too many endpoints; further endpoints are ignored",
                )
            case Elsewhere(prefix, host):
                self._warn(
                    prefix,
                    f"a ROS 2 participant at {host} is ignored, because its addresses are in other networks; "
                    "add them to ROS_STATIC_PEERS to allow them",
                )

    def _warn_of_mismatches(self) -> None:
        """Log, once, each remote endpoint that matches no local endpoint of its topic.

        The warnings are delayed, because an action may be offered with several types, one after another.
        """
        if not self._has_mismatches:
            return
        self._has_mismatches = False
        for _, remote, policy in self._participant.ask(ParticipantCore.mismatched)[:_REPORTED]:
            self._warn(remote.guid, f"{remote.topic}: a peer does not match: {_reason(remote, policy)}")

    def _warn(self, guid: bytes, text: str) -> None:
        if (guid, text) not in self._reported and len(self._reported) < _REPORTED:
            self._reported.add((guid, text))
            _LOG.warning(text)


class _Own:
    """An endpoint of the engine."""

    def __init__(
        self, engine: RtpsEngine, ends: Sequence[TopicReader | RtpsTopicWriter | RtpsServer | RtpsClient]
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


class _Publisher(_Own):
    def __init__(self, engine: RtpsEngine, writer: RtpsTopicWriter) -> None:
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


class _Client(_Own):
    def __init__(self, engine: RtpsEngine, client: RtpsClient) -> None:
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


def _dds(qos: TopicQos) -> dds.Qos:
    return dds.Qos(
        dds.ReliabilityKind[qos.reliability.name],
        dds.DurabilityKind[qos.durability.name],
        depth=qos.depth,
    )


def _entry(type_hash: str) -> bytes:
    return f"typehash={type_hash};".encode() if type_hash else b""


def _reason(remote: EndpointData, policy: dds.QosPolicy | None) -> str:
    """Return why a peer's endpoint does not match."""
    if policy is None:
        return f"its type is {type_of_dds(remote.type_name) or remote.type_name}"
    return f"its QoS is incompatible ({policy.value})"


def _endpoint(peer: ParticipantData, data: EndpointData, node: str) -> Endpoint | None:
    """Return an endpoint with its ROS 2 names, or None for non-ROS 2 topics and for service replies."""
    topic, service, kind = topic_of_dds(data.topic), service_of_dds(data.topic), type_of_dds(data.type_name)
    if kind is None:
        return None
    gateway = entries(peer.user_data).get(PIPROS_MARK, "")
    gateway = "" if gateway == _NO_GATEWAY else gateway
    type_hash = entries(data.user_data).get("typehash", "")
    if topic is not None:
        what = EndpointKind.PUBLISHER if data.is_writer else EndpointKind.SUBSCRIBER
        return Endpoint(data.guid, what, topic, kind, type_hash, _qos(data.qos), node, gateway)
    if service is None or not data.topic.startswith("rq/") or not kind.endswith(_REQUEST):
        return None
    what = EndpointKind.CLIENT if data.is_writer else EndpointKind.SERVER
    kind, problem = kind[: -len(_REQUEST)], "" if style_of(peer, data) else _UNKNOWN_STYLE
    return Endpoint(data.guid, what, service, kind, type_hash, _qos(data.qos), node, gateway, problem)


def _qos(qos: dds.Qos) -> TopicQos:
    return TopicQos(
        Reliability[qos.reliability.name],
        Durability.TRANSIENT_LOCAL if qos.is_latched else Durability.VOLATILE,
    )
