"""Discovery of other participants and their endpoints, and the announcement of our own (SPDP and SEDP).

Theory of operation. The participant announces itself repeatedly for as long as it exists, so that
participants find each other. Two built-in pairs of writers and readers, which are reliable and keep their
history for late readers, announce each side's endpoints to the other. A peer is considered gone if it
announces that it is leaving, or if it is silent for longer than its lease.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from pipros_ros2.rtps.announcements import (
    EndpointData,
    read_endpoint,
    read_key,
    read_participant,
    write_endpoint,
    write_key,
)
from pipros_ros2.rtps.connections import Connections, Local
from pipros_ros2.rtps.events import Elsewhere, EndpointChanged, OverLimit, PeerChanged, RtpsSettings
from pipros_ros2.rtps.identity import (
    GUID_BYTES,
    PUBLICATIONS_READER,
    PUBLICATIONS_WRITER,
    SUBSCRIPTIONS_READER,
    SUBSCRIPTIONS_WRITER,
)
from pipros_ros2.rtps.outbox import DatagramOutbox
from pipros_ros2.rtps.parameters import Parameter, ended, is_ended
from pipros_ros2.rtps.peers import ROS2_DISCOVERY_BYTES, ROS2_PEER_BYTES, Peer, Peers
from pipros_ros2.rtps.presence import ParticipantPresence
from pipros_ros2.rtps.qos import DurabilityKind, Qos, ReliabilityKind
from pipros_ros2.rtps.reader import Reader
from pipros_ros2.rtps.submessages import Data
from pipros_ros2.rtps.writer import LOCAL_FRAGMENT_BYTES, Writer
from pipros_ros2.rtps.writer_proxy import RtpsSample

_LEASE_CHECK_S: Final = 0.5
_ANSWERS_S: Final = 3.0
"""How long our announcement is repeated to a new peer that has not answered."""
_STRANGERS: Final = 500
"""Maximum number of peers that have not answered our built-in endpoints; each is asked repeatedly."""
_ENDED_ENDPOINTS: Final = 256
_MAX_NAME_CHARACTERS: Final = 255
_DISCOVERY_QOS: Final = Qos(ReliabilityKind.RELIABLE, DurabilityKind.TRANSIENT_LOCAL, depth=0)
_DISCOVERY: Final = (
    (PUBLICATIONS_WRITER, PUBLICATIONS_READER),
    (SUBSCRIPTIONS_WRITER, SUBSCRIPTIONS_READER),
)


class PeerDiscovery:
    """The peers of a participant, and what it announces to them; see the module docstring.

    Attributes:
        peers: the other participants, with their endpoints.
    """

    def __init__(
        self,
        settings: RtpsSettings,
        connections: Connections,
        outbox: DatagramOutbox,
        now: float,
    ) -> None:
        self.peers = Peers(settings.local_hosts | settings.static_hosts)
        self._connections = connections
        self._events = connections.events
        self._presence = ParticipantPresence(settings, outbox, now)
        self._check_leases_at = now + _LEASE_CHECK_S
        self._strangers: dict[
            bytes, None
        ] = {}  # prefixes, oldest first; those that have answered may be left
        self._ended: deque[tuple[Writer, int]] = deque()
        self._discovery_readers: list[Reader] = []
        prefix = settings.me.prefix
        for writer, reader in _DISCOVERY:
            connections.writers[writer] = Writer(prefix, writer, _DISCOVERY_QOS, ROS2_DISCOVERY_BYTES, outbox)
            request_bytes = settings.request_bytes
            end = Reader(prefix, reader, ROS2_PEER_BYTES, outbox, self._on_endpoint, request_bytes)
            self._discovery_readers.append(end)

    def add(self, data: EndpointData, end: Writer | Reader, now: float) -> None:
        """Announce an endpoint of this participant, and connect it with those of the peers."""
        announcer = self._announcer(data)
        local = Local(data, end, announcer.write(write_endpoint(data), now))
        self._connections.busy.add(announcer)
        self._connections.add(local)
        self._connections.match_local(local, list(self.peers), now)

    def remove(self, local: Local, now: float) -> None:
        """Notify the peers that an endpoint of this participant has ended."""
        data = local.data
        announcer = self._announcer(data)
        announcer.forget(local.announcement)
        payload = write_key(Parameter.ENDPOINT_GUID, data.guid)
        self._ended.append((announcer, announcer.write(payload, now, ended(data.guid), is_key=True)))
        self._connections.busy.add(announcer)
        while len(self._ended) > _ENDED_ENDPOINTS:
            earlier, number = self._ended.popleft()
            earlier.forget(number)

    def _announcer(self, data: EndpointData) -> Writer:
        return self._connections.writers[PUBLICATIONS_WRITER if data.is_writer else SUBSCRIPTIONS_WRITER]

    def close(self) -> None:
        """Notify the peers that the participant is leaving."""
        self._presence.end(self.peers)

    @property
    def deadline(self) -> float:
        """Time by which `poll` must be called."""
        return min(self._presence.due, self._check_leases_at)

    def poll(self, now: float, handled_until: float) -> None:
        """Announce the participant if that is due, and remove peers whose leases have expired.

        All datagrams that arrived before `handled_until` must have been handled.
        """
        if now >= self._presence.due:
            self._presence.announce(self.peers, now)
        if handled_until >= self._check_leases_at:
            self._check_leases_at = now + _LEASE_CHECK_S
            for peer in self.peers.expired(handled_until):
                self._remove_peer(peer.data.prefix)
            for peer in self.peers:
                if now - peer.found_at < _ANSWERS_S and not self._has_answered(peer):
                    self._presence.answer(peer)

    def on_participant(self, prefix: bytes, data: Data, host: str, now: float) -> None:
        """Handle the announcement or the end of a participant, which a host has sent."""
        if is_ended(data.inline) or not data.has_payload:
            self._remove_peer(prefix)
            return
        announced = read_participant(data.payload)
        if announced is None or announced.prefix != prefix:
            return
        connections = self._connections
        peer = self.peers.get(prefix)
        if peer is not None:
            if not peer.renew(announced, data.payload):
                self._remove_peer(prefix)
            elif not self._has_answered(peer):
                self._presence.answer(peer)  # the peer may have missed our first announcement
            return
        peer = self.peers.add(announced, data.payload, host, now)
        if peer is None:
            if not self.peers.reaches(announced, host):
                self._events.append(Elsewhere(prefix, host))
            return
        address = peer.discovery_address
        self._presence.answer(peer)
        for (writer, reader), discovery_reader in zip(_DISCOVERY, self._discovery_readers, strict=True):
            discovery_writer = connections.writers[writer]
            discovery_writer.match(prefix + reader, address, _DISCOVERY_QOS, LOCAL_FRAGMENT_BYTES, now)
            connections.connect_reader(
                discovery_reader, prefix + writer, address, peer, now, is_reliable=True
            )
            connections.busy.add(discovery_writer)
        self._events.append(PeerChanged(announced, True))
        self._strangers[prefix] = None
        while len(self._strangers) > _STRANGERS:
            oldest = next(iter(self._strangers))
            del self._strangers[oldest]
            if not self._is_acquainted(self.peers.get(oldest)):
                self._remove_peer(oldest)

    def _is_acquainted(self, peer: Peer | None) -> bool:
        """Return whether a peer's built-in endpoints and ours have answered each other."""
        if peer is None or not self._has_answered(peer):
            return False
        announcers = self._discovery_readers[0].writers
        return announcers[peer.data.prefix + PUBLICATIONS_WRITER].is_greeted

    def _has_answered(self, peer: Peer) -> bool:
        """Return False if a peer may not have received our announcements."""
        guid = peer.data.prefix + PUBLICATIONS_READER
        return self._connections.writers[PUBLICATIONS_WRITER].readers[guid].is_greeted

    def _remove_peer(self, prefix: bytes) -> None:
        peer = self.peers.get(prefix)
        if peer is None:
            return
        for remote in list(peer.endpoints.values()):
            self._remove_endpoint(peer, remote.guid)
        for (writer, reader), discovery_reader in zip(_DISCOVERY, self._discovery_readers, strict=True):
            self._connections.writers[writer].unmatch(prefix + reader)
            self._connections.disconnect_reader(discovery_reader, prefix + writer)
        self.peers.remove(prefix)
        self._strangers.pop(prefix, None)
        self._events.append(PeerChanged(peer.data, False))

    def _on_endpoint(self, sample: RtpsSample) -> None:
        """Handle the announcement or the removal of a remote endpoint."""
        prefix = sample.writer[:12]
        peer = self.peers.get(prefix)
        if peer is None:
            return
        if is_ended(sample.inline) or not sample.has_payload:
            guid = read_key(sample.payload, Parameter.ENDPOINT_GUID)
            hashes = (sample.inline or {}).get(Parameter.KEY_HASH, [b""])
            self._remove_endpoint(peer, guid or hashes[0][:GUID_BYTES])
            return
        remote = read_endpoint(sample.payload)
        if remote is None or remote.guid[:12] != prefix:
            return
        if remote.is_writer is not (sample.writer[12:] == PUBLICATIONS_WRITER):
            return
        if max(len(remote.topic), len(remote.type_name)) > _MAX_NAME_CHARACTERS:
            return
        known = peer.endpoints.get(remote.guid)
        if not peer.keep(remote, sample.payload):
            if not peer.is_over_limit:
                peer.is_over_limit = True
                self._events.append(OverLimit(prefix))
            return
        if known is not None and known != remote:
            self._connections.disconnect(known)
        if known != remote:
            self._events.append(EndpointChanged(remote, True))
            self._connections.match_remote(peer, remote, peer.heard_at)

    def _remove_endpoint(self, peer: Peer, guid: bytes) -> None:
        remote = peer.forget(guid)
        if remote is not None:
            self._connections.disconnect(remote)
            self._events.append(EndpointChanged(remote, False))
