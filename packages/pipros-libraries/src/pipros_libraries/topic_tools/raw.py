"""Message classes for republishing raw messages whose type is known only from a connection header."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.node.any_msg import AnyMsg


class MissingType(PiprosError):
    """A publisher's connection header does not contain the message type or its MD5 sum."""


def class_like(header: Mapping[str, str]) -> type[AnyMsg]:
    """Return a message class with the type, MD5 sum and definition from a publisher's connection header.

    Messages are not decoded, so the package that defines the type is not needed. `body` contains their bytes.

    Raises:
        MissingType: the header lacks the type or the MD5 sum.

    >>> class_like({"type": "a/B", "md5sum": "0" * 32})._type
    'a/B'
    """
    kind, md5sum = header.get("type", ""), header.get("md5sum", "")
    if kind in ("", "*") or md5sum in ("", "*"):
        caller = printable(header.get("callerid", "?"))
        raise MissingType(f"publisher [{caller}] must send the type and md5sum of its messages")
    text = header.get("message_definition", "")
    return type("Passed", (AnyMsg,), {"_type": kind, "_md5sum": md5sum, "_full_text": text})


def raw_service_class(kind: str, md5sum: str) -> Any:
    """Return a service class whose requests and responses are not decoded."""
    request_class = class_like({"type": f"{kind}Request", "md5sum": md5sum})
    response_class = class_like({"type": f"{kind}Response", "md5sum": md5sum})
    return type(
        "PassedService",
        (),
        {
            "_type": kind,
            "_md5sum": md5sum,
            "_request_class": request_class,
            "_response_class": response_class,
        },
    )
