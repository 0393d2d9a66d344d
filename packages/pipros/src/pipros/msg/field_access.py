"""Define which attributes of messages and times expressions may read."""

from __future__ import annotations

from typing import Any

from pipros.msg.base import Message
from pipros.msg.time import TVal
from pipros.safe.expr_walk import TYPE_NAMES

_OF_TIMES = ("secs", "nsecs", "to_sec", "to_nsec", "to_time", "is_zero")


def field_of(value: Any, name: str) -> Any:
    """Return a message's declared field, `_type` or `_md5sum`, or a field or method of a time.

    Access to anything else is refused.

    Raises:
        AttributeError: the field does not exist, or access to the attribute is refused.
    """
    if isinstance(value, TVal) and name in _OF_TIMES:
        return getattr(value, name)
    if isinstance(value, Message) and (name in value.__slots__ or name in TYPE_NAMES):
        return getattr(value, name)
    raise AttributeError(f"{type(value).__name__} has no field [{name}]")
