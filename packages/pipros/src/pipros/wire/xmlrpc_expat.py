"""The complete XML-RPC reader: reads any valid document, and explains why others are invalid.

Theory of operation: the reader keeps a stack of open elements. `_MAY_CONTAIN` lists which elements an element
may contain; all others are errors. Complete values are collected in the enclosing element, and combined when
it closes. Attributes, comments and CDATA are handled as specified by XML. A DTD is refused at its first byte,
so only the five predefined entities exist.

The document is passed to Expat in slices, because Expat holds the interpreter lock while it reads a slice,
and a server reads large documents in a thread while it responds to other requests. A tag or comment longer
than a few slices is refused, because Expat would rescan it from its start with each slice, and would process
a tag with a million attributes in one go.
"""

from __future__ import annotations

import re
from binascii import Error as Base64Error
from binascii import a2b_base64
from collections.abc import Callable
from typing import Any, Final
from xml.parsers import expat

from pipros.basics.errors import LimitExceeded, ProtocolError

_SCALARS = frozenset(
    ["int", "i1", "i2", "i4", "i8", "string", "double", "boolean", "base64", "dateTime.iso8601"]
)
_MAY_CONTAIN: dict[str, frozenset[str]] = {
    "": frozenset(["methodCall", "methodResponse"]),
    "methodCall": frozenset(["methodName", "params"]),
    "methodResponse": frozenset(["params", "fault"]),
    "params": frozenset(["param"]),
    "param": frozenset(["value"]),
    "fault": frozenset(["value"]),
    "value": _SCALARS | {"array", "struct"},
    "array": frozenset(["data"]),
    "data": frozenset(["value"]),
    "struct": frozenset(["member"]),
    "member": frozenset(["name", "value"]),
}
_NOTHING: frozenset[str] = frozenset()

SLICE_BYTES: Final = 32 * 1024
"""Size of a slice. Expat reads a slice in less than a millisecond, regardless of its content."""
TAG_LIMIT_BYTES: Final = 64 * 1024
"""Maximum length of a tag, comment or processing instruction."""


def decode_call(body: bytes | bytearray, nesting_limit: int) -> tuple[str, tuple[Any, ...]]:
    """Return the method and parameters of a call, like `wire.xmlrpc.decode_call`."""
    root, children = _read(body, nesting_limit)
    if root != "methodCall" or not children or not isinstance(children[0], _Name):
        raise ProtocolError("the document must be an XML-RPC call: a methodCall element with a methodName")
    params = children[1] if len(children) == 2 else []
    if len(children) > 2 or not isinstance(params, list):
        raise ProtocolError("a methodCall must have one methodName and at most one params element")
    return children[0].text, tuple(params)


def decode_response(body: bytes | bytearray, nesting_limit: int) -> tuple[Any, bool]:
    """Return the value of a response, and whether it is a fault."""
    root, children = _read(body, nesting_limit)
    if root == "methodResponse" and len(children) == 1:
        [content] = children
        if isinstance(content, _Fault):
            return content.value, True
        if isinstance(content, list) and len(content) == 1:
            return content[0], False
    raise ProtocolError(
        "the document must be an XML-RPC response: a methodResponse element with one value or a fault"
    )


class _Name:
    __slots__ = ("text",)

    def __init__(self, text: str) -> None:
        self.text = text


class _Fault:
    __slots__ = ("value",)

    def __init__(self, value: Any) -> None:
        self.value = value


class _Element:
    __slots__ = ("children", "tag", "text")

    def __init__(self, tag: str) -> None:
        self.tag = tag
        self.text: list[str] = []
        self.children: list[Any] = []


def _read(body: bytes | bytearray, nesting_limit: int) -> tuple[str, list[Any]]:
    """Return the name of the root element and the values that it contains."""
    document = _Element("")
    open_elements = [document]
    containers = 0

    def start(tag: str, _attributes: dict[str, str]) -> None:
        nonlocal containers
        parent = open_elements[-1]
        if tag not in _MAY_CONTAIN.get(parent.tag, _NOTHING):
            if tag == "nil":
                raise ProtocolError("ROS does not support the value nil")
            raise ProtocolError(f"element <{tag[:40]}> is not allowed in <{parent.tag}> in XML-RPC")
        if tag in ("array", "struct"):
            containers += 1
            if containers > nesting_limit:
                raise LimitExceeded(f"XML-RPC values must be nested at most {nesting_limit} levels deep")
        open_elements.append(_Element(tag))

    def characters(text: str) -> None:
        open_elements[-1].text.append(text)

    def end(tag: str) -> None:
        nonlocal containers
        element = open_elements.pop()
        if tag in ("array", "struct"):
            containers -= 1
        open_elements[-1].children.append(_close(element))
        if tag in ("methodCall", "methodResponse"):
            document.tag = tag
            document.children = element.children

    def refuse_dtd(*_: Any) -> None:
        raise ProtocolError("an XML-RPC document must not contain a DTD, because a DTD can define entities")

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = refuse_dtd
    try:
        for fed in range(SLICE_BYTES, len(body), SLICE_BYTES):
            parser.Parse(body[fed - SLICE_BYTES : fed], False)
            if fed - parser.CurrentByteIndex > TAG_LIMIT_BYTES:
                raise LimitExceeded(f"a tag or comment in XML-RPC must have at most {TAG_LIMIT_BYTES} bytes")
        parser.Parse(body[(max(len(body), 1) - 1) // SLICE_BYTES * SLICE_BYTES :], True)
    except expat.ExpatError as error:
        raise ProtocolError(f"the XML-RPC document is not well-formed XML: {error}") from None
    except (UnicodeError, LookupError) as error:
        raise ProtocolError(f"cannot decode the XML-RPC document: {error}") from None
    return document.tag, document.children


def _close(element: _Element) -> Any:
    tag, children = element.tag, element.children
    text = "".join(element.text)
    if tag in _MAY_CONTAIN and children and text.strip():
        raise ProtocolError(f"<{tag}> in XML-RPC must not contain text, got {text.strip()[:40]!r}")
    if convert := _CONVERT.get(tag):
        try:
            return convert(text)
        except (ValueError, Base64Error) as error:
            raise ProtocolError(f"<{tag}> in XML-RPC has invalid content {text[:40]!r}: {error}") from None
    if tag == "value":
        if not children:
            return text
        return _only_child(element)
    if tag == "struct":
        return dict(children)
    if tag == "member":
        if len(children) != 2 or not isinstance(children[0], _Name):
            raise ProtocolError("a member of an XML-RPC struct needs one name and one value, in this order")
        return children[0].text, children[1]
    if tag == "fault":
        return _Fault(_only_child(element))
    if tag in ("param", "array"):
        return _only_child(element)
    return children


def _only_child(element: _Element) -> Any:
    if len(element.children) != 1:
        raise ProtocolError(
            f"<{element.tag}> in XML-RPC must contain one element, got {len(element.children)}"
        )
    return element.children[0]


_INTEGER = r"\s*[+-]?[0-9]{1,20}\s*"


def _integer(text: str) -> int:
    if not re.fullmatch(_INTEGER, text, re.ASCII):
        raise ValueError("not an integer")
    value = int(text)
    if not -(2**31) <= value < 2**31:
        raise ValueError("beyond 32 bits")
    return value


def _double(text: str) -> float:
    if "_" in text:
        raise ValueError("not a number")
    return float(text)


def _boolean(text: str) -> bool:
    if text.strip() not in ("0", "1"):
        raise ValueError("not a boolean")
    return text.strip() == "1"


def _binary(text: str) -> Any:
    from xmlrpc.client import Binary

    return Binary(a2b_base64(text))


def _date(text: str) -> Any:
    from xmlrpc.client import DateTime

    return DateTime(text.strip())


_CONVERT: dict[str, Callable[[str], Any]] = {
    "int": _integer,
    "i1": _integer,
    "i2": _integer,
    "i4": _integer,
    "i8": _integer,
    "double": _double,
    "boolean": _boolean,
    "string": str,
    "name": _Name,
    "methodName": _Name,
    "base64": _binary,
    "dateTime.iso8601": _date,
}
