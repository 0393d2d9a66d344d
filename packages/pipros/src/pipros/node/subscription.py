"""A topic that a node receives: its callbacks, and its publishers."""

from __future__ import annotations

import asyncio
import functools
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import Interrupted, LimitExceeded, MissingExtra, ProtocolError
from pipros.basics.printable import printable
from pipros.net.connection_table import LinkEntry
from pipros.net.delivery_lock import DeliveryLock
from pipros.net.incoming import IncomingLink, ReceiveStatistics
from pipros.net.shared_receiver import NoSharedMemory
from pipros.net.tcpros import TcprosConnection
from pipros.net.workers import interpreter_ends
from pipros.node.any_msg import AnyMsg
from pipros.node.asyncio_support import MessageStream
from pipros.node.codec import decoder, encoder, view_decoder
from pipros.node.context import NO_ARGS, NodeContext
from pipros.node.in_process import InProcessLink, with_octets
from pipros.node.latch import LastMessage, LatchedFirst
from pipros.node.peers import SubscriberLink
from pipros.node.publisher_connector import LinkEnd, PublisherConnector
from pipros.node.publisher_dialer import PublisherDialer
from pipros.wire.handshake import WireType

if TYPE_CHECKING:
    from pipros.msg.base import Message
    from pipros.node.publication import Publication


Callback = Callable[..., object]

MessageObserver = Callable[[str, Mapping[str, str], int, Any], None]
"""Function called for each received message with the topic, the connection header, the size in bytes, and the
message.
"""


class SubscriberCallback:
    """One callback of a subscription.

    Attributes:
        args: the callback's second argument, if it has one.
        takes_views: whether the callback gets arrays that share the memory of the received message.
        stands_for: the new callback that this entry replaces until the new callback has received the latched
            messages.
    """

    __slots__ = ("args", "callback", "stands_for", "takes_views")

    def __init__(
        self,
        callback: Callback,
        args: object = NO_ARGS,
        takes_views: bool = False,
        stands_for: SubscriberCallback | None = None,
    ) -> None:
        self.callback, self.args = callback, args
        self.takes_views, self.stands_for = takes_views, stands_for


class Subscription:
    """A topic that a node receives, with all its callbacks.

    The callbacks of a topic are called in the order they were added, one message at a time, even if there are
    several publishers. A callback that blocks delays only its own topic. If a callback raises, the exception
    is logged and the other callbacks are still called.
    """

    def __init__(self, topic: str, message_class: type[Message], context: NodeContext) -> None:
        self.topic = topic
        self.message_class = message_class
        self.interface = WireType(message_class._type, message_class._md5sum, message_class._full_text)
        self.queue_size: int | None = None
        self.tcp_nodelay = False
        self.links: tuple[SubscriberLink, ...] = ()
        self.callbacks: tuple[SubscriberCallback, ...] = ()
        self.links_ended = 0
        self._closed_totals = ReceiveStatistics()  # totals of closed links
        self.handles = 0
        self.observe: MessageObserver | None = None
        self._missing: set[str] = set()  # texts of `MissingExtra` errors that have been logged
        self._context = context
        self._decode = decoder(message_class)
        self._delivery_lock = DeliveryLock()
        self._lock = threading.Lock()
        self._dialer = PublisherDialer(topic, self.interface, context)
        self._connector = PublisherConnector(topic, context, self._link)
        self._announcements = 0  # changed only in the event loop
        self._is_closed = False
        self._takes_views = False  # whether any callback takes views
        self._decode_views = decoder(message_class)

    # -- callbacks --------------------------------------------------------------

    def add(self, entry: SubscriberCallback) -> Callable[[], object]:
        """Add a callback.

        Call the returned function next, without holding a lock: it calls the callback with the last message
        of each connected latching publisher, before newer messages.
        """
        with self._lock:
            if entry.takes_views and not self._takes_views:
                self._takes_views, self._decode_views = True, view_decoder(self.message_class)
                for peer in self.links:
                    peer.link.lends = True
            latched = [
                peer.last.message for peer in self.links if peer.last and peer.last.message is not None
            ]
            if not latched:
                self.callbacks = (*self.callbacks, entry)
                return _nothing
            first = LatchedFirst(latched, lambda message: self._call_back(entry, message, is_latched=True))
            stand_in = SubscriberCallback(first, takes_views=entry.takes_views, stands_for=entry)
            self.callbacks = (*self.callbacks, stand_in)

        def give_latched() -> None:
            first.give()
            with self._lock:
                self.callbacks = tuple(entry if item is stand_in else item for item in self.callbacks)

        return give_latched

    def remove(self, entry: SubscriberCallback) -> None:
        with self._lock:
            self.callbacks = tuple(item for item in self.callbacks if entry not in (item, item.stands_for))

    def set_queue_size(self, queue_size: int | None) -> None:
        self.queue_size = queue_size
        for peer in self.links:
            peer.link.queue_size = queue_size

    def close(self) -> None:
        """Close all links and stop opening new links."""
        self._is_closed = True
        for entry in self.callbacks:
            if isinstance(entry.callback, MessageStream):
                entry.callback.close()
        self._context.loop.call(self._connector.stop)
        for peer in self.links:
            peer.link.close()

    # -- publishers ---------------------------------------------------------------

    def update_publishers(self, uris: Iterable[str]) -> None:
        """Apply a list of publishers from the master. Called from the event loop."""
        self._announcements += 1
        self._connector.update(self._others(uris))

    def ask_for_publishers(self) -> Callable[[Iterable[str]], object]:
        """Prepare a registration with the master.

        Return a function to call with the master's response, in any thread.

        If the master announces a list of publishers before its response is applied, the response is ignored:
        the announced list is newer, and the response may lack a publisher that has just registered.
        """
        before = self._announcements

        def update(uris: Iterable[str]) -> None:
            if self._announcements == before:
                self._connector.update(self._others(uris))

        return lambda uris: self._context.loop.call(update, uris)

    def _others(self, uris: Iterable[str]) -> Iterable[str]:
        """Return the publishers, excluding this node if it passes the topic's messages directly to itself."""
        own = {peer.uri for peer in self.links if isinstance(peer.link, InProcessLink)}
        return [uri for uri in uris if uri not in own] if own else uris

    def link_in_process(self, publication: Publication, uri: str) -> InProcessLink:
        """Return a new link through which a publication of the same node passes its messages."""
        header = publication.connection_header()
        last = LastMessage() if publication.is_latching else None

        def end(link: InProcessLink) -> None:
            publication.end_hand_over(link)
            self._remove_link(link)

        link = InProcessLink(
            self._context.node_name,
            deliver=functools.partial(self._deliver_object, header, last),
            delivery_lock=self._delivery_lock,
            queue_size=self.queue_size,
            on_closed=end,
        )
        peer = SubscriberLink(uri, self._context.node_name, self._context.next_link_number(), link, last)
        with self._lock:
            self.links = (*self.links, peer)
        link.start()
        return link

    @property
    def attempts(self) -> int:
        """The total number of attempts to connect to publishers."""
        return self._connector.attempts

    async def _link(self, uri: str) -> LinkEnd:
        """Connect to a publisher.

        Raises:
            PiprosError: the publisher is unreachable, refuses the connection or violates the protocol, or
                this node has too many connections.
            ValueError: the publisher registered an invalid URI.
        """
        connections, limits = self._context.connections, self._context.limits
        if not connections.reserve_outgoing(limits.incoming_links):
            raise LimitExceeded("this node has as many connections as its limits allow")
        ended: LinkEnd = asyncio.get_running_loop().create_future()
        try:
            connection = await self._dialer.connect(uri, tcp_nodelay=self.tcp_nodelay)
            link = self._start(uri, connection, ended)
        except BaseException:
            connections.release_outgoing()
            raise
        if self._is_closed:
            link.close()
        return ended

    def _start(self, uri: str, connection: TcprosConnection, ended: LinkEnd) -> IncomingLink:
        header = dict(connection.fields)
        last = LastMessage() if header.get("latching") == "1" else None
        link = IncomingLink(
            connection.sock,
            name=f"topic {self.topic} from {header.get('callerid', uri)}",
            deliver=functools.partial(self._deliver, header, last),
            delivery_lock=self._delivery_lock,
            queue_size=self.queue_size,
            on_closed=lambda link, error: self._detach(link, error, ended, uri),
            published=self._context.published,
            received_count=self._context.received,
            on_incomplete=self._note_incomplete,
            limit_bytes=self._context.limits.frame_bytes,
            keeps_large=self._takes_views or issubclass(self.message_class, AnyMsg),
            received=connection.rest,
            timings=self._context.timings.links,
        )
        peer = SubscriberLink(uri, header.get("callerid", "?"), self._context.next_link_number(), link, last)
        with self._lock:
            link.lends = self._takes_views
            self.links = (*self.links, peer)
        try:
            link.start()
        # no thread is available; one may be free at the next attempt
        except RuntimeError as error:
            connection.sock.close()
            self._remove_link(link)
            if interpreter_ends(error):
                raise asyncio.CancelledError from error
            raise ProtocolError(str(error)) from error
        return link

    def _note_incomplete(self, entry: LinkEntry, count: int) -> None:
        loop, incomplete = self._context.loop, self._context.incomplete
        if count:
            loop.call(incomplete.note, entry, count)
        else:
            loop.call(incomplete.forget, entry)

    # -- messages -------------------------------------------------------------------

    def _deliver(self, header: Mapping[str, str], last: LastMessage | None, data: memoryview | bytes) -> None:
        if self._takes_views:
            self._deliver_views(header, last, data)
            return
        try:
            message: Any = self._decode(data)
        except Exception as error:
            raise self._undecodable(data, error) from error
        message._connection_header = header
        if last is None:
            callbacks = self.callbacks
        else:
            # A callback that is added concurrently gets the message from `last` or with the other callbacks.
            with self._lock:
                last.message = message
                callbacks = self.callbacks
        if self.observe is not None:
            self._observe(header, len(data), message)
        for entry in callbacks:
            try:
                if entry.args is NO_ARGS:
                    entry.callback(message)
                else:
                    entry.callback(message, entry.args)
            except Exception as error:
                self._log_bad_callback(entry, error)

    def _deliver_object(self, header: Mapping[str, str], last: LastMessage | None, message: Any) -> None:
        """Call the callbacks with a message that this node published."""
        message._connection_header = header
        with self._lock:
            if last is not None:
                last.message = message
            callbacks = self.callbacks
        if self.observe is not None:
            self._observe(header, 0, message)
        for entry in callbacks:
            self._call_back(entry, with_octets(message, as_arrays=entry.takes_views))

    def _deliver_views(
        self, header: Mapping[str, str], last: LastMessage | None, data: memoryview | bytes
    ) -> None:
        """Like `_deliver`, but for topics on which a callback takes views. Other callbacks get a copy."""
        with self._lock:
            callbacks = self.callbacks
            is_copied = (
                last is not None
                or self.observe is not None
                or any(not entry.takes_views for entry in callbacks)
            )
            copied = self._decoded(self._decode, header, data) if is_copied else None
            if last is not None:
                last.message = copied
        if self.observe is not None:
            self._observe(header, len(data), copied)
        viewed = self._decoded(self._decode_views, header, data)
        del data
        for entry in callbacks:
            self._call_back(entry, viewed if entry.takes_views else copied)

    def _decoded(
        self, decode: Callable[[memoryview | bytes], Any], header: Mapping[str, str], data: memoryview | bytes
    ) -> Any:
        try:
            message = decode(data)
        except Exception as error:
            raise self._undecodable(data, error) from error
        message._connection_header = header
        return message

    def _undecodable(self, data: memoryview | bytes, error: Exception) -> ProtocolError:
        return ProtocolError(f"cannot decode {len(data)} bytes as {self.interface.type}: {error}")

    def _observe(self, header: Mapping[str, str], size: int, message: Any) -> None:
        try:
            if self.observe is not None:
                self.observe(self.topic, header, size, message)
        except Exception:
            self._context.log.exception("an observer of [%s] failed", self.topic)

    def _call_back(self, entry: SubscriberCallback, message: Any, *, is_latched: bool = False) -> None:
        """Call one callback. `_deliver` does the same inline, to avoid a function call per message."""
        try:
            if is_latched and entry.takes_views:
                data = b"".join(encoder(type(message))(message))
                message = self._decoded(self._decode_views, message._connection_header, data)
            entry.callback(*(message, entry.args) if entry.args is not NO_ARGS else (message,))
        except Exception as error:
            self._log_bad_callback(entry, error)

    def _log_bad_callback(self, entry: SubscriberCallback, error: Exception) -> None:
        # logged once, because every message fails until the user installs the missing package
        if isinstance(error, MissingExtra):
            if str(error) not in self._missing:
                self._missing.add(str(error))
                self._context.log.error("bad callback: %s: %s", entry.callback, error)
            return
        if isinstance(error, Interrupted):  # the node ends while the callback waits
            return
        self._context.log.error("bad callback: %s", entry.callback, exc_info=error)

    def _remove_link(self, link: IncomingLink | InProcessLink) -> None:
        with self._lock:
            self.links = tuple(peer for peer in self.links if peer.link is not link)
            self.links_ended += 1
            self._closed_totals.add(link.statistics)

    def statistics(self) -> dict[str, int]:
        """Return the totals of all links; see `Subscriber.statistics`."""
        total = ReceiveStatistics()
        with self._lock:
            total.add(self._closed_totals)
            for peer in self.links:
                total.add(peer.link.statistics)
            return {**total.as_dict(), "links_ended": self.links_ended}

    def _detach(self, link: IncomingLink, error: Exception | None, ended: LinkEnd, uri: str) -> None:
        self._remove_link(link)
        if isinstance(error, NoSharedMemory):
            self._dialer.avoid_memory(uri)
        self._context.connections.release_outgoing()
        broken = ""
        if error is not None and not isinstance(error, OSError):
            broken = f"the link to {link.peer} for [{self.topic}] is broken: {printable(error, 1000)}"
        self._context.loop.call(_finish, ended, broken)


def _nothing() -> None:
    """Do nothing; returned by `add` if no message was latched."""


def _finish(ended: LinkEnd, broken: str) -> None:
    if not ended.done():
        ended.set_result(broken)
