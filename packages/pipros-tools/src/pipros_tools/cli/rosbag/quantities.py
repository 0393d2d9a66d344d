"""Durations and sizes on the command line."""

from __future__ import annotations

import re

_SECONDS = {"": 1, "s": 1, "m": 60, "h": 3600}
_BYTES = {"": 1, "k": 1 << 10, "m": 1 << 20, "g": 1 << 30}


def seconds_of(text: str) -> float:
    """Return a duration such as `30`, `5m` or `2h` in seconds. Raise `ValueError` if it is invalid."""
    match = re.fullmatch(r"(\d+(?:\.\d*)?)([smh]?)", text)
    if match is None or float(match[1]) <= 0:
        raise ValueError(f"Duration specification invalid: {text}. It must be like 30, 5m or 2h")
    return float(match[1]) * _SECONDS[match[2]]


def bytes_of(text: str, what: str) -> int:
    """Return a size such as `500M` in bytes. Raise `ValueError` if `what`, which it is, is invalid."""
    match = re.fullmatch(r"(\d+)([kKmMgG]?)", text)
    if match is None:
        raise ValueError(f"{what} must be like 500M, got {text}")
    return int(match[1]) * _BYTES[match[2].lower()]
