"""Estimate the weight of a parameter: roughly its size in bytes, in memory and as XML-RPC."""

from __future__ import annotations

import sys
from collections.abc import Collection
from typing import Any, Final

VALUE_BYTES: Final = 32
ENTRY_BYTES: Final = 32
"""Weight of a value, and of a dictionary entry, in addition to their text."""
SMALL: Final = 2_000
"""Maximum number of elements in a value that is weighed on the event loop."""
_UTF8_BYTES: Final = 4


class TooManyElements(Exception):
    """A value has more elements than `elements_limit`."""


def weigh(value: object, *, elements_limit: int = sys.maxsize) -> int:
    """Return the weight of a value.

    Raises:
        TooManyElements: the lists and dictionaries in the value have more than `elements_limit` elements in
            total.

    >>> weigh("abc"), weigh([1, 2]), weigh({"a": 1})
    (35, 96, 97)
    """
    weight = 0
    elements_left = elements_limit
    stack: list[Collection[Any]] = [[value]]
    while stack:
        values = stack.pop()
        weight += VALUE_BYTES * len(values)
        for each in values:
            kind = type(each)
            if kind is dict or kind is list:
                elements_left -= len(each)
                if elements_left < 0:
                    raise TooManyElements
                if kind is dict:
                    weight += ENTRY_BYTES * len(each) + _total_text_bytes(each)
                stack.append(each.values() if kind is dict else each)
            elif kind is str:
                weight += _text_bytes(each)
            elif kind is not float and kind is not int and kind is not bool:
                weight += len(getattr(each, "data", ""))  # `data` is the content of a `Binary`
    return weight


def entry_weight(key: str) -> int:
    """Return the weight of a dictionary entry without its value."""
    return ENTRY_BYTES + _text_bytes(key)


def _total_text_bytes(texts: Collection[str]) -> int:
    """Return the sum of `_text_bytes` over all strings. Fast if all strings are ASCII."""
    joined = "".join(texts)
    return len(joined) if joined.isascii() else sum(map(_text_bytes, texts))


def _text_bytes(text: str) -> int:
    """Return an upper bound for the encoded size of a string. Encoding the string would take too long."""
    return len(text) if text.isascii() else _UTF8_BYTES * len(text)
