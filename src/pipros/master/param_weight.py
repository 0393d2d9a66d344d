"""Estimate the weight of a parameter: roughly its size in bytes, in memory and as XML-RPC."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Final

VALUE_BYTES: Final = 32
ENTRY_BYTES: Final = 32
"""Weight of a value, and of a dictionary entry, in addition to their text."""
_SMALL: Final = 2_000
"""Maximum number of elements in a value that is weighed on the event loop."""
_UTF8_BYTES: Final = 4


def weigh(value: Any) -> int:
    """Return the weight of a value.

    >>> weigh("abc"), weigh([1, 2]), weigh({"a": 1})
    (35, 96, 97)
    """
    weight = 0
    stack: list[Collection[Any]] = [[value]]
    while stack:
        values = stack.pop()
        weight += VALUE_BYTES * len(values)
        for each in values:
            kind = type(each)
            if kind is dict:
                weight += ENTRY_BYTES * len(each) + _total_text_bytes(each)
                stack.append(each.values())
            elif kind is list:
                stack.append(each)
            elif kind is str:
                weight += _text_bytes(each)
            elif kind is not float and kind is not int and kind is not bool:
                weight += len(getattr(each, "data", ""))  # Binary
    return weight


def is_small(value: Any) -> bool:
    """Return whether a value can be weighed without delaying other calls."""
    left = _SMALL
    stack = [value]
    while stack:
        value = stack.pop()
        if type(value) is dict or type(value) is list:
            left -= len(value)
            if left < 0:
                return False
            stack.extend(value.values() if type(value) is dict else value)
    return True


def entry_weight(key: str) -> int:
    """Return the weight of a dictionary entry without its value."""
    return ENTRY_BYTES + _text_bytes(key)


def _total_text_bytes(texts: Collection[str]) -> int:
    """Return the sum of `_text_bytes` for all texts. Fast if all are ASCII."""
    joined = "".join(texts)
    return len(joined) if joined.isascii() else sum(map(_text_bytes, texts))


def _text_bytes(text: str) -> int:
    """Return an upper bound for the encoded size of a string. Encoding the string would take too long."""
    return len(text) if text.isascii() else _UTF8_BYTES * len(text)
