"""Messages of any type, undecoded, and the classes that decode them.

A command subscribes with the wildcard type, so it can receive any topic. The class comes from the
installed package if its definition equals the publisher's, else from the definition
in the publisher's connection header, so types of packages that are not installed are shown as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.errors import PiprosError
from pipros.graph.errors import GraphError
from pipros.msg.base import Message
from pipros.node.any_msg import RawMessage
from pipros.printable import printable


class MessageClasses:
    """Finds the class of a connection header, once for each definition."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], type[Message]] = {}

    def of(self, header: Mapping[str, str]) -> type[Message]:
        """Raises:
        GraphError: the publisher sent no definition of a type that is not installed.
        """
        key = header.get("type", "*"), header.get("md5sum", "*")
        if key not in self._known:
            self._known[key] = self._find(*key, header.get("message_definition", ""))
        return self._known[key]

    def decode(self, raw: RawMessage) -> Any:
        """The message. Raises `DeserializationError` when the bytes do not fit the announced type."""
        return self.of(raw.header)._from_bytes(raw.body)

    @staticmethod
    def _find(type_name: str, md5sum: str, definition: str) -> type[Message]:
        installed = installed_class(type_name)
        if installed is not None and installed._md5sum == md5sum:
            return installed
        if not definition and installed is None:
            raise GraphError(
                f"Cannot load message class for [{printable(type_name)}]. Are your messages built?"
            )
        from pipros.msg.dynamic import message_classes_from_text

        return message_classes_from_text(type_name, definition)[type_name]


def installed_class(type_name: str) -> type[Message] | None:
    """The class of a type whose package is on the path, else None."""
    from pipros.msg import load_message_class

    try:
        return load_message_class(type_name)
    except PiprosError:
        return None
