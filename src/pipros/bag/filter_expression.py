"""Which messages of a bag are meant, by an expression over `topic`, `m` and `t` that can only look at them.

The idioms of tutorials work: `t.to_sec() < 10`, `topic.startswith("/cam")`, `m._type == "std_msgs/String"`,
`any(x.header.frame_id == "map" for x in m.transforms)`.
"""

from __future__ import annotations

from typing import Any

from pipros.msg.base import Message
from pipros.msg.time import TVal
from pipros.safe.expr import TYPE_NAMES, Expression

_OF_TIMES = ("secs", "nsecs", "to_sec", "to_nsec", "to_time", "is_zero")


def field_of(value: Any, name: str) -> Any:
    """A field of a message, what type it is, or a field or method of a time.

    Raises:
        AttributeError: the field does not exist.
    """
    if isinstance(value, TVal) and name in _OF_TIMES:
        return getattr(value, name)
    if isinstance(value, Message) and (name in value.__slots__ or name in TYPE_NAMES):
        return getattr(value, name)
    raise AttributeError(f"{type(value).__name__} has no field [{name}]")


class MessageExpression:
    """An expression over one message.

    Raises:
        ExpressionError: the text is malformed.
    """

    def __init__(self, text: str) -> None:
        self._expression = Expression(text, fields=field_of)
        self.needs_message = "m" in self._expression.names()
        """False if the topic and the time tell the result."""

    def value(self, topic: str, message: Any, time: Any) -> Any:
        """Its value. Raises `ExpressionError` where it fails."""
        return self._expression.value({"topic": topic, "m": message, "t": time})
