"""Merges levels with messages."""

from __future__ import annotations


def merged(level: int, message: str, other_level: int, other_message: str) -> tuple[int, str]:
    """The worse level. Messages of good states, or of bad ones, are joined; a bad one replaces a good one."""
    if (level > 0) == (other_level > 0):
        message = f"{message}; {other_message}" if message else other_message
    elif other_level > level:
        message = other_message
    return max(level, other_level), message
