"""Find the JSON objects in a client's data: text split at arbitrary positions, and `fragment` operations.

The size of a client's incomplete data is limited. Errors do not stop the parser: text that is not a JSON
object is discarded with an error for the client, and reading continues with the next object.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.limits import limit_text

_MARK = re.compile(r'[{}"\\]')
_MARK_IN_STRING = re.compile(r'["\\]')
_SHOWN = 60


class BadInput(PiprosError):
    """Text from a client is not a JSON object, or is too long."""


def json_object(text: str | bytes) -> dict[str, Any]:
    """Parse text that must be a single JSON object.

    Raises:
        BadInput: the text is not a JSON object, or is nested too deeply.
    """
    try:
        value = json.loads(text)
    except RecursionError:
        raise BadInput("the JSON object is nested too deeply") from None
    except ValueError as error:
        raise BadInput(f"not JSON: {error}") from None
    if not isinstance(value, dict):
        raise BadInput(f"expected a JSON object, got {str(value)[:_SHOWN]!r}")
    return value


class JsonObjects:
    """Splits a stream of JSON objects without delimiters, by matching their braces."""

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._parts: list[str] = []
        self._length = 0
        self._depth = 0
        self._is_in_string = False
        self._is_escaped = False

    @property
    def is_empty(self) -> bool:
        """Whether the buffer is empty, so that no object is incomplete."""
        return not self._depth

    def clear(self) -> None:
        """Discard the incomplete object."""
        self._parts, self._length, self._depth = [], 0, 0
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
            self._length += end - position
            self._parts.append(text[position:end])
            position = end
            if not self._depth:
                whole = "".join(self._parts)
                self.clear()
                yield whole
            elif self._length > self._limit_bytes:
                self.clear()
                limit = limit_text("bridge_message_bytes", self._limit_bytes)
                yield BadInput(f"a JSON object is too long; {limit}")
                return

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

    def __init__(self, limit_bytes: int, timeout_s: float) -> None:
        """Keep at most `limit_bytes` of incomplete texts, each for `timeout_s` after its last fragment."""
        self._limit_bytes = limit_bytes
        self._timeout_s = timeout_s
        self._texts: dict[str, _Incomplete] = {}
        self._bytes = 0

    def add(self, fragment: dict[str, Any], now_s: float) -> str | None:
        """Add a fragment. Return the whole text if it is complete.

        Raises:
            BadInput: the fragment is malformed or contradicts the others, or all of them together are too
                long.
        """
        for old in [key for key, text in self._texts.items() if now_s - text.since_s > self._timeout_s]:
            self._drop(old)
        number, total, data = fragment.get("num"), fragment.get("total"), fragment.get("data")
        if not isinstance(data, str):
            raise BadInput("fragment: data must be a string")
        if type(total) is not int or type(number) is not int or not 0 <= number < total:
            raise BadInput("fragment: num and total must be integers, 0 <= num < total")
        key = json.dumps(fragment.get("id"))
        text = self._texts.setdefault(key, _Incomplete(total))
        if text.total != total:
            self._drop(key)
            raise BadInput("fragment: total differs from that of earlier fragments")
        cost = len(data) + _COST_OF_A_FRAGMENT
        size = cost - (len(text.parts.get(number, "")) + _COST_OF_A_FRAGMENT if number in text.parts else 0)
        text.parts[number] = data
        text.size += size
        text.since_s = now_s
        self._bytes += size
        if len(text.parts) == total:
            self._drop(key)
            return "".join(text.parts[each] for each in range(total))
        if self._bytes > self._limit_bytes:
            self._texts.clear()
            self._bytes = 0
            limit = limit_text("bridge_message_bytes", self._limit_bytes)
            raise BadInput(f"the incomplete fragments are too long; {limit}")
        return None

    def _drop(self, key: str) -> None:
        self._bytes -= self._texts.pop(key).size


_COST_OF_A_FRAGMENT = 200
"""Memory in bytes that a fragment needs besides its data."""
