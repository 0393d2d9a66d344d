"""Merge the levels and messages of statuses."""

from __future__ import annotations


def merged(level: int, message: str, other_level: int, other_message: str) -> tuple[int, str]:
    """Return the worse level and the merged message.

    If both levels are 0 or both are above 0, the messages are joined. Otherwise, the message with the higher
    level is returned.
    """
    if (level > 0) == (other_level > 0):
        message = f"{message}; {other_message}" if message else other_message
    elif other_level > level:
        message = other_message
    return max(level, other_level), message
