"""`Capability`, the base of classes that add operations to a protocol."""

from __future__ import annotations

from typing import Any

from rosbridge_library.internal.exceptions import InvalidArgumentException, MissingArgumentException
from rosbridge_library.protocol import Protocol


class Capability:
    """One or more operations of a client's protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def handle_message(self, message: dict[str, Any]) -> None:
        """Handle an operation. For subclasses."""

    def finish(self) -> None:
        """Release what the client used: its connection has ended. For subclasses."""

    def basic_type_check(self, msg: dict[str, Any], types_info: list[tuple[Any, ...]]) -> None:
        """Check the arguments of an operation.

        Args:
            types_info: for each argument whether it is required, its name, and its type or types, if any.

        Raises:
            MissingArgumentException, InvalidArgumentException: an argument is missing, or has another type.
        """
        for mandatory, name, *kinds in types_info:
            if mandatory and name not in msg:
                raise MissingArgumentException(f"missing required argument {name}")
            if name not in msg or not kinds:
                continue
            allowed = kinds[0] if isinstance(kinds[0], tuple) else (kinds[0],)
            if not isinstance(msg[name], allowed):
                names = " or ".join(kind.__name__ for kind in allowed)
                raise InvalidArgumentException(f"{name} must be of type {names}, got {msg[name]!r}")
