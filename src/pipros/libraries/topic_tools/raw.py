"""Message classes for republishing raw messages whose type is known only from a connection header."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.node.any_msg import AnyMsg


class UnknownType(PiprosError):
    """A publisher's connection header does not contain the message type."""


def class_like(header: Mapping[str, str]) -> type[AnyMsg]:
    """Return a message class with the type, MD5 sum and definition in a publisher's connection header.

    Its messages keep their bytes in `body` and are not decoded, so the type's package is not needed.

    Raises:
        UnknownType: the header does not contain a type and an MD5 sum.

    >>> class_like({"type": "a/B", "md5sum": "0" * 32})._type
    'a/B'
    """
    kind, md5sum = header.get("type", ""), header.get("md5sum", "")
    if kind in ("", "*") or md5sum in ("", "*"):
        caller = printable(header.get("callerid", "?"))
        raise UnknownType(f"publisher [{caller}] must send the type and md5sum of its messages")
    text = header.get("message_definition", "")
    return type("Passed", (AnyMsg,), {"_type": kind, "_md5sum": md5sum, "_full_text": text})
