"""The publisher's side of shared memory: large messages are copied once for all subscribers on this machine.

Theory of operation. A subscriber on a Unix stream says in its connection header that it accepts slots
(`pipros.wire.slot_frames`). When the first large message is published, the publisher offers slots, and the
subscriber accepts. Each later message of LEAST_BYTES or more is copied once into a slot of a segment
(`shared_segment`). Each of these subscribers gets a 28-byte frame through its stream. This wakes the
subscriber and preserves the order of messages. A subscriber returns the slot through a pipe, which the
publisher reads before the next large message. (Returning it through the stream would wake the publisher's
event loop for each slot.) Only the publisher writes to the memory, so nothing depends on the order of memory
accesses.

If no slot is available (`slot_table`), the message is sent through the streams, with their queues and limits.
The total size of the segments is limited, for each topic and for the node. After `LinkTimings.keep_memory_s`
without large messages, their memory is freed.
"""

from __future__ import annotations

import logging
import os
import select
import sys
import threading
import time
import weakref
from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Final

from pipros.basics.budget import Budget
from pipros.basics.errors import ProtocolError
from pipros.basics.limits import limit_text
from pipros.basics.posix import call_in_children
from pipros.net.backlog import WireMessage
from pipros.net.link_memory import LinkMemory, MemorySharingLink, PlacedMessage
from pipros.net.loop import BackgroundLoop
from pipros.net.slot_table import FEWEST_SLOTS, QUOTA, SLOTS, SlotTable
from pipros.wire.slot_frames import DROP, SLOT, ControlFrame, Slot, decode_acknowledgements, encode

if TYPE_CHECKING:
    from pipros.net.shared_segment import Segment

SHARED_TOPIC_BYTES = 64 * 1024 * 1024
"""Limit: the memory that a node shares with the subscribers of one topic on this machine. Messages that do
not fit are sent through sockets. Beyond it, if shared memory for two messages would exceed the limit,
messages are sent through sockets, with a log entry; slots count from their first use.
"""

LEAST_BYTES: Final = 128 * 1024
"""Minimum size of a message in shared memory. Smaller messages are cheaper to send than to share."""

RETRY_S: Final = 5.0
"""Time without further attempts after a limit was reached, or the system refused memory or descriptors."""

_HEADROOM: Final = 1.25
"""The size of a segment's slots, relative to the message for which the segment was created. Unused memory is
not allocated.
"""
_CACHED_BYTES: Final = 8 * 1024 * 1024
"""If more bytes wait for a subscriber, they leave the processor's caches before they are read. The publisher
then waits briefly, which takes less time than reading them from main memory.
"""
_PAGE_BYTES: Final = 4096
_READ_BYTES: Final = 4096
_WATCH_CLOSE_S: Final = 0.1


class TopicMemory:
    """The shared memory of one topic. Thread-safe.

    Its lock is the last one that a thread acquires: no other lock is acquired while it is held.

    Attributes:
        limit_bytes: the most memory that the topic may use.
    """

    def __init__(
        self,
        topic: str,
        loop: BackgroundLoop,
        budget: Budget,
        log: logging.Logger,
        keep_s: float,
    ) -> None:
        self._keep_s = keep_s
        self._topic = topic
        self._loop = loop
        self.limit_bytes = SHARED_TOPIC_BYTES
        self._budget = budget
        self._log = log
        self._lock = threading.Lock()
        self._table = SlotTable()
        self._links: set[LinkMemory] = set()
        self._segments: dict[int, Segment] = {}
        self._current: Segment | None = None
        self._numbers = 0
        self._last_use_s = 0.0
        self._most_held = 0  # the maximum number of held slots since the last `_watch`
        self._retry_s = 0.0  # no segment is created before this time
        self._has_reported = False
        self._is_watched = False
        self._is_closed = False

    # -- subscribers --------------------------------------------------------------

    def add(self, owner: MemorySharingLink) -> LinkMemory:
        """Add a subscriber, and return the shared-memory state of its link."""
        link = LinkMemory(self, owner)
        with self._lock:
            self._links.add(link)
            self._table.add_subscriber(link)
        return link

    def remove(self, link: LinkMemory) -> None:
        with self._lock:
            self._links.discard(link)
            self._table.remove_subscriber(link)
            link.close_descriptors()
            self._close_unused()

    @property
    def used_bytes(self) -> int:
        """The size of all slots that were used, at least FEWEST_SLOTS of each segment."""
        return sum(segment.counted_bytes for segment in tuple(self._segments.values()))

    @property
    def held_slots(self) -> int:
        """The number of slots that are held by subscribers or a running `publish`."""
        with self._lock:
            return self._table.held_slots

    # -- messages -----------------------------------------------------------------

    def offer(self, links: Sequence[LinkMemory]) -> None:
        """Offer memory to new subscribers. After they accept, messages for them can be placed in slots."""
        for link in links:
            if not link.is_ready:
                link.owner.offer_memory()

    def place(self, links: Iterable[LinkMemory], message: WireMessage, size: int) -> PlacedMessage | None:
        """Copy a message into a slot.

        Return None if no subscriber has room, or if no slot or memory is available. Call `release` after
        `LinkMemory.give`. Only one thread may call `place` at a time.

        Args:
            message: the length, then the message.
            size: the size of the message without its length.
        """
        with self._lock:
            if self._is_closed:
                return None
            for link in links:
                self._collect(link)
            if not any(link.is_ready and self._may_have(link) for link in links):
                return None
            segment = self._segment_for(size)
            slot = self._table.take(segment.number) if segment else None
            if segment is None or slot is None:
                return None
            if slot[1] not in segment.counted:
                if not self._budget.take(segment.slot_bytes):
                    self._report(self._budget_refusal())
                    self._table.release(slot)
                    return None
                segment.counted.add(slot[1])
            self._last_use_s = time.monotonic()
            self._most_held = max(self._most_held, self._table.held_slots)
        try:
            segment.allocate(slot[1], size)
        except OSError as error:
            self.report(error)
            self.release(slot)
            return None
        segment.write(slot[1], message[1:])
        return PlacedMessage(segment, slot, encode(ControlFrame(SLOT, slot[0], slot[1], size)))

    def release(self, slot: Slot) -> None:
        """Remove the publisher from the holders of a slot."""
        with self._lock:
            self._table.release(slot)
            self._close_unused()

    def wait_for_space(self, links: Iterable[LinkMemory], limit_s: float) -> None:
        """Wait until each subscriber has handled enough messages for another one, at most `limit_s` in total.

        The publisher does not wait again for a subscriber that took longer, until this subscriber has handled
        all waiting messages.
        """
        full = [link for link in links if self._is_full(link)]
        if not full:
            return
        end = time.monotonic() + limit_s
        while True:
            with self._lock:
                for link in full:
                    self._collect(link)
                full = [link for link in full if self._is_full(link)]
                left_s = end - time.monotonic()
                if left_s <= 0:
                    for link in full:
                        link.is_slow = True
                pipes = [link.acknowledgements for link in full]
            if not full or left_s <= 0 or sys.platform == "win32":
                return
            poll = select.poll()
            for pipe in pipes:
                poll.register(pipe, select.POLLIN)
            poll.poll(min(left_s, _WATCH_CLOSE_S) * 1000)

    def give(self, link: LinkMemory, placed: PlacedMessage) -> bool:
        """Add a subscriber to the holders of a slot; return False if it has no room."""
        with self._lock:
            if not link.is_ready or not self._may_have(link):
                return False
            self._table.give(link, placed.slot)
            return True

    def take_back(self, link: LinkMemory, placed: PlacedMessage) -> None:
        with self._lock:
            self._table.take_back(link, placed.slot)

    def close(self) -> None:
        """Free each segment as soon as no subscriber and no running `publish` uses it."""
        with self._lock:
            self._is_closed = True
            self._current = None
            self._close_unused()

    def report(self, error: Exception) -> None:
        """Log once that the system refuses memory or descriptors, and create no segment for some time."""
        self._retry_s = time.monotonic() + RETRY_S
        self._report(f"the system refuses shared memory ({getattr(error, 'strerror', None) or error})")

    def close_in_child(self) -> None:
        """Close the memory in a forked process, which would otherwise keep it allocated."""
        self._is_closed = True
        for segment in self._segments.values():
            segment.close()
        for link in self._links:
            link.close_descriptors()
        self._segments, self._current, self._lock = {}, None, threading.Lock()

    def _is_full(self, link: LinkMemory) -> bool:
        """Return whether the publisher waits for a subscriber before the next message."""
        size, current = link.owner.queue_size, self._current
        if current is None or link.is_slow:
            return False
        limit = 0 if size is None else min(size or SLOTS, _CACHED_BYTES // current.slot_bytes)
        return self._table.waiting(link) >= max(self._table.quota, limit)

    # -- with the lock held -------------------------------------------------------

    def _may_have(self, link: LinkMemory) -> bool:
        """Return whether a subscriber may get another slot."""
        size = link.owner.queue_size
        if size is None:
            return not link.is_slow and self._table.has_free_slot(link)
        return self._table.has_free_slot(link, size or SLOTS)

    def _collect(self, link: LinkMemory) -> None:
        """Read a subscriber's acknowledgements."""
        if link.acknowledgements < 0 or not self._table.has_slots(link):
            return
        try:
            data = os.read(link.acknowledgements, _READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        reason = None if data else ""  # the subscriber has ended; no log entry is needed
        try:
            for slot, in_use in decode_acknowledgements(data):
                self._table.acknowledge(link, slot, in_use=in_use)
        except ProtocolError as error:
            reason = str(error)
        if reason is not None:
            self._table.remove_subscriber(link)
            self._loop.call(link.owner.end, reason)
        if link.is_slow and not self._table.waiting(link):
            link.is_slow = False

    def _segment_for(self, size: int) -> Segment | None:
        """Return a segment with slots of at least `size` bytes; None if there is no memory for it."""
        current = self._current
        if current is not None and size <= current.slot_bytes:
            return current
        if time.monotonic() < self._retry_s:
            return None
        slot_bytes = -(-int(size * _HEADROOM) // _PAGE_BYTES) * _PAGE_BYTES
        slots = min(SLOTS, (self.limit_bytes - self.used_bytes) // slot_bytes)
        if slots < FEWEST_SLOTS:
            limit = f"the limit is {self.limit_bytes} bytes"
            self._refuse(f"{FEWEST_SLOTS} messages of {size} bytes do not fit; {limit}")
            return None
        if not self._budget.take(slot_bytes * FEWEST_SLOTS):
            self._refuse(self._budget_refusal())
            return None
        try:
            from pipros.net.shared_segment import Segment  # imported here because only large messages need it

            created = Segment(self._numbers + 1, slot_bytes, slots)
        except (ImportError, OSError) as error:
            self._budget.give_back(slot_bytes * FEWEST_SLOTS)
            self.report(error)
            return None
        created.counted.update(range(slots - FEWEST_SLOTS, slots))  # those that are taken first
        self._numbers += 1
        self._current = self._segments[created.number] = created
        self._table.add_segment(created.number, slots)
        self._close_unused()
        _close_in_children(self)
        if not self._is_watched:
            self._is_watched = True
            self._loop.call(self._watch)
        return created

    def _budget_refusal(self) -> str:
        limit = limit_text("shared_bytes", int(self._budget.limit))
        return f"the node's topics leave too little of it; {limit}"

    def _refuse(self, reason: str) -> None:
        self._retry_s = time.monotonic() + RETRY_S
        self._report(reason)

    def _report(self, reason: str) -> None:
        if not self._has_reported:
            self._has_reported = True
            self._log.info("large messages on [%s] are sent without shared memory: %s", self._topic, reason)

    def _close_unused(self) -> None:
        """Close unused segments, except the current one."""
        for segment in tuple(self._segments.values()):
            if segment is not self._current and self._table.is_unused(segment.number):
                self._table.remove_segment(segment.number)
                del self._segments[segment.number]
                segment.close()
                self._budget.give_back(segment.counted_bytes)

    # -- in the event loop --------------------------------------------------------

    def _watch(self) -> None:
        """Free the memory some time after the last large message, once all subscribers have returned it.

        Also free it if far fewer slots are needed now; the next message then gets a new segment.
        """
        self._drop_current()
        with self._lock:
            self._most_held = self._table.held_slots
            self._is_watched = self._current is not None
            left_s = self._last_use_s + self._keep_s - time.monotonic()
        if self._is_watched:
            self._loop.asyncio.call_later(left_s if left_s > 0 else self._keep_s, self._watch)

    def _drop_current(self) -> None:
        with self._lock:
            current = self._current
            if current is None:
                return
            is_oversized = len(current.counted) > max(QUOTA, 2 * self._most_held)
            if not is_oversized and time.monotonic() < self._last_use_s + self._keep_s:
                return
            for link in self._links:
                self._collect(link)
            if not self._table.is_unused(current.number):
                return
            knowing = [link for link in self._links if link.known == current.number]
        frame = encode(ControlFrame(DROP, current.number))
        for link in knowing:
            link.owner.send_drop(frame)
        with self._lock:
            # a message may have been placed, and its segment sent again, in the meantime
            if not any(link.known == current.number for link in self._links):
                self._current = None
                self._close_unused()


_topics: weakref.WeakSet[TopicMemory] = weakref.WeakSet()


def _close_in_children(topic: TopicMemory) -> None:
    """Make forked processes close a topic's memory, which they would otherwise keep allocated."""
    _register()
    _topics.add(topic)


@cache
def _register() -> None:
    call_in_children(_close_topics)


def _close_topics() -> None:
    for topic in _topics:
        topic.close_in_child()
