"""Local topics whose messages are sent to other members."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Final

from pipros.basics.limits import Limits
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.subscriber import Subscriber
from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.fleet_rules import FleetRule
from pipros_fleet.frames import FrameChange
from pipros_fleet.limits import FleetLimits
from pipros_fleet.local_graph import is_agent, is_result
from pipros_fleet.messages import MessageAttachment, compressed, pack
from pipros_fleet.outbox import FleetOutbox
from pipros_fleet.zenoh_session import SessionLink
from pipros_libraries.topic_tools.raw import class_like

FLEET_LATCHED_BYTES = 64 * 1024 * 1024
"""Maximum total size of the latched messages that a member keeps for others, or has from others, or that a
router repeats in its history. Beyond it, the latched message is sent, but members and subscribers that join
later do not get it; a sender can use at most half of what other senders leave.
"""

MARK: Final = "pipros_fleet"
"""Connection header field of every topic that an agent publishes. Agents do not forward messages from
connections with this field, so that no message circulates, whatever the topology.
"""
FULL_AFTER_S: Final = 0.01
FULL_AFTER_S_PER_BYTE: Final = 1e-8
"""The link is considered full if sending a message takes longer than FULL_AFTER_S, plus FULL_AFTER_S_PER_BYTE
for each byte of its body. (FULL_AFTER_S is half the time that Zenoh waits for room. With a smaller value, a
busy processor would look like a full link.)
"""
FULL_S: Final = 0.02
"""Time during which only the sender thread sends on a full link; longer for a topic with queued messages."""
CATCH_UP_S: Final = 0.02
"""Maximum time that a topic waits for its queued messages to be sent, on a link that is not full."""
RESULT_S: Final = 60.0
"""Time for which an action's results are kept: its clients may have missed them while a link was down."""
_RESULTS: Final = 100
_MAX_SOURCES: Final = 1000
"""Maximum number of publishers per topic that are numbered separately."""


@dataclass(frozen=True, slots=True)
class SourceMessage:
    """A message to be sent."""

    source: SentTopic
    publisher: int
    body: bytes
    is_latched: bool


@dataclass(frozen=True, slots=True)
class Kept:
    """A latched message or a result, kept for members that join later or return."""

    body: bytes
    attachment: bytes


class Sender:
    """Sends the messages of all sources over one link. Thread-safe.

    While the link has room, the thread that received a message also sends it, because handing it to another
    thread takes longer than sending it. Otherwise the message is queued, and the sender thread sends it.

    Attributes:
        outbox: messages waiting to be sent; guarded by the sender's lock.
        is_up: whether the link is up. While it is down, messages are counted and discarded.
    """

    def __init__(self, link: SessionLink, instance: str, limits: Limits, bandwidth_kbit: float = 0.0) -> None:
        self._link = link
        self.instance = instance
        self.limits = limits
        self.outbox: FleetOutbox[SourceMessage] = FleetOutbox(
            limits.of(FleetLimits).fleet_queue_bytes, bandwidth_kbit
        )
        self.latched_bytes = 0
        self._sequences: dict[str, int] = {}
        self._changed = threading.Condition()
        self._is_sending: SentTopic | None = None
        self._is_closed = False
        self._full_until_s = 0.0
        self.is_up = True
        threading.Thread(target=self._send_all, name="sender of a fleet link", daemon=True).start()

    def add(self, source: SentTopic) -> None:
        with self._changed:
            self.outbox.add_topic(source.key, source.rule)

    def remove(self, source: SentTopic) -> None:
        with self._changed:
            self.outbox.remove_topic(source.key)

    def next_sequence(self, key: str) -> int:
        """Return a key's next sequence number. The caller must hold the lock of the key's `SentTopic`.

        The numbers continue when a topic is restarted, because receivers ignore numbers that they
        have already received.
        """
        self._sequences[key] = number = self._sequences.get(key, 0) + 1
        return number

    def dropped(self, key: str) -> int:
        with self._changed:
            return self.outbox.dropped.get(key, 0)

    def offer(self, message: SourceMessage) -> None:
        """Send a message immediately, or queue it.

        Blocks for at most CATCH_UP_S plus the time that Zenoh waits for room; does not block while the link
        is known to be full. Like any slow subscriber, this slows down a publisher that is faster than the
        link, so that the publisher drops surplus messages before they are transferred. Must not be called
        concurrently for the same source, because its messages could then be reordered.
        """
        source = message.source
        with self._changed:
            is_free = self._is_free(source)
            if not is_free and self.outbox.is_unlimited(source.key):
                self._changed.wait_for(lambda: self._is_free(source) or self._is_full, CATCH_UP_S)
                is_free = self._is_free(source)
            if not is_free or source.rule.is_compressed or self._is_full:
                self.outbox.push(source.key, message, len(message.body))
                self._changed.notify_all()
                return
        self._send(message)

    @property
    def _is_full(self) -> bool:
        return self._is_closed or time.monotonic() < self._full_until_s

    def _is_free(self, source: SentTopic) -> bool:
        """Return whether all earlier messages of a source have been sent."""
        return self._is_sending is not source and self.outbox.is_idle(source.key)

    def _send(self, message: SourceMessage) -> None:
        begin_s = time.monotonic()
        message.source.send(self._link, message, is_up=self.is_up)
        end_s = time.monotonic()
        if end_s - begin_s > FULL_AFTER_S + len(message.body) * FULL_AFTER_S_PER_BYTE:
            self._full_until_s = end_s + FULL_S

    def close(self) -> None:
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def _send_all(self) -> None:
        while True:
            with self._changed:
                self._is_sending = None
                self._changed.notify_all()
                found = self.outbox.pop(time.monotonic())
                while found is None and not self._is_closed:
                    self._changed.wait(self.outbox.wait_s(time.monotonic()))
                    found = self.outbox.pop(time.monotonic())
                if found is None or self._is_closed:
                    return
                self._is_sending = found[1].source
            self._send(found[1])


class SentTopic:
    """A local topic whose messages are sent to other members.

    Attributes:
        entry: name and type of the local topic.
        key: the Zenoh key of its messages.
        messages, bytes: totals sent.
        unsent: number of messages discarded because the link was down.
    """

    def __init__(
        self,
        node: Node,
        sender: Sender,
        entry: DirectoryEntry,
        key: str,
        rule: FleetRule,
        change: FrameChange | None = None,
    ) -> None:
        self.entry = entry
        self.key = key
        self.rule = rule
        self.messages = self.bytes = self.unsent = 0
        self._node = node
        self._sender = sender
        self._change = change
        self._numbers: dict[str, int] = {}
        self._latched: dict[int, Kept] = {}
        self._results: deque[tuple[float, Kept]] = deque()
        self._is_result = is_result(entry)
        self._lock = threading.Lock()
        self._subscriber: Subscriber[AnyMsg] | None = None

    def start(self) -> None:
        """Subscribe to the local topic. Blocks until the master answers."""
        self._sender.add(self)
        message_class = class_like({"type": self.entry.type, "md5sum": self.entry.md5sum})
        # without a queue, a publisher that is faster than the link is slowed down or drops messages itself;
        # receiving messages only to drop them would take time from messages that can be sent
        queue_size = 1 if self.rule.is_latest_only else None
        self._subscriber = self._node.subscribe(
            self.entry.name, message_class, self._on_message, queue_size=queue_size
        )

    @property
    def is_linked(self) -> bool:
        """Whether the topic is connected to a publisher."""
        return self._subscriber is not None and self._subscriber.connection_count > 0

    def close(self) -> None:
        """Unsubscribe from the local topic, and discard its queued and latched messages."""
        if self._subscriber is not None:
            self._subscriber.unregister()
        self._sender.remove(self)
        with self._lock:
            self._sender.latched_bytes -= sum(len(kept.body) for kept in self._latched.values())
            self._latched.clear()
            self._drop_results(0)

    def kept(self) -> list[Kept]:
        """Return the last message of each latching publisher, and results of the last RESULT_S."""
        with self._lock:
            self._drop_results(_RESULTS)
            return [*self._latched.values(), *(kept for _, kept in self._results)]

    @property
    def dropped(self) -> int:
        """Number of messages dropped before sending, by the subscriber or the outbox."""
        before = self._subscriber.statistics()["dropped"] if self._subscriber is not None else 0
        return before + self._sender.dropped(self.key)

    def send(self, link: SessionLink, message: SourceMessage, *, is_up: bool) -> None:
        """Number a message, keep it if it is latched, and send it if the link is up. Called by `Sender`."""
        body = compressed(message.body) if self.rule.is_compressed else message.body
        with self._lock:
            attachment = pack(
                MessageAttachment(
                    message.publisher,
                    self._sender.instance,
                    self._sender.next_sequence(self.key),
                    time.time_ns(),
                    self.entry.md5sum,
                    is_compressed=self.rule.is_compressed,
                    is_latched=message.is_latched,
                )
            )
            if message.is_latched:
                self._keep(message.publisher, Kept(body, attachment))
            elif self._is_result:
                self._results.append((time.monotonic() + RESULT_S, Kept(body, attachment)))
                self._sender.latched_bytes += len(body)
                self._drop_results(_RESULTS)
        if not is_up:
            self.unsent += 1
            return
        self.messages += 1
        self.bytes += len(body)
        with contextlib.suppress(Exception):  # the session was closed
            link.put(self.key, body, attachment, self.rule.priority)

    def _keep(self, publisher: int, kept: Kept) -> None:
        before = self._latched.pop(publisher, None)
        self._sender.latched_bytes -= len(before.body) if before is not None else 0
        if self._sender.latched_bytes + len(kept.body) <= FLEET_LATCHED_BYTES:
            self._latched[publisher] = kept
            self._sender.latched_bytes += len(kept.body)

    def _drop_results(self, most: int) -> None:
        """Drop old results, those before the last `most`, and those beyond the limit in bytes."""
        now_s, limit_bytes = time.monotonic(), FLEET_LATCHED_BYTES
        while self._results and (
            len(self._results) > most
            or self._results[0][0] < now_s
            or self._sender.latched_bytes > limit_bytes
        ):
            self._sender.latched_bytes -= len(self._results.popleft()[1].body)

    def _on_message(self, raw: AnyMsg) -> None:
        header = raw.header
        caller = header.get("callerid", "")
        if MARK in header or is_agent(caller):
            return
        number = self._numbers.get(caller)
        if number is None:
            number = self._numbers[caller] = min(len(self._numbers), _MAX_SOURCES)
            if number == _MAX_SOURCES:
                del self._numbers[caller]
        body, is_latched = raw.body, header.get("latching") == "1"
        if self._change is not None:
            number, body = 0, self._change(body)
        self._sender.offer(SourceMessage(self, number, body, is_latched))
