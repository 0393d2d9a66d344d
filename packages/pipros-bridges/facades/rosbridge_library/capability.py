"""`Capability`, the base class for classes that add operations to a protocol."""

from __future__ import annotations

from typing import Any

from rosbridge_library.internal.exceptions import InvalidArgumentException, MissingArgumentException
from rosbridge_library.protocol import Protocol


class Capability:
    """Handler for one or more operations in a client's protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def handle_message(self, message: dict[str, Any]) -> None:
        """Do nothing. Subclasses override this method to handle operations."""

    def finish(self) -> None:
        """Do nothing. Subclasses release the client's resources here after its connection has closed."""

    def basic_type_check(self, msg: dict[str, Any], types_info: list[tuple[Any, ...]]) -> None:
        """Check the arguments of an operation.

        Args:
            types_info: a tuple for each argument: whether it is required, its name and, optionally, its type
                or types.

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
