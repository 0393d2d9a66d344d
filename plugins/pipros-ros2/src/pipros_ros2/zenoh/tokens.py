"""Liveliness tokens and attachments of rmw_zenoh: encoding and parsing.

Every node and endpoint declares a token, which disappears with its session. All tokens together form the ROS
graph. Parts of a token are separated by `/`, so slashes within a part become `%`.
"""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass

from pipros_ros2.interface import Endpoint, EndpointKind, TopicQos, gateway_of_node
from pipros_ros2.qos_table import qos_of_zenoh, zenoh_qos
from pipros_rosbag2.names import dds_type, type_of_dds

NO_HASH = "TypeHashNotSupported"
"""The placeholder for type hashes in Humble."""

GID_BYTES = 16
_PREFIX = "@ros2_lv"
_KINDS = {
    EndpointKind.PUBLISHER: "MP",
    EndpointKind.SUBSCRIBER: "MS",
    EndpointKind.SERVER: "SS",
    EndpointKind.CLIENT: "SC",
}
_KIND_OF = {word: kind for kind, word in _KINDS.items()}
_PARTS_OF_ENDPOINT = 13
_PUBLISHERS = 1000
_ATTACHMENT = struct.Struct(f"<qqB{GID_BYTES}s")


@dataclass(frozen=True, slots=True)
class NodeIdentity:
    """A node in a Zenoh session.

    Attributes:
        session: the id of the session, as Zenoh's API prints it.
        namespace, name: the node's namespace, which is empty or begins with a slash, and its base name.
    """

    domain: int
    session: str
    namespace: str
    name: str


@dataclass(frozen=True, slots=True)
class Attachment:
    """Metadata of every message, request and reply.

    Attributes:
        sequence: number of the message, counted from 1 by its publisher or client.
        gid: identity of the publisher or client. A reply has the GID of its request.
    """

    sequence: int
    time_ns: int
    gid: bytes

    def to_bytes(self) -> bytes:
        return _ATTACHMENT.pack(self.sequence, self.time_ns, GID_BYTES, self.gid)


def parse_attachment(data: bytes) -> Attachment | None:
    """Return the attachment, or None if it is malformed. rmw_zenoh drops messages without an attachment."""
    if len(data) != _ATTACHMENT.size:
        return None
    sequence, time_ns, size, gid = _ATTACHMENT.unpack(data)
    return Attachment(sequence, time_ns, gid) if size == GID_BYTES else None


def new_attachment(sequence: int, gid: bytes) -> Attachment:
    """Return an attachment with the current time."""
    return Attachment(sequence, time.time_ns(), gid)


class Arrivals:
    """Counts the messages that a subscriber misses, from gaps in its publishers' sequence numbers.

    Attributes:
        missing: number of missing messages, counted from each publisher's first message to arrive.
    """

    def __init__(self) -> None:
        self.missing = 0
        self._last: dict[bytes, int] = {}

    def add(self, gid: bytes, sequence: int) -> bool:
        """Record a message, and return whether it is the first one from its publisher.

        Older messages, which a publisher repeats for late subscribers, do not affect `missing`.
        """
        is_first = gid not in self._last
        last = self._last.pop(gid, sequence - 1)
        self.missing += max(0, sequence - last - 1)
        self._last[gid] = max(last, sequence)
        if len(self._last) > _PUBLISHERS:
            del self._last[next(iter(self._last))]
        return is_first


def graph_key(domain: int) -> str:
    """Return the key expression that all tokens of a domain match."""
    return f"{_PREFIX}/{domain}/**"


def node_token(node: NodeIdentity) -> str:
    """Return the token of a session's only node."""
    session = f"{_PREFIX}/{node.domain}/{node.session}/0/0/NN"
    return f"{session}/%/{_mangled(node.namespace)}/{node.name}"


def endpoint_token(
    node: NodeIdentity,
    number: int,
    kind: EndpointKind,
    name: str,
    type_name: str,
    type_hash: str,
    qos: TopicQos,
) -> str:
    """Return the token of an endpoint. `number` is unique in the session; the node's own token has 0."""
    start = f"{_PREFIX}/{node.domain}/{node.session}/0/{number}/{_KINDS[kind]}"
    owner = f"%/{_mangled(node.namespace)}/{node.name}"
    return f"{start}/{owner}/{_mangled(name)}/{dds_type(type_name)}/{type_hash or NO_HASH}/{zenoh_qos(qos)}"


def parse_token(token: str) -> tuple[str, Endpoint] | None:
    """Return a token's session and endpoint, or None if the token belongs to a node or has an unknown form.

    Further parts, which later versions may append, are ignored.
    """
    parts = token.split("/")
    if len(parts) < _PARTS_OF_ENDPOINT or parts[0] != _PREFIX or parts[5] not in _KIND_OF:
        return None
    session, kind, namespace, node, name, dds_name, type_hash, qos = parts[2], *parts[5:6], *parts[7:13]
    type_name = type_of_dds(dds_name)
    if type_name is None:
        return None
    full_node = f"{_unmangled(namespace)}/{node}"
    endpoint = Endpoint(
        token.encode(),
        _KIND_OF[kind],
        _unmangled(name),
        type_name,
        "" if type_hash == NO_HASH else type_hash,
        qos_of_zenoh(qos),
        full_node,
        *(gateway_of_node(full_node), "", session),
    )
    return session, endpoint


def gid_of_hash(digest: int) -> bytes:
    """Return an entity's GID: the 128-bit XXH3 hash (seed 0) of its token, in little-endian order."""
    return digest.to_bytes(GID_BYTES, "little")


def _mangled(name: str) -> str:
    return name.replace("/", "%") if name not in ("", "/") else "%"


def _unmangled(part: str) -> str:
    return "" if part == "%" else part.replace("%", "/")
