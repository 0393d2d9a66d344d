"""Encode values as JSON without blocking the event loop.

`orjson` is used if it is installed, since it takes a tenth of the time of the standard library
(`benchmarks/bridges.py --only encodings`). It leaves non-ASCII characters as they are. The standard library
encodes what `orjson` refuses: keys that are not strings, integers beyond 64 bits, and lone surrogates.
"""

from __future__ import annotations

import json
import math
from typing import Any, Final

from pipros.net.loop import in_daemon_thread

try:
    import orjson
except ImportError:
    ORJSON: Any = None
else:
    ORJSON = orjson

LARGE_VALUES: Final = 20_000
LARGE_CHARACTERS: Final = 1_000_000
_COPIED_BYTES: Final = 4096
"""Shorter results of `orjson` are copied, because it keeps all of the 4 KiB into which it wrote them."""

_OPTIONS: Final = (
    ORJSON and ORJSON.OPT_SERIALIZE_NUMPY | ORJSON.OPT_PASSTHROUGH_DATACLASS | ORJSON.OPT_PASSTHROUGH_DATETIME
)
_ENCODER: Final = json.JSONEncoder(separators=(",", ":"), allow_nan=False, default=str)


async def json_text(value: object) -> str:
    """Return a value as JSON. NaN and infinity become `null`.

    A large value is encoded in a thread and in pieces, because the C encoder holds the GIL until it is done.

    Raises:
        TypeError: the key of a mapping is neither a string, a number nor None.
        RecursionError: the value is nested too deeply, or contains itself.
    """
    return await in_daemon_thread(_in_pieces, value) if is_large(value) else encoded(value)


def encoded(value: object) -> str:
    """Return a value as JSON like `json_text`, but always encode it in the calling thread."""
    if (data := json_bytes(value)) is not None:
        return data.decode()
    try:
        return _ENCODER.encode(value)
    except ValueError:
        return _ENCODER.encode(_without_infinity(value))


def json_bytes(value: object) -> bytes | None:
    """Return a value, which may contain numpy arrays, as JSON in UTF-8. NaN and infinity become `null`.

    Return None if `orjson` is not installed, or cannot encode the value.
    """
    if ORJSON is None:
        return None
    try:
        data: bytes = ORJSON.dumps(value, _other, _OPTIONS)
    except TypeError:
        return None
    return data if len(data) > _COPIED_BYTES else bytes(memoryview(data))


def _other(value: object) -> Any:
    """Convert a value for which `orjson` and the standard library differ, or which both lack."""
    if isinstance(value, float):
        return float(value)
    return list(value) if isinstance(value, tuple) else str(value)


def is_large(value: object) -> bool:
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


def _in_pieces(value: object) -> str:
    try:
        return "".join(_ENCODER.iterencode(value))
    except ValueError:
        return "".join(_ENCODER.iterencode(_without_infinity(value)))


def _without_infinity(value: object) -> Any:
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
