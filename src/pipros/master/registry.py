"""Who publishes, subscribes and serves what: the master's books, without any IO.

A node is known by its name, and has one API (the URI of its XML-RPC server) at a time. It exists
in the books as long as it has at least one registration. A call that changes something returns
the `Notice`s that the change calls for; somebody else delivers them.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

from pipros.master.params import as_namespace

ANY_TYPE = "*"
MASTER_ID = "/master"
REPLACED = "new node registered with same name"


@dataclass(frozen=True, slots=True)
class Notice:
    """One call that a node's API is to get.

    Attributes:
        node: the name of the node.
        api: where to call it; a node that has moved since is not called there any more.
        method: `publisherUpdate`, `paramUpdate` or `shutdown`.
        params: the parameters, the master's own caller_id first.
    """

    node: str
    api: str
    method: str
    params: tuple[Any, ...]


class Role(Enum):
    """In which of the three tables a registration stands."""

    PUBLISHER = "publisher"
    SUBSCRIBER = "subscriber"
    SERVICE = "service"
    PARAM_SUBSCRIBER = "parameter subscriber"


@dataclass(slots=True)
class NodeEntry:
    """What one node has registered. The sets are ordered (dictionaries without values).

    Attributes:
        heard: how often the node has registered something, known or new.
    """

    name: str
    api: str
    heard: int = 0
    names: dict[Role, dict[str, None]] = field(default_factory=lambda: {role: {} for role in Role})

    @property
    def is_empty(self) -> bool:
        return not any(self.names.values())


class RegistryJournal(Protocol):
    """Is told of every change of the books, in order. Must not block."""

    def registered(self, role: Role, node: str, key: str, api: str, service_api: str | None) -> None: ...

    def unregistered(self, role: Role, node: str, key: str) -> None: ...

    def typed(self, topic: str, type_name: str) -> None: ...


class Registry:
    """The books of one master. Not for use from several threads at once.

    Names of topics, services and nodes come in resolved and checked; they are keys here, no more.

    A process whose name went to a newer one is `leaving` until it was told to shut down. Meanwhile nothing
    that it registers is entered: a roscpp node subscribes to a parameter when it logs that it was told, and
    would so take its name back and end its successor.

    Attributes:
        leaving: name and API of the processes that were replaced and have not been told yet.
    """

    def __init__(self) -> None:
        self.journal: RegistryJournal | None = None
        self.nodes: dict[str, NodeEntry] = {}
        self.leaving: set[tuple[str, str]] = set()
        self.topic_types: dict[str, str] = {}
        self._tables: dict[Role, dict[str, dict[str, None]]] = {role: {} for role in Role}
        self._service_apis: dict[str, str] = {}
        self._param_namespaces: list[str] = []  # the subscribed keys, each with a slash behind, sorted

    # ---- reading

    def api_of(self, node: str) -> str | None:
        """The API of a node; None when it has nothing registered."""
        entry = self.nodes.get(node)
        return entry.api if entry else None

    def service_api_of(self, service: str) -> str | None:
        """The `rosrpc://` URI of a service; None when nobody offers it."""
        return self._service_apis.get(service)

    def names_of(self, role: Role, key: str) -> list[str]:
        """The nodes that stand under a topic, service or parameter key, first come first."""
        return list(self._tables[role].get(key, ()))

    def apis_of(self, role: Role, key: str) -> list[str]:
        """The APIs of those nodes."""
        return [self.nodes[name].api for name in self._tables[role].get(key, ())]

    def keys_of(self, role: Role) -> Iterator[str]:
        """The topics, services or parameter keys that have somebody."""
        return iter(self._tables[role])

    def param_keys_around(self, key: str) -> list[str]:
        """The parameter keys at, above and below `key` that somebody has subscribed to."""
        subscribed = self._tables[Role.PARAM_SUBSCRIBER]
        if not subscribed:
            return []
        parts = key.rstrip("/").split("/")
        above = ("/".join(parts[:count]) or "/" for count in range(1, len(parts)))
        namespace = as_namespace(key)
        start = bisect_left(self._param_namespaces, namespace)
        end = bisect_left(self._param_namespaces, namespace[:-1] + "0", start)  # "0" comes after "/"
        below = (found.rstrip("/") or "/" for found in self._param_namespaces[start:end])
        return [*(found for found in above if found in subscribed), *below]

    def table(self, role: Role) -> list[list[Any]]:
        """`[key, [node, …]]` for every key, as `getSystemState` has it."""
        return [[key, list(names)] for key, names in self._tables[role].items()]

    # ---- changing

    def register_publisher(self, node: str, topic: str, type_name: str, api: str) -> list[Notice]:
        """Enters a publisher; tells the subscribers, also when it was there before."""
        notices = self._enter(Role.PUBLISHER, node, topic, api)
        if type_name != ANY_TYPE or topic not in self.topic_types:
            self._set_type(topic, type_name)
        notices += self._publisher_updates(topic)
        return notices

    def register_subscriber(self, node: str, topic: str, type_name: str, api: str) -> list[Notice]:
        """Enters a subscriber. Its type is noted only when none is known yet."""
        notices = self._enter(Role.SUBSCRIBER, node, topic, api)
        if type_name != ANY_TYPE and topic not in self.topic_types:
            self._set_type(topic, type_name)
        return notices

    def register_service(self, node: str, service: str, service_api: str, api: str) -> list[Notice]:
        """Enters the one provider of a service; an earlier provider silently loses it."""
        if (node, api) in self.leaving:
            return []
        notices = self._enter(Role.SERVICE, node, service, api, service_api)
        for former in self.names_of(Role.SERVICE, service):
            if former != node:
                self._remove(Role.SERVICE, former, service)
        return notices

    def subscribe_param(self, node: str, key: str, api: str) -> list[Notice]:
        """Enters a node that wants to hear of changes at and below a parameter key."""
        return self._enter(Role.PARAM_SUBSCRIBER, node, key, api)

    def unregister(self, role: Role, node: str, key: str, api: str) -> tuple[bool, list[Notice]]:
        """Takes one registration out. Nothing happens when `api` is not the node's present one."""
        if self.api_of(node) != api or node not in self._tables[role].get(key, ()):
            return False, []
        self._remove(role, node, key)
        return True, self._publisher_updates(key) if role is Role.PUBLISHER else []

    def unregister_service(self, node: str, service: str, service_api: str) -> bool:
        """Takes a service out. Nothing happens when it has moved to another provider meanwhile."""
        if self._service_apis.get(service) != service_api:
            return False
        if node not in self._tables[Role.SERVICE].get(service, ()):
            return False
        self._remove(Role.SERVICE, node, service)
        return True

    def remove_node(self, node: str) -> list[Notice]:
        """Takes all registrations of a node out, and tells the subscribers of its topics."""
        entry = self.nodes.get(node)
        if entry is None:
            return []
        published = list(entry.names[Role.PUBLISHER])
        for role in Role:
            for key in list(entry.names[role]):
                self._remove(role, node, key)
        return [notice for topic in published for notice in self._publisher_updates(topic)]

    def dealt_with(self, notice: Notice) -> None:
        """A notice was delivered, or is not going to be."""
        if notice.method == "shutdown":
            self.leaving.discard((notice.node, notice.api))

    def restore(self, role: Role, node: str, key: str, api: str, service_api: str | None) -> None:
        """Enters what was known before a crash of the master. Nobody needs to be told."""
        self._enter(role, node, key, api, service_api)

    def restore_type(self, topic: str, type_name: str) -> None:
        """The type of a topic that was known before a crash."""
        self._set_type(topic, type_name)

    def _set_type(self, topic: str, type_name: str) -> None:
        if self.journal and self.topic_types.get(topic) != type_name:
            self.journal.typed(topic, type_name)
        self.topic_types[topic] = type_name

    def _enter(
        self, role: Role, node: str, key: str, api: str, service_api: str | None = None
    ) -> list[Notice]:
        notices: list[Notice] = []
        if (node, api) in self.leaving:
            return notices
        entry = self.nodes.get(node)
        if entry and entry.api != api:
            reason = f"[{node}] Reason: {REPLACED}"
            notices.append(Notice(node, entry.api, "shutdown", (MASTER_ID, reason)))
            self.leaving.add((node, entry.api))
            notices += self.remove_node(node)
            entry = None
        if entry is None:
            entry = self.nodes[node] = NodeEntry(node, api)
        entry.heard += 1
        if self.journal and (key not in entry.names[role] or role is Role.SERVICE):
            self.journal.registered(role, node, key, api, service_api)
        entry.names[role][key] = None
        if role is Role.PARAM_SUBSCRIBER and key not in self._tables[role]:
            insort(self._param_namespaces, as_namespace(key))
        self._tables[role].setdefault(key, {})[node] = None
        if service_api is not None:
            self._service_apis[key] = service_api
        return notices

    def _remove(self, role: Role, node: str, key: str) -> None:
        nodes_here = self._tables[role][key]
        del nodes_here[node]
        if not nodes_here:
            del self._tables[role][key]
            if role is Role.SERVICE:
                del self._service_apis[key]
            elif role is Role.PARAM_SUBSCRIBER:
                del self._param_namespaces[bisect_left(self._param_namespaces, as_namespace(key))]
        if self.journal:
            self.journal.unregistered(role, node, key)
        entry = self.nodes[node]
        del entry.names[role][key]
        if entry.is_empty:
            del self.nodes[node]

    def _publisher_updates(self, topic: str) -> list[Notice]:
        subscribers = self._tables[Role.SUBSCRIBER].get(topic)
        if not subscribers:
            return []
        params = (MASTER_ID, topic, self.apis_of(Role.PUBLISHER, topic))
        return [Notice(name, self.nodes[name].api, "publisherUpdate", params) for name in subscribers]


def param_updates(
    registry: Registry, changes: Iterable[tuple[str, str, Any]], *, except_node: str
) -> Iterator[Notice]:
    """The notices for changed parameters, as `params.changes_for` lists them, one's own changes left out.

    They are made as they are taken, and tell who stands in the books then.
    """
    for subscribed, key, value in changes:
        params = (MASTER_ID, key, value)  # one for all, so that it is encoded once
        for name in registry.names_of(Role.PARAM_SUBSCRIBER, subscribed):
            if name != except_node:
                yield Notice(name, registry.nodes[name].api, "paramUpdate", params)
