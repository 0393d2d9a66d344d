"""Services that a gateway offers on one side and calls on the other."""

from __future__ import annotations

from typing import Final

from pipros.basics.budget import SharedBudget
from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.service_server import HandlerError
from pipros_libraries.topic_tools.raw import raw_service_class
from pipros_ros2.counts import Counts
from pipros_ros2.interface import ROS2_CALLS, Ros2Engine
from pipros_ros2.type_pairs import ServicePair

CALL_S: Final = 5.0
"""Timeout of calls to ROS 2, as in ros1_bridge. Rules set other timeouts."""
ANSWER_S: Final = 300.0
"""Timeout of calls from ROS 2, whose clients are not notified of failures."""


class _BridgedService:
    """What both directions share."""

    def __init__(self, node: Node, name: str, pair: ServicePair, timeout_s: float) -> None:
        self.counts = Counts()
        self.types = pair.plan.ros1_type, pair.plan.ros2_type
        self._node = node
        self._name = name
        self._plan = pair.plan
        self._class = raw_service_class(pair.plan.ros1_type, pair.md5sum)
        self._timeout_s = timeout_s


class ServiceToRos1(_BridgedService):
    """A ROS 1 service, offered in ROS 2. If a call fails, the ROS 2 client gets no reply."""

    def __init__(
        self, node: Node, engine: Ros2Engine, name: str, pair: ServicePair, timeout_s: float | None = None
    ) -> None:
        """Offer the ROS 1 service in ROS 2.

        Raises:
            PiprosError: the engine is closed, or the name is not legal in ROS 2.
        """
        super().__init__(node, name, pair, ANSWER_S if timeout_s is None else timeout_s)
        self._server = engine.serve(name, pair.plan.ros2_type, pair.type_hash, self._answer, pair.parts)

    def _answer(self, request: bytes) -> bytes | None:
        client = self._node.client(self._name, self._class)
        try:
            response: AnyMsg = client.call(
                self._class._request_class(self._plan.request.to_ros1(request)), self._timeout_s
            )
            reply = self._plan.response.to_cdr(response.body)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: {error}")
            return None
        finally:
            client.close()
        self.counts.passed += 1
        return reply

    def update(self) -> None:
        """Count the requests that the engine has refused."""
        self.counts.overflow("", self._server.dropped, f"{self._name}: requests from ROS 2 were refused")

    def close(self) -> None:
        self._server.close()


class ServiceToRos2(_BridgedService):
    """A ROS 2 service, offered in ROS 1."""

    def __init__(
        self, node: Node, engine: Ros2Engine, name: str, pair: ServicePair, timeout_s: float | None = None
    ) -> None:
        """Offer the ROS 2 service in ROS 1. Blocks until the master answers.

        Raises:
            PiprosError: the engine is closed, or the node already provides a service with this name.
        """
        super().__init__(node, name, pair, CALL_S if timeout_s is None else timeout_s)
        self._slots = SharedBudget(ROS2_CALLS)
        self._caller = engine.caller(name, pair.plan.ros2_type, pair.type_hash, pair.parts)
        try:
            self._server = node.serve(name, self._class, self._call)
        except PiprosError:
            self._caller.close()
            raise

    def _call(self, request: AnyMsg) -> AnyMsg:
        caller = request.header.get("callerid")
        if not self._slots.take(caller):
            self.counts.fail(f"{self._name}: too many pending calls to ROS 2")
            raise HandlerError("too many pending calls to ROS 2")
        try:
            reply = self._caller.call(self._plan.request.to_cdr(request.body), self._timeout_s)
            response: AnyMsg = self._class._response_class(self._plan.response.to_ros1(reply))
            self.counts.passed += 1
            return response
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: {error}")
            raise HandlerError(str(error)) from None
        finally:
            self._slots.give_back(caller)

    def close(self) -> None:
        self._node.endpoints.stop_serving(self._server)
        self._caller.close()
