"""Local topics whose messages are received from other members."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from math import inf
from typing import Final

from pipros.basics.budget import Budget
from pipros.basics.errors import PiprosError, ProtocolError
from pipros.basics.limits import Limits
from pipros.net.shared_workers import SharedWorkers
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.publisher import Publisher
from pipros_fleet.directory import FLEET_MEMBERS, DirectoryEntry
from pipros_fleet.limits import FleetLimits
from pipros_fleet.local_graph import is_result
from pipros_fleet.messages import MessageAttachment, ReceivedMessage, decompressed, is_compressed, unpack
from pipros_fleet.outbox import QUEUE
from pipros_fleet.sources import FLEET_LATCHED_BYTES, MARK
from pipros_fleet.warnings_once import WarningsOnce
from pipros_libraries.topic_tools.raw import class_like

_KEPT = 100
"""Maximum number of a member's latching publishers per topic whose last message is kept for late subscribers.
"""
_KEPT_BYTES: Final = 500
"""Memory of such a message in addition to its content."""


class SinkRoom:
    """What several topics may use together; each sender to a topic can use at most half of what others leave.

    Attributes:
        latched: memory for latched messages.
        inflating: threads that decompress messages, each sender's in order; small messages can become 1000
            times as large, and the receiving thread must not wait for that.
    """

    def __init__(self, limits: Limits) -> None:
        room = 3 * limits.of(FleetLimits).fleet_message_bytes  # a sender can use it for its largest message
        self.latched = Budget(FLEET_LATCHED_BYTES)
        self.inflating = SharedWorkers("compressed messages", 2, room, each=1)


class Sink:
    """A local topic on which the agent publishes messages from other members.

    It is either a topic that another member shares, or a topic that this member accepts.

    Attributes:
        entry: name and type of the local topic.
        is_result: whether it is an action's result topic.
        received: message counts by sender, of the last `FLEET_MEMBERS` senders.
        is_owed: whether results may have been missed. Until they were requested, results are not taken
            otherwise, so that none arrives before its subscribers are connected again.
    """

    def __init__(
        self,
        node: Node,
        entry: DirectoryEntry,
        origin: str,
        definition: str,
        log: logging.Logger,
        on_change: Callable[[], object],
        room: SinkRoom,
    ) -> None:
        """Advertise the topic. Blocks until the master answers.

        Args:
            origin: name of the member in the field `pipros_fleet` of connection headers.
            definition: definition of the message type; may be empty.
            on_change: called from any thread if a subscriber connects or disconnects. Must not block.

        Raises:
            PiprosError: the node already publishes the topic with another type.
        """
        self.entry = entry
        self.received: dict[str, ReceivedMessage] = {}
        self.is_owed = False
        self.is_result = is_result(entry)
        self._node = node
        self._warn = WarningsOnce(log, limit=10)
        self._on_change = on_change
        self._class = class_like(
            {"type": entry.type, "md5sum": entry.md5sum, "message_definition": definition}
        )
        self._headers = {MARK: origin}
        self._publishers = [self._advertise(latch=False)]
        self._latched: dict[str, tuple[dict[int, AnyMsg], Budget]] = {}  # by sender, then by publisher
        self._room = room
        self._lock = threading.Lock()  # of the above and of new senders: replies arrive in other threads
        self._is_closed = False
        self._newest: AnyMsg | None = None
        self._publishers[0].publication.listeners.append(self)

    def _advertise(self, *, latch: bool) -> Publisher[AnyMsg]:
        return self._node.endpoints.advertise(
            self.entry.name, self._class, queue_size=QUEUE, latch=latch, headers=self._headers
        )

    @property
    def is_wanted(self) -> bool:
        """Whether a node other than the agent subscribes to the topic."""
        links = self._publishers[0].publication.links
        return any(link.caller_id != self._node.name for link in links)

    def take(self, sender: str, payload: bytes, attachment: bytes, *, is_replay: bool = False) -> None:
        """Publish a message from a member, unless it is malformed, repeated or of another type.

        A compressed message that is no replay is published by another thread.
        """
        cost = len(payload) + _KEPT_BYTES
        if is_replay or not is_compressed(attachment):
            self._take(sender, payload, attachment, is_replay=is_replay)
        elif not self._room.inflating.run(sender, self._take, sender, payload, attachment, cost=cost):
            self._warn(f"too many compressed messages of [{sender}] for [{self.entry.name}] wait", sender)

    def _take(self, sender: str, payload: bytes, attachment: bytes, *, is_replay: bool = False) -> None:
        received = self.received.get(sender) or self._new_sender(sender)
        try:
            found = unpack(attachment)
            if found.md5sum != self.entry.md5sum:
                raise ProtocolError(
                    f"[{self.entry.type}] has md5sum {found.md5sum} at the sender, {self.entry.md5sum} here"
                )
            limit = self._node.limits.of(FleetLimits).fleet_message_bytes
            body = decompressed(payload, limit) if found.is_compressed else payload
        except PiprosError as error:
            received.malformed += 1
            self._warn(f"messages of [{sender}] for [{self.entry.name}] are dropped: {error}", sender)
            return
        if self._is_closed or (self.is_owed != is_replay and not found.is_latched):
            return
        if received.is_new(found, len(payload), is_replay=is_replay):
            self._publish(sender, found, body)

    def _new_sender(self, sender: str) -> ReceivedMessage:
        with self._lock:
            while len(self.received) >= FLEET_MEMBERS:  # the oldest one has left, or as many others have
                oldest = next(iter(self.received))
                del self.received[oldest]
                self._latched.pop(oldest, ({}, Budget(0)))[1].close()
            return self.received.setdefault(sender, ReceivedMessage(remembers=self.is_result))

    def _publish(self, sender: str, attachment: MessageAttachment, body: bytes) -> None:
        message = self._class(body)
        if attachment.is_latched:
            if len(self._publishers) == 1:
                self._publishers.append(self._advertise(latch=True))
            self._keep(sender, attachment.source, message)
            self._newest = message
        self._publishers[0].publish(message)

    def _keep(self, sender: str, source: int, message: AnyMsg) -> None:
        """Keep a latched message for late subscribers, if the sender's share has room for it."""
        with self._lock:
            if self._is_closed:
                return
            unused = Budget(inf, self._room.latched, part=0.5)
            kept, share = self._latched.setdefault(sender, ({}, unused))
            if source in kept:
                share.give_back(len(kept.pop(source).body) + _KEPT_BYTES)
            if len(kept) < _KEPT and share.take(len(message.body) + _KEPT_BYTES):
                kept[source] = message

    def restart(self) -> None:
        """Start a new sequence: messages sent while the topic was not received do not count as lost."""
        for received in self.received.values():
            received.restart()

    def close(self) -> None:
        """Unadvertise the topic."""
        for publisher in self._publishers:
            publisher.unregister()
        with self._lock:
            self._is_closed = True
            for _, share in self._latched.values():
                share.close()

    # -- subscribers; see `pipros.node.peers.PeerListener`

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None:
        """Send a new subscriber the last message of each latching publisher.

        The newest of these messages is omitted, because the publication has already sent it.
        """
        del topic_name, topic_publish
        with self._lock:
            messages = [each for kept, _ in self._latched.values() for each in kept.values()]
        for message in messages:
            if message is not self._newest:
                peer_publish(message)
        self._on_change()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        del topic_name, num_peers
        self._on_change()
