"""Messages that are passed on as bytes: the class for a type known only from a connection header."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.errors import PiprosError
from pipros.node.any_msg import RawMessage
from pipros.printable import printable


class UnknownType(PiprosError):
    """A publisher does not say what type its messages have."""


def class_like(header: Mapping[str, str]) -> type[RawMessage]:
    """A message class with the type, md5 and definition that a publisher's connection header has.

    What is published with it has the bytes of `body`. Nothing is decoded: the type's package is not needed.

    Raises:
        UnknownType: the header has no type or md5.

    >>> class_like({"type": "a/B", "md5sum": "0" * 32})._type
    'a/B'
    """
    kind, md5sum = header.get("type", ""), header.get("md5sum", "")
    if kind in ("", "*") or md5sum in ("", "*"):
        caller = printable(header.get("callerid", "?"))
        raise UnknownType(f"the publisher [{caller}] does not say what type it publishes")
    text = header.get("message_definition", "")
    return type("Passed", (RawMessage,), {"_type": kind, "_md5sum": md5sum, "_full_text": text})
