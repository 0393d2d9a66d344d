"""The master and its parameter server, as their callers see them."""

from __future__ import annotations

from typing import Any

from pipros.errors import ProtocolError, Refused, Unreachable
from pipros.net.rpc import TIMEOUT_OF_CLIENT, RpcClient

CURE = "Is roscore running there? Start it, or set ROS_MASTER_URI to where it runs"


class MasterClient:
    """One method for each of the Master API and the Parameter Server API, from one node's point of view.

    Each returns the value of the master's `[code, text, value]`. May be used from any thread.
    Every method raises:
        Refused: the master said no (code -1 or 0).
        Unreachable: no master there, or it gave no answer in time.
        Interrupted: `interrupt` was called.
        Fault, ProtocolError: what answers is no ROS master.

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
            raise ProtocolError(f"[{self.uri}] is no ROS master: it answered {str(answer)[:80]} to {method}")
        return answer[0], str(answer[1]), answer[2]

    def interrupt(self, limit_s: float) -> None:
        """Ends the calls under way: they raise Interrupted. Later ones are given `limit_s`."""
        self._rpc.interrupt(limit_s)

    def close(self) -> None:
        self._rpc.close()

    # ---- registrations

    def register_publisher(self, topic: str, type_name: str, api: str) -> list[str]:
        """Returns the APIs of the topic's subscribers."""
        apis: list[str] = self.call("registerPublisher", topic, type_name, api)
        return apis

    def unregister_publisher(self, topic: str, api: str) -> int:
        """Returns 1, or 0 when it was not registered."""
        return int(self.call("unregisterPublisher", topic, api))

    def register_subscriber(self, topic: str, type_name: str, api: str) -> list[str]:
        """Returns the APIs of the topic's publishers."""
        apis: list[str] = self.call("registerSubscriber", topic, type_name, api)
        return apis

    def unregister_subscriber(self, topic: str, api: str) -> int:
        """Returns 1, or 0 when it was not registered."""
        return int(self.call("unregisterSubscriber", topic, api))

    def register_service(self, service: str, service_api: str, api: str) -> int:
        return int(self.call("registerService", service, service_api, api))

    def unregister_service(self, service: str, service_api: str) -> int:
        """Returns 1, or 0 when it was not registered."""
        return int(self.call("unregisterService", service, service_api))

    # ---- the graph

    def lookup_node(self, node: str) -> str:
        """The API of a node. Raises `Refused` when it is unknown."""
        return str(self.call("lookupNode", node))

    def lookup_service(self, service: str) -> str:
        """The `rosrpc://HOST:PORT` of a service. Raises `Refused` when nobody offers it."""
        return str(self.call("lookupService", service))

    def get_system_state(self) -> list[list[list[Any]]]:
        """Publishers, subscribers and services: three lists of `[name, [node, …]]`."""
        state: list[list[list[Any]]] = self.call("getSystemState")
        return state

    def get_topic_types(self) -> list[list[str]]:
        """`[topic, type]` of every topic that was ever registered with a type."""
        types: list[list[str]] = self.call("getTopicTypes")
        return types

    def get_published_topics(self, subgraph: str = "") -> list[list[str]]:
        """`[topic, type]` of the topics below `subgraph` that have a publisher."""
        topics: list[list[str]] = self.call("getPublishedTopics", subgraph)
        return topics

    def get_uri(self) -> str:
        return str(self.call("getUri"))

    def get_pid(self) -> int:
        return int(self.call("getPid"))

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
        names: list[str] = self.call("getParamNames")
        return names

    def subscribe_param(self, api: str, key: str) -> Any:
        """Asks for `paramUpdate` on changes. Returns the value now, `{}` when it is not set."""
        return self.call("subscribeParam", api, key)

    def unsubscribe_param(self, api: str, key: str) -> int:
        return int(self.call("unsubscribeParam", api, key))
