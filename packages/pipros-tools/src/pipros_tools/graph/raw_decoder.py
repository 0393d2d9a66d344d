"""Decodes messages of any type.

A command subscribes with the wildcard type, so it can receive any topic. The publisher's connection header
names the actual type.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.basics.printable import printable
from pipros.msg.class_finder import ClassFinder, MissingDefinition
from pipros.node.any_msg import AnyMsg
from pipros_tools.graph.errors import GraphError

if TYPE_CHECKING:
    from pipros.msg.base import Message


class WrongDefinition(GraphError):
    """A publisher's definition of a type differs from the installed one."""


def decode_as(raw: AnyMsg, topic: str, message_class: type[Message]) -> Any:
    """Decode the message as an instance of `message_class`.

    Raises:
        WrongDefinition: the publisher's definition differs, even if the type has the same name.
        DeserializationError: the bytes do not fit the announced type.
    """
    header = raw.header
    if header.get("md5sum") != message_class._md5sum:
        raise WrongDefinition(
            f"[{topic}]: {printable(header.get('callerid', 'a node'))} publishes "
            f"[{printable(header.get('type'))}/{printable(header.get('md5sum'))}] "
            f"instead of [{message_class._type}/{message_class._md5sum}]"
        )
    return message_class._from_bytes(raw.body)


class RawDecoder:
    """Decodes messages with the installed class, or with the publisher's definition if none matches it."""

    def __init__(self) -> None:
        self._classes = ClassFinder()

    def decode(self, raw: AnyMsg) -> Any:
        """Decode a message.

        Raises:
            GraphError: the type is not installed and the publisher sent no definition.
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
