"""Merge the levels and messages of statuses."""

from __future__ import annotations


def merged(level: int, message: str, other_level: int, other_message: str) -> tuple[int, str]:
    """Return the worse level and the merged message.

    Messages of two good or two bad states are joined; the message of a bad state replaces the message of a
    good state.
    """
    if (level > 0) == (other_level > 0):
        message = f"{message}; {other_message}" if message else other_message
    elif other_level > level:
        message = other_message
    return max(level, other_level), message
