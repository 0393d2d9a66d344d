"""The state shared by all publishers or all subscribers of a topic in this process, with Noetic's names."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

from pipros.node.context import NO_ARGS
from pipros.node.peers import PeerListener
from pipros.node.publication import Publication
from pipros.node.subscription import SubscriberCallback, Subscription
from rospy.session import session

if TYPE_CHECKING:
    from pipros.msg.base import Message

Callback = Callable[..., object]


@dataclass(frozen=True, slots=True)
class TopicConnection:
    """One topic connection.

    Attributes:
        id: number of the connection in this process, as reported by the slave API.
        direction: `i` if the peer is a publisher, `o` if it is a subscriber.
        endpoint_id: the caller ID of a subscriber, or the URI of a publisher.
        callerid_pub: the caller ID of the publisher.
    """

    id: int
    direction: str
    endpoint_id: str
    callerid_pub: str


class TopicImpl:
    """Base class of the publishing and the receiving side of a topic.

    Attributes:
        resolved_name: the topic's global name; `name` is the same.
        type: for example, `std_msgs/String`.
        data_class: the message class.
    """

    def __init__(self, topic: str, data_class: type[Message]) -> None:
        self.resolved_name = self.name = topic
        self.type = data_class._type
        self.data_class = data_class

    @property
    def connections(self) -> list[TopicConnection]:
        """The current connections, in a new list."""
        raise NotImplementedError

    def get_num_connections(self) -> int:
        return len(self.connections)

    def has_connections(self) -> bool:
        return bool(self.connections)

    def has_connection(self, endpoint_id: str) -> bool:
        """Return whether a peer is connected.

        Subscribers are identified by caller ID, publishers by URI.
        """
        return any(connection.endpoint_id == endpoint_id for connection in self.connections)


class PublisherImpl(TopicImpl):
    """The publishing side of a topic."""

    def __init__(self, publication: Publication) -> None:
        super().__init__(publication.topic, publication.message_class)
        self._publication = publication

    @property
    def connections(self) -> list[TopicConnection]:
        """The current connections, in a new list."""
        links = self._publication.links
        return [TopicConnection(link.number, "o", link.caller_id, session.name) for link in links]

    @property
    def is_latch(self) -> bool:
        return self._publication.is_latching

    @property
    def subscriber_listeners(self) -> list[PeerListener]:
        """The listeners for subscribers that connect or disconnect. Callers may modify the list."""
        return self._publication.listeners

    def add_subscriber_listener(self, listener: PeerListener) -> None:
        """Add a listener for subscribers that connect or disconnect."""
        self._publication.listeners.append(listener)


class SubscriberImpl(TopicImpl):
    """The receiving side of a topic."""

    def __init__(self, subscription: Subscription) -> None:
        super().__init__(subscription.topic, subscription.message_class)
        self._subscription = subscription

    @property
    def connections(self) -> list[TopicConnection]:
        """The current connections, in a new list."""
        return [
            TopicConnection(link.number, "i", link.uri, link.caller_id) for link in self._subscription.links
        ]

    @property
    def callbacks(self) -> list[tuple[Callback, Any]]:
        """`(function, args)` for each callback, in a new list.

        `args` is None if the callback has no arguments.
        """
        entries = [each.stands_for or each for each in self._subscription.callbacks]
        return [(each.callback, None if each.args is NO_ARGS else each.args) for each in entries]

    def add_callback(self, cb: Callback, cb_args: Any) -> None:
        """Call `cb` with each message, and with `cb_args` unless it is None.

        Before this method returns, `cb` is called with the last message from each connected latching
        publisher.
        """
        self._subscription.add(SubscriberCallback(cb, NO_ARGS if cb_args is None else cb_args))()

    def remove_callback(self, cb: Callback, cb_args: Any) -> None:
        """Remove the first callback with this function and these arguments.

        Raises:
            KeyError: the callback is not registered.
        """
        args = NO_ARGS if cb_args is None else cb_args
        entries = [each.stands_for or each for each in self._subscription.callbacks]
        for entry in entries:
            if entry.callback == cb and entry.args == args:
                self._subscription.remove(entry)
                return
        raise KeyError("no matching cb")

    def receive_callback(self, msgs: Iterable[Message], connection: object) -> None:  # noqa: ARG002
        """Call all callbacks with each message. pipros does not call this for messages that arrive."""
        for message in msgs:
            for callback, args in self.callbacks:
                callback(message) if args is None else callback(message, args)


class Impls:
    """The shared state of each publication and subscription, kept while a handle refers to it."""

    def __init__(self) -> None:
        self._publishers: WeakValueDictionary[Publication, PublisherImpl] = WeakValueDictionary()
        self._subscribers: WeakValueDictionary[Subscription, SubscriberImpl] = WeakValueDictionary()

    def of_publication(self, publication: Publication) -> PublisherImpl:
        return self._publishers.setdefault(publication, PublisherImpl(publication))

    def of_subscription(self, subscription: Subscription) -> SubscriberImpl:
        return self._subscribers.setdefault(subscription, SubscriberImpl(subscription))


impls = Impls()
