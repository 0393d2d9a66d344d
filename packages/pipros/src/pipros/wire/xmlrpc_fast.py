"""The fast XML-RPC reader: reads plain documents, and raises `NeedsExpat` for all others.

It matches whole values with a few regular expressions: tags without attributes, white space between tags, and
text with the five entities of XML. It raises `NeedsExpat` for comments, CDATA, character references, other
encodings, binary data, dates, faults, integers out of range and all errors.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any


class NeedsExpat(Exception):
    """The document contains something that only `xmlrpc_expat` reads, or is invalid."""


def decode_call(body: bytes | bytearray, nesting_limit: int) -> tuple[str, tuple[Any, ...]]:
    """Return the method and parameters of a call, like `wire.xmlrpc.decode_call`, or raise `NeedsExpat`."""
    try:
        return _Scanner(body).call(nesting_limit)
    except ValueError:  # a malformed double
        raise NeedsExpat from None


def decode_response(body: bytes | bytearray, nesting_limit: int) -> Any:
    """Return the value of a response, like `wire.xmlrpc.decode_response`, or raise `NeedsExpat`."""
    try:
        return _Scanner(body).response(nesting_limit)
    except ValueError:  # a malformed double
        raise NeedsExpat from None


# White space and text are bounded, so that a megabyte of either is left to Expat, which handles it faster.
_S = r"[ \t\n]{0,80}"
_T = r"([^<]{0,20000})"
_VALUE = (
    rf"{_S}<value>(?:{_S}<(?:int>([+-]?[0-9]{{1,9}})</int|i4>([+-]?[0-9]{{1,9}})</i4"
    rf"|string>{_T}</string|double>([0-9eE.+-]{{1,40}})</double|boolean>([01])</boolean"
    rf"|int>([+-]?[0-9]{{10}})</int|i4>([+-]?[0-9]{{10}})</i4)>{_S}"
    rf"|{_T})</value>"
)


def _tags(*tags: str) -> Callable[[str, int], re.Match[str] | None]:
    return re.compile(_S + rf">{_S}<".join(tags).join("<>")).match


_DECLARATION = re.compile(r"""<\?xml version=(['"])1\.0\1(?: encoding=(['"])[uU][tT][fF]-8\2)? ?\?>""").match
_METHOD = re.compile(rf"{_S}<methodCall>{_S}<methodName>([A-Za-z0-9_.:/]*)</methodName>{_S}<params>").match
_PARAM = _tags("param")
_PARAM_END = _tags("/param")
_CALL_END = _tags("/params", "/methodCall")
_RESPONSE = _tags("methodResponse", "params", "param")
_RESPONSE_END = _tags("/param", "/params", "/methodResponse")
_ARRAY = _tags("value", "array", "data")
_ARRAY_END = _tags("/data", "/array", "/value")
_STRUCT = _tags("value", "struct")
_STRUCT_END = _tags("/struct", "/value")
_MEMBER_END = _tags("/member")
_NAME = rf"{_S}<member>{_S}<name>{_T}</name>"
_MEMBER_START = re.compile(_NAME).match
_SCALAR = re.compile(_VALUE).match
_SCALAR_MEMBER = re.compile(rf"{_NAME}{_VALUE}{_S}</member>").match

_NOT_PLAIN_BYTES = bytes(set(range(32)) - set(b"\t\n"))
"""Control characters, which XML forbids, and the carriage return, which XML parsers convert to a newline."""
_SLICE_BYTES = 256 * 1024
_NOT_XML = re.compile("[\ufffe\uffff]").search


def _integer(text: str) -> int:
    value = int(text)
    if not -(2**31) <= value < 2**31:
        raise NeedsExpat
    return value


_ENTITY = re.compile("&([^;]{0,8})(;?)")
_ENTITIES = {"amp": "&", "lt": "<", "gt": ">", "quot": '"', "apos": "'"}


def _replace_entity(match: re.Match[str]) -> str:
    character = _ENTITIES.get(match[1])
    if character is None or not match[2]:
        raise NeedsExpat
    return character


def _string(text: str) -> str:
    return _ENTITY.sub(_replace_entity, text) if "&" in text else text


# The converters for the groups in _VALUE, in order. Integers with up to nine digits are never out of range.
_CONVERT: tuple[Callable[[str], Any], ...] = (
    int,
    int,
    _string,
    float,
    "1".__eq__,
    _integer,
    _integer,
    _string,
)


class _Scanner:
    __slots__ = ("_at", "_text")

    def __init__(self, body: bytes | bytearray) -> None:
        # Read the document in slices, so that other threads can run in between.
        for start in range(0, len(body), _SLICE_BYTES):
            piece = body[start : start + _SLICE_BYTES + 2]
            # Only xmlrpc_expat decides whether "]]>" is allowed. The pieces overlap by two bytes to find it.
            if len(piece.translate(None, _NOT_PLAIN_BYTES)) != len(piece) or b"]]>" in piece:
                raise NeedsExpat
        try:
            self._text = text = body.decode("utf-8")
        except UnicodeDecodeError:
            raise NeedsExpat from None
        if not text.isascii() and _NOT_XML(text):
            raise NeedsExpat
        declaration = _DECLARATION(text)
        self._at = declaration.end() if declaration else 0

    def call(self, depth_left: int) -> tuple[str, tuple[Any, ...]]:
        method: str = self._expect(_METHOD)[1]
        params: list[Any] = []
        while match := _PARAM(self._text, self._at):
            self._at = match.end()
            params.append(self._value(depth_left))
            self._expect(_PARAM_END)
        self._expect_end(_CALL_END)
        return method, tuple(params)

    def response(self, depth_left: int) -> Any:
        self._expect(_RESPONSE)
        value = self._value(depth_left)
        self._expect_end(_RESPONSE_END)
        return value

    def _expect(self, pattern: Callable[[str, int], re.Match[str] | None]) -> re.Match[str]:
        match = pattern(self._text, self._at)
        if match is None:
            raise NeedsExpat
        self._at = match.end()
        return match

    def _expect_end(self, pattern: Callable[[str, int], re.Match[str] | None]) -> None:
        self._expect(pattern)
        if self._text[self._at :].strip(" \t\n"):
            raise NeedsExpat

    def _value(self, depth_left: int) -> Any:
        match = _SCALAR(self._text, self._at)
        if match is None:
            return self._container(depth_left)
        self._at = match.end()
        group = match.lastindex or 0
        return _CONVERT[group - 1](match[group])

    def _container(self, depth_left: int) -> Any:
        if not depth_left:
            raise NeedsExpat
        if match := _STRUCT(self._text, self._at):
            self._at = match.end()
            return self._members(depth_left - 1)
        self._expect(_ARRAY)
        return self._items(depth_left - 1)

    def _members(self, depth_left: int) -> dict[str, Any]:
        text, at = self._text, self._at
        members: dict[str, Any] = {}
        while True:
            if match := _SCALAR_MEMBER(text, at):
                at = match.end()
                group = match.lastindex or 0
                name, value = match.group(1, group)
                members[_string(name) if "&" in name else name] = _CONVERT[group - 2](value)
            elif match := _MEMBER_START(text, at):
                self._at = match.end()
                members[_string(match[1])] = self._container(depth_left)
                at = self._expect(_MEMBER_END).end()
            else:
                self._at = at
                self._expect(_STRUCT_END)
                return members

    def _items(self, depth_left: int) -> list[Any]:
        text, at = self._text, self._at
        items: list[Any] = []
        while True:
            if match := _SCALAR(text, at):
                at = match.end()
                group = match.lastindex or 0
                items.append(_CONVERT[group - 1](match[group]))
            elif match := _ARRAY_END(text, at):
                self._at = match.end()
                return items
            else:
                self._at = at
                items.append(self._container(depth_left))
                at = self._at
