"""Escape characters that hide, reorder or format text, for readers such as language models."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pipros.basics.printable import listed

LONGEST_TEXT: Final = 4000
"""Maximum number of characters in one string; the rest is cut off."""

_INVISIBLE = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U0001d173-\U0001d17a\U000e0000-\U000e0fff]"
)
"""Characters that Unicode counts as printable, but that are invisible and can therefore hide text."""


def safe_text(text: str, limit: int = LONGEST_TEXT) -> str:
    """Return text without characters that hide, reorder or format text.

    Control characters (including those in ANSI codes), bidirectional controls, Unicode tags, variation
    selectors and blank letters become escapes such as `\\x1b`. Text beyond `limit` characters is cut off.

    >>> safe_text("a\\x1b[31mb\\u202ec\\U000e0041")
    'a\\\\x1b[31mb\\\\u202ec\\\\U000e0041'
    """
    rest = len(text) - limit
    shown = _INVISIBLE.sub(_escaped, listed(text[:limit]))
    return f"{shown}... ({rest} more characters)" if rest > 0 else shown


def safe(value: Any) -> Any:
    """Return a value as JSON can represent it, with `safe_text` for all strings and keys.

    Binary data is replaced by its size.
    """
    if value is None or isinstance(value, (bool, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, str):
        return safe_text(value)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return {"bytes": len(value)}
    if isinstance(value, Mapping):
        return {safe_text(str(key), 300): safe(part) for key, part in value.items()}
    if isinstance(value, Sequence):
        return [safe(part) for part in value]
    return safe_text(str(value))


def _escaped(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode()
