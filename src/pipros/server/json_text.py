"""Encode values as JSON without blocking the event loop."""

from __future__ import annotations

import json
import math
from typing import Any, Final

from pipros.net.loop import in_daemon_thread

LARGE_VALUES: Final = 20_000
LARGE_CHARACTERS: Final = 1_000_000

_ENCODER: Final = json.JSONEncoder(separators=(",", ":"), allow_nan=False, default=str)


async def json_text(value: Any) -> str:
    """Return a value as JSON. NaN and infinity become `null`.

    A large value is encoded in a thread and in pieces, because the C encoder holds the GIL until it is done.

    Raises:
        TypeError: the key of a mapping is neither a string, a number nor None.
        RecursionError: the value is nested too deeply, or contains itself.
    """
    return await in_daemon_thread(_in_pieces, value) if is_large(value) else encoded(value)


def encoded(value: Any) -> str:
    """Return a value as JSON like `json_text`, but always encode it in the calling thread."""
    try:
        return _ENCODER.encode(value)
    except ValueError:
        return _ENCODER.encode(_without_infinity(value))


def is_large(value: Any) -> bool:
    """Return whether a value contains more than `LARGE_VALUES` values or `LARGE_CHARACTERS` characters."""
    values = characters = 0
    left = [value]
    while left:
        value = left.pop()
        if isinstance(value, str):
            characters += len(value)
        elif isinstance(value, dict):
            values += len(value)
            left.extend(value.values() if values <= LARGE_VALUES else ())
        elif isinstance(value, (list, tuple)):
            values += len(value)
            left.extend(value if values <= LARGE_VALUES else ())
        if values > LARGE_VALUES or characters > LARGE_CHARACTERS:
            return True
    return False


def _in_pieces(value: Any) -> str:
    try:
        return "".join(_ENCODER.iterencode(value))
    except ValueError:
        return "".join(_ENCODER.iterencode(_without_infinity(value)))


def _without_infinity(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {
            str(key) if isinstance(key, float) else key: _without_infinity(part)
            for key, part in value.items()
        }
    if isinstance(value, (list, tuple)):
        return [_without_infinity(part) for part in value]
    return value
