"""The Master API and the Parameter Server API: arguments in, `[code, text, value]` out.

http://wiki.ros.org/ROS/Master_API and http://wiki.ros.org/ROS/Parameter%20Server%20API say what
there is; texts, checks and odd corners are those of genuine rosmaster, found by asking it (the
differential test in tests/interop keeps asking). Nothing here waits or touches a socket.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import Any

from pipros import names
from pipros.master.params import NotATree, NotSet, ParamTree, changes_for
from pipros.master.registry import ANY_TYPE, Notice, Registry, Role, param_updates

Answer = list[Any]

_SUCCESS = 1
_INTERNAL = 0
_CALLER_ERROR = -1


class _BadArgument(Exception):
    """The caller's error; its text goes back to the caller."""


class MasterApi:
    """Answers the calls of nodes and tools out of the registry and the parameter tree.

    `methods` is the table for an `RpcServer`. Each notice that a call gives rise to is handed to
    `notify`, in order, before the call is answered. `changed` is called with a word about what
    changed after each call that changed something lasting.
    """

    def __init__(
        self,
        registry: Registry,
        params: ParamTree,
        *,
        notify: Callable[[Iterable[Notice]], None],
        shutdown: Callable[[str], bool],
    ) -> None:
        """
        Args:
            registry: the books.
            params: the parameters.
            notify: delivers notices.
            shutdown: ends the master, given the reason; returns False when the caller may not.
        """
        self.uri = ""
        self._registry = registry
        self._params = params
        self._notify = notify
        self._shutdown = shutdown
        # name: (what answers, the value that goes with an error)
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
        self.methods = {name: _guarded(method, value) for name, (method, value) in table.items()}

    # ---- the master itself

    def _get_pid(self, _caller: str) -> Answer:
        return [_SUCCESS, "", os.getpid()]

    def _get_uri(self, _caller: str) -> Answer:
        return [_SUCCESS, "", self.uri]

    def _shut_down(self, _caller: str, reason: Any) -> Answer:
        if not self._shutdown(str(reason)):
            return [_CALLER_ERROR, "shutdown is accepted from this machine only", 0]
        return [_SUCCESS, "shutdown", 0]

    # ---- registrations

    def _register_publisher(self, caller: str, topic: Any, type_name: Any, api: Any) -> Answer:
        topic = _topic(topic, caller)
        type_name = _type(type_name)
        api = _api("caller_api", api)
        self._notify(self._registry.register_publisher(caller, topic, type_name, api))
        subscribers = self._registry.apis_of(Role.SUBSCRIBER, topic)
        return [_SUCCESS, f"Registered [{caller}] as publisher of [{topic}]", subscribers]

    def _unregister_publisher(self, caller: str, topic: Any, api: Any) -> Answer:
        return self._unregister(Role.PUBLISHER, caller, _topic(topic, caller), _api("caller_api", api))

    def _register_subscriber(self, caller: str, topic: Any, type_name: Any, api: Any) -> Answer:
        topic = _topic(topic, caller)
        type_name = _type(type_name)
        api = _api("caller_api", api)
        self._notify(self._registry.register_subscriber(caller, topic, type_name, api))
        publishers = self._registry.apis_of(Role.PUBLISHER, topic)
        return [_SUCCESS, f"Subscribed to [{topic}]", publishers]

    def _unregister_subscriber(self, caller: str, topic: Any, api: Any) -> Answer:
        return self._unregister(Role.SUBSCRIBER, caller, _topic(topic, caller), _api("caller_api", api))

    def _unregister(self, role: Role, caller: str, key: str, api: str) -> Answer:
        if self._registry.api_of(caller) is None:
            return [_SUCCESS, f"[{caller}] is not a registered node", 0]
        was_there, notices = self._registry.unregister(role, caller, key, api)
        if not was_there:
            return [_SUCCESS, f"[{caller}] is not a known provider of [{key}]", 0]
        self._notify(notices)
        return [_SUCCESS, f"Unregistered [{caller}] as provider of [{key}]", 1]

    def _register_service(self, caller: str, service: Any, service_api: Any, api: Any) -> Answer:
        service = _service(service, caller)
        service_api = _api("service_api", service_api)
        api = _api("caller_api", api)
        self._notify(self._registry.register_service(caller, service, service_api, api))
        return [_SUCCESS, f"Registered [{caller}] as provider of [{service}]", 1]

    def _unregister_service(self, caller: str, service: Any, service_api: Any) -> Answer:
        service = _service(service, caller)
        service_api = _api("service_api", service_api)
        if self._registry.api_of(caller) is None:
            return [_SUCCESS, f"[{caller}] is not a registered node", 0]
        if self._registry.unregister_service(caller, service, service_api):
            return [_SUCCESS, f"Unregistered [{caller}] as provider of [{service}]", 1]
        text = f"[{service_api}] is no longer the current service api handle for [{service}]"
        return [_SUCCESS, text, 0]

    # ---- the graph

    def _lookup_node(self, caller: str, node: Any) -> Answer:
        node = _resolved("node", node, caller)
        api = self._registry.api_of(node)
        if api is None:
            return [_CALLER_ERROR, f"unknown node [{node}]", ""]
        return [_SUCCESS, "node api", api]

    def _lookup_service(self, caller: str, service: Any) -> Answer:
        api = self._registry.service_api_of(_service(service, caller))
        if api is None:
            return [_CALLER_ERROR, "no provider", ""]
        return [_SUCCESS, f"rosrpc URI: [{api}]", api]

    def _get_topic_types(self, _caller: str) -> Answer:
        return [_SUCCESS, "current system state", [list(pair) for pair in self._registry.topic_types.items()]]

    def _get_published_topics(self, caller: str, subgraph: Any) -> Answer:
        if type(subgraph) is not str:
            raise _BadArgument("ERROR: parameter [subgraph] must be a string")
        below = names.resolve(subgraph, caller).rstrip("/") + "/" if subgraph else "/"
        types = self._registry.topic_types
        return [
            _SUCCESS,
            "current topics",
            [
                [topic, types[topic]]
                for topic in self._registry.keys_of(Role.PUBLISHER)
                if topic.startswith(below)
            ],
        ]

    def _get_system_state(self, _caller: str) -> Answer:
        roles = (Role.PUBLISHER, Role.SUBSCRIBER, Role.SERVICE)
        return [_SUCCESS, "current system state", [self._registry.table(role) for role in roles]]

    # ---- parameters

    def _get_param(self, caller: str, key: Any) -> Answer:
        key = _key(key, caller)
        try:
            return [_SUCCESS, f"Parameter [{key}]", self._params.get(key)]
        except NotSet:
            return [_CALLER_ERROR, f"Parameter [{key}] is not set", 0]

    def _set_param(self, caller: str, key: Any, value: Any) -> Answer:
        key = _key(key, caller)
        try:
            self._params.set(key, value)
        except NotATree as error:
            return [_CALLER_ERROR, f"Error: invalid arguments: {error}", 0]
        self._announce(key, value, caller)
        return [_SUCCESS, f"parameter {key} set", 0]

    def _delete_param(self, caller: str, key: Any) -> Answer:
        key = _key(key, caller)
        try:
            self._params.delete(key)
        except NotSet:
            return [_CALLER_ERROR, f"parameter [{key}] is not set", 0]
        self._announce(key, {}, caller)
        return [_SUCCESS, f"parameter {key} deleted", 0]

    def _announce(self, key: str, value: Any, caller: str) -> None:
        changes = changes_for(self._registry.param_keys_around(key), key, value)
        if changes:
            self._notify(param_updates(self._registry, changes, except_node=caller))

    def _has_param(self, caller: str, key: Any) -> Answer:
        key = _key(key, caller)
        return [_SUCCESS, key, self._params.has(key)]

    def _search_param(self, caller: str, key: Any) -> Answer:
        _key(key, caller)
        if names.is_private(key):
            return [_INTERNAL, "Internal failure: invalid key", 0]
        if not names.is_global(caller):
            return [_INTERNAL, "Internal failure: namespace must be global", 0]
        found = self._params.search(caller, key)
        if found is None:
            return [_CALLER_ERROR, f"Cannot find parameter [{key}] in an upwards search", ""]
        return [_SUCCESS, f"Found [{found}]", found]

    def _get_param_names(self, _caller: str) -> Answer:
        return [_SUCCESS, "Parameter names", self._params.names()]

    def _subscribe_param(self, caller: str, api: Any, key: Any) -> Answer:
        api = _api("caller_api", api)
        key = _key(key, caller)
        self._notify(self._registry.subscribe_param(caller, key, api))
        try:
            value = self._params.get(key)
        except NotSet:
            value = {}
        return [_SUCCESS, f"Subscribed to parameter [{key}]", value]

    def _unsubscribe_param(self, caller: str, api: Any, key: Any) -> Answer:
        api = _api("caller_api", api)
        key = _key(key, caller)
        self._registry.unregister(Role.PARAM_SUBSCRIBER, caller, key, api)
        return [_SUCCESS, f"Unsubscribe to parameter [{key}]", 1]


def _guarded(method: Callable[..., Answer], error_value: Any) -> Callable[..., Answer]:
    """`method` with the checks that all share, and its errors as answers."""
    arity = method.__code__.co_argcount - 1  # without self

    def answer(*params: Any) -> Answer:
        if not params:
            return [_CALLER_ERROR, "missing required caller_id parameter", error_value]
        if type(params[0]) is not str:
            return [_CALLER_ERROR, "caller_id must be a string", error_value]
        if len(params) != arity:
            return [_CALLER_ERROR, "Error: bad call arity", error_value]
        try:
            return method(*params)
        except _BadArgument as error:
            return [_CALLER_ERROR, str(error), error_value]

    return answer


# ---- checks of arguments, in the words of genuine rosmaster


def _resolved(parameter: str, name: Any, caller: str) -> str:
    if type(name) is not str or not name:
        raise _BadArgument(f"ERROR: parameter [{parameter}] must be a non-empty string")
    if ":" in name or " " in name:
        raise _BadArgument(f"ERROR: parameter [{parameter}] contains illegal chars")
    return names.resolve(name, caller)


def _topic(name: Any, caller: str) -> str:
    resolved = _resolved("topic", name, caller)
    if name == "/":
        raise _BadArgument("ERROR: parameter [topic] cannot be the global namespace")
    return resolved


def _service(name: Any, caller: str) -> str:
    resolved = _resolved("service", name, caller)
    if name == "/":
        raise _BadArgument("ERROR: parameter [service] cannot be the global namespace")
    return resolved


def _type(type_name: Any) -> str:
    if type(type_name) is not str or not type_name:
        raise _BadArgument("ERROR: parameter [topic_type] must be a non-empty string")
    if type_name != ANY_TYPE and type_name.count("/") != 1:
        raise _BadArgument("ERROR: parameter [topic_type] is not a valid package resource name")
    return type_name


def _api(parameter: str, api: Any) -> str:
    if type(api) is not str or not api:
        raise _BadArgument(f"ERROR: parameter [{parameter}] is not an XMLRPC URI")
    if not api.startswith(("http://", "rosrpc://")):
        raise _BadArgument(f"ERROR: parameter [{parameter}] is not an RPC URI")
    return api


def _key(key: Any, caller: str) -> str:
    if type(key) is not str:
        raise _BadArgument("ERROR: parameter [key] must be a string")
    if not key:
        raise _BadArgument("ERROR: parameter [key] must be specified and non-empty")
    return names.resolve(key, caller)
