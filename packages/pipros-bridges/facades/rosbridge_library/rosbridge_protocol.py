"""`RosbridgeProtocol`: the rosbridge protocol for one client of a server that is not part of pipros."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cache
from typing import Any

from pipros_bridges.limits import BridgeLimits
from pipros_bridges.outbox import ClientOutbox
from pipros_bridges.rosbridge.session import RosbridgeNode
from pipros_bridges.rosbridge.text_input import BadInput, json_object
from rosbridge_library.protocol import Protocol
from rospy.session import session


class RosbridgeProtocol(Protocol):
    """The protocol of one client: rosbridge's operations, and the operations that capabilities register.

    The process's rospy node performs rosbridge's operations. The server passes received text to `incoming`,
    and assigns a function to `outgoing`.
    """

    def __init__(self, client_id: Any, parameters: Any = None) -> None:
        self.parameters = parameters
        super().__init__(client_id)
        bridge = shared_bridge()
        self._sending = threading.Lock()
        self._outbox = ClientOutbox(bridge.limits.of(BridgeLimits).bridge_queue_bytes, self._send_all)
        self._session = bridge.connect(self._outbox)

    def incoming(self, message_string: str | bytes = "") -> None:
        """Handle text from the client: an operation or a fragment of an operation."""
        if self.operations and self._is_registered(message_string):
            super().incoming(message_string)
        else:
            self._session.receive(message_string)

    def finish(self) -> None:
        """Release the client's resources after its connection has closed."""
        super().finish()
        self._session.close()

    def _is_registered(self, text: str | bytes) -> bool:
        try:
            return json_object(text).get("op") in self.operations
        except (BadInput, TypeError):
            return False

    def _send_all(self) -> None:
        with self._sending:
            while (frames := self._outbox.pop()) is not None:
                for frame in frames:
                    data = b"".join(frame.parts)
                    self.outgoing(data.decode() if frame.is_text else data)


@cache
def shared_bridge() -> RosbridgeNode:
    """Return the bridge that all clients in the process share.

    Raises:
        RuntimeError: `rospy.init_node` was not called.
    """
    if session.node is None:
        raise RuntimeError("call rospy.init_node before RosbridgeProtocol")
    return RosbridgeNode(session.node, call_later)


def call_later(delay_s: float, function: Callable[[], object]) -> None:
    """Call a function after a delay, in a thread that does not keep the process alive."""
    timer = threading.Timer(delay_s, function)
    timer.daemon = True
    timer.start()
