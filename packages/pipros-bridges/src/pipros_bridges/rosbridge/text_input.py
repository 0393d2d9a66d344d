"""Find the JSON objects in a client's data: text split at arbitrary positions, and `fragment` operations.

The size of a client's incomplete data is limited. Errors do not stop the parser: text that is not a JSON
object is discarded with an error for the client, and reading continues with the next object.
"""

from __future__ import annotations

import gc
import json
import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from pipros.basics.budget import Budget
from pipros.basics.errors import PiprosError
from pipros.basics.limits import limit_text

_MARK = re.compile(r'[{}"\\]')
_MARK_IN_STRING = re.compile(r'["\\]')
_SHOWN = 60
_CHECKED_CHARACTERS = 4096
_LONG_CHARACTERS = 65_536
_LONG_TEXTS = threading.Lock()
"""Held while a long text is parsed. Parsing stops all other threads; without the lock, each of them would
wait until the texts of all clients have been parsed, instead of one text.
"""
_LIST_BYTES, _DICT_BYTES, _ITEM_BYTES, _QUOTE_BYTES = 90, 250, 40, 30
"""Memory of Python objects, rounded up. `{}` and `[]` need 30 times as much memory as their text."""


class BadInput(PiprosError):
    """Text from a client is not a JSON object, or is too long."""


def parsed_json_bytes(text: str | bytes) -> int:
    """Return an upper bound on the memory of a JSON text and its parsed values, or 0 for a short text.

    The text is not parsed to find this out, because parsing stops all other threads for about 10 ms per MiB.
    """
    if len(text) <= _CHECKED_CHARACTERS:
        return 0
    text = text if isinstance(text, str) else text.decode(errors="replace")
    objects = text.count("[") * _LIST_BYTES + text.count("{") * _DICT_BYTES
    return 2 * text.__sizeof__() + objects + text.count(",") * _ITEM_BYTES + text.count('"') * _QUOTE_BYTES


def json_object(text: str | bytes) -> dict[str, Any]:
    """Parse text that must be a single JSON object.

    Raises:
        BadInput: the text is not a JSON object, or is nested too deeply.
    """
    try:
        value = _long_value(text) if len(text) > _LONG_CHARACTERS else json.loads(text)
    except RecursionError:
        raise BadInput("the JSON object is nested too deeply") from None
    except ValueError as error:
        raise BadInput(f"not JSON: {error}") from None
    if not isinstance(value, dict):
        raise BadInput(f"expected a JSON object, got {str(value)[:_SHOWN]!r}")
    return value


def _long_value(text: str | bytes) -> Any:
    """Parse a long text without garbage collection, which would search all new objects repeatedly."""
    with _LONG_TEXTS:
        was_enabled = gc.isenabled()
        gc.disable()
        try:
            return json.loads(text)
        finally:
            if was_enabled:
                gc.enable()


class JsonObjects:
    """Splits a stream of JSON objects without delimiters, by matching their braces."""

    def __init__(self, limit_bytes: int, budget: Budget | None = None) -> None:
        """Keep at most `limit_bytes` of an incomplete object, counted in `budget`."""
        self._limit_bytes = limit_bytes
        self._budget = budget or Budget(limit_bytes)
        self._parts: list[str] = []
        self._held = 0
        self._depth = 0
        self._is_in_string = False
        self._is_escaped = False

    @property
    def is_empty(self) -> bool:
        """Whether no object is incomplete."""
        return not self._depth

    @property
    def held_bytes(self) -> int:
        """Memory of the incomplete object; each part of its text counts with its overhead."""
        return self._held

    def clear(self) -> None:
        """Discard the incomplete object."""
        self._budget.give_back(self._held)
        self._parts, self._held, self._depth = [], 0, 0
        self._is_in_string = self._is_escaped = False

    def feed(self, text: str) -> Iterator[str | BadInput]:
        """Yield the text of each completed object.

        Yield an error for each overlong object and for any text between objects. After an overlong object,
        the rest of `text` is discarded.
        """
        position = 0
        while position < len(text):
            if not self._depth:
                start = text.find("{", position)
                between = text[position : start if start >= 0 else None].strip()
                if between:
                    yield BadInput(f"expected a JSON object, got {between[:_SHOWN]!r}")
                if start < 0:
                    return
                position = start
            end = self._end_of_object(text, position)
            part = text[position:end]
            self._parts.append(part)
            position = end
            if not self._depth:
                whole = "".join(self._parts)
                self.clear()
                yield whole
            elif self._held + part.__sizeof__() > self._limit_bytes or not self._budget.take(
                part.__sizeof__()
            ):
                self.clear()
                limit = limit_text("bridge_message_bytes", self._limit_bytes)
                yield BadInput(f"a JSON object is too long; {limit}")
                return
            else:
                self._held += part.__sizeof__()

    def _end_of_object(self, text: str, position: int) -> int:
        """Return the position after the object's last brace, or the end of the text."""
        if self._is_escaped and position < len(text):
            position += 1
            self._is_escaped = False
        while True:
            found = (_MARK_IN_STRING if self._is_in_string else _MARK).search(text, position)
            if found is None:
                return len(text)
            position = found.end()
            mark = found[0]
            if mark == '"':
                self._is_in_string = not self._is_in_string
            elif mark == "\\":
                if position == len(text):
                    self._is_escaped = True
                position = min(position + 1, len(text))
            elif mark == "{":
                self._depth += 1
            else:
                self._depth -= 1
                if not self._depth:
                    return position


@dataclass(slots=True)
class _Incomplete:
    total: int
    size: int = 0
    parts: dict[int, str] = field(default_factory=dict)
    since_s: float = 0.0


class Fragments:
    """Joins a client's fragments, which may arrive in any order."""

    def __init__(self, limit_bytes: int, timeout_s: float, budget: Budget | None = None) -> None:
        """Keep at most `limit_bytes` of incomplete texts, each for `timeout_s` after its last fragment.

        The texts also count against `budget`.
        """
        self._budget = budget or Budget(2 * limit_bytes)
        self._limit_bytes = limit_bytes
        self._timeout_s = timeout_s
        self._texts: dict[str, _Incomplete] = {}
        self._bytes = 0

    def add(self, fragment: dict[str, Any], now_s: float) -> str | None:
        """Add a fragment. Return the whole text if it is complete.

        Raises:
            BadInput: the fragment is malformed or contradicts earlier fragments, or all fragments together
                are too long.
        """
        for old in [key for key, text in self._texts.items() if now_s - text.since_s > self._timeout_s]:
            self._drop(old)
        number, total, data = fragment.get("num"), fragment.get("total"), fragment.get("data")
        if not isinstance(data, str):
            raise BadInput("fragment: data must be a string")
        if type(total) is not int or type(number) is not int or not 0 <= number < total:
            raise BadInput("fragment: num and total must be integers, 0 <= num < total")
        key = json.dumps(fragment.get("id"))
        if len(key) > _ID_CHARACTERS:
            raise BadInput(f"fragment: id must have at most {_ID_CHARACTERS} characters")
        text = self._texts.setdefault(key, _Incomplete(total))
        if text.total != total:
            self._drop(key)
            raise BadInput("fragment: total differs from that of earlier fragments")
        before = _cost(text.parts[number]) if number in text.parts else 0
        size = _cost(data) - before
        if not self._budget.hold(before, _cost(data)):
            self._drop(key)
            raise BadInput("fragment: incomplete messages exceed the memory for this client")
        text.parts[number] = data
        text.size += size
        text.since_s = now_s
        self._bytes += size
        if len(text.parts) == total:
            self._drop(key)
            return "".join(text.parts[each] for each in range(total))
        if self._bytes > self._limit_bytes:
            for each in list(self._texts):
                self._drop(each)
            limit = limit_text("bridge_message_bytes", self._limit_bytes)
            raise BadInput(f"the incomplete fragments are too long; {limit}")
        return None

    def _drop(self, key: str) -> None:
        size = self._texts.pop(key).size
        self._bytes -= size
        self._budget.give_back(size)


def _cost(data: str) -> int:
    return data.__sizeof__() + _COST_OF_A_FRAGMENT


_ID_CHARACTERS = 1_000
_COST_OF_A_FRAGMENT = 250
"""Memory in bytes that a fragment needs besides its data."""
