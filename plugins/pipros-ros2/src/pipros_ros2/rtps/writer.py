"""RTPS writers, which keep a history of samples and the state of each matched reader.

Theory of operation. `write` sends a sample to each reader, immediately or, if it must be fragmented, in
bursts. A heartbeat that need not be answered follows. However, a reliable reader gets new samples only after
it has answered a heartbeat that announces no samples. Until then, it may not have discovered the writer, and
Cyclone DDS begins with the sample after those that the first heartbeat announces. While a reliable reader has
not acknowledged all samples, further heartbeats, which must be answered, are sent at doubling intervals. The
reader requests missing samples, and gets them again. A late reader of a latched topic requests all of them,
after a heartbeat that announces them. Below the first kept sample, it gets a heartbeat that
names this sample as the first, as from Fast DDS's writers, and no GAP: if a GAP names a sample of which Fast
DDS's reader has fragments, its `take` never returns. Hence the history has no holes: the oldest samples are
displaced first. If a reader's participant had considered the writer's participant lost, the reader starts
again: samples that it requests count as unacknowledged, even if it had acknowledged them. A service reply is
addressed to a single reader. The other readers get a GAP for its sequence number before their next sample.
What genuine writers send in the same situations is in a table in docs/internals/rtps.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from pipros.basics.errors import LimitExceeded
from pipros_ros2.rtps.encoding import data_frag_head, data_head, datagram_head, gap, heartbeat, info_ts
from pipros_ros2.rtps.history import OVERHEAD_BYTES, CacheChange, WriterHistory
from pipros_ros2.rtps.outbox import DatagramOutbox, Outgoing, Transfer
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.qos import Qos
from pipros_ros2.rtps.reader_proxy import FIRST_HEARTBEAT_S, ReaderProxy
from pipros_ros2.rtps.submessages import MAX_SET, AckNack, NackFrag

SLOWEST_HEARTBEAT_S: Final = 1.0
SLOWEST_GREETING_S: Final = 10.0
"""Maximum heartbeat interval for readers that never answered, so that a flood of them causes little work."""
ENOUGH_QUESTIONS: Final = 3
"""A reader that has asked for a heartbeat this often has received one, even if it sends no final ACKNACK."""
QUEUE_BYTES: Final = 32 * 1024 * 1024
"""Samples beyond the depth that wait behind one that is being sent, such as 33 images of 1 MB."""
LOCAL_FRAGMENT_BYTES: Final = 60_000
REMOTE_FRAGMENT_BYTES: Final = 1_344
"""Fits an Ethernet frame, as in Cyclone DDS: a larger datagram is lost if one of its IP fragments is lost."""


@dataclass(slots=True, eq=False)
class Writer:
    """A writer of samples; see the module docstring. Not thread-safe.

    Attributes:
        dropped: number of samples that were displaced before all reliable readers had acknowledged them.
            Most of these have arrived.
        lost: number of samples that were displaced before they were sent completely, or that a reader
            requested after they had been displaced.
    """

    prefix: bytes
    entity: bytes
    qos: Qos
    history_bytes: int
    outbox: DatagramOutbox
    readers: dict[bytes, ReaderProxy] = field(default_factory=dict)
    dropped: int = 0
    lost: int = 0
    _heartbeats: int = 0
    _behind: dict[bytes, ReaderProxy] = field(default_factory=dict)
    _history: WriterHistory = field(init=False)

    def __post_init__(self) -> None:
        self._history = WriterHistory(self.history_bytes)

    def has_space(self, payload_bytes: int) -> bool:
        """Return False if a sample would displace one that a reliable reader still lacks.

        With a limited depth, samples may always be displaced.
        """
        return bool(self.qos.depth) or not self._behind or self._history.fits(payload_bytes)

    @property
    def is_acknowledged(self) -> bool:
        """True if no reliable reader lacks a sample."""
        return not any(reader.acked < reader.wanted for reader in self._behind.values())

    def write(
        self,
        payload: bytes,
        now: float,
        inline: bytes = b"",
        recipients: frozenset[bytes] | None = None,
        *,
        is_key: bool = False,
        stamp_ns: int = 0,
    ) -> int:
        """Send a sample, and keep it for requests and late readers; return its sequence number.

        Args:
            stamp_ns: time since 1970 that readers get with the sample; 0 for none.

        Raises:
            LimitExceeded: the sample is larger than `ROS2_HISTORY_BYTES`.
        """
        if len(payload) + OVERHEAD_BYTES > self.history_bytes:
            text = f"the limit is {self.history_bytes} bytes"
            raise LimitExceeded(f"a message for ROS 2 is too large ({len(payload)} bytes): {text}")
        stamp = info_ts(stamp_ns) if stamp_ns else b""
        change = CacheChange(self._history.last + 1, payload, inline, recipients, is_key, stamp)
        self._make_space(len(payload))
        self._history.add(change)
        for reader in self.readers.values():
            if change.is_for(reader.guid):
                self._send_new(reader, change, now)
        if not self.readers and not self.qos.is_latched:
            self._history.forget_all()
        return change.sequence

    def _make_space(self, payload_bytes: int) -> None:
        """Drop the oldest samples for a new one.

        A sample that is being sent stays, and with it all newer ones, while there is space. Then, all that
        exceed the depth are dropped, or half of the bytes: otherwise, no large sample would ever arrive while
        samples are written faster than they can be sent, as each would displace the one that is being sent.
        """
        history, depth = self._history, self.qos.depth
        while depth and len(history) >= depth and not self._is_sending(history.oldest()):
            self._drop_oldest()
        if depth and len(history) >= 2 * depth and history.kept_bytes > QUEUE_BYTES:
            while len(history) >= depth:
                self._drop_oldest()
        if not history.fits(payload_bytes):
            is_sending = self._is_sending(history.oldest())
            goal_bytes = self.history_bytes // 2 if is_sending else history.kept_bytes
            while history and (history.kept_bytes > goal_bytes or not history.fits(payload_bytes)):
                self._drop_oldest()

    def _is_sending(self, sequence: int) -> bool:
        return any(key[::2] == (self.entity, sequence) for key in self.outbox.sending)

    def _drop_oldest(self) -> None:
        oldest = self._history.oldest()
        if any(reader.acked < oldest <= reader.wanted for reader in self._behind.values()):
            self.dropped += 1
        waiting = [
            each
            for each in self.readers.values()
            if each.acked < oldest and self.outbox.is_queued((self.entity, each.guid, oldest))
        ]
        self.lost += bool(waiting)
        for reader in waiting:
            reader.given_up = oldest
        self._history.forget(oldest)

    def forget(self, sequence: int) -> None:
        """Remove a sample from the history. Do nothing if it is not there."""
        self._history.forget(sequence)

    def _send_new(self, reader: ReaderProxy, change: CacheChange, now: float) -> None:
        head = reader.head
        reader.wanted = change.sequence
        if reader.is_reliable:
            if reader.due > now + SLOWEST_HEARTBEAT_S:
                reader.interval_s = FIRST_HEARTBEAT_S
                reader.due = now + reader.interval_s
                self._behind[reader.guid] = reader
            if not reader.is_greeted:
                return
            skipped = max(reader.sent + 1, self._history.oldest())
            if skipped < change.sequence:
                head += gap(reader.entity, self.entity, skipped, change.sequence)
        reader.sent = change.sequence
        if len(change.payload) > reader.fragment_bytes:
            if head is not reader.head:
                self.outbox.send(reader.address, head)
            self._queue(reader, change)
            return
        tail = self._heartbeat(reader, is_final=True) if reader.is_reliable else b""
        self.outbox.send(reader.address, *self._data(reader, change, head), tail)

    def _data(self, reader: ReaderProxy, change: CacheChange, head: bytes) -> tuple[bytes, bytes, bytes]:
        payload = change.payload
        padding = bytes(-len(payload) % 4)
        size = len(payload) + len(padding)
        start = data_head(
            reader.entity, self.entity, change.sequence, size, change.inline, is_key=change.is_key
        )
        return head + change.stamp + start, payload, padding

    def _heartbeat(self, reader: ReaderProxy, *, is_final: bool) -> bytes:
        self._heartbeats += 1
        first = max(reader.first, self._history.oldest())
        last = max(reader.sent, first - 1)
        return heartbeat(reader.entity, self.entity, first, last, self._heartbeats, is_final=is_final)

    def _queue(
        self,
        reader: ReaderProxy,
        change: CacheChange,
        fragments: tuple[int, ...] | None = None,
        *,
        is_requested: bool = False,
    ) -> None:
        key = (self.entity, reader.guid, change.sequence)
        datagrams = self._datagrams(reader, change, fragments)
        transfer = Transfer(key, datagrams, lambda: self._is_wanted(reader, change))
        self.outbox.queue(transfer, is_requested=is_requested)

    def _is_wanted(self, reader: ReaderProxy, change: CacheChange) -> bool:
        return self._history.get(change.sequence) is change and self.readers.get(reader.guid) is reader

    def _datagrams(
        self, reader: ReaderProxy, change: CacheChange, fragments: tuple[int, ...] | None
    ) -> Iterator[Outgoing]:
        """Yield a sample as DATA or as fragments (all if `fragments` is None), then a heartbeat.

        After fragments, it must be answered, as from genuine writers: readers then request lost ones.
        """
        if len(change.payload) <= reader.fragment_bytes:
            tail = self._heartbeat(reader, is_final=True) if reader.is_reliable else b""
            yield Outgoing(reader.address, (*self._data(reader, change, reader.head), tail))
            return
        view, size = memoryview(change.payload), reader.fragment_bytes
        total = -(-len(view) // size)
        for number in fragments or range(1, total + 1):
            if number > total:
                return
            piece = view[(number - 1) * size : number * size]
            padding = bytes(-len(piece) % 4)
            start = data_frag_head(
                reader.entity,
                self.entity,
                change.sequence,
                number,
                size,
                len(view),
                len(piece) + len(padding),
                change.inline,
            )
            yield Outgoing(reader.address, (reader.head + change.stamp + start, piece, padding))
        if reader.is_reliable:
            yield Outgoing(reader.address, (reader.head, self._heartbeat(reader, is_final=False)))

    def match(self, guid: bytes, address: Address, requested: Qos, fragment_bytes: int, now: float) -> None:
        """Add a reader, or change its address.

        A reliable reader gets the last `depth` samples of the history if both sides are transient_local.
        """
        if guid in self.readers:
            self.readers[guid].address = address
            return
        replays = self.qos.is_latched and requested.is_latched and requested.is_reliable
        kept = [each.sequence for each in self._history][-self.qos.depth :] if replays else []
        first = kept[0] if kept else self._history.last + 1
        reader = ReaderProxy(
            guid,
            address,
            datagram_head(self.prefix, guid[:12]),
            requested.is_reliable and self.qos.is_reliable,
            fragment_bytes,
            first,
            self._history.last,
            self._history.last if replays else 0,
            first - 1,
            given_up=first - 1,
        )
        self.readers[guid] = reader
        if not reader.is_reliable:
            return
        self._behind[guid] = reader
        reader.due = now + reader.interval_s
        self.outbox.send(address, reader.head, self._heartbeat(reader, is_final=False))

    def unmatch(self, guid: bytes) -> None:
        """Remove a reader, if it is known."""
        self.readers.pop(guid, None)
        self._behind.pop(guid, None)
        self._forget_acknowledged()

    def on_acknack(self, guid: bytes, acknack: AckNack, now: float) -> None:
        reader = self.readers.get(guid)
        if reader is None or not reader.is_reliable or acknack == reader.last_acknack:
            return
        reader.last_acknack = acknack
        starts_again = acknack.base <= reader.acked
        has_asked = not acknack.missing and not acknack.is_final
        reader.asked += has_asked
        if not reader.is_greeted and (not has_asked or reader.asked >= ENOUGH_QUESTIONS):
            reader.is_greeted = True
            self._send_held(reader)
        if reader.acked < acknack.base - 1:
            reader.acked = min(acknack.base - 1, self._history.last)
            reader.interval_s = FIRST_HEARTBEAT_S
            reader.due = now + reader.interval_s
        elif acknack.missing and acknack.base <= reader.acked:
            reader.acked = max(acknack.base, reader.first) - 1
        self._repeat(reader, acknack.missing)
        if reader.is_behind:
            self._behind[guid] = reader
            if reader.due == math.inf:
                reader.due = now + reader.interval_s
        else:
            reader.due = math.inf
            self._behind.pop(guid, None)
            self._forget_acknowledged()
        if has_asked:
            beat = self._heartbeat(reader, is_final=reader.is_greeted and not starts_again)
            self.outbox.send(reader.address, reader.head, beat)

    def _send_held(self, reader: ReaderProxy) -> None:
        """Send the samples that were held back until the reader's first response."""
        held = [change for change in self._history if change.sequence > reader.sent]
        for change in held:
            if change.is_for(reader.guid):
                self._queue(reader, change)
        reader.sent = max(reader.sent, reader.wanted)

    def _repeat(self, reader: ReaderProxy, missing: tuple[int, ...]) -> None:
        """Send samples again, a heartbeat for those no longer kept, and a GAP for those of other readers."""
        lacking: list[int] = []
        first = max(reader.first, self._history.oldest())
        for sequence in missing:
            change = self._history.get(sequence)
            if change is not None and sequence >= reader.first and change.is_for(reader.guid):
                self._queue(reader, change, is_requested=True)
            elif sequence <= self._history.last:
                if sequence >= first:
                    lacking.append(sequence)
                self.lost += change is None and sequence > reader.given_up
                reader.given_up = max(reader.given_up, sequence)
        if missing and missing[0] < first <= self._history.last + 1:
            self.outbox.send(reader.address, reader.head, self._heartbeat(reader, is_final=False))
        if lacking:
            start, base = lacking[0], lacking[0] + 1
            while base in lacking[: MAX_SET + 1]:
                base += 1
            others = [sequence for sequence in lacking if sequence >= base]
            skipped = gap(reader.entity, self.entity, start, base, others)
            self.outbox.send(reader.address, reader.head, skipped)

    def on_nack_frag(self, guid: bytes, nack: NackFrag) -> None:
        reader, change = self.readers.get(guid), self._history.get(nack.sequence)
        if reader is None or not reader.is_reliable or nack == reader.last_nack_frag:
            return
        reader.last_nack_frag = nack
        if change is None or not change.is_for(guid):
            self._repeat(reader, (nack.sequence,))
        elif nack.missing:
            self._queue(reader, change, nack.missing, is_requested=True)

    def _forget_acknowledged(self) -> None:
        """Drop samples that all readers have, unless late readers may request them."""
        if self.qos.is_latched or not all(reader.is_reliable for reader in self.readers.values()):
            return  # datagrams for best-effort readers may still be in the outbox
        if not self._behind:
            self._history.forget_all()
            return
        acked = min(reader.acked for reader in self._behind.values())
        while self._history and self._history.oldest() <= acked:
            self._history.forget(self._history.oldest())

    @property
    def deadline(self) -> float:
        """Time of the next heartbeat; infinite if there is none."""
        return min((reader.due for reader in self._behind.values()), default=math.inf)

    def poll(self, now: float) -> None:
        """Send the heartbeats that are due."""
        for reader in self._behind.values():
            if reader.due <= now:
                slowest_s = SLOWEST_HEARTBEAT_S if reader.is_greeted else SLOWEST_GREETING_S
                reader.interval_s = min(reader.interval_s * 2, slowest_s)
                reader.due = now + reader.interval_s
                self.outbox.send(reader.address, reader.head, self._heartbeat(reader, is_final=False))
