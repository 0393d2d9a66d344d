"""The classes of a bag's messages.

The class of an installed package is taken where its definition is the very one of the bag, so that messages
are what `from package.msg import Name` imports. Else it is made of the definition in the bag, apart from all
packages: one of the same name is never disturbed.
"""

from __future__ import annotations

from pipros.bag.connection import Connection
from pipros.bag.errors import BagError
from pipros.errors import PiprosError
from pipros.msg.base import Message
from pipros.msg.language.spec import DefinitionError


class BagClasses:
    """Finds the class of a connection's messages, once for each definition."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str, str], type[Message]] = {}

    def of(self, connection: Connection) -> type[Message]:
        """Raises:
        BagError: the bag's definition is broken, or lacks and no package has the type.
        """
        key = connection.type, connection.md5sum, connection.definition
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._find(connection)
        return found

    def _find(self, connection: Connection) -> type[Message]:
        installed = installed_class(connection.type)
        if installed is not None and installed._md5sum == connection.md5sum:
            return installed
        from pipros.msg.dynamic import message_classes_from_text

        definition = connection.definition
        if not definition.strip() and connection.md5sum != _MD5_OF_NOTHING:
            raise BagError(
                f"the bag has no definition of {connection.type} (topic {connection.topic}), "
                "and no package has the same one"
            )
        try:
            return message_classes_from_text(connection.type, definition)[connection.type]
        except DefinitionError as error:
            raise BagError(
                f"the bag's definition of {connection.type} (topic {connection.topic}) is broken: {error}"
            ) from error


_MD5_OF_NOTHING = "d41d8cd98f00b204e9800998ecf8427e"


def installed_class(type_name: str) -> type[Message] | None:
    """The class of a type whose package is on the path, else None."""
    from pipros.msg import load_message_class

    try:
        return load_message_class(type_name)
    except PiprosError:
        return None
