"""The local endpoints of a participant, and their connections with remote ones.

A local and a remote endpoint with the same topic and type, and compatible quality of service, match: the
local endpoint then keeps a proxy of the remote endpoint.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pipros_ros2.rtps.announcements import EndpointData
from pipros_ros2.rtps.events import Elsewhere, Event, Matched, Mismatched
from pipros_ros2.rtps.identity import FAST_DDS
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.peers import Peer
from pipros_ros2.rtps.qos import mismatch
from pipros_ros2.rtps.reader import Reader
from pipros_ros2.rtps.writer import LOCAL_FRAGMENT_BYTES, REMOTE_FRAGMENT_BYTES, Writer


@dataclass(slots=True, eq=False)
class Local:
    """An endpoint of this participant.

    Attributes:
        announcement: sequence number of the endpoint's announcement.
    """

    data: EndpointData
    end: Writer | Reader
    announcement: int


class Connections:
    """Tables of endpoints and connections; see the module docstring. Not thread-safe.

    Attributes:
        writers: local writers by entity id, including those for discovery.
        readers: local readers by the GUID of the remote writer.
        busy: writers and readers that have a deadline.
        events: list to which matches, mismatches and `Elsewhere` events are appended.
    """

    def __init__(self, local_hosts: frozenset[str], events: list[Event]) -> None:
        self.writers: dict[bytes, Writer] = {}
        self.readers: dict[bytes, list[Reader]] = {}
        self.busy: set[Writer | Reader] = set()
        self.events = events
        self._local_hosts = local_hosts
        self._locals: dict[bytes, Local] = {}
        self._by_topic: dict[str, list[Local]] = {}

    def local(self, entity: bytes) -> Local | None:
        return self._locals.get(entity)

    def add(self, local: Local) -> None:
        """Add a local endpoint, without matching it."""
        self._locals[local.data.guid[12:]] = local
        self._by_topic.setdefault(local.data.topic, []).append(local)
        if isinstance(local.end, Writer):
            self.writers[local.end.entity] = local.end

    def remove(self, entity: bytes) -> Local | None:
        """Disconnect and return a local endpoint, or return None if it is unknown."""
        local = self._locals.pop(entity, None)
        if local is None:
            return None
        topic = local.data.topic
        self._by_topic[topic].remove(local)
        if not self._by_topic[topic]:
            del self._by_topic[topic]
        self.busy.discard(local.end)
        if isinstance(local.end, Reader):
            for guid in list(local.end.writers):
                self.disconnect_reader(local.end, guid)
        else:
            del self.writers[entity]
            for guid in list(local.end.readers):
                local.end.unmatch(guid)
        return local

    def match_local(self, local: Local, peers: list[Peer], now: float) -> None:
        """Match a new local endpoint with all remote ones."""
        for peer in peers:
            for remote in list(peer.endpoints.values()):
                if remote.topic == local.data.topic:
                    self._try_match(peer, local, remote, now)

    def match_remote(self, peer: Peer, remote: EndpointData, now: float) -> None:
        """Match a new remote endpoint with all local ones."""
        for local in self._by_topic.get(remote.topic, ()):
            self._try_match(peer, local, remote, now)

    def _try_match(self, peer: Peer, local: Local, remote: EndpointData, now: float) -> None:
        endpoint, end = local.data, local.end
        if endpoint.is_writer is remote.is_writer:
            return
        entity = endpoint.guid[12:]
        found = _mismatched(endpoint, remote)
        if found is not None:
            self.events.append(found)
            return
        address = peer.address_of(remote)
        if address is None:
            self.events.append(Elsewhere(peer.data.prefix, peer.host))
            return
        if isinstance(end, Writer):
            is_local = address.host in self._local_hosts or address.host.startswith("127.")
            fragment_bytes = LOCAL_FRAGMENT_BYTES if is_local else REMOTE_FRAGMENT_BYTES
            end.match(remote.guid, address, remote.qos, fragment_bytes, now)
            self.busy.add(end)
        else:
            is_reliable = endpoint.qos.is_reliable and remote.qos.is_reliable
            self.connect_reader(end, remote.guid, address, peer, now, is_reliable=is_reliable)
        self.events.append(Matched(entity, remote, True))

    def mismatched(self, peer: Peer) -> Iterator[Mismatched]:
        """Yield a mismatch for each endpoint of a peer if its topic has local endpoints, but none match."""
        for remote in peer.endpoints.values():
            found = [
                _mismatched(each.data, remote)
                for each in self._by_topic.get(remote.topic, ())
                if each.data.is_writer is not remote.is_writer
            ]
            if found and found[0] is not None and all(found):
                yield found[0]

    def disconnect(self, remote: EndpointData) -> None:
        """End all connections of a remote endpoint."""
        for local in self._by_topic.get(remote.topic, ()):
            end = local.end
            if isinstance(end, Writer) and remote.guid in end.readers:
                end.unmatch(remote.guid)
            elif isinstance(end, Reader) and remote.guid in end.writers:
                self.disconnect_reader(end, remote.guid)
            else:
                continue
            self.events.append(Matched(local.data.guid[12:], remote, False))

    def connect_reader(
        self, reader: Reader, guid: bytes, address: Address, peer: Peer, now: float, *, is_reliable: bool
    ) -> None:
        """Start passing a remote writer's samples to a local reader."""
        connected = self.readers.setdefault(guid, [])
        if reader not in connected:
            connected.append(reader)
        base = 0 if peer.data.vendor == FAST_DDS else 1
        budget = peer.incomplete
        reader.match(guid, address, budget, now, is_reliable=is_reliable, question_base=base)
        self.busy.add(reader)

    def disconnect_reader(self, reader: Reader, guid: bytes) -> None:
        """Undo `connect_reader`. May be called repeatedly."""
        reader.unmatch(guid)
        connected = self.readers.get(guid, [])
        if reader in connected:
            connected.remove(reader)
        if not connected:
            self.readers.pop(guid, None)


def _mismatched(endpoint: EndpointData, remote: EndpointData) -> Mismatched | None:
    """Return why a local and a remote endpoint of a topic do not match, or None if they do."""
    offered, requested = (endpoint, remote) if endpoint.is_writer else (remote, endpoint)
    has_same_type = endpoint.type_name == remote.type_name
    policy = mismatch(offered.qos, requested.qos) if has_same_type else None
    if has_same_type and policy is None:
        return None
    return Mismatched(endpoint.guid[12:], remote, policy)
