"""Subscribing: one `Subscription` a topic, and a `Subscriber` handle for each callback."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pipros.errors import PiprosError, ProtocolError, Refused, Unreachable
from pipros.net import reach, tcpros
from pipros.net.incoming import IncomingLink, Turn
from pipros.net.rpc_async import call_async
from pipros.node.context import NodeContext
from pipros.node.stream import MessageStream
from pipros.wire.handshake import Interface, check_topic_reply, request_topic_link

if TYPE_CHECKING:
    from pipros.msg.base import Message

AnyMessage = TypeVar("AnyMessage", bound="Message")

#: Waits between attempts to reach a publisher that the master still lists.
RETRY_FIRST_S = 0.1
RETRY_LONGEST_S = 5.0

#: How long a publisher may take to say where its topic is to be had.
REQUEST_DEADLINE_S = 10.0

Callback = Callable[..., object]

#: Is told of every arrival: topic, connection header, size in bytes, message.
Observer = Callable[[str, Mapping[str, str], int, Any], None]

#: Stands for "no callback_args": None is a value that a callback may be given.
NO_ARGS = object()


@dataclass(frozen=True, slots=True, eq=False)
class Listener:
    """One callback of a subscription, and the second argument that it gets, if any."""

    callback: Callback
    args: object = NO_ARGS


@dataclass(frozen=True, slots=True)
class SubscriberLink:
    """One publisher that a subscription receives from."""

    uri: str
    caller_id: str
    number: int
    link: IncomingLink


class Subscription:
    """All that a node receives on one topic, however many callbacks it has.

    The callbacks of a topic are called in the order they were added, one message after the
    other, also with several publishers: they may block, and block nobody but their own topic.
    An exception in one is logged; the others are still called.
    """

    def __init__(self, topic: str, message_class: type[Message], context: NodeContext) -> None:
        self.topic = topic
        self.message_class = message_class
        self.interface = Interface(message_class._type, message_class._md5sum, message_class._full_text)
        self.queue_size: int | None = None
        self.tcp_nodelay = False
        self.links: tuple[SubscriberLink, ...] = ()
        self.listeners: tuple[Listener, ...] = ()
        self.received = 0
        self.attempts = 0  # to reach a publisher
        self.handles = 0
        self.observe: Observer | None = None
        self._context = context
        self._decode = decoder(message_class)
        self._turn = Turn()
        self._lock = threading.Lock()
        self._publishers: set[str] = set()  # as the master lists them; owned by the event loop
        self._followed: dict[str, asyncio.Task[None]] = {}  # owned by the event loop
        self._is_closed = False

    # -- callbacks --------------------------------------------------------------

    def add(self, listener: Listener) -> None:
        with self._lock:
            self.listeners = (*self.listeners, listener)

    def remove(self, listener: Listener) -> None:
        with self._lock:
            self.listeners = tuple(one for one in self.listeners if one is not listener)

    def set_queue_size(self, queue_size: int | None) -> None:
        self.queue_size = queue_size
        for peer in self.links:
            peer.link.queue_size = queue_size

    def close(self) -> None:
        """Ends all links and looks for no others."""
        self._is_closed = True
        for listener in self.listeners:
            if isinstance(listener.callback, MessageStream):
                listener.callback.close()
        self._context.loop.call(self._follow_nobody)
        for peer in self.links:
            peer.link.close()

    # -- who publishes ------------------------------------------------------------

    def update_publishers(self, uris: Iterable[str]) -> None:
        """Takes over the master's list of publishers. Called in the event loop.

        A link to a publisher that is no longer listed stays until the publisher ends it: a
        master that has just been restarted does not know everybody yet.
        """
        self._publishers = set(uris)
        for uri in self._publishers - self._followed.keys():
            if not self._is_closed:
                self._followed[uri] = asyncio.ensure_future(self._follow(uri))

    def _follow_nobody(self) -> None:
        self._publishers = set()
        for task in self._followed.values():
            task.cancel()

    async def _follow(self, uri: str) -> None:
        """Keeps a link to one publisher for as long as the master lists it."""
        delay_s, said = RETRY_FIRST_S, ""
        try:
            while uri in self._publishers and not self._is_closed:
                self.attempts += 1
                try:
                    ended = await self._link(uri)
                except (PiprosError, ValueError) as error:  # ValueError: what it registered is no URI
                    if str(error) != said:  # each problem is explained once
                        said = str(error)
                        await self._explain(uri, error)
                    if isinstance(error, Refused):
                        return  # and will be until the publisher registers anew
                else:
                    await ended
                    delay_s, said = RETRY_FIRST_S, ""
                await asyncio.sleep(delay_s)
                delay_s = min(2 * delay_s, RETRY_LONGEST_S)
        finally:
            del self._followed[uri]

    async def _explain(self, uri: str, error: Exception) -> None:
        """Says what keeps a publisher from being heard, and what to do about it (ros_comm#222)."""
        advice = await reach.advice(error.peer) if isinstance(error, Unreachable) else ""
        if uri in self._publishers and not self._is_closed:  # not one that has left meanwhile
            self._context.log.warning(
                "cannot receive [%s] from the publisher at %s: %s%s", self.topic, uri, error, advice
            )

    async def _link(self, uri: str) -> asyncio.Future[None]:
        """Connects to a publisher. The future ends with the link."""
        host, port = await self._request(uri)
        wanted = request_topic_link(
            self.topic, self._context.node_name, self.interface, tcp_nodelay=self.tcp_nodelay
        )
        connection = await tcpros.connect(host, port, wanted)
        try:
            check_topic_reply(connection.fields, self.interface, f"{host}:{port}")
        except PiprosError:
            connection.sock.close()
            raise
        ended = asyncio.get_running_loop().create_future()
        header = dict(connection.fields)
        link = IncomingLink(
            connection.sock,
            name=f"topic {self.topic} from {header.get('callerid', uri)}",
            deliver=lambda frame: self._deliver(frame, header),
            turn=self._turn,
            queue_size=self.queue_size,
            on_closed=lambda link, error: self._detach(link, error, ended),
        )
        peer = SubscriberLink(uri, header.get("callerid", "?"), self._context.next_link_number(), link)
        with self._lock:
            self.links = (*self.links, peer)
        try:
            link.start(connection.rest)
        except RuntimeError as error:  # no more threads: some may end before the next attempt
            connection.sock.close()
            self._detach(link, None, ended)
            raise ProtocolError(str(error)) from error
        if self._is_closed:
            link.close()
        return ended

    async def _request(self, uri: str) -> tuple[str, int]:
        """Asks a publisher where its topic is to be had by TCPROS."""
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
        raise ProtocolError(f"requestTopic was answered with {answer!r:.200}")

    # -- messages -------------------------------------------------------------------

    def _deliver(self, frame: memoryview | bytes, header: Mapping[str, str]) -> None:
        try:
            message: Any = self._decode(frame)
        except Exception as error:
            raise ProtocolError(f"{len(frame)} bytes are no {self.interface.type}: {error}") from error
        message._connection_header = header
        self.received += 1
        if self.observe is not None:
            self.observe(self.topic, header, len(frame), message)
        for listener in self.listeners:
            try:
                if listener.args is NO_ARGS:
                    listener.callback(message)
                else:
                    listener.callback(message, listener.args)
            except Exception as error:
                self._context.log.error("bad callback: %s", listener.callback, exc_info=error)

    def _detach(self, link: IncomingLink, error: Exception | None, ended: asyncio.Future[None]) -> None:
        with self._lock:
            self.links = tuple(peer for peer in self.links if peer.link is not link)
        if error is not None and not self._is_closed and not isinstance(error, OSError):
            self._context.log.error("the link to %s for [%s] is broken: %s", link.peer, self.topic, error)
        self._context.loop.call(_finish, ended)


def decoder(message_class: type[Message]) -> Callable[[memoryview | bytes], Any]:
    """The quickest way from a frame to a message; genuine generated classes only take bytes."""
    from_bytes: Callable[[memoryview | bytes], Any] | None = getattr(message_class, "_from_bytes", None)
    if from_bytes is not None:
        return from_bytes
    return lambda frame: message_class().deserialize(bytes(frame))


def _finish(future: asyncio.Future[None]) -> None:
    if not future.done():
        future.set_result(None)


class Subscriber(Generic[AnyMessage]):
    """A handle on one callback of a topic. Made by `Node.subscribe`."""

    def __init__(
        self,
        subscription: Subscription,
        listener: Listener | None,
        release: Callable[[Subscription, Listener | None], None],
    ) -> None:
        self.subscription = subscription
        self._listener = listener
        self._release: Callable[[Subscription, Listener | None], None] | None = release

    @property
    def topic(self) -> str:
        return self.subscription.topic

    @property
    def connection_count(self) -> int:
        return len(self.subscription.links)

    def statistics(self) -> Mapping[str, int]:
        """Frames delivered and bytes received, and frames dropped because callbacks were too slow."""
        links = [peer.link.statistics for peer in self.subscription.links]
        return {
            "frames": sum(link.frames for link in links),
            "bytes": sum(link.bytes for link in links),
            "dropped": sum(link.dropped for link in links),
        }

    def unregister(self) -> None:
        """Ends the callback; with the last one the topic is unregistered. Harmless when repeated."""
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
