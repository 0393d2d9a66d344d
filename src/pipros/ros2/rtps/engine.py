"""A participant without sockets: datagrams and the time in, datagrams and events out.

Theory of operation. `announce` datagrams (SPDP) find other participants, and repeat until the end. Two
built-in writers and readers (SEDP), which are ordinary reliable ones with the history for late readers,
exchange the endpoints of both sides. A local and a remote endpoint with the same topic and type, and fitting
quality of service, match: from then on samples flow between them. A peer ends by saying so, or by silence.

The engine never raises because of a datagram. It is not thread-safe.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from pipros.basics.errors import NotFound
from pipros.basics.limits import Limits
from pipros.ros2.rtps.announcements import (
    EndpointData,
    read_endpoint,
    read_key,
    read_participant,
    write_endpoint,
    write_key,
    write_participant,
)
from pipros.ros2.rtps.encoding import data_head, datagram_head
from pipros.ros2.rtps.events import (
    EndpointChanged,
    Event,
    Matched,
    Mismatched,
    OverLimit,
    PeerChanged,
    Received,
    Settings,
)
from pipros.ros2.rtps.identity import (
    GUID_BYTES,
    PARTICIPANT_ENTITY,
    PARTICIPANT_READER,
    PARTICIPANT_WRITER,
    PUBLICATIONS_READER,
    PUBLICATIONS_WRITER,
    SUBSCRIPTIONS_READER,
    SUBSCRIPTIONS_WRITER,
    UNKNOWN_ENTITY,
    user_entity,
)
from pipros.ros2.rtps.outbox import Outbox, Outgoing
from pipros.ros2.rtps.parameters import (
    Address,
    Parameter,
    SampleIdentity,
    ended,
    is_ended,
    related_sample,
)
from pipros.ros2.rtps.peers import Peer, Peers, cost_bytes
from pipros.ros2.rtps.qos import Durability, Qos, Reliability, mismatch
from pipros.ros2.rtps.reader import Reader, Sample
from pipros.ros2.rtps.submessages import (
    AckNack,
    Data,
    DataFrag,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
    read_datagram,
)
from pipros.ros2.rtps.writer import LOCAL_FRAGMENT_BYTES, REMOTE_FRAGMENT_BYTES, Writer

_FIRST_ANNOUNCEMENTS_S: Final = (0.1, 0.2, 0.3, 0.4, 0.5, 1.0)
_LEASE_CHECK_S: Final = 0.5
_ENDED_ENDPOINTS: Final = 256
_MAX_NAME_CHARACTERS: Final = 255
_DISCOVERY_QOS: Final = Qos(Reliability.RELIABLE, Durability.TRANSIENT_LOCAL, depth=0)
_DISCOVERY: Final = (
    (PUBLICATIONS_WRITER, PUBLICATIONS_READER),
    (SUBSCRIPTIONS_WRITER, SUBSCRIPTIONS_READER),
)


@dataclass(slots=True, eq=False)
class _Local:
    """An endpoint of this participant, with the number of its announcement."""

    data: EndpointData
    end: Writer | Reader
    announcement: int


class Engine:
    """A participant; see the module docstring."""

    def __init__(self, settings: Settings, limits: Limits, now: float) -> None:
        self.settings = settings
        self.prefix = settings.me.prefix
        self.peers = Peers(limits)
        self.malformed = 0
        self._limits = limits
        self._outbox = Outbox()
        self._events: list[Event] = []
        self._announcements = 0
        self._announce_at = now
        self._check_leases_at = now + _LEASE_CHECK_S
        self._entities = 0
        self._is_closed = False
        self._locals: dict[bytes, _Local] = {}
        self._by_topic: dict[str, list[_Local]] = {}
        self._ended: deque[tuple[Writer, int]] = deque()
        self._writers: dict[bytes, Writer] = {}
        self._readers: dict[bytes, list[Reader]] = {}  # by the GUID of the remote writer
        self._busy: set[Writer | Reader] = set()
        self._discovery_readers: list[tuple[bytes, Reader]] = []
        for writer, reader in _DISCOVERY:
            self._writers[writer] = Writer(
                self.prefix, writer, _DISCOVERY_QOS, limits.ros2_discovery_bytes, self._outbox
            )
            end = Reader(
                self.prefix,
                reader,
                limits.ros2_peer_bytes,
                self._outbox,
                self._on_endpoint,
                settings.request_bytes,
            )
            self._discovery_readers.append((writer, end))
        self._handlers: dict[type, Callable[[Peer, Submessage, float], None]] = {
            Data: self._to_readers,
            DataFrag: self._to_readers,
            Heartbeat: self._to_readers,
            HeartbeatFrag: self._to_readers,
            Gap: self._to_readers,
            AckNack: self._to_writer,
            NackFrag: self._to_writer,
        }

    # What the participant does.

    def add_writer(self, topic: str, type_name: str, qos: Qos, now: float, user_data: bytes = b"") -> bytes:
        """Announce a writer with DDS's names of topic and type; return its entity id."""
        self._entities += 1
        entity = user_entity(self._entities, is_writer=True)
        writer = Writer(self.prefix, entity, qos, self._limits.ros2_history_bytes, self._outbox)
        self._writers[entity] = writer
        self._add(EndpointData(self.prefix + entity, topic, type_name, qos, user_data), writer, now)
        return entity

    def add_reader(self, topic: str, type_name: str, qos: Qos, now: float, user_data: bytes = b"") -> bytes:
        """Announce a reader; return its entity id. Each sample becomes a `Received`."""
        self._entities += 1
        entity = user_entity(self._entities, is_writer=False)
        reader = Reader(
            self.prefix,
            entity,
            self._limits.ros2_sample_bytes,
            self._outbox,
            lambda sample: self._on_sample(entity, sample),
            self.settings.request_bytes,
        )
        self._add(EndpointData(self.prefix + entity, topic, type_name, qos, user_data), reader, now)
        return entity

    def _on_sample(self, entity: bytes, sample: Sample) -> None:
        if sample.has_payload:
            self._events.append(Received(entity, sample))

    def _add(self, data: EndpointData, end: Writer | Reader, now: float) -> None:
        announcer = self._announcer(data)
        local = _Local(data, end, announcer.write(write_endpoint(data), now))
        self._busy.add(announcer)
        self._locals[data.guid[12:]] = local
        self._by_topic.setdefault(data.topic, []).append(local)
        for peer in self.peers:
            for remote in list(peer.endpoints.values()):
                if remote.topic == data.topic:
                    self._try_match(peer, local, remote, now)

    def _announcer(self, data: EndpointData) -> Writer:
        return self._writers[PUBLICATIONS_WRITER if data.is_writer else SUBSCRIPTIONS_WRITER]

    def remove(self, entity: bytes, now: float) -> None:
        """End a writer or reader. May be called repeatedly."""
        local = self._locals.pop(entity, None)
        if local is None:
            return
        data = local.data
        self._by_topic[data.topic].remove(local)
        if not self._by_topic[data.topic]:
            del self._by_topic[data.topic]
        self._busy.discard(local.end)
        if isinstance(local.end, Reader):
            for guid in list(local.end.writers):
                self._disconnect_reader(local.end, guid)
        else:
            del self._writers[entity]
            for guid in list(local.end.readers):
                local.end.unmatch(guid)
        announcer = self._announcer(data)
        announcer.forget(local.announcement)
        payload = write_key(Parameter.ENDPOINT_GUID, data.guid)
        self._ended.append((announcer, announcer.write(payload, now, ended(data.guid), is_key=True)))
        self._busy.add(announcer)
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
        """Send a sample, to all matched readers or to some; return its sequence number.

        Raises:
            LimitExceeded: see `Writer.write`.
            NotFound: the writer was removed.
        """
        writer = self.writer(entity)
        inline = related_sample(related) if related else b""
        number = writer.write(payload, now, inline, recipients)
        if writer.readers:
            self._busy.add(writer)
        return number

    def writer(self, entity: bytes) -> Writer:
        """Return the state of a local writer.

        Raises:
            NotFound: it was removed.
        """
        if entity not in self._writers:
            raise NotFound("the writer was closed")
        return self._writers[entity]

    def reader(self, entity: bytes) -> Reader:
        """Return the state of a local reader.

        Raises:
            NotFound: it was removed.
        """
        local = self._locals.get(entity)
        if local is None or not isinstance(local.end, Reader):
            raise NotFound("the reader was closed")
        return local.end

    def endpoint(self, guid: bytes) -> EndpointData | None:
        """Return a remote endpoint that is known."""
        peer = self.peers.get(guid[:12])
        return peer.endpoints.get(guid) if peer else None

    def close(self) -> None:
        """Announce the end of the participant to its peers. May be called repeatedly."""
        if self._is_closed:
            return
        self._is_closed = True
        guid = self.prefix + PARTICIPANT_ENTITY
        payload = write_key(Parameter.PARTICIPANT_GUID, guid)
        self._send_announcement(2, payload, ended(guid), is_key=True)

    @property
    def has_transfers(self) -> bool:
        """True if datagrams wait for their turn in a burst."""
        return self._outbox.deadline < math.inf

    def take_outgoing(self) -> list[Outgoing]:
        """Return the datagrams to send now."""
        return self._outbox.take()

    def take_events(self) -> list[Event]:
        """Return the events since the last call, in their order."""
        events, self._events = self._events, []
        return events

    # The passage of time.

    @property
    def deadline(self) -> float:
        """When `poll` must be called at the latest."""
        soonest = min(self._outbox.deadline, self._announce_at, self._check_leases_at)
        return min(soonest, *(end.deadline for end in self._busy), math.inf)

    def poll(self, now: float, handled_until: float = math.inf) -> None:
        """Do what is due: announcements, heartbeats, repeated requests, bursts, and the end of leases.

        Args:
            handled_until: every datagram that arrived before this time has been passed to `receive`. So what
                a peer has answered in time is not requested again, and a lease that it has renewed goes on.
        """
        if self._is_closed:
            return
        handled_until = min(now, handled_until)
        if now >= self._announce_at:
            self._announce(now)
        if handled_until >= self._check_leases_at:
            self._check_leases_at = now + _LEASE_CHECK_S
            for peer in self.peers.expired(handled_until):
                self._remove_peer(peer.data.prefix)
        for end in list(self._busy):
            if isinstance(end, Reader):
                end.poll(now, handled_until)
            else:
                end.poll(now)
            if end.deadline == math.inf:
                self._busy.discard(end)
        self._outbox.poll(now)

    def _announce(self, now: float) -> None:
        index = self._announcements
        pauses = _FIRST_ANNOUNCEMENTS_S
        pause_s = pauses[index] if index < len(pauses) else self.settings.me.lease_s / 3
        self._announcements += 1
        self._announce_at = now + pause_s
        self._send_announcement(1, write_participant(self.settings.me))

    def _send_announcement(
        self, number: int, payload: bytes, inline: bytes = b"", *, is_key: bool = False
    ) -> None:
        addresses = dict.fromkeys(self.settings.announce_to)
        addresses.update(dict.fromkeys(peer.discovery_address for peer in self.peers))
        datagram = self._announcement(number, payload, inline, is_key=is_key)
        for address in addresses:
            self._outbox.send(address, datagram)

    def _announcement(self, number: int, payload: bytes, inline: bytes = b"", *, is_key: bool) -> bytes:
        head = data_head(PARTICIPANT_READER, PARTICIPANT_WRITER, number, len(payload), inline, is_key=is_key)
        return datagram_head(self.prefix) + head + payload

    # What arrives.

    def receive(self, datagram: bytes, host: str, now: float) -> None:
        """Handle a datagram from a host. Never raises, whatever it contains."""
        read = read_datagram(datagram, self.prefix)
        if read is None or read.prefix == self.prefix or self._is_closed:
            return
        self.malformed += read.is_malformed
        peer = self.peers.get(read.prefix)
        if peer is not None:
            peer.heard_at = now
        for submessage in read.submessages:
            if isinstance(submessage, Data) and submessage.writer == PARTICIPANT_WRITER:
                self._on_participant(read.prefix, submessage, host, now)
                peer = self.peers.get(read.prefix)
            elif peer is not None:
                self._handlers[type(submessage)](peer, submessage, now)

    def _to_readers(self, peer: Peer, submessage: Submessage, now: float) -> None:
        guid = peer.data.prefix + submessage.writer
        for reader in self._readers.get(guid, ()):
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
                self._busy.add(reader)

    def _to_writer(self, peer: Peer, submessage: Submessage, now: float) -> None:
        writer = self._writers.get(submessage.writer)
        if writer is None:
            return
        guid = peer.data.prefix + submessage.reader
        if isinstance(submessage, AckNack):
            writer.on_acknack(guid, submessage, now)
        elif isinstance(submessage, NackFrag):
            writer.on_nack_frag(guid, submessage)
        self._busy.add(writer)

    def _on_participant(self, prefix: bytes, data: Data, host: str, now: float) -> None:
        if is_ended(data.inline) or not data.has_payload:
            self._remove_peer(prefix)
            return
        announced = read_participant(data.payload)
        if announced is None or announced.prefix != prefix:
            return
        peer = self.peers.get(prefix)
        if peer is not None:
            peer.data = announced
            if not self._writers[PUBLICATIONS_WRITER].readers[prefix + PUBLICATIONS_READER].is_greeted:
                self._answer(peer)  # it may have lost the first one
            return
        payload = bytes(data.payload)
        peer = self.peers.add(announced, cost_bytes(payload), host, now)
        if peer is None:
            return
        address = peer.discovery_address
        self._answer(peer)
        for (writer, reader), (_, own_reader) in zip(_DISCOVERY, self._discovery_readers, strict=True):
            own = self._writers[writer]
            own.match(prefix + reader, address, _DISCOVERY_QOS, LOCAL_FRAGMENT_BYTES, now)
            self._connect_reader(own_reader, prefix + writer, address, peer, now, is_reliable=True)
            self._busy.add(own)
        self._events.append(PeerChanged(announced, True))

    def _answer(self, peer: Peer) -> None:
        """Announce ourselves to one peer."""
        announcement = self._announcement(1, write_participant(self.settings.me), is_key=False)
        self._outbox.send(peer.discovery_address, announcement)

    def _remove_peer(self, prefix: bytes) -> None:
        peer = self.peers.get(prefix)
        if peer is None:
            return
        for remote in list(peer.endpoints.values()):
            self._remove_endpoint(peer, remote.guid)
        for (writer, reader), (_, own_reader) in zip(_DISCOVERY, self._discovery_readers, strict=True):
            self._writers[writer].unmatch(prefix + reader)
            self._disconnect_reader(own_reader, prefix + writer)
        self.peers.remove(prefix)
        self._events.append(PeerChanged(peer.data, False))

    def _on_endpoint(self, sample: Sample) -> None:
        """Handle an announcement of SEDP."""
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
            self._disconnect(known)
        if known != remote:
            self._events.append(EndpointChanged(remote, True))
            for local in self._by_topic.get(remote.topic, ()):
                self._try_match(peer, local, remote, peer.heard_at)

    def _remove_endpoint(self, peer: Peer, guid: bytes) -> None:
        remote = peer.forget(guid)
        if remote is not None:
            self._disconnect(remote)
            self._events.append(EndpointChanged(remote, False))

    def _try_match(self, peer: Peer, local: _Local, remote: EndpointData, now: float) -> None:
        mine, end = local.data, local.end
        if mine.is_writer is remote.is_writer:
            return
        entity = mine.guid[12:]
        offered, requested = (mine, remote) if mine.is_writer else (remote, mine)
        policy = mismatch(offered.qos, requested.qos)
        if policy is not None or mine.type_name != remote.type_name:
            found = policy if mine.type_name == remote.type_name else None
            self._events.append(Mismatched(entity, remote, found))
            return
        address = peer.address_of(remote)
        if isinstance(end, Writer):
            is_local = address.host in self.settings.local_hosts or address.host.startswith("127.")
            fragment_bytes = LOCAL_FRAGMENT_BYTES if is_local else REMOTE_FRAGMENT_BYTES
            end.match(remote.guid, address, remote.qos, fragment_bytes, now)
            self._busy.add(end)
        else:
            is_reliable = mine.qos.is_reliable and remote.qos.is_reliable
            self._connect_reader(end, remote.guid, address, peer, now, is_reliable=is_reliable)
        self._events.append(Matched(entity, remote, True))

    def _disconnect(self, remote: EndpointData) -> None:
        for local in self._by_topic.get(remote.topic, ()):
            end = local.end
            if isinstance(end, Writer) and remote.guid in end.readers:
                end.unmatch(remote.guid)
            elif isinstance(end, Reader) and remote.guid in end.writers:
                self._disconnect_reader(end, remote.guid)
            else:
                continue
            self._events.append(Matched(local.data.guid[12:], remote, False))

    def _connect_reader(
        self, reader: Reader, guid: bytes, address: Address, peer: Peer, now: float, *, is_reliable: bool
    ) -> None:
        connected = self._readers.setdefault(guid, [])
        if reader not in connected:
            connected.append(reader)
        reader.match(guid, address, peer.incomplete, now, is_reliable=is_reliable)
        self._busy.add(reader)

    def _disconnect_reader(self, reader: Reader, guid: bytes) -> None:
        reader.unmatch(guid)
        connected = self._readers.get(guid, [])
        if reader in connected:
            connected.remove(reader)
        if not connected:
            self._readers.pop(guid, None)
