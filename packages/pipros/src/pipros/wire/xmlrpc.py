"""XML-RPC documents: values to bytes and back, with limits.

`decode_call` and `decode_response` use two readers. The fast reader (`xmlrpc_fast`) accepts only the plain
documents that ROS peers send. The complete reader (`xmlrpc_expat`) reads all other documents with Expat. Only
the complete reader decides which documents are invalid, so every error text is in one place.
A property test checks that both readers agree on every document that the fast reader accepts.

The fast reader reads a nested dictionary with 1,000 keys in 0.9 ms instead of 4.6 ms (`xmlrpc.client`:
3.3 ms), and a `getParam` call in 2 us instead of 9 us. Compiling its patterns takes 4 ms, longer than all the
calls of a typical command and of a node's start, so Expat reads the first short documents of each process.
"""

from __future__ import annotations

import itertools
import re
import sys
from typing import Any, Final

from pipros.basics.errors import LimitExceeded, PiprosError, ProtocolError
from pipros.basics.limits import limit_text, process_limits

NESTING_LIMIT: Final = 100
"""Maximum nesting of lists and dictionaries in a call; far below Python's recursion limit."""
ANSWER_NESTING_LIMIT: Final = 200
"""Maximum nesting in a response. It is higher, because a parameter tree contains values below nested keys.
"""
BRIEF_BYTES: Final = 16 * 1024
BRIEF_DOCUMENTS: Final = 500
"""For this many documents of up to BRIEF_BYTES, importing the fast reader is not worthwhile."""
INT_MIN: Final = -(2**31)
INT_MAX: Final = 2**31 - 1


class Fault(PiprosError):
    """The peer replied with an XML-RPC fault: the method does not exist, or it raised an exception.

    Attributes:
        code: the fault code; ROS peers use 1 (Python) or -1 (C++).
        text: the peer's message.
    """

    def __init__(self, code: int, text: str) -> None:
        self.code = code
        self.text = text
        super().__init__(f"fault {code}: {text}")


# ---- values to text


class Encoded:
    """A value that is already encoded, and is inserted unchanged into an array or struct in a response."""

    __slots__ = ("text",)

    def __init__(self, value: Any, *, size_limit: int | None = None) -> None:
        """Encode `value`. Raises the same errors as `encode_call` and `encode_response`."""
        parts: list[str] = []
        _encode(value, parts, ANSWER_NESTING_LIMIT - 1, _Budget(size_limit))
        self.text = "".join(parts)


class ValueTooLarge(PiprosError):
    """A value exceeds the caller's `size_limit`."""


def encode_call(method: str, params: tuple[Any, ...] | list[Any], *, size_limit: int | None = None) -> bytes:
    """Return a `methodCall` document.

    Raises:
        ValueTooLarge: `size_limit` is exceeded, as in `encode_response`.
        TypeError: XML-RPC cannot represent a value (None, a set, a dictionary key that is not a string), or
            values are nested too deeply.
        OverflowError: an integer exceeds 32 bits.
        ValueError: a string has characters that XML cannot represent, such as control characters.
    """
    parts = ["<?xml version='1.0'?>\n<methodCall><methodName>", _escape(method), "</methodName><params>"]
    budget = _Budget(size_limit)
    for param in params:
        parts.append("<param>")
        _encode(param, parts, NESTING_LIMIT, budget)
        parts.append("</param>")
    parts.append("</params></methodCall>\n")
    return _join(parts)


def encode_response(value: Any, *, size_limit: int | None = None) -> bytes:
    """Return a `methodResponse` document with one value. Raises the same errors as `encode_call`.

    Raises:
        ValueTooLarge: the value has more than `size_limit` elements. A long string or binary value counts as
            one element per `SLICE_CHARACTERS`. This is raised as soon as the count exceeds the limit.
    """
    parts = ["<?xml version='1.0'?>\n<methodResponse><params><param>"]
    _encode(value, parts, ANSWER_NESTING_LIMIT, _Budget(size_limit))
    parts.append("</param></params></methodResponse>\n")
    return _join(parts)


def encode_fault(code: int, text: str) -> bytes:
    """Return a fault document. Never raises: characters that XML forbids become `?`."""
    text = re.sub(_NOT_XML, "?", text)
    return (
        "<?xml version='1.0'?>\n<methodResponse><fault><value><struct>"
        f"<member><name>faultCode</name><value><int>{code}</int></value></member>"
        f"<member><name>faultString</name><value><string>{_escape(text)}</string></value></member>"
        "</struct></value></fault></methodResponse>\n"
    ).encode("utf-8", "replace")


class _Budget:
    """The number of elements that may still be encoded."""

    __slots__ = ("_left",)

    def __init__(self, limit: int | None) -> None:
        self._left = sys.maxsize if limit is None else limit

    def spend(self, size: int) -> None:
        self._left -= size
        if self._left < 0:
            raise ValueTooLarge


SLICE_CHARACTERS: Final = 500
"""Longer strings are encoded in slices of this length, and large documents are joined in several steps, so
that other threads can run in between.
"""
_PARTS_AT_A_TIME: Final = 1_000


def _join(parts: list[str]) -> bytes:
    if len(parts) <= _PARTS_AT_A_TIME:
        return "".join(parts).encode("utf-8", "strict")
    starts = range(0, len(parts), _PARTS_AT_A_TIME)
    return b"".join(
        ["".join(parts[start : start + _PARTS_AT_A_TIME]).encode("utf-8", "strict") for start in starts]
    )


_NOT_XML: Final = "[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]"
"""The characters that XML forbids. The pattern is compiled on first use; most processes never need it."""


def _escape(text: str) -> str:
    if text.isidentifier():  # fast path: most keys need none of the searches below
        return text
    if not text.isprintable() and (found := re.search(_NOT_XML, text)):
        raise ValueError(f"XML-RPC cannot represent the character {found[0]!r} in {text[:80]!r}")
    if "&" in text or "<" in text or ">" in text:
        return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return text


def _encode(value: Any, parts: list[str], depth_left: int, budget: _Budget) -> None:
    scalar = _encode_scalar(value)
    if scalar:
        parts.append(scalar)
        return
    kind = type(value)
    if kind is str:
        parts += ["<value><string>", *_slices(value, budget), "</string></value>"]
    elif kind is list or kind is tuple:
        if not depth_left:
            raise TypeError("cannot marshal lists nested this deeply, or recursive sequences")
        budget.spend(len(value))
        parts.append("<value><array><data>")
        for item in value:
            _encode(item, parts, depth_left - 1, budget)
        parts.append("</data></array></value>")
    elif kind is dict:
        if not depth_left:
            raise TypeError("cannot marshal dictionaries nested this deeply, or recursive dictionaries")
        budget.spend(len(value))
        parts.append("<value><struct>")
        for key, item in value.items():
            if type(key) is not str:
                raise TypeError("dictionary key must be string")
            if len(key) > SLICE_CHARACTERS:
                name = "".join(_slices(key, budget))
            else:  # saves a call for most keys
                name = key if key.isidentifier() else _escape(key)
            scalar = _encode_scalar(item)
            if scalar:
                parts.append(f"<member><name>{name}</name>{scalar}</member>")
            else:
                parts.append(f"<member><name>{name}</name>")
                _encode(item, parts, depth_left - 1, budget)
                parts.append("</member>")
        parts.append("</struct></value>")
    else:
        parts.append(
            _encoded_text(value, budget) if kind is Encoded else _encode_rare(value, depth_left, budget)
        )


def _encode_scalar(value: Any) -> str:
    """Encode a number, a boolean or a short string; return an empty string for other values."""
    kind = type(value)
    if kind is float:
        return f"<value><double>{value!r}</double></value>"
    if kind is int:
        if not INT_MIN <= value <= INT_MAX:
            raise OverflowError("int exceeds XML-RPC limits")
        return f"<value><int>{value}</int></value>"
    if kind is str:
        return f"<value><string>{_escape(value)}</string></value>" if len(value) <= SLICE_CHARACTERS else ""
    if kind is bool:
        return "<value><boolean>1</boolean></value>" if value else "<value><boolean>0</boolean></value>"
    return ""


def _encoded_text(encoded: Encoded, budget: _Budget) -> str:
    budget.spend(len(encoded.text) // SLICE_CHARACTERS)
    return encoded.text


def _slices(text: str, budget: _Budget) -> list[str]:
    """Return a long string as escaped slices."""
    budget.spend(len(text) // SLICE_CHARACTERS)
    starts = range(0, len(text), SLICE_CHARACTERS)
    return [_escape(text[start : start + SLICE_CHARACTERS]) for start in starts]


PARAMETER_RULE = (
    "a parameter must consist of booleans, integers of 32 bits, floats, strings, binary data, dates with"
    " times, lists and dictionaries with strings as keys"
)
"""Why a value cannot be a parameter, for users, to whom the errors of `encode_call` say nothing."""


def _encode_rare(value: Any, depth_left: int, budget: _Budget) -> str:
    """Encode binary data and dates, and other objects as dictionaries of their attributes, as Python does.

    `xmlrpc.client` and `datetime` are used only if they have already been imported.
    """
    if value is None:
        raise TypeError("cannot marshal None unless allow_none is enabled")
    if isinstance(value, (bytes, bytearray)):
        return _encode_binary(bytes(value), budget)
    if client := sys.modules.get("xmlrpc.client"):
        if type(value) is client.Binary:
            return _encode_binary(value.data, budget)
        if type(value) is client.DateTime:
            return f"<value><dateTime.iso8601>{_escape(value.value)}</dateTime.iso8601></value>"
    if (dates := sys.modules.get("datetime")) and type(value) is dates.datetime:
        return f"<value><dateTime.iso8601>{value:%Y%m%dT%H:%M:%S}</dateTime.iso8601></value>"
    if isinstance(value, str | int | float | list | tuple | dict) or not hasattr(value, "__dict__"):
        raise TypeError(f"cannot marshal {type(value)} objects")
    parts: list[str] = []
    _encode(vars(value), parts, depth_left, budget)
    return "".join(parts)


def _encode_binary(data: bytes, budget: _Budget) -> str:
    from binascii import b2a_base64

    budget.spend(len(data) // SLICE_CHARACTERS)
    return f"<value><base64>\n{b2a_base64(data).decode('ascii')}</base64></value>"


# ---- text to values


def decode_call(body: bytes | bytearray, *, limit_bytes: int | None = None) -> tuple[str, tuple[Any, ...]]:
    """Return the method and parameters of a `methodCall` document. The default limit is `Limits.body_bytes`.

    Base64 is returned as `xmlrpc.client.Binary`, and dates as `xmlrpc.client.DateTime`, as in genuine ROS.

    Raises:
        LimitExceeded: the document is larger or deeper than the limits.
        ProtocolError: the document is not an XML-RPC call, or contains a DTD, nil, or an integer beyond 32
            bits. (The master could store such an integer, but not send it.)
    """
    _check_size(body, "body_bytes", process_limits().body_bytes if limit_bytes is None else limit_bytes)
    if _is_worth_the_fast_reader(body):
        from pipros.wire import xmlrpc_fast

        try:
            return xmlrpc_fast.decode_call(body, NESTING_LIMIT)
        except xmlrpc_fast.NeedsExpat:
            pass  # the complete reader reads the document or raises the error
    from pipros.wire import xmlrpc_expat

    return xmlrpc_expat.decode_call(body, NESTING_LIMIT)


def decode_response(body: bytes | bytearray, *, limit_bytes: int | None = None) -> Any:
    """Return the value of a `methodResponse` document. The default limit is `Limits.answer_bytes`.

    Raises:
        Fault: the document is a fault.
        LimitExceeded, ProtocolError: as in `decode_call`.
    """
    _check_size(body, "answer_bytes", process_limits().answer_bytes if limit_bytes is None else limit_bytes)
    if _is_worth_the_fast_reader(body):
        from pipros.wire import xmlrpc_fast

        try:
            return xmlrpc_fast.decode_response(body, ANSWER_NESTING_LIMIT)
        except xmlrpc_fast.NeedsExpat:
            pass  # the complete reader reads the document or raises the error
    from pipros.wire import xmlrpc_expat

    value, is_fault = xmlrpc_expat.decode_response(body, ANSWER_NESTING_LIMIT)
    if is_fault:
        if not isinstance(value, dict) or type(value.get("faultCode")) is not int:
            raise ProtocolError("an XML-RPC fault must contain faultCode and faultString")
        raise Fault(value["faultCode"], str(value.get("faultString", "")))
    return value


_documents = itertools.count(1)


def _is_worth_the_fast_reader(body: bytes | bytearray) -> bool:
    return (
        len(body) > BRIEF_BYTES
        or "pipros.wire.xmlrpc_fast" in sys.modules
        or next(_documents) > BRIEF_DOCUMENTS
    )


def _check_size(body: bytes | bytearray, limit_name: str, limit_bytes: int) -> None:
    if len(body) > limit_bytes:
        limit = limit_text(limit_name, limit_bytes)
        raise LimitExceeded(f"the XML-RPC document has {len(body)} bytes; {limit}")
