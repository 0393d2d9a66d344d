"""A participant without sockets, which turns datagrams and the time into datagrams and events.

Theory of operation. The participant announces itself repeatedly for as long as it exists (SPDP), so that
participants find each other. Two built-in pairs of writers and readers (SEDP), which are reliable and keep
their history for late readers, announce each side's endpoints to the other. A local and a remote endpoint
with the same topic and type, and compatible quality of service, match, and samples flow between them. A peer
is considered gone if it announces that it is leaving, or if it is silent for longer than its lease.

The core never raises because of a datagram. It is not thread-safe.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from pipros.basics.errors import NotFound
from pipros.basics.limits import Limits
from pipros.ros2.limits import Ros2Limits
from pipros.ros2.rtps.announcements import (
    EndpointData,
    read_endpoint,
    read_key,
    read_participant,
    write_endpoint,
    write_key,
)
from pipros.ros2.rtps.connections import Connections, Local
from pipros.ros2.rtps.decoding import read_datagram
from pipros.ros2.rtps.events import (
    Elsewhere,
    EndpointChanged,
    Event,
    Mismatched,
    OverLimit,
    PeerChanged,
    ReceivedSample,
    RtpsSettings,
)
from pipros.ros2.rtps.identity import (
    GUID_BYTES,
    PARTICIPANT_WRITER,
    PUBLICATIONS_READER,
    PUBLICATIONS_WRITER,
    SUBSCRIPTIONS_READER,
    SUBSCRIPTIONS_WRITER,
    UNKNOWN_ENTITY,
    user_entity,
)
from pipros.ros2.rtps.outbox import DatagramOutbox, Outgoing
from pipros.ros2.rtps.parameters import Parameter, SampleIdentity, ended, is_ended, related_sample
from pipros.ros2.rtps.peers import Peer, Peers
from pipros.ros2.rtps.presence import ParticipantPresence
from pipros.ros2.rtps.qos import DurabilityKind, Qos, ReliabilityKind
from pipros.ros2.rtps.reader import Reader, RtpsSample
from pipros.ros2.rtps.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
)
from pipros.ros2.rtps.writer import LOCAL_FRAGMENT_BYTES, Writer

_PARTICIPANT_WORK: Final = 32
_ENDPOINT_WORK: Final = 16
_ANSWER_WORK: Final = 8
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


class ParticipantCore:
    """A participant; see the module docstring."""

    def __init__(self, settings: RtpsSettings, limits: Limits, now: float) -> None:
        self.settings = settings
        self.prefix = settings.me.prefix
        self.peers = Peers(limits, settings.local_hosts | settings.static_hosts)
        self.malformed = 0
        self._limits = limits
        self._outbox = DatagramOutbox()
        self._events: list[Event] = []
        self._presence = ParticipantPresence(settings, self._outbox, now)
        self._connections = Connections(settings.local_hosts, self._events)
        self._check_leases_at = now + _LEASE_CHECK_S
        self._entities = 0
        self._is_closed = False
        self._strangers: dict[
            bytes, None
        ] = {}  # prefixes, oldest first; those that have answered may be left
        self._ended: deque[tuple[Writer, int]] = deque()
        self._discovery_readers: list[Reader] = []
        for writer, reader in _DISCOVERY:
            self._connections.writers[writer] = Writer(
                self.prefix, writer, _DISCOVERY_QOS, limits.of(Ros2Limits).ros2_discovery_bytes, self._outbox
            )
            end = Reader(
                self.prefix,
                reader,
                limits.of(Ros2Limits).ros2_peer_bytes,
                self._outbox,
                self._on_endpoint,
                settings.request_bytes,
            )
            self._discovery_readers.append(end)
        self._handlers: dict[type, Callable[[Peer, Submessage, float], None]] = {
            Data: self._to_readers,
            DataFrag: self._to_readers,
            Heartbeat: self._to_readers,
            HeartbeatFrag: self._to_readers,
            Gap: self._to_readers,
            AckNack: self._to_writer,
            NackFrag: self._to_writer,
        }

    # Called by the participant.

    def add_writer(self, topic: str, type_name: str, qos: Qos, now: float, user_data: bytes = b"") -> bytes:
        """Announce a writer; return its entity ID. `topic` and `type_name` are DDS names."""
        self._entities += 1
        entity = user_entity(self._entities, is_writer=True)
        writer = Writer(
            self.prefix, entity, qos, self._limits.of(Ros2Limits).ros2_history_bytes, self._outbox
        )
        self._add(EndpointData(self.prefix + entity, topic, type_name, qos, user_data), writer, now)
        return entity

    def add_reader(self, topic: str, type_name: str, qos: Qos, now: float, user_data: bytes = b"") -> bytes:
        """Announce a reader; return its entity ID. Each sample becomes a `ReceivedSample`."""
        self._entities += 1
        entity = user_entity(self._entities, is_writer=False)
        reader = Reader(
            self.prefix,
            entity,
            self._limits.of(Ros2Limits).ros2_sample_bytes,
            self._outbox,
            lambda sample: self._on_sample(entity, sample),
            self.settings.request_bytes,
        )
        self._add(EndpointData(self.prefix + entity, topic, type_name, qos, user_data), reader, now)
        return entity

    def _on_sample(self, entity: bytes, sample: RtpsSample) -> None:
        if sample.has_payload:
            self._events.append(ReceivedSample(entity, sample))

    def _add(self, data: EndpointData, end: Writer | Reader, now: float) -> None:
        announcer = self._announcer(data)
        local = Local(data, end, announcer.write(write_endpoint(data), now))
        self._connections.busy.add(announcer)
        self._connections.add(local)
        self._connections.match_local(local, list(self.peers), now)

    def _announcer(self, data: EndpointData) -> Writer:
        return self._connections.writers[PUBLICATIONS_WRITER if data.is_writer else SUBSCRIPTIONS_WRITER]

    def remove(self, entity: bytes, now: float) -> None:
        """Remove a writer or reader, and notify the peers. May be called repeatedly."""
        local = self._connections.remove(entity)
        if local is None:
            return
        data = local.data
        announcer = self._announcer(data)
        announcer.forget(local.announcement)
        payload = write_key(Parameter.ENDPOINT_GUID, data.guid)
        self._ended.append((announcer, announcer.write(payload, now, ended(data.guid), is_key=True)))
        self._connections.busy.add(announcer)
        while len(self._ended) > _ENDED_ENDPOINTS:
            earlier, number = self._ended.popleft()
            earlier.forget(number)

    def write(
        self,
        entity: bytes,
        payload: bytes,
        now: float,
        related: SampleIdentity | None = None,
        recipients: frozenset[bytes] | None = None,
    ) -> int:
        """Send a sample to all matched readers, or only to `recipients`; return its sequence number.

        Raises:
            LimitExceeded: see `Writer.write`.
            NotFound: the writer was removed.
        """
        writer = self.writer(entity)
        inline = related_sample(related) if related else b""
        number = writer.write(payload, now, inline, recipients)
        if writer.readers:
            self._connections.busy.add(writer)
        return number

    def writer(self, entity: bytes) -> Writer:
        """Return the state of a local writer.

        Raises:
            NotFound: the writer was removed.
        """
        if entity not in self._connections.writers:
            raise NotFound("the writer was closed")
        return self._connections.writers[entity]

    def reader(self, entity: bytes) -> Reader:
        """Return the state of a local reader.

        Raises:
            NotFound: the reader was removed.
        """
        local = self._connections.local(entity)
        if local is None or not isinstance(local.end, Reader):
            raise NotFound("the reader was closed")
        return local.end

    def endpoint(self, guid: bytes) -> EndpointData | None:
        """Return a remote endpoint, or None if it is unknown."""
        peer = self.peers.get(guid[:12])
        return peer.endpoints.get(guid) if peer else None

    def mismatched(self) -> list[Mismatched]:
        """Return a mismatch for each remote endpoint whose topic has local endpoints, none of which match."""
        return [found for peer in self.peers for found in self._connections.mismatched(peer)]

    def close(self) -> None:
        """Notify the peers that the participant is leaving. May be called repeatedly."""
        if self._is_closed:
            return
        self._is_closed = True
        self._presence.end(self.peers)

    @property
    def has_transfers(self) -> bool:
        """True if datagrams are waiting for the next burst."""
        return self._outbox.deadline < math.inf

    def take_outgoing(self) -> list[Outgoing]:
        """Return the datagrams to send now."""
        return self._outbox.take()

    def take_events(self) -> list[Event]:
        """Return the events since the last call, in order."""
        events = self._events.copy()
        self._events.clear()
        return events

    # Timers.

    @property
    def deadline(self) -> float:
        """Time by which `poll` must be called."""
        soonest = min(self._outbox.deadline, self._presence.due, self._check_leases_at)
        return min(soonest, *(end.deadline for end in self._connections.busy), math.inf)

    def poll(self, now: float, handled_until: float = math.inf) -> None:
        """Perform due actions: announcements, heartbeats, repeated requests, bursts, and expiry of leases.

        Args:
            handled_until: every datagram that arrived before this time has been handled. Thus, a
                request answered in time is not repeated, and a lease renewed in time does not expire.
        """
        if self._is_closed:
            return
        handled_until = min(now, handled_until)
        if now >= self._presence.due:
            self._presence.announce(self.peers, now)
        if handled_until >= self._check_leases_at:
            self._check_leases_at = now + _LEASE_CHECK_S
            for peer in self.peers.expired(handled_until):
                self._remove_peer(peer.data.prefix)
            for peer in self.peers:
                if now - peer.found_at < _ANSWERS_S and not self._has_answered(peer):
                    self._presence.answer(peer)
        for end in list(self._connections.busy):
            if isinstance(end, Reader):
                end.poll(now, handled_until)
            else:
                end.poll(now)
            if end.deadline == math.inf:
                self._connections.busy.discard(end)
        self._outbox.poll(now)

    # Incoming datagrams.

    def receive(self, datagram: bytes, host: str, now: float) -> None:
        """Handle a datagram from a host. Never raises, whatever it contains."""
        for _ in self.handle(datagram, host, now):
            pass

    def handle(self, datagram: bytes, host: str, now: float) -> Iterator[int]:
        """Handle a datagram step by step; yield the work of each step in units of about 20 us.

        Other methods may be called between the steps.
        """
        read = read_datagram(datagram, self.prefix)
        if read is None or read.prefix == self.prefix or self._is_closed:
            return
        self.malformed += read.is_malformed
        peer = self.peers.get(read.prefix)
        if peer is not None:
            peer.heard_at = now
        for submessage in _latest(read.submessages):
            if isinstance(submessage, Data) and submessage.writer == PARTICIPANT_WRITER:
                self._on_participant(read.prefix, submessage, host, now)
                yield _PARTICIPANT_WORK
                continue
            peer = self.peers.get(read.prefix)
            if peer is not None:
                work = self._work_of(peer, submessage)
                self._handlers[type(submessage)](peer, submessage, now)
                yield work

    def _work_of(self, peer: Peer, submessage: Submessage) -> int:
        """Return the units of work that a submessage causes."""
        if isinstance(submessage, Data | DataFrag | HeartbeatFrag):
            is_discovery = submessage.writer in (PUBLICATIONS_WRITER, SUBSCRIPTIONS_WRITER)
            return _ENDPOINT_WORK if is_discovery else 1
        if isinstance(submessage, AckNack):
            return _ANSWER_WORK + len(submessage.missing)
        if isinstance(submessage, NackFrag):
            return _ANSWER_WORK + len(submessage.missing) // 8
        guid = peer.data.prefix + submessage.writer
        readers = self._connections.readers.get(guid, ())
        others = len(submessage.others) // 8 if isinstance(submessage, Gap) else 0
        return 1 + sum(_ANSWER_WORK + others + reader.work(guid) for reader in readers)

    def _to_readers(self, peer: Peer, submessage: Submessage, now: float) -> None:
        guid = peer.data.prefix + submessage.writer
        for reader in self._connections.readers.get(guid, ()):
            if submessage.reader != UNKNOWN_ENTITY and submessage.reader != reader.entity:
                continue
            if isinstance(submessage, Data):
                reader.on_data(guid, submessage, now)
            elif isinstance(submessage, Heartbeat):
                reader.on_heartbeat(guid, submessage, now)
            elif isinstance(submessage, DataFrag):
                reader.on_data_frag(guid, submessage, now)
            elif isinstance(submessage, HeartbeatFrag):
                reader.on_heartbeat_frag(guid, submessage, now)
            elif isinstance(submessage, Gap):
                reader.on_gap(guid, submessage)
            if reader.is_waiting:
                self._connections.busy.add(reader)

    def _to_writer(self, peer: Peer, submessage: Submessage, now: float) -> None:
        writer = self._connections.writers.get(submessage.writer)
        if writer is None:
            return
        guid = peer.data.prefix + submessage.reader
        if isinstance(submessage, AckNack):
            writer.on_acknack(guid, submessage, now)
        elif isinstance(submessage, NackFrag):
            writer.on_nack_frag(guid, submessage)
        self._connections.busy.add(writer)

    def _on_participant(self, prefix: bytes, data: Data, host: str, now: float) -> None:
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


def _latest(submessages: Sequence[Submessage]) -> Sequence[Submessage]:
    """Leave out heartbeats and ACKNACKs that are superseded by a later one with the same writer and reader.

    The response to each is larger than the submessage itself, and a datagram can contain 1,800 of them.
    """
    if len(submessages) <= 2:
        return submessages
    seen: set[tuple[type, bytes, bytes]] = set()
    latest: list[Submessage] = []
    for each in reversed(submessages):
        if isinstance(each, Heartbeat | AckNack):
            key = type(each), each.writer, each.reader
            if key in seen:
                continue
            seen.add(key)
        latest.append(each)
    return latest[::-1]
