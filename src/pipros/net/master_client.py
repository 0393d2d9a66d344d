"""The master and its parameter server, as their callers see them."""

from __future__ import annotations

from typing import Any

from pipros.errors import ProtocolError, Refused, Unreachable
from pipros.net.rpc_client import TIMEOUT_OF_CLIENT, RpcClient
from pipros.printable import printable

CURE = "Is roscore running there? Start it, or set ROS_MASTER_URI to where it runs"


class MasterClient:
    """One method for each of the Master API and the Parameter Server API, from one node's point of view.

    Each returns the value of the master's `[code, text, value]`. May be used from any thread.
    Every method raises:
        Refused: the master refused (code -1 or 0).
        Unreachable: there is no master at the URI, or it did not answer in time.
        Interrupted: `interrupt` was called.
        Fault, ProtocolError: what answers is not a ROS master.

    >>> MasterClient("http://localhost:11311/", "/me").get_topic_types()        # doctest: +SKIP
    [['/rosout', 'rosgraph_msgs/Log']]
    """

    def __init__(self, uri: str, caller_id: str, *, timeout_s: float | None = None) -> None:
        """Nothing is connected yet.

        Args:
            uri: the master's, `http://HOST:PORT/`.
            caller_id: the full name of the node that asks; relative names are resolved beside it.
            timeout_s: how long one call may take; None is for ever.
        """
        self.uri = uri
        self.caller_id = caller_id
        self._rpc = RpcClient(uri, timeout_s=timeout_s)

    def call(self, method: str, *params: Any, timeout_s: float | None = TIMEOUT_OF_CLIENT) -> Any:
        """Calls any method; the caller_id goes first by itself."""
        code, text, value = self.call_raw(method, *params, timeout_s=timeout_s)
        if code != 1:
            raise Refused(f"master [{self.uri}]", code, text)
        return value

    def call_raw(
        self, method: str, *params: Any, timeout_s: float | None = TIMEOUT_OF_CLIENT
    ) -> tuple[int, str, Any]:
        """As `call`, but returns code, text and value, whatever the code."""
        try:
            answer = self._rpc.call(method, self.caller_id, *params, timeout_s=timeout_s)
        except Unreachable as error:
            raise Unreachable(f"master [{self.uri}]", error.reason, CURE) from error.__cause__
        if not isinstance(answer, list) or len(answer) != 3 or type(answer[0]) is not int:
            raise self._nonsense(method, answer)
        return answer[0], str(answer[1]), answer[2]

    def _call_for_number(self, method: str, *params: Any) -> int:
        value = self.call(method, *params)
        if not isinstance(value, int):
            raise self._nonsense(method, value)
        return int(value)

    def _call_for_names(self, method: str, *params: Any) -> list[str]:
        value = self.call(method, *params)
        if not _is_list_of_texts(value):
            raise self._nonsense(method, value)
        names: list[str] = value
        return names

    def _call_for_types(self, method: str, *params: Any) -> list[list[str]]:
        value = self.call(method, *params)
        if not (isinstance(value, list) and all(_is_list_of_texts(pair, 2) for pair in value)):
            raise self._nonsense(method, value)
        types: list[list[str]] = value
        return types

    def _nonsense(self, method: str, value: object) -> ProtocolError:
        return ProtocolError(
            f"[{self.uri}] does not answer as a ROS master: {method} gave [{printable(value, 80)}]"
        )

    @property
    def addresses(self) -> tuple[str, ...]:
        """The IP addresses at which the master was found lately; none before the first call."""
        return self._rpc.server_addresses

    def interrupt(self, limit_s: float) -> None:
        """Ends the calls under way: they raise Interrupted. Later ones are given `limit_s`."""
        self._rpc.interrupt(limit_s)

    def close(self) -> None:
        self._rpc.close()

    # ---- registrations

    def register_publisher(self, topic: str, type_name: str, api: str) -> list[str]:
        """Returns the APIs of the topic's subscribers."""
        return self._call_for_names("registerPublisher", topic, type_name, api)

    def unregister_publisher(self, topic: str, api: str) -> int:
        """Returns 1, or 0 when it was not registered."""
        return self._call_for_number("unregisterPublisher", topic, api)

    def register_subscriber(self, topic: str, type_name: str, api: str) -> list[str]:
        """Returns the APIs of the topic's publishers."""
        return self._call_for_names("registerSubscriber", topic, type_name, api)

    def unregister_subscriber(self, topic: str, api: str) -> int:
        """Returns 1, or 0 when it was not registered."""
        return self._call_for_number("unregisterSubscriber", topic, api)

    def register_service(self, service: str, service_api: str, api: str) -> int:
        return self._call_for_number("registerService", service, service_api, api)

    def unregister_service(self, service: str, service_api: str) -> int:
        """Returns 1, or 0 when it was not registered."""
        return self._call_for_number("unregisterService", service, service_api)

    # ---- the graph

    def lookup_node(self, node: str) -> str:
        """The API of a node. Raises `Refused` when it is unknown."""
        return str(self.call("lookupNode", node))

    def lookup_service(self, service: str) -> str:
        """The `rosrpc://HOST:PORT` of a service. Raises `Refused` when no node offers it."""
        return str(self.call("lookupService", service))

    def get_system_state(self) -> list[list[list[Any]]]:
        """Publishers, subscribers and services: three lists of `[name, [node, …]]`."""
        state = self.call("getSystemState")
        if not (isinstance(state, list) and len(state) == 3 and all(map(_is_registered, state))):
            raise self._nonsense("getSystemState", state)
        kinds: list[list[list[Any]]] = state
        return kinds

    def get_topic_types(self) -> list[list[str]]:
        """`[topic, type]` of every topic that was ever registered with a type."""
        return self._call_for_types("getTopicTypes")

    def get_published_topics(self, subgraph: str = "") -> list[list[str]]:
        """`[topic, type]` of the topics below `subgraph` that have a publisher."""
        return self._call_for_types("getPublishedTopics", subgraph)

    def get_uri(self) -> str:
        return str(self.call("getUri"))

    def get_pid(self) -> int:
        return self._call_for_number("getPid")

    # ---- parameters

    def get_param(self, key: str) -> Any:
        """A value, or the dictionary of a namespace. Raises `Refused` when it is not set."""
        return self.call("getParam", key)

    def set_param(self, key: str, value: Any) -> None:
        """Sets a value; a dictionary replaces the whole namespace."""
        self.call("setParam", key, value)

    def delete_param(self, key: str) -> None:
        """Raises `Refused` when it is not set."""
        self.call("deleteParam", key)

    def has_param(self, key: str) -> bool:
        return bool(self.call("hasParam", key))

    def search_param(self, key: str) -> str:
        """The full name of the nearest such parameter upwards. Raises `Refused` when there is none."""
        return str(self.call("searchParam", key))

    def get_param_names(self) -> list[str]:
        return self._call_for_names("getParamNames")

    def subscribe_param(self, api: str, key: str) -> Any:
        """Asks for `paramUpdate` on changes. Returns the value now, `{}` when it is not set."""
        return self.call("subscribeParam", api, key)

    def unsubscribe_param(self, api: str, key: str) -> int:
        return self._call_for_number("unsubscribeParam", api, key)


def _is_list_of_texts(value: object, length: int | None = None) -> bool:
    if not isinstance(value, list) or length not in (None, len(value)):
        return False
    return all(isinstance(one, str) for one in value)


def _is_registered(kind: object) -> bool:
    """Whether a third of the system state is a list of names with the nodes that have each."""
    return isinstance(kind, list) and all(
        isinstance(one, list) and len(one) == 2 and isinstance(one[0], str) and _is_list_of_texts(one[1])
        for one in kind
    )
