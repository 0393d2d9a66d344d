"""The classes for the messages of a bag, by connection."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros.msg.class_finder import ClassFinder, MissingDefinition, installed_class
from pipros.msg.language.spec import DefinitionError
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError

FirstMessage = Callable[[Connection], bytes | None]
"""Function that returns the first serialized message of a connection, or None."""


class MessageClasses:
    """Finder of message classes. `classes` finds them by definition."""

    def __init__(self, classes: ClassFinder) -> None:
        self._classes = classes
        self._without_fields: dict[int, Any] = {}

    def of(self, connection: Connection, first_message: FirstMessage) -> Any:
        """Return the class for a connection's messages.

        Raise `BagError` if there is no valid definition of its type.
        """
        kind, topic = connection.type, connection.topic
        try:
            found = self._classes.find(kind, connection.md5sum, connection.definition)
            return found if found.__slots__ else self._one_without_fields(connection, found, first_message)
        except MissingDefinition:
            raise BagError(
                f"the bag has no definition of {kind} (topic {topic}), and no package has the same definition"
            ) from None
        except DefinitionError as error:
            raise BagError(f"the bag's definition of {kind} (topic {topic}) is broken: {error}") from error

    def _one_without_fields(self, connection: Connection, found: Any, first_message: FirstMessage) -> Any:
        """Return the class for a definition without fields: the installed one, if messages are not empty.

        Some recorders store an empty definition instead of one that they do not know.
        """
        known = self._without_fields.get(connection.id)
        if known is None:
            known, installed = found, installed_class(connection.type)
            if installed is None or installed.__slots__:
                known = installed if first_message(connection) else found
            if known is None:
                raise MissingDefinition
            self._without_fields[connection.id] = known
        return known
