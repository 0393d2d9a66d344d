"""Publishing: one `Publication` a topic, and a `Publisher` handle for each who advertised it."""

from __future__ import annotations

import io
import struct
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from pipros.net.outgoing import Buffer, Frame, OutgoingLink
from pipros.net.tcpros import Connection, refuse_connection
from pipros.node.context import NodeContext
from pipros.node.pace import Pace
from pipros.wire.handshake import Interface, accept_topic_link, check_topic_request
from pipros.wire.header import encode_header

if TYPE_CHECKING:
    from pipros.msg.base import Message

AnyMessage = TypeVar("AnyMessage", bound="Message")

#: Frames up to this size are joined and written by one plain send; larger ones are never copied.
JOIN_LIMIT_BYTES = 32 * 1024

#: Messages up to this size share packets when they follow each other closely.
SHARED_BYTES = 8 * 1024

#: How often a dense run is looked at for its end: its last messages may wait so long in a shared packet
#: when the subscriber is slow to acknowledge those before.
WATCH_PACE_S = 0.01

#: What was published last should arrive, but no slow subscriber keeps a node from ending.
FAREWELL_S = 0.2

_pack_length = struct.Struct("<I").pack


class PeerListener(Protocol):
    """Is told when subscribers come and go; see `rospy.SubscribeListener`."""

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable[..., None], peer_publish: Callable[..., None]
    ) -> None: ...

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None: ...


@dataclass(frozen=True, slots=True)
class PublisherLink:
    """One subscriber of a publication: who it is, and the way to it."""

    caller_id: str
    number: int
    link: OutgoingLink


class Publication:
    """All that a node publishes on one topic, however many handles it has.

    Invariant: `links` is replaced, never changed, so that `publish` reads it without a lock.
    """

    def __init__(self, topic: str, message_class: type[Message], context: NodeContext) -> None:
        self.topic = topic
        self.message_class = message_class
        self.interface = Interface(message_class._type, message_class._md5sum, message_class._full_text)
        self.queue_size: int | None = None
        self.is_latching = False
        self.links: tuple[PublisherLink, ...] = ()
        self.handles = 0
        self.headers: dict[str, str] = {}  # further fields for the connection header
        self.listeners: list[PeerListener] = []
        self.only_thread: int | None = None  # while the node ends, nobody else's messages go out
        self.dropped = 0  # by links that are closed already
        self._context = context
        self._encode = encoder(message_class)
        self._has_header = bool(getattr(message_class, "_has_header", False))
        self._pace = Pace()
        self._is_watched = False  # by the event loop, while the pace is dense
        self._sequence = 0
        self._latched: Message | None = None
        self._lock = threading.Lock()  # keeps sequence numbers and frames of several threads in step
        self._is_closed = False

    def publish(self, message: Message) -> None:
        """Sends a message to every subscriber; serialises it once, and not at all for nobody.

        Raises:
            SerializationError: a field has a value that its type cannot hold. Nothing was sent.
        """
        if self.only_thread is not None and self.only_thread != threading.get_ident():
            return
        with self._lock:
            if self.is_latching:
                self._latched = message
            links = self.links
            if not links:
                return
            frame, size = self._frame(message)
            if size <= SHARED_BYTES and self._pace.note(time.monotonic()):
                self._follow_pace()
            for peer in links:
                peer.link.send(frame, size)
        for peer in links:
            if peer.link.is_behind:
                peer.link.settle()

    def publish_to(self, peer: PublisherLink, message: Message) -> None:
        """Sends a message to one subscriber only."""
        with self._lock:
            peer.link.send(*self._frame(message))
        peer.link.settle()

    def attach(self, connection: Connection) -> None:
        """Answers a subscriber's header: links it and sends the latched message, or refuses it."""
        refusal = check_topic_request(connection.fields, self.interface)
        if refusal:
            self._context.log.warning(refusal)
            refuse_connection(connection.sock, refusal)
            return
        answer = accept_topic_link(
            self.topic, self._context.node_name, self.interface, latching=self.is_latching
        )
        header = encode_header({**self.headers, **answer})
        link = OutgoingLink(
            connection.sock,
            self._context.loop,
            queue_size=self.queue_size,
            may_share_packets=connection.fields.get("tcp_nodelay") != "1",
            on_closed=self._detach,
        )
        peer = PublisherLink(connection.fields["callerid"], self._context.next_link_number(), link)
        with self._lock:
            link.greet(header)
            self._send_latched(link)
            link.share_packets(share=self._pace.is_dense)
            self.links = (*self.links, peer)
        if self._is_closed:  # and `close` may not have seen this link
            link.close()
        self._tell_listeners(
            lambda listener: listener.peer_subscribe(
                self.topic, self.publish, lambda message: self.publish_to(peer, message)
            )
        )

    def _send_latched(self, link: OutgoingLink) -> None:
        if not self.is_latching or self._latched is None:
            return
        try:
            link.send(*self._frame(self._latched))
            link.hand_over()
        except Exception as error:  # nobody was connected when it was published, so nobody looked at it
            self._context.log.error("the latched message of [%s] cannot be sent: %s", self.topic, error)

    def set_queue_size(self, queue_size: int | None) -> None:
        self.queue_size = queue_size
        for peer in self.links:
            peer.link.queue_size = queue_size

    def close(self, end: float | None = None) -> None:
        """Closes all links; new messages go nowhere.

        What waits gets until `end` (of `time.monotonic`) to go out, by default for FAREWELL_S.
        """
        self._is_closed = True
        end = time.monotonic() + FAREWELL_S if end is None else end
        for peer in self.links:
            if peer.link.is_behind:
                peer.link.drain(end - time.monotonic())
            peer.link.close()

    def _frame(self, message: Message) -> tuple[Frame, int]:
        """The message as it goes over the wire, and its length with the length field."""
        if self._has_header:
            self._sequence += 1
            header: Any = message.header  # type: ignore[attr-defined]
            header.seq = self._sequence
            if header.frame_id is None:
                header.frame_id = "0"
        buffers = self._encode(message)
        if len(buffers) == 1 and len(buffers[0]) <= JOIN_LIMIT_BYTES:
            size = len(buffers[0])
            return (_pack_length(size) + buffers[0],), size + 4
        size = sum(map(len, buffers))
        if size <= JOIN_LIMIT_BYTES:
            return (b"".join((_pack_length(size), *buffers)),), size + 4
        return (_pack_length(size), *buffers), size + 4

    def _follow_pace(self) -> None:
        """Has all links share packets, or no longer. With the lock held."""
        for peer in self.links:
            peer.link.share_packets(share=self._pace.is_dense)
        if self._pace.is_dense and not self._is_watched:
            self._is_watched = True
            self._context.loop.call(self._watch_pace)

    def _watch_pace(self) -> None:
        """Sees that the last messages of a dense run go out. Called in the event loop."""
        with self._lock:
            if self._pace.falls_silent(time.monotonic()):
                self._follow_pace()
            is_watched = self._is_watched = self._pace.is_dense and not self._is_closed
        if is_watched:  # by us: meanwhile the next run may have begun, with a watch of its own
            self._context.loop.asyncio.call_later(WATCH_PACE_S, self._watch_pace)

    def _detach(self, link: OutgoingLink) -> None:
        with self._lock:
            self.links = tuple(peer for peer in self.links if peer.link is not link)
            self.dropped += link.statistics.dropped
        self._tell_listeners(lambda listener: listener.peer_unsubscribe(self.topic, len(self.links)))

    def _tell_listeners(self, tell: Callable[[PeerListener], None]) -> None:
        """Calls the users' listeners in a thread: they may block, the event loop must not."""
        if self.listeners:
            self._context.loop.asyncio.run_in_executor(None, self._call_listeners, tell)

    def _call_listeners(self, tell: Callable[[PeerListener], None]) -> None:
        for listener in list(self.listeners):
            try:
                tell(listener)
            except Exception:
                self._context.log.exception("a subscribe listener of [%s] failed", self.topic)


def encoder(message_class: type[Message]) -> Callable[[Any], list[Buffer]]:
    """The quickest way from a message to its bytes, in one buffer or several, without a length."""
    to_buffers: Callable[[Any], list[Buffer]] | None = getattr(message_class, "_to_buffers", None)
    return to_buffers if to_buffers is not None else _serialize


def _serialize(message: Message) -> list[Buffer]:
    """For classes from genuine generators, which only write to a file."""
    file = io.BytesIO()
    message.serialize(file)
    return [file.getvalue()]


class Publisher(Generic[AnyMessage]):
    """A handle on a topic that the node publishes. Made by `Node.advertise`."""

    def __init__(self, publication: Publication, release: Callable[[Publication], None]) -> None:
        self.publication = publication
        self._release: Callable[[Publication], None] | None = release

    @property
    def topic(self) -> str:
        return self.publication.topic

    @property
    def connection_count(self) -> int:
        return len(self.publication.links)

    @property
    def is_unregistered(self) -> bool:
        return self._release is None

    def publish(self, message: AnyMessage) -> None:
        """See `Publication.publish`; does nothing once the node has shut down."""
        self.publication.publish(message)

    def statistics(self) -> Mapping[str, int]:
        """Frames and bytes sent, and frames dropped because a subscriber was too slow."""
        links = [peer.link.statistics for peer in self.publication.links]
        return {
            "frames": sum(link.frames for link in links),
            "bytes": sum(link.bytes for link in links),
            "dropped": self.publication.dropped + sum(link.dropped for link in links),
        }

    def unregister(self) -> None:
        """Gives the handle up; with the last one the topic is unregistered. Harmless when repeated."""
        release, self._release = self._release, None
        if release is not None:
            release(self.publication)
