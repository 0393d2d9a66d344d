"""`rosmaster.registrations`: registrations of nodes; a facade of `pipros.master.registry`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Protocol

from pipros.basics.lazy_names import star_names as _star_names
from pipros.master.registry import ANY_TYPE, Notice, Registry, Role
from rosmaster.exceptions import InternalException
from rosmaster.util import remove_server_proxy as remove_server_proxy
from rosmaster.util import xmlrpcapi as xmlrpcapi

_star_names(__name__, "rosmaster")

_ROLES = {1: Role.SUBSCRIBER, 2: Role.PUBLISHER, 3: Role.SERVICE, 4: Role.PARAM_SUBSCRIBER}

Unregistered = tuple[int, str, int]


class ThreadPool(Protocol):
    """Interface for running tasks with the same marker one after another."""

    def queue_task(self, marker: str, task: Any, args: Any = None) -> object: ...


def shutdown_node_task(api: str, caller_id: str, reason: str) -> None:
    """Ask a node to shut down. Errors are ignored."""
    import contextlib
    from xmlrpc.client import Error

    with contextlib.suppress(OSError, Error):
        xmlrpcapi(api).shutdown("/master", f"[{reason}] Reason: new node registered with same name")  # type: ignore[union-attr]
    del caller_id
    remove_server_proxy(api)


class NodeRef:
    """A node and its registered names."""

    def __init__(self, id: str, api: str) -> None:  # noqa: A002  # its name in rosmaster
        self.id = id
        self.api = api
        self.param_subscriptions: list[str] = []
        self.topic_subscriptions: list[str] = []
        self.topic_publications: list[str] = []
        self.services: list[str] = []

    def add(self, type_: int, key: str) -> None:
        """Add a name. `type_` is one of the type numbers in `Registrations`.

        Raises:
            Exception: `type_` is not one of these numbers.
        """
        names = self._names(type_)
        if key not in names:
            names.append(key)

    def remove(self, type_: int, key: str) -> None:
        """Remove a name. Raises the same errors as `add`, and ValueError if the name is not registered."""
        self._names(type_).remove(key)

    def clear(self) -> None:
        """Remove all names."""
        for type_ in _ROLES:
            self._names(type_).clear()

    def is_empty(self) -> bool:
        return not any(self._names(type_) for type_ in _ROLES)

    def _names(self, type_: int) -> list[str]:
        names = {
            Registrations.TOPIC_SUBSCRIPTIONS: self.topic_subscriptions,
            Registrations.TOPIC_PUBLICATIONS: self.topic_publications,
            Registrations.SERVICE: self.services,
            Registrations.PARAM_SUBSCRIPTIONS: self.param_subscriptions,
        }
        if type_ not in names:
            raise Exception(
                f"type must be one of {sorted(names)}, got {type_}"
            )  # users of rosmaster catch this class
        return names[type_]


class Registrations:
    """Registrations of one type, keyed by the name of the topic, service or parameter."""

    TOPIC_SUBSCRIPTIONS = 1
    TOPIC_PUBLICATIONS = 2
    SERVICE = 3
    PARAM_SUBSCRIPTIONS = 4

    def __init__(self, type_: int, registry: Registry | None = None) -> None:
        """Use `registry`, which other types may share, or create a registry. (`registry` is not in Noetic.)

        Raises:
            rosmaster.exceptions.InternalException: `type_` is not one of the four type numbers.
        """
        if type_ not in _ROLES:
            raise InternalException(f"invalid registration type: {type_}")
        self.type = type_
        self._role = _ROLES[type_]
        self._registry = Registry() if registry is None else registry

    @property
    def map(self) -> Mapping[str, list[tuple[str, str]]]:
        """The nodes registered for each name, as `(caller_id, api)`."""
        return {key: self._nodes(key) for key in self._registry.keys_of(self._role)}

    @property
    def service_api_map(self) -> Mapping[str, str] | None:
        """The URI of each service, or None for other types."""
        if self._role is not Role.SERVICE:
            return None
        return {key: str(self._registry.service_api_of(key)) for key in self._registry.keys_of(self._role)}

    def __bool__(self) -> bool:
        return bool(self.map)

    def __contains__(self, key: str) -> bool:
        return key in self.map

    def __getitem__(self, key: str) -> list[tuple[str, str]]:
        return self._nodes(key)

    def has_key(self, key: str) -> bool:
        return key in self

    def iterkeys(self) -> Iterator[str]:
        return self._registry.keys_of(self._role)

    def get_service_api(self, service: str) -> str | None:
        """Return the URI of a service, or None if the service is not registered."""
        return self._registry.service_api_of(service)

    def get_apis(self, key: str) -> list[str]:
        """Return the URIs of the nodes registered for a name."""
        return self._registry.apis_of(self._role, key)

    def get_state(self) -> list[list[Any]]:
        """Return `[name, [caller_id, …]]` for each name."""
        return self._registry.table(self._role)

    def register(self, key: str, caller_id: str, caller_api: str, service_api: str | None = None) -> None:
        """Register a node for a name.

        Raises:
            rosmaster.exceptions.InternalException: `service_api` is missing for a service, or given for
                another type.
        """
        self.enter(key, caller_id, caller_api, service_api)

    def enter(self, key: str, caller_id: str, caller_api: str, service_api: str | None) -> list[Notice]:
        """Register a node, and return the notifications for other nodes; see `register`. (Not in Noetic.)"""
        if (self._role is Role.SERVICE) != bool(service_api):
            raise InternalException(
                f"service_api must be given if and only if this is a service, got {service_api!r} for {key}"
            )
        match self._role:
            case Role.SERVICE:
                return self._registry.register_service(caller_id, key, str(service_api), caller_api)
            case Role.PUBLISHER:
                return self._registry.register_publisher(caller_id, key, ANY_TYPE, caller_api)
            case Role.SUBSCRIBER:
                return self._registry.register_subscriber(caller_id, key, ANY_TYPE, caller_api)
            case _:
                return self._registry.subscribe_param(caller_id, key, caller_api)

    def unregister(
        self, key: str, caller_id: str, caller_api: str | None, service_api: str | None = None
    ) -> Unregistered:
        """Remove a registration. Return `(1, status message, number of removed registrations)`."""
        if self._role is Role.SERVICE:
            is_done = self._registry.unregister_service(caller_id, key, str(service_api))
        else:
            is_done, _ = self._registry.unregister(self._role, caller_id, key, str(caller_api))
        if is_done:
            return 1, f"Unregistered [{caller_id}] as provider of [{key}]", 1
        if self._role is Role.SERVICE:
            return 1, f"[{service_api}] is no longer the current service api handle for [{key}]", 0
        return 1, f"[{caller_id}] is not a known provider of [{key}]", 0

    def unregister_all(self, caller_id: str) -> None:
        """Remove all registrations of a node."""
        api = self._registry.api_of(caller_id)
        for key in list(self.iterkeys()):
            if caller_id not in self._registry.names_of(self._role, key):
                continue
            if self._role is Role.SERVICE:
                self._registry.unregister_service(caller_id, key, str(self.get_service_api(key)))
            else:
                self._registry.unregister(self._role, caller_id, key, str(api))

    def _nodes(self, key: str) -> list[tuple[str, str]]:
        names = self._registry.names_of(self._role, key)
        return list(zip(names, self._registry.apis_of(self._role, key), strict=True))


class RegistrationManager:
    """All registrations with a master."""

    def __init__(self, thread_pool: ThreadPool | None, registry: Registry | None = None) -> None:
        """Create empty registrations, unless `registry` is given.

        If another node takes over a node's name, `thread_pool` shuts the old node down. If `thread_pool` is
        None, the old node keeps running.
        """
        self.thread_pool = thread_pool
        self._registry = Registry() if registry is None else registry
        self.publishers = Registrations(Registrations.TOPIC_PUBLICATIONS, self._registry)
        self.subscribers = Registrations(Registrations.TOPIC_SUBSCRIPTIONS, self._registry)
        self.services = Registrations(Registrations.SERVICE, self._registry)
        self.param_subscribers = Registrations(Registrations.PARAM_SUBSCRIPTIONS, self._registry)

    @property
    def nodes(self) -> Mapping[str, NodeRef]:
        """The nodes, by name."""
        return {name: self._reference(name) for name in self._registry.nodes}

    def get_node(self, caller_id: str) -> NodeRef | None:
        return self._reference(caller_id) if caller_id in self._registry.nodes else None

    def reverse_lookup(self, caller_api: str) -> NodeRef | None:
        """Return the node with the given URI, or None."""
        names = [name for name, node in self._registry.nodes.items() if node.api == caller_api]
        return self._reference(names[0]) if names else None

    def register_publisher(self, topic: str, caller_id: str, caller_api: str) -> None:
        self._shut_down_replaced(self.publishers.enter(topic, caller_id, caller_api, None))

    def register_subscriber(self, topic: str, caller_id: str, caller_api: str) -> None:
        self._shut_down_replaced(self.subscribers.enter(topic, caller_id, caller_api, None))

    def register_service(self, service: str, caller_id: str, caller_api: str, service_api: str) -> None:
        self._shut_down_replaced(self.services.enter(service, caller_id, caller_api, service_api))

    def register_param_subscriber(self, param: str, caller_id: str, caller_api: str) -> None:
        self._shut_down_replaced(self.param_subscribers.enter(param, caller_id, caller_api, None))

    def unregister_publisher(self, topic: str, caller_id: str, caller_api: str) -> Unregistered:
        return self._unregister(self.publishers, topic, caller_id, caller_api)

    def unregister_subscriber(self, topic: str, caller_id: str, caller_api: str) -> Unregistered:
        return self._unregister(self.subscribers, topic, caller_id, caller_api)

    def unregister_service(self, service: str, caller_id: str, service_api: str) -> Unregistered:
        return self._unregister(self.services, service, caller_id, None, service_api)

    def unregister_param_subscriber(self, param: str, caller_id: str, caller_api: str) -> Unregistered:
        return self._unregister(self.param_subscribers, param, caller_id, caller_api)

    def _unregister(
        self,
        registrations: Registrations,
        key: str,
        caller_id: str,
        caller_api: str | None,
        service_api: str | None = None,
    ) -> Unregistered:
        if caller_id not in self._registry.nodes:
            return 1, f"[{caller_id}] is not a registered node", 0
        return registrations.unregister(key, caller_id, caller_api, service_api)

    def _shut_down_replaced(self, notices: Iterable[Notice]) -> None:
        for notice in notices:
            if notice.method == "shutdown":
                if self.thread_pool is not None:
                    args = notice.api, notice.node, notice.params[-1]
                    self.thread_pool.queue_task(notice.api, shutdown_node_task, args)
                self._registry.notice_done(notice)

    def _reference(self, name: str) -> NodeRef:
        node = self._registry.nodes[name]
        reference = NodeRef(name, node.api)
        for type_, role in _ROLES.items():
            for key in node.names[role]:
                reference.add(type_, key)
        return reference
