"""A participant without sockets, which turns datagrams and the time into datagrams and events.

Theory of operation. A datagram descends once: the announcements of participants go to `PeerDiscovery`, all
other submessages of known peers to `Delivery`, and from there to the writers and readers that they are for. A
local and a remote endpoint with the same topic and type, and compatible quality of service, match, and
samples flow between them; the built-in endpoints of `PeerDiscovery` match those of each peer.

The core never raises because of a datagram. It is not thread-safe.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from pipros.basics.errors import NotFound
from pipros.basics.limits import Limits
from pipros_ros2.interface import ROS2_HISTORY_BYTES
from pipros_ros2.limits import Ros2Limits
from pipros_ros2.rtps.announcements import EndpointData
from pipros_ros2.rtps.connections import Connections
from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.delivery import Delivery
from pipros_ros2.rtps.discovery import PeerDiscovery
from pipros_ros2.rtps.events import Event, Mismatched, ReceivedSample, RtpsSettings
from pipros_ros2.rtps.identity import PARTICIPANT_WRITER, user_entity
from pipros_ros2.rtps.outbox import DatagramOutbox, Outgoing
from pipros_ros2.rtps.parameters import SampleIdentity, related_sample
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.rtps.reader import Reader
from pipros_ros2.rtps.submessages import AckNack, Data, Heartbeat, Submessage
from pipros_ros2.rtps.writer import Writer
from pipros_ros2.rtps.writer_proxy import RtpsSample

_PARTICIPANT_WORK: Final = 32


class ParticipantCore:
    """A participant; see the module docstring."""

    def __init__(self, settings: RtpsSettings, limits: Limits, now: float) -> None:
        self.settings = settings
        self.prefix = settings.me.prefix
        self.malformed = 0
        self._limits = limits
        self._outbox = DatagramOutbox()
        self._events: list[Event] = []
        self._connections = Connections(settings.local_hosts, self._events)
        self._discovery = PeerDiscovery(settings, self._connections, self._outbox, now)
        self._delivery = Delivery(self._connections)
        self.peers = self._discovery.peers
        self._entities = 0
        self._is_closed = False

    # Called by the participant.

    def add_writer(self, topic: str, type_name: str, qos: Qos, now: float, user_data: bytes = b"") -> bytes:
        """Announce a writer; return its entity ID. `topic` and `type_name` are DDS names."""
        self._entities += 1
        entity = user_entity(self._entities, is_writer=True)
        writer = Writer(self.prefix, entity, qos, ROS2_HISTORY_BYTES, self._outbox)
        self._discovery.add(EndpointData(self.prefix + entity, topic, type_name, qos, user_data), writer, now)
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
        self._discovery.add(EndpointData(self.prefix + entity, topic, type_name, qos, user_data), reader, now)
        return entity

    def _on_sample(self, entity: bytes, sample: RtpsSample) -> None:
        if sample.has_payload:
            self._events.append(ReceivedSample(entity, sample))

    def remove(self, entity: bytes, now: float) -> None:
        """Remove a writer or reader, and notify the peers. May be called repeatedly."""
        local = self._connections.remove(entity)
        if local is not None:
            self._discovery.remove(local, now)

    def write(
        self,
        entity: bytes,
        payload: bytes,
        now: float,
        related: SampleIdentity | None = None,
        recipients: frozenset[bytes] | None = None,
        stamp_ns: int = 0,
    ) -> int:
        """Send a sample to all matched readers, or only to `recipients`; return its sequence number.

        `stamp_ns` is the time since 1970 that readers get with it; 0 for none.

        Raises:
            LimitExceeded: see `Writer.write`.
            NotFound: the writer was removed.
        """
        writer = self.writer(entity)
        inline = related_sample(related) if related else b""
        number = writer.write(payload, now, inline, recipients, stamp_ns=stamp_ns)
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
        self._discovery.close()

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
        soonest = min(self._outbox.deadline, self._discovery.deadline)
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
        self._discovery.poll(now, handled_until)
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
                self._discovery.on_participant(read.prefix, submessage, host, now)
                yield _PARTICIPANT_WORK
                continue
            peer = self.peers.get(read.prefix)
            if peer is not None:
                yield self._delivery.deliver(read.prefix, submessage, now)


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
