"""The Master API and the Parameter Server API, whose methods return `[code, text, value]`.

http://wiki.ros.org/ROS/Master_API and http://wiki.ros.org/ROS/Parameter%20Server%20API describe the methods.
Status messages, checks and corner cases match genuine rosmaster; a test in tests/interop compares the two.
This module performs no I/O.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final

from pipros.basics import names
from pipros.basics.names import NAME_CHARACTERS
from pipros.master.arguments import CALLER_ERROR, INTERNAL, SUCCESS, Answer, CallArguments
from pipros.master.params import NotATree, NotSet, ParamsFull, ParamTree, TooDeep, value_below
from pipros.master.registry import MASTER_ID, Notice, Registry, Role

_log = logging.getLogger("rosmaster.master")

_LOGGED_AS: Final = {
    Role.PUBLISHER: "PUB",
    Role.SUBSCRIBER: "SUB",
    Role.SERVICE: "SERVICE",
    Role.PARAM_SUBSCRIBER: "CACHEDPARAM",
}


class MasterApi:
    """Handles calls from nodes and tools, using the registry and the parameter tree.

    `methods` is the method table for an `RpcServer`. The notices that a call causes are passed to `notify`,
    in order, before the response is returned; `notify` may deliver them later.
    """

    def __init__(
        self,
        registry: Registry,
        params: ParamTree,
        *,
        notify: Callable[[Iterable[Notice]], None],
        shutdown: Callable[[str], bool],
    ) -> None:
        """Create the method table.

        Args:
            notify: delivers notices.
            shutdown: function that stops the master, given the reason; returns False if the caller is not
                allowed to stop it.
            limits: defaults to the process-wide limits.
        """
        self.uri = ""
        self.arguments = CallArguments(NAME_CHARACTERS)
        self._registry = registry
        self._params = params
        self._notify = notify
        self._shutdown = shutdown
        # name: (method, value in an error response)
        table: dict[str, tuple[Callable[..., Answer], Any]] = {
            "getPid": (self._get_pid, -1),
            "getUri": (self._get_uri, ""),
            "shutdown": (self._shut_down, 0),
            "registerPublisher": (self._register_publisher, []),
            "unregisterPublisher": (self._unregister_publisher, 0),
            "registerSubscriber": (self._register_subscriber, []),
            "unregisterSubscriber": (self._unregister_subscriber, 0),
            "registerService": (self._register_service, 0),
            "unregisterService": (self._unregister_service, 0),
            "lookupNode": (self._lookup_node, ""),
            "lookupService": (self._lookup_service, ""),
            "getTopicTypes": (self._get_topic_types, []),
            "getPublishedTopics": (self._get_published_topics, 0),
            "getSystemState": (self._get_system_state, [[], [], []]),
            "getParam": (self._get_param, 0),
            "setParam": (self._set_param, 0),
            "hasParam": (self._has_param, False),
            "deleteParam": (self._delete_param, 0),
            "searchParam": (self._search_param, 0),
            "getParamNames": (self._get_param_names, []),
            "subscribeParam": (self._subscribe_param, 0),
            "unsubscribeParam": (self._unsubscribe_param, 0),
        }
        self.methods = {
            name: self.arguments.guarded(name, method, value) for name, (method, value) in table.items()
        }

    # ---- the master itself

    def _get_pid(self, _caller: str) -> Answer:
        return [SUCCESS, "", os.getpid()]

    def _get_uri(self, _caller: str) -> Answer:
        return [SUCCESS, "", self.uri]

    def _shut_down(self, caller: str, reason: object) -> Answer:
        if caller == MASTER_ID:  # a peer has registered this address with another master, as that of a node
            return [CALLER_ERROR, "a master does not accept shutdown from a master", 0]
        if not self._shutdown(str(reason)):
            return [CALLER_ERROR, "shutdown is only accepted from this machine", 0]
        return [SUCCESS, "shutdown", 0]

    # ---- registrations

    def _register_publisher(self, caller: str, topic: object, type_name: object, api: object) -> Answer:
        topic = self.arguments.topic(topic, caller)
        type_name = self.arguments.topic_type(type_name)
        api = self.arguments.api_uri("caller_api", api)
        self._notify(self._registry.register_publisher(caller, topic, type_name, api))
        self._log_entry(Role.PUBLISHER, topic, caller, api)
        subscribers = self._registry.apis_of(Role.SUBSCRIBER, topic)
        return [SUCCESS, f"Registered [{caller}] as publisher of [{topic}]", subscribers]

    def _unregister_publisher(self, caller: str, topic: object, api: object) -> Answer:
        return self._unregister(Role.PUBLISHER, caller, self.arguments.topic(topic, caller), api)

    def _register_subscriber(self, caller: str, topic: object, type_name: object, api: object) -> Answer:
        topic = self.arguments.topic(topic, caller)
        type_name = self.arguments.topic_type(type_name)
        api = self.arguments.api_uri("caller_api", api)
        self._notify(self._registry.register_subscriber(caller, topic, type_name, api))
        self._log_entry(Role.SUBSCRIBER, topic, caller, api)
        publishers = self._registry.apis_of(Role.PUBLISHER, topic)
        return [SUCCESS, f"Subscribed to [{topic}]", publishers]

    def _unregister_subscriber(self, caller: str, topic: object, api: object) -> Answer:
        return self._unregister(Role.SUBSCRIBER, caller, self.arguments.topic(topic, caller), api)

    def _unregister(self, role: Role, caller: str, key: str, api: object) -> Answer:
        api = self.arguments.api_uri("caller_api", api)
        if self._registry.api_of(caller) is None:
            return [SUCCESS, f"[{caller}] is not a registered node", 0]
        was_there, notices = self._registry.unregister(role, caller, key, api)
        if not was_there:
            return [SUCCESS, f"[{caller}] is not a known provider of [{key}]", 0]
        _log.info("-%s [%s] %s %s", _LOGGED_AS[role], key, caller, api)
        self._notify(notices)
        return [SUCCESS, f"Unregistered [{caller}] as provider of [{key}]", 1]

    def _log_entry(self, role: Role, key: str, caller: str, api: str) -> None:
        kind = _LOGGED_AS[role]
        if self._registry.api_of(caller) != api:
            _log.info(
                "%s [%s] of %s %s ignored: that process was replaced",
                kind,
                key,
                caller,
                api,
            )
        elif role is Role.PARAM_SUBSCRIBER:
            _log.info("+%s [%s] by %s", kind, key, caller)
        else:
            _log.info("+%s [%s] %s %s", kind, key, caller, api)

    def _register_service(self, caller: str, service: object, service_api: object, api: object) -> Answer:
        service = self.arguments.service(service, caller)
        service_api = self.arguments.api_uri("service_api", service_api)
        api = self.arguments.api_uri("caller_api", api)
        self._notify(self._registry.register_service(caller, service, service_api, api))
        self._log_entry(Role.SERVICE, service, caller, api)
        return [SUCCESS, f"Registered [{caller}] as provider of [{service}]", 1]

    def _unregister_service(self, caller: str, service: object, service_api: object) -> Answer:
        service = self.arguments.service(service, caller)
        service_api = self.arguments.api_uri("service_api", service_api)
        if self._registry.api_of(caller) is None:
            return [SUCCESS, f"[{caller}] is not a registered node", 0]
        if self._registry.unregister_service(caller, service, service_api):
            _log.info("-SERVICE [%s] %s %s", service, caller, service_api)
            return [SUCCESS, f"Unregistered [{caller}] as provider of [{service}]", 1]
        text = f"[{service_api}] is no longer the current service api handle for [{service}]"
        return [SUCCESS, text, 0]

    # ---- the graph

    def _lookup_node(self, caller: str, node: object) -> Answer:
        node = self.arguments.resolved("node", node, caller)
        api = self._registry.api_of(node)
        if api is None:
            return [CALLER_ERROR, f"unknown node [{node}]", ""]
        return [SUCCESS, "node api", api]

    def _lookup_service(self, caller: str, service: object) -> Answer:
        api = self._registry.service_api_of(self.arguments.service(service, caller))
        if api is None:
            return [CALLER_ERROR, "no provider", ""]
        return [SUCCESS, f"rosrpc URI: [{api}]", api]

    def _get_topic_types(self, _caller: str) -> Answer:
        return [SUCCESS, "current system state", [list(pair) for pair in self._registry.topic_types.items()]]

    def _get_published_topics(self, caller: str, subgraph: object) -> Answer:
        below = self.arguments.subgraph(subgraph, caller)
        types = self._registry.topic_types
        return [
            SUCCESS,
            "current topics",
            [
                [topic, types[topic]]
                for topic in self._registry.keys_of(Role.PUBLISHER)
                if topic.startswith(below)
            ],
        ]

    def _get_system_state(self, _caller: str) -> Answer:
        roles = (Role.PUBLISHER, Role.SUBSCRIBER, Role.SERVICE)
        return [SUCCESS, "current system state", [self._registry.table(role) for role in roles]]

    # ---- parameters

    def _get_param(self, caller: str, key: object) -> Answer:
        key = self.arguments.param_key(key, caller)
        try:
            return [SUCCESS, f"Parameter [{key}]", self._params.get(key)]
        except NotSet:
            return [CALLER_ERROR, f"Parameter [{key}] is not set", 0]

    def _set_param(self, caller: str, key: object, value: object) -> Answer:
        key = self.arguments.param_key(key, caller)
        try:
            self._params.set(key, value)
        except (NotATree, TooDeep, ParamsFull) as error:
            return [CALLER_ERROR, f"Error: invalid arguments: {error}", 0]
        _log.info("+PARAM [%s] by %s", key, caller)
        self._notify(param_notices(self._registry, key, value, except_node=caller))
        return [SUCCESS, f"parameter {key} set", 0]

    def _delete_param(self, caller: str, key: object) -> Answer:
        key = self.arguments.param_key(key, caller)
        try:
            self._params.delete(key)
        except NotSet:
            return [CALLER_ERROR, f"parameter [{key}] is not set", 0]
        _log.info("-PARAM [%s] by %s", key, caller)
        self._notify(param_notices(self._registry, key, {}))
        return [SUCCESS, f"parameter {key} deleted", 0]

    def _has_param(self, caller: str, key: object) -> Answer:
        key = self.arguments.param_key(key, caller)
        return [SUCCESS, key, self._params.has(key)]

    def _search_param(self, caller: str, key: Any) -> Answer:
        self.arguments.param_key(key, caller)
        if names.is_private(key):
            return [INTERNAL, "Internal failure: invalid key", 0]
        if not names.is_global(caller):
            return [INTERNAL, "Internal failure: namespace must be global", 0]
        found = self._params.search(caller, key)
        if found is None:
            return [CALLER_ERROR, f"Cannot find parameter [{key}] in an upwards search", ""]
        return [SUCCESS, f"Found [{found}]", found]

    def _get_param_names(self, _caller: str) -> Answer:
        return [SUCCESS, "Parameter names", self._params.names()]

    def _subscribe_param(self, caller: str, api: object, key: object) -> Answer:
        api = self.arguments.api_uri("caller_api", api)
        key = self.arguments.param_key(key, caller)
        self._notify(self._registry.subscribe_param(caller, key, api))
        self._log_entry(Role.PARAM_SUBSCRIBER, key, caller, api)
        try:
            value = self._params.get(key)
        except NotSet:
            value = {}
        return [SUCCESS, f"Subscribed to parameter [{key}]", value]

    def _unsubscribe_param(self, caller: str, api: object, key: object) -> Answer:
        api = self.arguments.api_uri("caller_api", api)
        key = self.arguments.param_key(key, caller)
        if self._registry.unregister(Role.PARAM_SUBSCRIBER, caller, key, api)[0]:
            _log.info("-CACHEDPARAM [%s] by %s", key, caller)
        return [SUCCESS, f"Unsubscribe to parameter [{key}]", 1]


def param_notices(
    registry: Registry, key: str, value: object, *, except_node: str | None = None
) -> Iterator[Notice]:
    """Return the `paramUpdate` notices for a change of `key` to `value` (`{}` if it was deleted).

    A subscriber at or above the key receives the key and its value. A subscriber below the key receives the
    part of the value at its own key, or `{}` if there is none. `except_node`, which set the value, receives
    only the latter, because roscpp does not divide values. Announced keys end with a slash. All is as in
    genuine masters.

    The subscribed keys are looked up immediately, but their nodes only as the notices are consumed,
    because a key can have thousands of subscribers.
    """
    return _notices(registry, registry.param_keys_around(key), key, value, except_node)


def _notices(
    registry: Registry, subscribed_keys: Sequence[str], key: str, value: object, except_node: str | None
) -> Iterator[Notice]:
    changed = names.as_namespace(key)
    for subscribed in subscribed_keys:
        namespace = names.as_namespace(subscribed)
        is_above = changed.startswith(namespace)
        if is_above:
            params = (MASTER_ID, changed, value)
        else:
            params = (MASTER_ID, namespace, value_below(value, namespace[len(changed) :], {}))
        # All subscribers to a key share one tuple, so that it is encoded only once.
        for name in registry.names_of(Role.PARAM_SUBSCRIBER, subscribed):
            if name != except_node or not is_above:
                yield Notice(name, registry.nodes[name].api, "paramUpdate", params)
