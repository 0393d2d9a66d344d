"""Subscribing: one `Subscription` per topic, and a `Subscriber` handle per callback."""

from __future__ import annotations

import asyncio
import functools
import threading
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Generic

from pipros.errors import LimitExceeded, PiprosError, ProtocolError, Unreachable
from pipros.net import tcpros
from pipros.net.incoming import DeliveryLock, IncomingLink, ReceiveStatistics
from pipros.net.rpc_async_client import call_async
from pipros.net.workers import interpreter_ends
from pipros.node.asyncio_support import MessageStream
from pipros.node.codec import AnyMessage, decoder
from pipros.node.context import NodeContext
from pipros.node.latch import LastMessage, LatchedFirst
from pipros.node.publisher_connector import LinkEnd, PublisherConnector
from pipros.printable import printable
from pipros.wire.handshake import WireType, check_topic_reply, request_topic_link

if TYPE_CHECKING:
    from pipros.msg.base import Message


REQUEST_DEADLINE_S = 10.0
"""How long a publisher may take to answer `requestTopic`."""

Callback = Callable[..., object]

MessageObserver = Callable[[str, Mapping[str, str], int, Any], None]
"""Called for every message that arrives: topic, connection header, size in bytes, message."""

NO_ARGS = object()
"""Stands for "no callback_args": None is a value that a callback may be given."""


@dataclass(frozen=True, slots=True, eq=False)
class SubscriberCallback:
    """One callback of a subscription, and the second argument that it gets, if any."""

    callback: Callback
    args: object = NO_ARGS
    stands_for: SubscriberCallback | None = None  # while that one has not had the latched messages


@dataclass(frozen=True, slots=True)
class SubscriberLink:
    """One publisher that a subscription receives from."""

    uri: str
    caller_id: str
    number: int
    link: IncomingLink
    last: LastMessage | None  # of a publisher that latches


class Subscription:
    """All that a node receives on one topic, however many callbacks it has.

    The callbacks of a topic are called in the order they were added, one message after the
    other, also with several publishers: they may block, which delays their own topic only.
    An exception in one is logged; the others are still called.
    """

    def __init__(self, topic: str, message_class: type[Message], context: NodeContext) -> None:
        self.topic = topic
        self.message_class = message_class
        self.interface = WireType(message_class._type, message_class._md5sum, message_class._full_text)
        self.queue_size: int | None = None
        self.tcp_nodelay = False
        self.links: tuple[SubscriberLink, ...] = ()
        self.listeners: tuple[SubscriberCallback, ...] = ()
        self.links_ended = 0
        self._taken = ReceiveStatistics()  # by links that have ended
        self.handles = 0
        self.observe: MessageObserver | None = None
        self._context = context
        self._decode = decoder(message_class)
        self._turn = DeliveryLock()
        self._lock = threading.Lock()
        self._connector = PublisherConnector(topic, context, self._link)
        self._announcements = 0  # changed in the event loop only
        self._is_closed = False

    # -- callbacks --------------------------------------------------------------

    def add(self, listener: SubscriberCallback) -> Callable[[], object]:
        """Has a callback called from now on.

        Call the returned function next, without holding a lock: it calls back with the last message of each
        connected publisher that latches, before newer ones.
        """
        with self._lock:
            latched = [
                peer.last.message for peer in self.links if peer.last and peer.last.message is not None
            ]
            if not latched:
                self.listeners = (*self.listeners, listener)
                return _nothing
            first = LatchedFirst(latched, lambda message: self._call_back(listener, message))
            stand_in = SubscriberCallback(first, stands_for=listener)
            self.listeners = (*self.listeners, stand_in)

        def give_latched() -> None:
            first.give()
            with self._lock:
                self.listeners = tuple(listener if item is stand_in else item for item in self.listeners)

        return give_latched

    def remove(self, listener: SubscriberCallback) -> None:
        with self._lock:
            self.listeners = tuple(item for item in self.listeners if listener not in (item, item.stands_for))

    def set_queue_size(self, queue_size: int | None) -> None:
        self.queue_size = queue_size
        for peer in self.links:
            peer.link.queue_size = queue_size

    def close(self) -> None:
        """Ends all links and makes no others."""
        self._is_closed = True
        for listener in self.listeners:
            if isinstance(listener.callback, MessageStream):
                listener.callback.close()
        self._context.loop.call(self._connector.stop)
        for peer in self.links:
            peer.link.close()

    # -- publishers ---------------------------------------------------------------

    def update_publishers(self, uris: Iterable[str]) -> None:
        """Takes over a list of publishers that the master announces. Called in the event loop."""
        self._announcements += 1
        self._connector.update(uris)

    def ask_for_publishers(self) -> Callable[[Iterable[str]], object]:
        """To be called before the master is asked; the result takes its answer, in any thread.

        A list that the master announces meanwhile is newer: its answer, which may lack a publisher that came
        just then, does not replace it.
        """
        before = self._announcements

        def update(uris: Iterable[str]) -> None:
            if self._announcements == before:
                self._connector.update(uris)

        return lambda uris: self._context.loop.call(update, uris)

    @property
    def attempts(self) -> int:
        """How many attempts to reach a publisher were made."""
        return self._connector.attempts

    async def _link(self, uri: str) -> LinkEnd:
        """Connects to a publisher.

        Raises:
            PiprosError: the publisher is out of reach, refuses or violates the protocol; no room for a link.
            ValueError: what it registered is not a URI.
        """
        connections, limits = self._context.connections, self._context.limits
        if not connections.reserve_outgoing(limits.incoming_links):
            raise LimitExceeded("this node has as many connections as its limits allow")
        ended: LinkEnd = asyncio.get_running_loop().create_future()
        try:
            connection = await self._connect(uri)
            link = self._start(uri, connection, ended)
        except BaseException:
            connections.release_outgoing()
            raise
        if self._is_closed:
            link.close()
        return ended

    async def _connect(self, uri: str) -> tcpros.TcprosConnection:
        host, port = await self._request(uri)
        wanted = request_topic_link(
            self.topic, self._context.node_name, self.interface, tcp_nodelay=self.tcp_nodelay
        )
        connection = await tcpros.connect(host, port, wanted, limits=self._context.limits)
        try:
            check_topic_reply(connection.fields, self.interface, f"{host}:{port}")
        except PiprosError:
            connection.sock.close()
            raise
        return connection

    def _start(self, uri: str, connection: tcpros.TcprosConnection, ended: LinkEnd) -> IncomingLink:
        header = dict(connection.fields)
        last = LastMessage() if header.get("latching") == "1" else None
        link = IncomingLink(
            connection.sock,
            name=f"topic {self.topic} from {header.get('callerid', uri)}",
            deliver=functools.partial(self._deliver, header, last),
            turn=self._turn,
            queue_size=self.queue_size,
            on_closed=lambda link, error: self._detach(link, error, ended),
            published=self._context.published,
            limit_bytes=self._context.limits.frame_bytes,
            received=connection.rest,
        )
        peer = SubscriberLink(uri, header.get("callerid", "?"), self._context.next_link_number(), link, last)
        with self._lock:
            self.links = (*self.links, peer)
        try:
            link.start()
        except RuntimeError as error:  # no more threads: some may end before the next attempt
            connection.sock.close()
            self._remove_link(link)
            if interpreter_ends(error):
                raise asyncio.CancelledError from error
            raise ProtocolError(str(error)) from error
        return link

    async def _request(self, uri: str) -> tuple[str, int]:
        """Asks a publisher for the TCPROS address of its topic."""
        answer = await call_async(
            uri,
            "requestTopic",
            self._context.node_name,
            self.topic,
            [["TCPROS"]],
            timeout_s=REQUEST_DEADLINE_S,
        )
        match answer:
            case [1, _, ["TCPROS", str(host), int(port)]]:
                return host, port
            case [int(code), str(text), _]:
                raise Unreachable(
                    uri, f"it does not offer the topic ({text})" if code != 1 else "it offers no TCPROS"
                )
        raise ProtocolError(f"requestTopic was answered with {printable(answer)}")

    # -- messages -------------------------------------------------------------------

    def _deliver(
        self, header: Mapping[str, str], last: LastMessage | None, frame: memoryview | bytes
    ) -> None:
        try:
            message: Any = self._decode(frame)
        except Exception as error:
            raise ProtocolError(f"{len(frame)} bytes are not a {self.interface.type}: {error}") from error
        message._connection_header = header
        if last is None:
            listeners = self.listeners
        else:
            with self._lock:  # a callback that is added now gets the message from `last` or with the others
                last.message = message
                listeners = self.listeners
        if self.observe is not None:
            try:
                self.observe(self.topic, header, len(frame), message)
            except Exception:
                self._context.log.exception("what observes [%s] failed", self.topic)
        for listener in listeners:
            try:
                if listener.args is NO_ARGS:
                    listener.callback(message)
                else:
                    listener.callback(message, listener.args)
            except Exception as error:
                self._log_bad_callback(listener, error)

    def _call_back(self, listener: SubscriberCallback, message: Any) -> None:
        """As the loop above, which a call for each message would slow down."""
        try:
            listener.callback(*(message, listener.args) if listener.args is not NO_ARGS else (message,))
        except Exception as error:
            self._log_bad_callback(listener, error)

    def _log_bad_callback(self, listener: SubscriberCallback, error: Exception) -> None:
        self._context.log.error("bad callback: %s", listener.callback, exc_info=error)

    def _remove_link(self, link: IncomingLink) -> None:
        with self._lock:
            self.links = tuple(peer for peer in self.links if peer.link is not link)
            self.links_ended += 1
            self._taken.add(link.statistics)

    def statistics(self) -> dict[str, int]:
        """See `Subscriber.statistics`."""
        total = ReceiveStatistics()
        with self._lock:
            total.add(self._taken)
            for peer in self.links:
                total.add(peer.link.statistics)
            return {**asdict(total), "links_ended": self.links_ended}

    def _detach(self, link: IncomingLink, error: Exception | None, ended: LinkEnd) -> None:
        self._remove_link(link)
        self._context.connections.release_outgoing()
        broken = ""
        if error is not None and not isinstance(error, OSError):
            broken = f"the link to {link.peer} for [{self.topic}] is broken: {printable(error, 1000)}"
        self._context.loop.call(_finish, ended, broken)


def _nothing() -> None:
    """Returned by `add` when nothing was latched."""


def _finish(ended: LinkEnd, broken: str) -> None:
    if not ended.done():
        ended.set_result(broken)


class Subscriber(Generic[AnyMessage]):
    """A handle on one callback of a topic. Made by `Node.subscribe`."""

    def __init__(
        self,
        subscription: Subscription,
        listener: SubscriberCallback | None,
        release: Callable[[Subscription, SubscriberCallback | None], None],
    ) -> None:
        self.subscription = subscription
        self._listener = listener
        self._release: Callable[[Subscription, SubscriberCallback | None], None] | None = release

    @property
    def topic(self) -> str:
        return self.subscription.topic

    @property
    def connection_count(self) -> int:
        return len(self.subscription.links)

    def statistics(self) -> Mapping[str, int]:
        """What this node did with the topic since the first `subscribe`, for all publishers together.

        `frames` delivered and `bytes` received; frames `dropped` because callbacks were too slow, or one of
        them could not be read; `links_ended`: each may have cost what was under way.
        """
        return self.subscription.statistics()

    def unregister(self) -> None:
        """Ends the callback; with the last one the topic is unregistered. May be repeated."""
        release, self._release = self._release, None
        if release is not None:
            release(self.subscription, self._listener)
            if self._listener is not None and isinstance(self._listener.callback, MessageStream):
                self._listener.callback.close()

    def __aiter__(self) -> AsyncIterator[AnyMessage]:
        """The messages, for a subscriber that was made in an asyncio loop without a callback.

        Raises:
            TypeError: for any other subscriber.
        """
        if self._listener is None or not isinstance(self._listener.callback, MessageStream):
            raise TypeError(f"[{self.topic}] was subscribed to with a callback, or outside an event loop")
        return self._listener.callback
