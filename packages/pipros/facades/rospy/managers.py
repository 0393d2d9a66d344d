"""The node's topic and service managers, as in `rospy.impl.registration`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pipros.node.registration import Entry, PublicationEntry, ServiceEntry, SubscriptionEntry
from rospy.listeners import RegistrationListeners
from rospy.session import session

if TYPE_CHECKING:
    from pipros.msg.base import Message
    from pipros.node import Node
    from pipros.node.slave import SlaveApi
    from rospy.service import Service
    from rospy.topic_impl import PublisherImpl, SubscriberImpl, TopicImpl

RegistrationCallback = Callable[[str, str, str], object]


class TopicManager:
    """The node's publications and subscriptions.

    Attributes:
        lock: a lock for callers that make several changes atomically. The node does not use this lock.
    """

    def __init__(self) -> None:
        self.lock = threading.Condition()
        self._held: list[tuple[str, str, Any]] = []

    @property
    def closed(self) -> bool:
        """Whether the node has started to shut down."""
        return session.is_shutdown

    @property
    def pubs(self) -> Mapping[str, PublisherImpl]:
        """The publishing side of each topic."""
        from rospy.topic_impl import impls

        node = session.node
        publications = node.endpoints.publications if node else ()
        return {publication.topic: impls.of_publication(publication) for publication in publications}

    @property
    def subs(self) -> Mapping[str, SubscriberImpl]:
        """The receiving side of each topic."""
        from rospy.topic_impl import impls

        node = session.node
        subscriptions = node.endpoints.subscriptions if node else ()
        return {subscription.topic: impls.of_subscription(subscription) for subscription in subscriptions}

    @property
    def topics(self) -> set[str]:
        """The names of all topics that the node publishes or subscribes to."""
        return {*self.pubs, *self.subs}

    def get_topics(self) -> set[str]:
        """Return the names of all topics that the node publishes or subscribes to."""
        return self.topics

    def get_pub_sub_info(self) -> list[list[Any]]:
        """Return the connections in the format of the slave API's `getBusInfo`."""
        return list(_slave(session.node).get_bus_info("")[2]) if session.node is not None else []

    def get_pub_sub_stats(self) -> tuple[list[Any], list[Any]]:
        """Return the connections' traffic in the format of the slave API's `getBusStats`."""
        if session.node is None:
            return [], []
        published, subscribed, _ = _slave(session.node).get_bus_stats("")[2]
        return published, subscribed

    def get_publications(self) -> list[list[str]]:
        """Return `[topic, type]` for each topic that the node publishes."""
        return [[topic, one.type] for topic, one in self.pubs.items()]

    def get_subscriptions(self) -> list[list[str]]:
        """Return `[topic, type]` for each topic that the node subscribes to."""
        return [[topic, one.type] for topic, one in self.subs.items()]

    def has_publication(self, resolved_name: str) -> bool:
        return resolved_name in self.pubs

    def has_subscription(self, resolved_name: str) -> bool:
        return resolved_name in self.subs

    def get_publisher_impl(self, resolved_name: str) -> PublisherImpl | None:
        return self.pubs.get(resolved_name)

    def get_subscriber_impl(self, resolved_name: str) -> SubscriberImpl | None:
        return self.subs.get(resolved_name)

    def get_impl(self, reg_type: str, resolved_name: str) -> TopicImpl | None:
        """Return the publishing (`pub`) or receiving (`sub`) side of a topic, or None if it does not exist.

        Raises:
            TypeError: `reg_type` is neither `pub` nor `sub`.
        """
        if reg_type == "pub":
            return self.get_publisher_impl(resolved_name)
        if reg_type == "sub":
            return self.get_subscriber_impl(resolved_name)
        raise TypeError(f"invalid reg_type: {reg_type}")

    def acquire_impl(self, reg_type: str, resolved_name: str, data_class: type[Message]) -> TopicImpl | None:
        """Advertise or subscribe to a topic until `release_impl` is called.

        Return the same object as `get_impl`.
        """
        if session.node is not None and not session.is_shutdown:
            endpoints = session.node.endpoints
            handle: Any
            if reg_type == "pub":
                handle = endpoints.advertise(resolved_name, data_class, queue_size=None, latch=False)
            else:
                handle = endpoints.subscribe(
                    resolved_name, data_class, None, queue_size=None, tcp_nodelay=False
                )
            self._held.append((reg_type, resolved_name, handle))
        return self.get_impl(reg_type, resolved_name)

    def release_impl(self, reg_type: str, resolved_name: str) -> None:
        """Undo one call to `acquire_impl`. Do nothing if all calls have already been undone."""
        for held in self._held:
            if held[:2] == (reg_type, resolved_name):
                self._held.remove(held)
                held[2].unregister()
                return

    def check_all(self) -> None:
        """Do nothing, because pipros links detect lost peers themselves."""

    def close_all(self) -> None:
        """Release everything acquired with `acquire_impl`.

        Other topics are closed when the node shuts down.
        """
        while self._held:
            self._held.pop()[2].unregister()


class ServiceManager:
    """The node's services.

    Attributes:
        map: the services by name.
        registration_listeners: listeners that are notified of the services registered with this manager.
    """

    def __init__(self, registration_listeners: RegistrationListeners | None = None) -> None:
        self.lock = threading.RLock()
        self.registration_listeners = registration_listeners or RegistrationListeners()
        self._own: dict[str, Service] = {}

    @property
    def map(self) -> Mapping[str, Service]:
        return {**session.services, **self._own}

    def get_services(self) -> list[tuple[str, Any]]:
        """Return `(name, class)` for each service."""
        return [(name, service.service_class) for name, service in self.map.items()]

    def get_service(self, resolved_service_name: str) -> Service | None:
        return self.map.get(resolved_service_name)

    def register(self, resolved_service_name: str, service: Service) -> None:
        """Add a running service to the list.

        Raises:
            ServiceException: the name is already registered.
        """
        from rospy.service import ServiceException

        with self.lock:
            if resolved_service_name in self.map:
                raise ServiceException(f"service [{resolved_service_name}] already registered")
            self._own[resolved_service_name] = service
        self.registration_listeners.notify_added(resolved_service_name, str(service.uri), "srv")

    def unregister(self, resolved_service_name: str, service: Service) -> None:
        """Remove a service from the list, unless its name now belongs to another service."""
        with self.lock:
            if self._own.get(resolved_service_name) is not service:
                return
            del self._own[resolved_service_name]
        self.registration_listeners.notify_removed(resolved_service_name, str(service.uri), "srv")

    def unregister_all(self, reason: str = "") -> None:
        """Shut all services down."""
        for service in list(self.map.values()):
            service.shutdown(reason)
        self._own.clear()


class Managers:
    """The process's managers, and the listeners for registrations."""

    def __init__(self) -> None:
        self.topics: Any = TopicManager()
        self.services: Any = ServiceManager()
        self._is_watching = False

    def watch(self, added: RegistrationCallback, removed: RegistrationCallback) -> None:
        """Call `added` or `removed` for each change, with a name, a type (for a service, its URI) and a kind.

        Only the first call of `watch` has an effect.
        """
        if self._is_watching:
            return
        self._is_watching = True

        def notify(entry: Entry, is_added: bool) -> None:
            described = _described(entry)
            if described is not None:
                (added if is_added else removed)(*described)

        session.when_started(lambda node: node.registrations.observe(notify))


def _described(entry: Entry) -> tuple[str, str, str] | None:
    if isinstance(entry, PublicationEntry):
        return entry.topic, entry.type, "pub"
    if isinstance(entry, SubscriptionEntry):
        return entry.topic, entry.type, "sub"
    if isinstance(entry, ServiceEntry):
        return entry.service, entry.service_uri, "srv"
    return None


def _slave(node: Node) -> SlaveApi:
    from pipros.node.slave import SlaveApi

    return SlaveApi(node, node.environment.master_uri)


managers = Managers()
