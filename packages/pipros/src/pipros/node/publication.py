"""A topic that a node publishes: its subscribers, and what they are sent."""

from __future__ import annotations

import functools
import os
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipros.basics.printable import printable
from pipros.net.connection_table import LinkEntry
from pipros.net.flush import LARGE_MESSAGE_WAIT_S, flush_or_queue
from pipros.net.local_stream import is_local, shares_memory
from pipros.net.outgoing_state import LinkState, SendStatistics
from pipros.net.tcpros import TcprosConnection, refuse_connection
from pipros.net.workers import Workers, interpreter_ends
from pipros.node.codec import TopicEncoder
from pipros.node.context import NodeContext
from pipros.node.message_batch import MessageBatch, flush_at_exit_and_fork
from pipros.node.packet_sharing import PACKET_SHARING_BYTES, PacketSharing
from pipros.node.peers import PeerListeners, PublisherLink
from pipros.wire.handshake import WireType, accept_topic_link, topic_refusal
from pipros.wire.header import encode_header
from pipros.wire.slot_frames import ACCEPTED, HEADER_FIELD

if TYPE_CHECKING:
    from pipros.msg.base import Message
    from pipros.net.backlog import Buffer, WireMessage
    from pipros.net.outgoing import OutgoingLink
    from pipros.net.shared_memory import TopicMemory
    from pipros.node.in_process import InProcessLink
    from pipros.node.shared_publication import SharedPublication


_IDLE = LinkState.IDLE  # an alias: enum lookups per message are slow

_CHILD_BYTES = 32 * 1024  # a socket takes this much from a forked child at once, not between parts of others


class Publication:
    """A topic that a node publishes, shared by all its handles.

    Invariant: `links` is replaced, never changed, so it can be read without a lock.

    There are two locks, acquired in this order. `_lock` keeps the messages of several threads in the same
    order on all links. It is held while a message is encoded, which can take seconds for a huge message; the
    event loop never waits for it. `_links_lock` is held only to change `links` and `_joining`, and to queue
    calls to the listeners.

    A new subscriber gets the reply header and waits in `_joining`. If no message is latched or being
    published, it is added to `links` at once; otherwise, it is added with the first message sent to it: the
    latched message, which a thread encodes, or a message that is being published.
    """

    def __init__(self, topic: str, message_class: type[Message], context: NodeContext) -> None:
        self.topic = topic
        self.message_class = message_class
        self.interface = WireType(message_class._type, message_class._md5sum, message_class._full_text)
        self.queue_size: int | None = None
        self.is_latching = False
        self.links: tuple[PublisherLink, ...] = ()
        self._joining: tuple[PublisherLink, ...] = ()
        self.links_in_process: tuple[InProcessLink, ...] = ()
        self.handles = 0
        self.headers: dict[str, str] = {}  # additional fields for the connection header
        self.listeners = PeerListeners(topic, context)
        self._join_thread = Workers(f"new subscribers of {topic}", limit=1, kept_idle=0)
        self.only_thread: int | None = None  # the only thread that may publish during shutdown
        self.links_ended = 0
        self._closed_totals = SendStatistics()  # totals of closed links
        self._context = context
        self._published = context.published
        self.encoder = TopicEncoder(message_class)
        self._encoded, self._number = self.encoder.encode, self.encoder.number  # bound once, for speed
        self._latched: dict[str, Message] = {}  # by the recorded publisher, in a bag that is played
        self._lock = threading.Lock()
        self._links_lock = threading.Lock()
        self._batch = MessageBatch()
        self._memory_sharing: SharedPublication | None = None  # set once a subscriber accepts shared memory
        self._received = context.received
        self._received_before = 0  # the value of `_received` at the last message
        self._packet_sharing = PacketSharing(
            context.loop, self._lock, lambda: [peer.link for peer in self.links], self._leave_batch_to_loop
        )
        self._burst = self._packet_sharing.detector
        self._may_share_packets = False  # whether a burst has an effect on any link so far
        self._is_closed = False
        self._process = os.getpid()

    @property
    def is_received(self) -> bool:
        """Whether a message that is published now has a subscriber, or is latched for later ones."""
        return self.is_latching or bool(self.links or self._joining or self.links_in_process)

    def publish(self, message: Message) -> None:
        """Send a message to every subscriber.

        The message is serialized once, or not at all if there are no subscribers. Blocks for at most
        `Limits.stall_s`, for all subscribers together, regardless of `queue_size` (see
        `pipros.net.outgoing`). If `queue_size` is None, a subscriber that takes longer has stalled: until it
        has caught up, `publish` does not wait for it, and it receives only the newest message.

        Raises:
            SerializationError: a value does not fit the type of its field. Nothing was sent.
        """
        if self.only_thread is not None and self.only_thread != threading.get_ident():
            return
        with self._lock:
            if self.is_latching:
                self._latch(message)
            if not self.links and not self._joining:
                if self.links_in_process:
                    self._number(message)
                    self._hand_over(message)
                return
            self._published.value += 1
            data, size = self._encoded(message)
            if self.links_in_process:
                self._hand_over(message)
            if self._joining:
                self._admit()
            links = self.links
            batch: Sequence[Buffer] | None = None
            is_shared = False
            if size > PACKET_SHARING_BYTES:
                if size > _CHILD_BYTES and os.getpid() != self._process:
                    self._refuse_child(size)
                    return
                self._send_batch()
                is_shared = self._memory_sharing is not None and self._memory_sharing.send(links, data, size)
            elif (batch := self._collect(data)) is not None:
                if not batch:
                    return
                self._send_together(batch)
            if batch is None and not is_shared:
                for peer in links:
                    peer.link.send(data, size)
        for peer in links:
            if peer.link.state is not _IDLE:
                flush_or_queue([peer.link for peer in links], self._context.limits.stall_s)
                return
        if is_shared and self._memory_sharing is not None:
            limit_s = self._context.limits.stall_s
            self._memory_sharing.wait_for_space(
                links, limit_s if self.queue_size is None else min(limit_s, LARGE_MESSAGE_WAIT_S)
            )

    def _refuse_child(self, size: int) -> None:
        if self._process:
            self._process = 0  # one warning is enough
            rule = f"a forked child can publish at most {_CHILD_BYTES} bytes on [{self.topic}], got {size}"
            self._context.log.warning("%s; advertise it in the child only, or let the parent publish", rule)

    def _latch(self, message: Message) -> None:
        """Keep a message for later subscribers, in place of the last one of the same recorded publisher."""
        publisher = getattr(message, "_recorded_publisher", "")
        if publisher is not None:
            self._latched.pop(publisher, None)  # so that the newest is the last
            self._latched[publisher] = message

    def _hand_over(self, message: Message) -> None:
        for link in self.links_in_process:
            link.put(message)

    def hand_over_to(self, link: InProcessLink) -> None:
        """Add a subscription of the same node, which gets the latched message, if there is one."""
        with self._lock:
            for message in self._latched.values():
                self._number(message)
                link.put(message)
            with self._links_lock:
                self.links_in_process = (*self.links_in_process, link)
        self.listeners.connected(self.publish, link.put)

    def end_hand_over(self, link: InProcessLink) -> None:
        """Remove a subscription of the same node."""
        with self._links_lock:
            self.links_in_process = tuple(each for each in self.links_in_process if each is not link)
        left = len(self.links) + len(self.links_in_process)
        self.listeners.disconnected(left)

    def publish_to(self, peer: PublisherLink, message: Message) -> None:
        """Send a message to a single subscriber."""
        with self._lock:
            self._send_batch()
            peer.link.send(*self._encoded(message))
        flush_or_queue([peer.link], self._context.limits.stall_s)

    def flush(self) -> None:
        """Send the messages that a burst has collected, or leave them to the event loop."""
        if self._batch.messages and self._lock.acquire(timeout=self._context.timings.close_flush_s):
            try:
                self._leave_batch_to_loop()
            finally:
                self._lock.release()

    def _collect(self, data: WireMessage) -> Sequence[Buffer] | None:
        """Collect a small message of a burst. The caller holds `_lock`.

        Return the messages to send now; an empty list if the message waits for others. Return None if the
        message must be sent by itself; the messages collected before it have then been sent.
        """
        if self.queue_size is None and not self._may_share_packets:
            self._send_batch()  # of messages from before `queue_size` changed
            return None
        now_s, burst = time.monotonic(), self._burst
        if self._packet_sharing.note(now_s):
            self._packet_sharing.apply()
            flush_at_exit_and_fork(self)
        before, self._received_before = self._received_before, self._received.value
        if (
            burst.in_burst
            and burst.is_close
            and self.queue_size is not None
            and before == self._received_before
        ):
            return self._batch.take() if self._batch.add(data[0], now_s) else ()
        self._send_batch()
        return None

    def _send_batch(self) -> None:
        """Send the collected messages. The caller holds `_lock`."""
        if self._batch.messages:
            self._send_together(self._batch.take())

    def _send_together(self, messages: Sequence[Buffer]) -> None:
        joined = b"".join(messages)
        for peer in self.links:
            peer.link.send_together(messages, joined)

    def _leave_batch_to_loop(self) -> None:
        self._send_batch()
        for peer in self.links:
            if peer.link.is_behind:
                peer.link.queue_for_loop()

    def attach(self, connection: TcprosConnection) -> None:
        """Respond to a subscriber's header: accept the subscriber and send the latched message, or refuse it.

        Called from the event loop. A separate thread encodes the latched message, or waits for the current
        call of `publish` to finish.
        """
        refusal = topic_refusal(connection.fields, self.interface)
        if refusal:
            self._context.log.warning(refusal)
            refuse_connection(connection.sock, refusal)
            return
        entry = LinkEntry(connection.peer, connection.sock.close)
        if not self._context.connections.add_link(entry):
            refuse_connection(connection.sock, f"[{self._context.node_name}] has too many connections")
            return
        header = encode_header(self.connection_header())
        link = self._link(connection, entry)
        entry.close = link.close
        peer = PublisherLink(printable(connection.fields["callerid"]), self._context.next_link_number(), link)
        with self._links_lock:
            # Before the header is sent: a connected subscriber expects all later messages.
            self._joining = (*self._joining, peer)
            link.send_header(header)
        if self._lock.acquire(blocking=False):
            try:
                if not self._latched:
                    self._admit()
                    return
            finally:
                self._lock.release()
        try:
            self._join_thread.run(self._send_latched)
        except RuntimeError as error:  # the subscriber will try again
            if not interpreter_ends(error):
                self._context.log.error("cannot serve a subscriber of [%s]: %s", self.topic, error)
            link.close()

    def connection_header(self) -> dict[str, str]:
        """Return the fields of the reply header for a subscriber."""
        answer = accept_topic_link(
            self.topic, self._context.node_name, self.interface, latching=self.is_latching
        )
        return {**self.headers, **answer}

    def _link(self, connection: TcprosConnection, entry: LinkEntry) -> OutgoingLink:
        context, is_accepted = self._context, connection.fields.get(HEADER_FIELD) == ACCEPTED
        if is_accepted and shares_memory() and is_local(connection.sock):
            if self._memory_sharing is None:
                from pipros.node.shared_publication import SharedPublication

                self._memory_sharing = SharedPublication(self.topic, context)
            return self._memory_sharing.link(
                connection.sock,
                queue_size=self.queue_size,
                on_closed=lambda link: self._detach(link, entry),
            )
        from pipros.net.outgoing import OutgoingLink  # imported here because `import rospy` needs no links

        return OutgoingLink(
            connection.sock,
            context.loop,
            queue_size=self.queue_size,
            limits=context.limits,
            timings=context.timings.links,
            may_share_packets=connection.fields.get("tcp_nodelay") != "1",
            on_closed=lambda link: self._detach(link, entry),
        )

    @property
    def memory(self) -> TopicMemory | None:
        """The memory shared with subscribers on this machine; None before the first such subscriber."""
        return self._memory_sharing.memory if self._memory_sharing is not None else None

    def _send_latched(self) -> None:
        """Send the latched message to all waiting subscribers, encoding it only once."""
        with self._lock:
            if not self._joining:
                return
            latched = []
            for message in self._latched.values():
                try:
                    latched.append(self._encoded(message))
                except Exception as error:
                    # it was published without subscribers, so it is serialized here for the first time
                    self._context.log.error(
                        "the latched message of [%s] cannot be sent: %s", self.topic, error
                    )
            for link in self._admit():
                for data in latched:
                    link.send(*data)
                    link.queue_for_loop()

    def _admit(self) -> list[OutgoingLink]:
        """Add the waiting subscribers to `links`, and return their links. The caller holds `_lock`."""
        self._send_batch()
        with self._links_lock:
            joining, self._joining = self._joining, ()
            for peer in joining:
                self._packet_sharing.apply_to(peer.link)
                self._may_share_packets |= peer.link.may_share_packets
                self.links = (*self.links, peer)
                self.listeners.connected(self.publish, functools.partial(self.publish_to, peer))
                if self._is_closed:  # `close` may have run before the link was added
                    peer.link.close()
        return [peer.link for peer in joining]

    def set_queue_size(self, queue_size: int | None) -> None:
        self.queue_size = queue_size
        for peer in (*self._joining, *self.links):
            peer.link.queue_size = queue_size

    def close(self, end: float | None = None) -> None:
        """Close all links; later messages are discarded.

        Queued messages are sent until `end` (a `time.monotonic()` time), by default for
        `NodeTimings.close_flush_s`.
        """
        self.flush()
        self._is_closed = True
        self._packet_sharing.close()
        for link in self.links_in_process:
            link.close()
        if end is None:
            end = time.monotonic() + self._context.timings.close_flush_s
        for peer in (*self._joining, *self.links):
            if peer.link.is_behind:
                peer.link.drain(end - time.monotonic())
            peer.link.close()
        if self._memory_sharing is not None:
            self._memory_sharing.memory.close()

    def statistics(self) -> dict[str, int]:
        """Return the totals of all links; see `Publisher.statistics`."""
        total = SendStatistics()
        with self._links_lock:
            total.add(self._closed_totals)
            for peer in self.links:
                total.add(peer.link.statistics)
            return {**total.as_dict(), "links_ended": self.links_ended}

    def _detach(self, link: OutgoingLink, entry: LinkEntry) -> None:
        self._context.connections.remove(entry)
        with self._links_lock:
            ended = [peer for peer in (*self.links, *self._joining) if peer.link is link]
            self._joining = tuple(peer for peer in self._joining if peer.link is not link)
            self.links_ended += 1
            self._closed_totals.add(link.statistics)
            before, self.links = self.links, tuple(peer for peer in self.links if peer.link is not link)
            if self.links != before:
                left = len(self.links) + len(self.links_in_process)
                self.listeners.disconnected(left)
        if link.end_reason:
            caller = " ".join(printable(peer.caller_id) for peer in ended)
            self._context.log.warning(
                "the link to the subscriber [%s] of [%s] at %s is closed: %s",
                caller,
                self.topic,
                link.peer,
                link.end_reason,
            )
