"""Decodes messages of any type.

A command subscribes with the wildcard type, so it can receive any topic; the publisher's connection header
says what came.
"""

from __future__ import annotations

from typing import Any

from pipros.graph.errors import GraphError
from pipros.msg.class_finder import ClassFinder, MissingDefinition
from pipros.node.any_msg import RawMessage
from pipros.printable import printable


class RawDecoder:
    """Decodes by the installed class if the publisher has the same definition, else by the publisher's."""

    def __init__(self) -> None:
        self._classes = ClassFinder()

    def decode(self, raw: RawMessage) -> Any:
        """The message.

        Raises:
            GraphError: the publisher sent no definition of a type that is not installed.
            DeserializationError: the bytes do not fit the announced type.
        """
        header = raw.header
        kind, md5sum = header.get("type", "*"), header.get("md5sum", "*")
        try:
            found = self._classes.find(kind, md5sum, header.get("message_definition", ""))
        except MissingDefinition:
            raise GraphError(
                f"Cannot load message class for [{printable(kind)}]. Are your messages built?"
            ) from None
        return found._from_bytes(raw.body)
