"""The engine for ROS 2 nodes that use DDS: a participant with ROS 2 names, types and QoS."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Final, TypeVar

from pipros.basics.errors import PiprosError
from pipros.basics.limits import Limits
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
)
from pipros_ros2.qos_table import dds_qos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine_endpoints import (
    NO_GATEWAY,
    EngineCaller,
    EnginePublisher,
    OwnEndpoint,
    endpoint_of,
    hash_entry,
    mismatch_reason,
)
from pipros_ros2.rtps.events import Elsewhere, Event, Mismatched, OverLimit, PeerChanged
from pipros_ros2.rtps.graph_info import GidBytes, Knowledge, NodeInfo
from pipros_ros2.rtps.identity import guid_text, is_writer
from pipros_ros2.rtps.nodes import Nodes
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.service_client import RtpsClient
from pipros_ros2.rtps.service_styles import PIPROS_MARK
from pipros_ros2.rtps.services import RtpsServer
from pipros_ros2.rtps.writer_proxy import RtpsSample
from pipros_rosbag2.names import dds_service, dds_topic, dds_type, topic_of_dds

_LOG = logging.getLogger("pipros_ros2")
_MIXED: Final = "`ros2 node list` does not show it: Humble and later distributions share the domain"
_REPORTED: Final = 100
_Made = TypeVar("_Made")
_Owned = TypeVar("_Owned", bound="OwnEndpoint")


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
        self._owners: list[OwnEndpoint] = []
        self._reported: set[tuple[bytes, str]] = set()
        self._has_mismatches = False
        self._nodes: Nodes | None = None
        mark = f"enclave=/;{PIPROS_MARK}={gateway or NO_GATEWAY};".encode()
        self._participant = Participant(discovery, mark, self._on_event, limits)
        self._nodes = Nodes(self._participant, gid_bytes)
        self._announce_node()

    def advertise(self, topic: str, type_name: str, type_hash: str, qos: TopicQos) -> Ros2Publisher:
        name, kind = dds_topic(topic), dds_type(type_name)
        writer = self._open(
            lambda: self._participant.add_writer(name, kind, dds_qos(qos), hash_entry(type_hash))
        )
        return self._owned(EnginePublisher(self, writer))

    def subscribe(
        self,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: TopicQos,
        callback: Callable[[Sample], None],
    ) -> Ros2Subscription:
        def pass_on(sample: RtpsSample) -> None:
            callback(Sample(sample.payload, sample.writer))

        name, kind, entry = dds_topic(topic), dds_type(type_name), hash_entry(type_hash)
        found = self._open(lambda: self._participant.add_reader(name, kind, dds_qos(qos), pass_on, entry))
        return self._owned(OwnEndpoint(self, [found]))

    def serve(
        self,
        service: str,
        type_name: str,
        type_hash: str,
        answer: Callable[[bytes], bytes | None],
        parts: PartHashes = NO_HASHES,
    ) -> Ros2Subscription:
        del type_hash
        types, hashes = _service_types(service, type_name), _hash_entries(parts)
        server = self._open(lambda: RtpsServer(self._participant, service, *types, answer, *hashes))
        return self._owned(OwnEndpoint(self, [server]))

    def caller(
        self, service: str, type_name: str, type_hash: str, parts: PartHashes = NO_HASHES
    ) -> Ros2Caller:
        del type_hash
        types, hashes = _service_types(service, type_name), _hash_entries(parts)
        client = self._open(lambda: RtpsClient(self._participant, service, *types, *hashes))
        return self._owned(EngineCaller(self, client))

    def lacks(self, type_name: str) -> str:
        del type_name
        return ""

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
                    endpoint = endpoint_of(peer.data, data, nodes.get(data.guid, ""))
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
                found.append(EngineProblem(kind, topic, mismatch_reason(remote, policy), node))
        if self._nodes is not None and self._nodes.knowledge is Knowledge.MIXED:
            found.append(EngineProblem(None, f"{self._namespace}/{self._name}", _MIXED))
        return found

    def close(self) -> None:
        self._participant.close()

    def forget(self, owner: OwnEndpoint) -> None:
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
            self._warn(
                remote.guid,
                f"{topic_of_dds(remote.topic) or remote.topic}: a peer does not match: "
                f"{mismatch_reason(remote, policy)}",
            )

    def _warn(self, guid: bytes, text: str) -> None:
        if (guid, text) not in self._reported and len(self._reported) < _REPORTED:
            self._reported.add((guid, text))
            _LOG.warning(text)


def _service_types(service: str, type_name: str) -> tuple[str, str]:
    """Return the DDS types of requests and responses. Raise PiprosError if the name is not legal."""
    dds_service(service)
    kind = dds_type(type_name)[:-1]
    return f"{kind}_Request_", f"{kind}_Response_"


def _hash_entries(parts: PartHashes) -> tuple[bytes, bytes]:
    return hash_entry(parts.request), hash_entry(parts.response)
