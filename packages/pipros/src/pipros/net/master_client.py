"""A client of the master and its parameter server."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from pipros.basics.errors import ProtocolError, Refused, Unreachable
from pipros.basics.printable import printable
from pipros.net.rpc_client import TIMEOUT_OF_CLIENT, RpcClient

CURE = "Is roscore running there? Start it, or set ROS_MASTER_URI to its address"
CURE_OF_OTHERS = (
    f"{CURE}. Unless ROS_MASTER_URI, ROS_IP, ROS_HOSTNAME or --bind opens it to the network, "
    "roscore accepts connections only from its own computer"
)


class MasterClient:
    """The methods of the Master API and the Parameter Server API, called on behalf of one node.

    Unless noted otherwise, a method returns the value from the master's `[code, text, value]`. Thread-safe.
    These methods raise:
        Refused: the master refused (code -1 or 0).
        Unreachable: the connection failed, or the master did not respond in time.
        Interrupted: `interrupt` was called.
        Fault, ProtocolError: the server at the URI is not a ROS master.

    Examples:
        >>> MasterClient("http://localhost:11311/", "/me").get_topic_types()  # doctest: +SKIP
        [['/rosout', 'rosgraph_msgs/Log']]
    """

    def __init__(self, uri: str, caller_id: str, *, timeout_s: float | None = None) -> None:
        """Store the settings; the first call connects.

        Args:
            uri: the URI of the master, `http://HOST:PORT/`.
            caller_id: the full name of the node, in whose namespace the master resolves relative names.
            timeout_s: time limit for one call; None for no limit.
        """
        self.uri = uri
        self.caller_id = caller_id
        self._rpc = RpcClient(uri, timeout_s=timeout_s)

    def call(
        self,
        method: str,
        *params: Any,
        timeout_s: float | None = TIMEOUT_OF_CLIENT,
        meanwhile: Callable[[], None] | None = None,
    ) -> Any:
        """Call any method; the caller_id is added as the first parameter.

        `meanwhile` is called when the request has been sent, and again if the request has to be resent.
        """
        code, text, value = self.call_raw(method, *params, timeout_s=timeout_s, meanwhile=meanwhile)
        if code != 1:
            raise Refused(f"master [{self.uri}]", code, text)
        return value

    def call_raw(
        self,
        method: str,
        *params: Any,
        timeout_s: float | None = TIMEOUT_OF_CLIENT,
        meanwhile: Callable[[], None] | None = None,
    ) -> tuple[int, str, Any]:
        """Like `call`, but return the code, text and value, regardless of the code."""
        try:
            answer = self._rpc.call(method, self.caller_id, *params, timeout_s=timeout_s, meanwhile=meanwhile)
        except Unreachable as error:
            from pipros.basics.uri import host_of
            from pipros.net.address import is_loopback

            cure = CURE if is_loopback(host_of(self.uri)) else CURE_OF_OTHERS
            raise Unreachable(f"master [{self.uri}]", error.reason, cure) from error.__cause__
        if not isinstance(answer, list) or len(answer) != 3 or type(answer[0]) is not int:
            raise self._malformed(method, answer)
        return answer[0], str(answer[1]), answer[2]

    def call_together(self, calls: Sequence[tuple[str, ...]]) -> None:
        """Call several methods in one request, and ignore the results.

        Each call is a method's name followed by the parameters after the caller_id.
        """
        together = [{"methodName": name, "params": [self.caller_id, *params]} for name, *params in calls]
        self._rpc.call("system.multicall", together)

    def _call_for_number(self, method: str, *params: Any, timeout_s: float | None = TIMEOUT_OF_CLIENT) -> int:
        value = self.call(method, *params, timeout_s=timeout_s)
        if not isinstance(value, int):
            raise self._malformed(method, value)
        return int(value)

    def _call_for_names(self, method: str, *params: Any) -> list[str]:
        value = self.call(method, *params)
        if not _is_list_of_texts(value):
            raise self._malformed(method, value)
        names: list[str] = value
        return names

    def _call_for_types(self, method: str, *params: Any) -> list[list[str]]:
        value = self.call(method, *params)
        if not (isinstance(value, list) and all(_is_list_of_texts(pair, 2) for pair in value)):
            raise self._malformed(method, value)
        types: list[list[str]] = value
        return types

    def _malformed(self, method: str, value: object) -> ProtocolError:
        return ProtocolError(f"[{self.uri}] is not a ROS master: {method} returned [{printable(value, 80)}]")

    @property
    def addresses(self) -> tuple[str, ...]:
        """The master's IP addresses in recent connections; empty before the first call."""
        return self._rpc.server_addresses

    def interrupt(self, limit_s: float, grace_s: float = 0.0) -> None:
        """Make calls that are still running after `grace_s` raise Interrupted.

        Later calls have the timeout `limit_s`.
        """
        self._rpc.interrupt(limit_s, grace_s)

    def close(self) -> None:
        self._rpc.close()

    # ---- registrations

    def register_publisher(self, topic: str, type_name: str, api: str) -> list[str]:
        """Register a publisher; return the APIs of the topic's subscribers."""
        return self._call_for_names("registerPublisher", topic, type_name, api)

    def unregister_publisher(self, topic: str, api: str) -> int:
        """Unregister a publisher; return 1, or 0 if it was not registered."""
        return self._call_for_number("unregisterPublisher", topic, api)

    def register_subscriber(self, topic: str, type_name: str, api: str) -> list[str]:
        """Register a subscriber; return the APIs of the topic's publishers."""
        return self._call_for_names("registerSubscriber", topic, type_name, api)

    def unregister_subscriber(self, topic: str, api: str) -> int:
        """Unregister a subscriber; return 1, or 0 if it was not registered."""
        return self._call_for_number("unregisterSubscriber", topic, api)

    def register_service(self, service: str, service_api: str, api: str) -> int:
        return self._call_for_number("registerService", service, service_api, api)

    def unregister_service(self, service: str, service_api: str) -> int:
        """Unregister a service; return 1, or 0 if it was not registered."""
        return self._call_for_number("unregisterService", service, service_api)

    # ---- the graph

    def lookup_node(self, node: str) -> str:
        """Return a node's API URI. Raises `Refused` if the node is unknown."""
        return str(self.call("lookupNode", node))

    def lookup_service(
        self,
        service: str,
        meanwhile: Callable[[], None] | None = None,
        *,
        timeout_s: float | None = TIMEOUT_OF_CLIENT,
    ) -> str:
        """Return a service's URI, `rosrpc://HOST:PORT`. Raises `Refused` if no node offers it.

        `meanwhile` is called when the request has been sent, and again if the request has to be resent.
        """
        return str(self.call("lookupService", service, timeout_s=timeout_s, meanwhile=meanwhile))

    def get_system_state(self) -> list[list[list[Any]]]:
        """Return three lists of `[name, [node, …]]`: the publishers, subscribers and services."""
        state = self.call("getSystemState")
        if not (isinstance(state, list) and len(state) == 3 and all(map(_is_registered, state))):
            raise self._malformed("getSystemState", state)
        kinds: list[list[list[Any]]] = state
        return kinds

    def get_topic_types(self) -> list[list[str]]:
        """Return `[topic, type]` for every topic whose type the master knows, with or without publishers."""
        return self._call_for_types("getTopicTypes")

    def get_published_topics(self, subgraph: str = "") -> list[list[str]]:
        """Return `[topic, type]` for each topic below `subgraph` that has a publisher."""
        return self._call_for_types("getPublishedTopics", subgraph)

    def get_uri(self) -> str:
        return str(self.call("getUri"))

    def get_pid(self, *, timeout_s: float | None = TIMEOUT_OF_CLIENT) -> int:
        return self._call_for_number("getPid", timeout_s=timeout_s)

    # ---- parameters

    def get_param(self, key: str) -> Any:
        """Return a value, or a namespace as a dictionary. Raises `Refused` if the parameter is not set."""
        return self.call("getParam", key)

    def set_param(self, key: str, value: Any) -> None:
        """Set a value; a dictionary replaces the whole namespace."""
        self.call("setParam", key, value)

    def delete_param(self, key: str) -> None:
        """Delete a parameter or a namespace. Raises `Refused` if it is not set."""
        self.call("deleteParam", key)

    def has_param(self, key: str) -> bool:
        return bool(self.call("hasParam", key))

    def search_param(self, key: str) -> str:
        """Search for a parameter upwards from the caller's namespace and return its full name.

        Raises `Refused` if it is not found.
        """
        return str(self.call("searchParam", key))

    def get_param_names(self) -> list[str]:
        return self._call_for_names("getParamNames")

    def subscribe_param(self, api: str, key: str) -> Any:
        """Subscribe to changes (`paramUpdate`).

        Return the current value, or `{}` if the parameter is not set.
        """
        return self.call("subscribeParam", api, key)


def _is_list_of_texts(value: object, length: int | None = None) -> bool:
    if not isinstance(value, list) or length not in (None, len(value)):
        return False
    return all(isinstance(element, str) for element in value)


def _is_registered(kind: object) -> bool:
    """Return whether one part of the system state is a list of `[name, [node, …]]`."""
    return isinstance(kind, list) and all(
        isinstance(entry, list)
        and len(entry) == 2
        and isinstance(entry[0], str)
        and _is_list_of_texts(entry[1])
        for entry in kind
    )
