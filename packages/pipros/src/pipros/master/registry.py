"""A master's registrations: the publishers, subscribers and servers for each name.

A node is identified by its name, and has one API (the URI of its XML-RPC server) at a time. It is registered
as long as it has at least one registration. A method that changes the registry returns the `Notice`s about
the change; the `Notifier` delivers them. This module performs no I/O.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final, NamedTuple, Protocol

from pipros.basics import names
from pipros.basics.errors import PiprosError

REGISTRATIONS_BYTES = 128 * 1024 * 1024
"""Limit: the names, types and URIs of all registrations of a master together. Beyond it, the registration is
refused; a registration counts with the size of its names, URIs and type plus 256 bytes.
"""
TOPIC_TYPES = 10_000
"""Limit: types that a master keeps for topics that have neither publishers nor subscribers. Beyond it, the
type of the topic that has been unused longest is discarded.
"""
TOPIC_TYPE_BYTES = 1024 * 1024
"""Limit: the names and types of all these topics together. Beyond it, the type of the topic that has been
unused longest is discarded.
"""

ANY_TYPE = "*"
MASTER_ID = "/master"
REGISTRATION_BYTES: Final = 256
"""The weight of a registration, in addition to its text."""


class Notice(NamedTuple):
    """One call to send to a node.

    Attributes:
        node: the node's name.
        api: the URI to call. An update is dropped if, before the call is made, the node is no longer
            registered with this URI; a `shutdown` is dropped if another process, or none, responds there.
        method: `publisherUpdate`, `paramUpdate` or `shutdown`.
        params: the arguments of the call, beginning with the master's own caller_id.
    """

    node: str
    api: str
    method: str
    params: tuple[Any, ...]


class RegistryFull(PiprosError, ValueError):
    """A registration would exceed the master's limit `REGISTRATIONS_BYTES`."""


class Role(Enum):
    """The kinds of registrations."""

    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"
    SERVICE = "service"
    PARAM_SUBSCRIBER = "parameter subscriber"


@dataclass(slots=True, eq=False, repr=False)
class NodeEntry:
    """One node's registrations.

    Attributes:
        registration_count: number of times the node has registered, including repetitions.
        names: the topics, services and parameter keys that the node has registered, by role, in order of
            registration. (A dictionary without values serves as an ordered set.)
    """

    name: str
    api: str
    registration_count: int = 0
    names: dict[Role, dict[str, None]] = field(default_factory=lambda: {role: {} for role in Role})

    @property
    def is_empty(self) -> bool:
        return not any(self.names.values())


class RegistryJournal(Protocol):
    """Receives every change of a registry, in order. Its methods must not block.

    A protocol because its implementation, `Store`, imports this module.
    """

    def registered(self, role: Role, node: str, key: str, api: str, service_api: str | None) -> None: ...

    def unregistered(self, role: Role, node: str, key: str) -> None: ...

    def type_set(self, topic: str, type_name: str) -> None: ...

    def type_forgotten(self, topic: str) -> None: ...


class Registry:
    """One master's registrations. Not thread-safe.

    The caller must resolve and check the names of topics, services and nodes.

    A node that registers with the name of another process takes over the name. The other process is
    `replaced` until its `shutdown` notice has been delivered or dropped. Its registrations are ignored in the
    meantime: a roscpp node subscribes to a parameter when it logs the shutdown request, and would thus take
    its name back and shut down its successor.

    As in genuine masters, a topic's type is kept after the last publisher and subscriber have unregistered,
    but only for as many unused topics as the limits allow. The type that has been unused for longest is
    forgotten first.

    If all registrations together would exceed `REGISTRATIONS_BYTES`, the methods that register raise
    `RegistryFull` and change nothing.

    Attributes:
        replaced: names and APIs of processes that have lost their names but have not been shut down yet.
        held_bytes: approximate memory used by all registrations and topic types.
    """

    def __init__(self) -> None:
        """Create an empty registry."""
        self.held_bytes = 0
        self._unused_types = UnusedTypes()
        self.journal: RegistryJournal | None = None
        self.nodes: dict[str, NodeEntry] = {}
        self.replaced: set[tuple[str, str]] = set()
        self.topic_types: dict[str, str] = {}
        self._tables: dict[Role, dict[str, dict[str, None]]] = {role: {} for role in Role}
        self._service_apis: dict[str, str] = {}
        self._param_namespaces: list[str] = []  # the subscribed keys, sorted, each with a trailing slash

    # ---- reading

    def api_of(self, node: str) -> str | None:
        """Return the API of a node, or None if the node is not registered."""
        entry = self.nodes.get(node)
        return entry.api if entry else None

    def service_api_of(self, service: str) -> str | None:
        """Return the `rosrpc://` URI of a service, or None if no node offers the service."""
        return self._service_apis.get(service)

    def names_of(self, role: Role, key: str) -> list[str]:
        """Return the nodes registered for a topic, service or parameter key, in order of registration."""
        return list(self._tables[role].get(key, ()))

    def apis_of(self, role: Role, key: str) -> list[str]:
        """Return the APIs of the nodes that `names_of` returns."""
        return [self.nodes[name].api for name in self._tables[role].get(key, ())]

    def keys_of(self, role: Role) -> Iterator[str]:
        """Return an iterator over the topics, services or parameter keys that have a registered node."""
        return iter(self._tables[role])

    def param_keys_around(self, key: str) -> list[str]:
        """Return the subscribed parameter keys at, above and below `key`."""
        subscribed = self._tables[Role.PARAM_SUBSCRIBER]
        if not subscribed:
            return []
        parts = key.rstrip("/").split("/")
        above = ("/".join(parts[:count]) or "/" for count in range(1, len(parts)))
        namespace = names.as_namespace(key)
        start = bisect_left(self._param_namespaces, namespace)
        end = bisect_left(self._param_namespaces, namespace[:-1] + "0", start)  # "0" comes after "/"
        below = (found.rstrip("/") or "/" for found in self._param_namespaces[start:end])
        return [*(found for found in above if found in subscribed), *below]

    def table(self, role: Role) -> list[list[Any]]:
        """Return `[key, [node, …]]` for every key, as in the response to `getSystemState`."""
        return [[key, list(names)] for key, names in self._tables[role].items()]

    # ---- changing

    def register_publisher(self, node: str, topic: str, type_name: str, api: str) -> list[Notice]:
        """Register a publisher. Subscribers are notified even if it was already registered."""
        self._check_limit(Role.PUBLISHER, node, topic, api, type_name, self.topic_types.get(topic))
        notices = self._enter(Role.PUBLISHER, node, topic, api)
        if type_name != ANY_TYPE or topic not in self.topic_types:
            self._set_type(topic, type_name)
        notices += self._publisher_updates(topic)
        return notices

    def register_subscriber(self, node: str, topic: str, type_name: str, api: str) -> list[Notice]:
        """Register a subscriber. Its type is used only if the topic has no type yet."""
        self._check_limit(Role.SUBSCRIBER, node, topic, api, type_name, self.topic_types.get(topic))
        notices = self._enter(Role.SUBSCRIBER, node, topic, api)
        if type_name != ANY_TYPE and topic not in self.topic_types:
            self._set_type(topic, type_name)
        return notices

    def register_service(self, node: str, service: str, service_api: str, api: str) -> list[Notice]:
        """Register the provider of a service. An earlier provider is silently replaced."""
        if (node, api) in self.replaced:
            return []
        self._check_limit(Role.SERVICE, node, service, api, service_api, self._service_apis.get(service))
        notices = self._enter(Role.SERVICE, node, service, api, service_api)
        for former in self.names_of(Role.SERVICE, service):
            if former != node:
                self._remove(Role.SERVICE, former, service)
        return notices

    def subscribe_param(self, node: str, key: str, api: str) -> list[Notice]:
        """Subscribe a node to changes at, above and below a parameter key."""
        self._check_limit(Role.PARAM_SUBSCRIBER, node, key, api)
        return self._enter(Role.PARAM_SUBSCRIBER, node, key, api)

    def unregister(self, role: Role, node: str, key: str, api: str) -> tuple[bool, list[Notice]]:
        """Remove a registration if `api` is the node's API.

        Return whether a registration was removed, and the notices.
        """
        if self.api_of(node) != api or node not in self._tables[role].get(key, ()):
            return False, []
        self._remove(role, node, key)
        return True, self._publisher_updates(key) if role is Role.PUBLISHER else []

    def unregister_service(self, node: str, service: str, service_api: str) -> bool:
        """Remove a service unless another provider has taken it over. Return whether it was removed."""
        if self._service_apis.get(service) != service_api:
            return False
        if node not in self._tables[Role.SERVICE].get(service, ()):
            return False
        self._remove(Role.SERVICE, node, service)
        return True

    def remove_node(self, node: str) -> list[Notice]:
        """Remove all registrations of a node. Return the notices to the subscribers of its topics."""
        entry = self.nodes.get(node)
        if entry is None:
            return []
        published = list(entry.names[Role.PUBLISHER])
        for role in Role:
            for key in list(entry.names[role]):
                self._remove(role, node, key)
        return [notice for topic in published for notice in self._publisher_updates(topic)]

    def notice_done(self, notice: Notice) -> None:
        """Record that a notice was delivered or dropped."""
        if notice.method == "shutdown":
            self.replaced.discard((notice.node, notice.api))

    def restore(self, role: Role, node: str, key: str, api: str, service_api: str | None) -> None:
        """Restore a registration from a previous run of the master, without notifying any node."""
        self._enter(role, node, key, api, service_api)

    def restore_type(self, topic: str, type_name: str) -> None:
        """Restore a topic's type from a previous run of the master."""
        self._set_type(topic, type_name)

    def _set_type(self, topic: str, type_name: str) -> None:
        former = self.topic_types.get(topic)
        if former == type_name:
            return
        if self.journal:
            self.journal.type_set(topic, type_name)
        self.held_bytes += len(type_name) - len(former or "")
        self.topic_types[topic] = type_name
        self._note_unused(topic)

    def _check_limit(
        self, role: Role, node: str, key: str, api: str, detail: str = "", former: str | None = None
    ) -> None:
        """Raise `RegistryFull` if a registration would exceed the limit.

        Args:
            detail: the type or URI.
            former: the type or URI that `detail` replaces.
        """
        growth = len(detail) - len(former or "")
        entry = self.nodes.get(node)
        if not entry or entry.api != api or key not in entry.names[role]:
            growth += _weight(node, key, api)
        if growth > 0 and self.held_bytes + growth > REGISTRATIONS_BYTES:
            raise RegistryFull(
                f"this would bring the master's registrations to {self.held_bytes + growth} bytes; "
                f"the limit is {REGISTRATIONS_BYTES}"
            )

    def _note_unused(self, topic: str) -> None:
        """Allow the type of a topic to be forgotten if the topic has no nodes left."""
        type_name = self.topic_types.get(topic)
        if type_name is None or any(topic in self._tables[role] for role in _ROLES_WITH_TYPES):
            return
        for forgotten in self._unused_types.add(topic, type_name):
            self.held_bytes -= len(self.topic_types.pop(forgotten))
            if self.journal:
                self.journal.type_forgotten(forgotten)

    def _enter(
        self, role: Role, node: str, key: str, api: str, service_api: str | None = None
    ) -> list[Notice]:
        notices: list[Notice] = []
        if (node, api) in self.replaced:
            return notices
        entry = self.nodes.get(node)
        if entry and entry.api != api:
            reason = f"[{node}] Reason: {names.REPLACED}"
            notices.append(Notice(node, entry.api, "shutdown", (MASTER_ID, reason)))
            self.replaced.add((node, entry.api))
            notices += self.remove_node(node)
            entry = None
        if entry is None:
            entry = self.nodes[node] = NodeEntry(node, api)
        entry.registration_count += 1
        is_new = key not in entry.names[role]
        if self.journal and (is_new or role is Role.SERVICE):
            self.journal.registered(role, node, key, api, service_api)
        if is_new:
            self.held_bytes += _weight(node, key, api)
            entry.names[role][key] = None
            if role in _ROLES_WITH_TYPES:
                self._unused_types.remove(key)
        if role is Role.PARAM_SUBSCRIBER and key not in self._tables[role]:
            insort(self._param_namespaces, names.as_namespace(key))
        self._tables[role].setdefault(key, {})[node] = None
        if service_api is not None:
            self.held_bytes += len(service_api) - len(self._service_apis.get(key, ""))
            self._service_apis[key] = service_api
        return notices

    def _remove(self, role: Role, node: str, key: str) -> None:
        nodes = self._tables[role][key]
        del nodes[node]
        if not nodes:
            del self._tables[role][key]
            if role is Role.SERVICE:
                self.held_bytes -= len(self._service_apis.pop(key))
            elif role is Role.PARAM_SUBSCRIBER:
                del self._param_namespaces[bisect_left(self._param_namespaces, names.as_namespace(key))]
        if self.journal:
            self.journal.unregistered(role, node, key)
        entry = self.nodes[node]
        del entry.names[role][key]
        self.held_bytes -= _weight(node, key, entry.api)
        if entry.is_empty:
            del self.nodes[node]
        if not nodes and role in _ROLES_WITH_TYPES:
            self._note_unused(key)

    def _publisher_updates(self, topic: str) -> list[Notice]:
        subscribers = self._tables[Role.SUBSCRIBER].get(topic)
        if not subscribers:
            return []
        params = (MASTER_ID, topic, self.apis_of(Role.PUBLISHER, topic))
        return [Notice(name, self.nodes[name].api, "publisherUpdate", params) for name in subscribers]


_ROLES_WITH_TYPES: Final = (Role.PUBLISHER, Role.SUBSCRIBER)


def _weight(node: str, key: str, api: str) -> int:
    """Return the approximate size of a registration in bytes: its strings and their dictionary entries."""
    return REGISTRATION_BYTES + len(node) + len(key) + len(api)


class UnusedTypes:
    """Topics with a known type but no publishers or subscribers, ordered by when they became unused.

    >>> unused = UnusedTypes()
    >>> unused.add("/a", "x/Y"), unused.add("/b", "x" * TOPIC_TYPE_BYTES)
    ([], ['/a', '/b'])
    """

    def __init__(self) -> None:
        self._bytes_of: dict[str, int] = {}
        self._bytes = 0

    def add(self, topic: str, type_name: str) -> list[str]:
        """Add a topic that became unused; return the topics whose types must be discarded."""
        self.remove(topic)
        self._bytes_of[topic] = size = len(topic) + len(type_name)
        self._bytes += size
        forgotten = []
        while len(self._bytes_of) > TOPIC_TYPES or self._bytes > TOPIC_TYPE_BYTES:
            oldest = next(iter(self._bytes_of))
            self.remove(oldest)
            forgotten.append(oldest)
        return forgotten

    def remove(self, topic: str) -> None:
        """Remove a topic that is in use again, or whose type was discarded."""
        self._bytes -= self._bytes_of.pop(topic, 0)
