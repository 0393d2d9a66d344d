"""Convert messages to JSON values of limited size; large arrays and long strings are shortened."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pipros.msg.time import TVal

SHOWN_ELEMENTS = 40
SHOWN_CHARACTERS = 4000
SHOWN_BYTES = 32
SHOWN_NAME = 300
"""Maximum length of a field's name or a key, in characters."""
LEAVES = 4000
"""Maximum number of values shown per message by default. A long string or name counts as several values."""
CHARACTERS_PER_LEAF = 50

NUMBER = "#"
"""Key of the text of a number that JavaScript cannot read from JSON."""
EXACT = 2**53
"""JavaScript rounds integers of which the absolute value is larger."""
MORE = "…"
"""Key of the full length of a shortened array, and the last character of a shortened string."""


def message_tree(message: object, leaves: int = LEAVES, *, for_browser: bool = False) -> Any:
    """Return the fields of a message as dictionaries, lists, strings and numbers.

    NaN and infinities become the strings `nan`, `inf` and `-inf`. A shortened array is
    `{"…": length, "items": […]}` with the first elements. Binary data is `{"…": length, "hex": "…"}` with the
    first bytes.

    Args:
        message: a message, or the value of a field.
        leaves: maximum number of values; see `LEAVES`.
        for_browser: whether numbers that JavaScript could not read or would round are `{"#": "nan"}` and
            `{"#": "18446744073709551615"}`, which differ from strings.
    """
    return _Tree(leaves, for_browser=for_browser).of(message)


class _Tree:
    def __init__(self, leaves: int, *, for_browser: bool) -> None:
        self._left = leaves
        self._for_browser = for_browser

    def of(self, value: Any) -> Any:
        self._left -= 1
        if value is None or isinstance(value, (bool, int)):
            return {NUMBER: str(value)} if self._for_browser and abs(value or 0) > EXACT else value
        if isinstance(value, float):
            if math.isfinite(value):
                return value
            return {NUMBER: str(value)} if self._for_browser else str(value)
        if isinstance(value, str):
            return self._cut(value, SHOWN_CHARACTERS)
        if isinstance(value, (bytes, bytearray, memoryview)):
            return {MORE: len(value), "hex": bytes(value[:SHOWN_BYTES]).hex(" ")}
        if isinstance(value, TVal):
            return {"secs": value.secs, "nsecs": value.nsecs}
        slots = getattr(value, "__slots__", None)
        if slots is not None and hasattr(value, "_slot_types"):
            return {
                self._cut(name, SHOWN_NAME): self.of(getattr(value, name)) for name in slots if self._left > 0
            }
        if isinstance(value, Mapping):
            return {
                self._cut(str(key), SHOWN_NAME): self.of(part)
                for key, part in value.items()
                if self._left > 0
            }
        if hasattr(value, "tolist") and hasattr(value, "dtype"):
            return self._array(value)
        if isinstance(value, Sequence):
            return self._array(value)
        return self._cut(str(value), SHOWN_CHARACTERS)

    def _cut(self, text: str, limit: int) -> str:
        self._left -= min(len(text), limit) // CHARACTERS_PER_LEAF
        return text if len(text) <= limit else text[:limit] + MORE

    def _array(self, values: Any) -> Any:
        length = len(values)
        shown = values[:SHOWN_ELEMENTS]
        shown = shown.tolist() if hasattr(shown, "tolist") else shown
        items = [self.of(item) for item in shown if self._left > 0]
        return items if len(items) == length else {MORE: length, "items": items}
