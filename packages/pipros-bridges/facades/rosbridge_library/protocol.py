"""`Protocol`, the base class of `RosbridgeProtocol`: dispatches operations by name, and converts JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import rospy
from pipros_bridges.rosbridge.text_input import BadInput, json_object


class Protocol:
    """The protocol of one client.

    Attributes:
        client_id: identifies the client.
        operations: handlers by operation name.
    """

    parameters: Any = None
    bson_only_mode = False

    def __init__(self, client_id: Any) -> None:
        self.client_id = client_id
        self.capabilities: list[Any] = []
        self.operations: dict[str, Callable[[dict[str, Any]], object]] = {}

    def incoming(self, message_string: str | bytes = "") -> None:
        """Handle an operation from the client. Errors are logged, not raised."""
        try:
            message = json_object(message_string)
        except BadInput as error:
            self.log("error", str(error))
            return
        handle = self.operations.get(str(message.get("op")))
        if handle is None:
            self.log("error", f"unknown operation {message.get('op')!r}", message.get("id"))
            return
        try:
            handle(message)
        except Exception as error:
            self.log("error", f"{message.get('op')}: {error}", message.get("id"))

    def outgoing(self, message: str | bytes, compression: str = "none") -> None:
        """Do nothing. Servers replace this method with a function that sends data to the client."""

    def send(self, message: dict[str, Any], cid: Any = None, compression: str = "none") -> None:
        """Send an operation to the client."""
        del cid
        self.outgoing(self.serialize(message), compression=compression)

    def finish(self) -> None:
        """Release the client's resources after its connection has closed."""
        for capability in self.capabilities:
            capability.finish()
        self.capabilities = []
        self.operations = {}

    def serialize(self, msg: Any, cid: Any = None) -> str:
        """Return an operation as JSON."""
        del cid
        return json.dumps(msg)

    def deserialize(self, msg: str | bytes, cid: Any = None) -> Any:
        """Parse an operation from a JSON document."""
        del cid
        return json_object(msg)

    def register_operation(self, opcode: str, handler: Callable[[dict[str, Any]], object]) -> None:
        """Call `handler` with each operation that has the given name."""
        self.operations[opcode] = handler

    def unregister_operation(self, opcode: str) -> None:
        """Undo `register_operation`."""
        self.operations.pop(opcode, None)

    def add_capability(self, capability_class: Callable[[Any], Any]) -> None:
        """Create an instance of a capability class for this client."""
        self.capabilities.append(capability_class(self))

    def log(self, level: str, message: str, lid: Any = None) -> None:
        """Write a message to the node's log."""
        text = f"[Client {self.client_id}] {f'[id: {lid}] ' if lid is not None else ''}{message}"
        write = {"error": rospy.logerr, "warning": rospy.logwarn, "info": rospy.loginfo}
        write.get(level, rospy.logdebug)(text)
