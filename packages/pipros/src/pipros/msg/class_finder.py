"""Find the classes of messages whose definitions were received over a connection or read from a bag.

An installed package's class is used if its definition has the same MD5 sum, so that messages are instances of
the class that `from package.msg import Name` imports. Otherwise, the class is created from the received
definition. Therefore, messages of types that are not installed can be read, and an installed type with the
same name is not affected.
"""

from __future__ import annotations

import re

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg.base import Message
from pipros.msg.language.digest import complete
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import DefinitionError, MessageSpec

DEFINITION_CACHE_BYTES = 64 * 1024 * 1024
"""Limit: definitions from peers and bags whose classes are kept for further messages. Beyond it, the cached
classes are discarded, and created again when they are needed.
"""

_CLASS_BYTES = 20_000
"""Approximate memory that the class for a small definition uses."""
_MD5_OF_NO_FIELDS = "d41d8cd98f00b204e9800998ecf8427e"


class MissingDefinition(PiprosError):
    """No definition was received, and no installed type has the requested name and MD5 sum."""


class ClassFinder:
    """Finder and cache of message classes by type and MD5 sum.

    A peer could send new definitions forever, so the cache is emptied when it would exceed
    `DEFINITION_CACHE_BYTES`.
    """

    def __init__(self) -> None:
        self._max_bytes = DEFINITION_CACHE_BYTES
        self._bytes = 0
        self._known: dict[tuple[str, str, str], type[Message]] = {}

    def find(self, type_name: str, md5sum: str, definition: str) -> type[Message]:
        """Return the class for the type with the given MD5 sum, which is empty if it is not known.

        Raises:
            MissingDefinition: `definition` is empty although the type has fields, and no installed type has
                this name and MD5 sum.
            DefinitionError: the definition is invalid.
        """
        key = type_name, md5sum, definition
        found = self._known.get(key)
        if found is None:
            found = _find(*key)
            size = _CLASS_BYTES + len(definition)
            if self._bytes + size > self._max_bytes:
                self._bytes = 0
                self._known.clear()
            self._bytes += size
            found = self._known.setdefault(key, found)  # another thread may have found it, too
            self._known.setdefault((type_name, found._md5sum, definition), found)  # if `md5sum` is not known
        return found


def installed_class(type_name: str) -> type[Message] | None:
    """Return a type's class from an installed package, or None if it cannot be loaded."""
    from pipros.msg import load_message_class

    try:
        return load_message_class(type_name)
    except PiprosError:
        return None


def _find(type_name: str, md5sum: str, definition: str) -> type[Message]:
    installed = installed_class(type_name)
    is_unknown = md5sum == "*" and not definition.strip()  # as subscribers of any type send
    if installed is not None and (installed._md5sum == md5sum or is_unknown):
        return installed
    if not definition.strip() and md5sum != _MD5_OF_NO_FIELDS:
        raise MissingDefinition(f"no definition of {type_name} has the md5 sum {md5sum}")
    try:
        made = _class_of_text(type_name, definition)
    except DefinitionError:
        completed = _completed(type_name, md5sum, definition)
        if completed is None:
            raise
        return completed
    if made._md5sum != md5sum and md5sum:
        return _completed(type_name, md5sum, definition) or made
    return made


def _class_of_text(type_name: str, definition: str) -> type[Message]:
    from pipros.msg.dynamic import message_classes_from_text

    return message_classes_from_text(type_name, definition)[type_name]


def _completed(type_name: str, md5sum: str, definition: str) -> type[Message] | None:
    """Return the class for a definition that lacks embedded types, or was cut within them.

    rosjava omits them, and some recorders cut long texts. They are taken from installed packages. Return None
    if the MD5 sum does not then agree.
    """
    from pipros.msg.importing.hook import installed_library

    head, *others = re.split(r"^={3,}\s*\n?", definition.replace("\r\n", "\n"), flags=re.MULTILINE)
    texts = dict(each.removeprefix("MSG: ").split("\n", 1) for each in others if "\n" in each)
    installed = installed_library().definitions

    def lookup(name: str) -> MessageSpec:
        try:
            return installed.message(name)
        except NotFound:
            if name not in texts:
                raise
            return parse_message(texts[name], name)

    try:
        whole = complete(parse_message(head, type_name), lookup)
        return _class_of_text(type_name, whole.full_text()) if whole.md5() == md5sum else None
    except (DefinitionError, NotFound):
        return None
