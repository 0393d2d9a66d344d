"""A node's topics and services, by name, and their connections."""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics import one_thread
from pipros.basics.budget import Budget, Slots
from pipros.basics.errors import Interrupted, PiprosError
from pipros.basics.limits import Limits
from pipros.basics.ports import AdvertisedAddress
from pipros.net.address import uri
from pipros.net.busy_poll import PublishCount
from pipros.net.connection_table import ConnectionTable
from pipros.net.held_bytes import BODIES_BYTES, HeldBytes
from pipros.net.loop import BackgroundLoop
from pipros.net.tcpros import TcprosConnection, refuse_connection
from pipros.net.workers import Workers
from pipros.node.any_msg import AnyMsg, taking_raw
from pipros.node.attempts import Attempts
from pipros.node.context import NO_ARGS, NodeContext
from pipros.node.publication import Publication
from pipros.node.publisher import Publisher
from pipros.node.registration import (
    Entry,
    PublicationEntry,
    Registrations,
    ServiceEntry,
    SubscriptionEntry,
)
from pipros.node.service_connection import WAITING_THREADS
from pipros.node.service_server import ServiceClass, ServiceServer
from pipros.node.timings import NodeTimings

if TYPE_CHECKING:
    from pipros.msg.base import Message
    from pipros.node.subscriber import Subscriber
    from pipros.node.subscription import Callback, MessageObserver, SubscriberCallback, Subscription

CONNECTION_ATTEMPTS = 20
"""Limit: publishers that a node tries to connect to at the same time. Beyond it, further attempts wait;
attempts that take longer than a second do not count, unless they exceed ten times the limit.
"""


TOPICS_LISTED = 50
"""Maximum number of topics listed in the error if a subscriber requests an unknown topic."""


class TypeConflict(PiprosError):
    """A node uses a topic with two different types."""


class NameInUse(PiprosError):
    """A node already provides a service with this name."""


class Endpoints:
    """A node's publications, subscriptions and services. All names here are global.

    Attributes:
        port: the TCPROS port.
        address: the host and port at which peers reach the TCPROS port.
        local_name: the abstract socket name through which nodes on this machine reach this node by a Unix
            stream, or None.
        own_uri: the URI of the node's slave API if its publications pass messages directly to its own
            subscriptions; otherwise None.
    """

    def __init__(
        self,
        node_name: str,
        *,
        port: int,
        advertised: AdvertisedAddress,
        loop: BackgroundLoop,
        registrations: Registrations,
        log: logging.Logger,
        limits: Limits,
        connections: ConnectionTable,
        timings: NodeTimings,
    ) -> None:
        self.port = port
        self.address = advertised.outside(port)
        self.local_name: str | None = None
        self.own_uri: str | None = None
        numbers = itertools.count(1)
        self.attempts = Attempts(CONNECTION_ATTEMPTS, slow_s=timings.slow_attempt_s)
        self._context = NodeContext(
            node_name,
            loop,
            log,
            lambda: next(numbers),
            limits,
            connections,
            self.attempts,
            PublishCount(),
            PublishCount(),
            Budget(limits.shared_bytes),
            HeldBytes(limit_bytes=limits.frame_bytes, refusals=connections.refusals),
            set(),
            timings,
        )
        self.service_uri = uri(*self.address, "rosrpc")
        self._registrations = registrations
        self._publications: dict[str, tuple[Publication, Entry]] = {}
        self._subscriptions: dict[str, tuple[Subscription, Entry]] = {}
        self._services: dict[str, tuple[ServiceServer, Entry]] = {}
        self._workers = Workers(f"service of {node_name}", limits.service_threads)
        self._waiting_threads = Slots(WAITING_THREADS)
        self._unread = HeldBytes(limit_bytes=BODIES_BYTES, refusals=connections.refusals)
        self._observer: MessageObserver | None = None
        self._lock = threading.RLock()

    # -- queries ------------------------------------------------------------------

    @property
    def publications(self) -> Sequence[Publication]:
        return [publication for publication, _ in list(self._publications.values())]

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        return [subscription for subscription, _ in list(self._subscriptions.values())]

    def publication(self, topic: str) -> Publication | None:
        found = self._publications.get(topic)
        return found[0] if found else None

    def subscription(self, topic: str) -> Subscription | None:
        found = self._subscriptions.get(topic)
        return found[0] if found else None

    def service(self, name: str) -> ServiceServer | None:
        found = self._services.get(name)
        return found[0] if found else None

    def statistics(self) -> Mapping[str, Any]:
        """Return the links' statistics by kind (`publications` or `subscriptions`), topic, and peer."""
        return {
            "publications": {
                publication.topic: {peer.caller_id: peer.link.statistics for peer in publication.links}
                for publication in self.publications
            },
            "subscriptions": {
                subscription.topic: {peer.caller_id: peer.link.statistics for peer in subscription.links}
                for subscription in self.subscriptions
            },
        }

    # -- publishing ---------------------------------------------------------------

    def advertise(
        self,
        topic: str,
        message_class: type[Message],
        *,
        queue_size: int | None,
        latch: bool,
        headers: Mapping[str, str] | None = None,
    ) -> Publisher[Any]:
        """Return a new handle for a topic; the first handle registers the topic with the master.

        `headers` are additional fields for the connection headers that subscribers receive.

        Raises:
            TypeConflict: this node already publishes the topic with another type.
        """
        with self._lock:
            found = self._publications.get(topic)
            if found is None:
                publication = Publication(topic, message_class, self._context)
                entry = PublicationEntry(topic, publication.interface.type)
                self._publications[topic] = publication, entry
                if not one_thread.has_threads():
                    publication.publish = one_thread.publishing(publication.publish)  # type: ignore[assignment,method-assign]
            else:
                publication = found[0]
                _same_type(publication.interface.md5sum, message_class, topic)
            publication.handles += 1
            publication.is_latching = publication.is_latching or latch
            publication.headers.update(headers or {})
            publication.set_queue_size(queue_size)
            if found is None:
                self._join(publication, self.subscription(topic))
                self._registrations.add(entry)
        return Publisher(publication, self._release_publication)

    def _join(self, publication: Publication | None, subscription: Subscription | None) -> None:
        """Make the node's publication pass its messages directly to the node's subscription.

        If the message classes differ or are `AnyMsg`, messages are sent as between different nodes.
        """
        if self.own_uri is None or publication is None or subscription is None:
            return
        if publication.message_class is subscription.message_class is not AnyMsg:
            publication.hand_over_to(subscription.link_in_process(publication, self.own_uri))

    def restrict_publishing_to(self, thread: int) -> None:
        """Publish subsequent messages only if they come from `thread`; silently drop all others.

        Messages that bursts have collected are sent first.
        """
        for publication in self.publications:
            publication.only_thread = thread
            publication.flush()

    def _release_publication(self, publication: Publication) -> None:
        with self._lock:
            publication.handles -= 1
            if publication.handles == 0:
                self._registrations.remove(self._publications[publication.topic][1])
                publication.close()
                del self._publications[publication.topic]  # last, so that `close` never misses open links

    # -- subscribing ----------------------------------------------------------------

    def subscribe(
        self,
        topic: str,
        message_class: type[Message],
        callback: Callback | None,
        *,
        callback_args: object = NO_ARGS,
        queue_size: int | None,
        tcp_nodelay: bool,
        zero_copy: bool = False,
    ) -> Subscriber[Any]:
        """Add a callback to a topic and return its handle. See `Node.subscribe` for `zero_copy`.

        The first callback registers the topic with the master.

        If the node already receives the topic, the callback gets the last message from each connected
        latching publisher before this method returns. This also applies to a callback for `AnyMsg` if the
        node already decodes the topic's messages, as a tool that uses simulated time does for `/clock`.

        Raises:
            TypeConflict: this node already subscribes to the topic with another type.
        """
        # imported here because many nodes only publish
        from pipros.node.subscriber import Subscriber
        from pipros.node.subscription import SubscriberCallback, Subscription

        with self._lock:
            found = self._subscriptions.get(topic)
            if found is None:
                subscription = Subscription(topic, message_class, self._context)
                entry = SubscriptionEntry(topic, subscription.interface.type, subscription.ask_for_publishers)
                subscription.observe = self._observer
                self._subscriptions[topic] = subscription, entry
            else:
                subscription = found[0]
                _same_type(subscription.interface.md5sum, message_class, topic)
                if message_class is AnyMsg and subscription.message_class is not AnyMsg:
                    callback = taking_raw(callback)
            added = SubscriberCallback(callback, callback_args, zero_copy) if callback is not None else None
            subscription.handles += 1
            subscription.tcp_nodelay = subscription.tcp_nodelay or tcp_nodelay
            subscription.set_queue_size(queue_size)
            give_latched = subscription.add(added) if added is not None else None
            if found is None:
                self._join(self.publication(topic), subscription)
                self._registrations.add(entry)
        if give_latched is not None:
            give_latched()
        return Subscriber(subscription, added, self._release_subscription)

    def observe(self, observer: MessageObserver) -> None:
        """Call `observer` for each subsequent message on every subscribed topic, before the callbacks."""
        with self._lock:
            self._observer = observer
            for subscription, _ in self._subscriptions.values():
                subscription.observe = observer

    def ask_for_publishers(self, topic: str) -> None:
        """Register a subscription again, to get the publisher list from the master. Blocks."""
        if found := self._subscriptions.get(topic):
            self._registrations.renew(found[1])

    def _release_subscription(self, subscription: Subscription, added: SubscriberCallback | None) -> None:
        if added is not None:
            subscription.remove(added)
        with self._lock:
            subscription.handles -= 1
            if subscription.handles == 0:
                self._registrations.remove(self._subscriptions[subscription.topic][1])
                subscription.close()
                del self._subscriptions[subscription.topic]

    # -- serving ----------------------------------------------------------------------

    def serve(
        self,
        name: str,
        service_class: ServiceClass,
        handler: Callable[[Any], Message],
        on_error: Callable[[BaseException], object] | None,
    ) -> ServiceServer:
        """Start serving calls to a service.

        Raises:
            NameInUse: this node already provides a service with this name.
        """
        with self._lock:
            if name in self._services:
                raise NameInUse(f"service [{name}] already registered")
            server = ServiceServer(
                name,
                service_class,
                handler,
                self._context,
                on_error=on_error or self._log_handler_error,
                workers=self._workers,
                waiting_threads=self._waiting_threads,
                unread=self._unread,
            )
            entry = ServiceEntry(name, self.service_uri)
            self._services[name] = server, entry
            self._registrations.add(entry)
        return server

    def stop_serving(self, server: ServiceServer) -> None:
        """Unregister a service and close its connections. May be called repeatedly.

        Calls that are running are answered, if their clients are on this machine.
        """
        with self._lock:
            found = self._services.get(server.name)
            if found is not None and found[0] is server:
                self._registrations.remove(found[1])
                server.close(answers_running=True)
                del self._services[server.name]

    def _log_handler_error(self, error: BaseException) -> None:
        if isinstance(error, Interrupted):  # the node ends while the handler waits
            return
        self._context.log.error("Error processing request: %s", error, exc_info=error)

    # -- connections --------------------------------------------------------------------

    def attach(self, connection: TcprosConnection) -> None:
        """Pass a connection to the topic or service named in its header, or refuse the connection."""
        if not connection.fields:  # an empty header is not answered
            connection.sock.close()
            return
        topic, service = connection.fields.get("topic"), connection.fields.get("service")
        if topic is not None:
            if publication := self.publication(topic):
                publication.attach(connection)
                return
            listed = [
                [publication.topic, publication.interface.type]
                for publication in self.publications[:TOPICS_LISTED]
            ]
            reason = f"[{self._context.node_name}] is not a publisher of [{topic}]. Topics are {listed}"
        elif service is not None:
            if server := self.service(service):
                server.attach(connection)
                return
            reason = f"[{self._context.node_name}] does not provide the service [{service}]"
        else:
            reason = "no topic or service name detected"
        refuse_connection(connection.sock, reason)

    def close(self) -> None:
        """Close all links and connections.

        Endpoints that another thread adds in the meantime are not registered. The caller closes
        the node's ports afterwards.
        """
        end = time.monotonic() + self._context.timings.close_flush_s  # all topics share one deadline
        for publication in self.publications:
            publication.close(end)
        for subscription in self.subscriptions:
            subscription.close()
        for server, _ in list(self._services.values()):
            server.close()
        self._workers.close()


def _same_type(md5sum: str, message_class: type[Message], topic: str) -> None:
    if "*" not in (md5sum, message_class._md5sum) and md5sum != message_class._md5sum:
        raise TypeConflict(
            f"[{topic}] is already used with md5sum {md5sum} in this node, "
            f"but [{message_class._type}] has {message_class._md5sum}"
        )
