"""`--filter`: which messages are meant, by an expression that cannot do anything but look at them."""

from __future__ import annotations

import sys
from typing import Any

from pipros.msg.base import Message
from pipros.msg.time import TVal
from pipros.safe.expr import ExpressionError, evaluate


def field_of(value: Any, name: str) -> Any:
    """The declared field `name` of a message or a time; no other attribute leads anywhere.

    Raises:
        AttributeError: there is no such field.
    """
    if isinstance(value, TVal) and name in ("secs", "nsecs"):
        return getattr(value, name)
    if isinstance(value, Message) and name in value.__slots__:
        return getattr(value, name)
    raise AttributeError(f"{type(value).__name__} has no field [{name}]")


class MessageFilter:
    """Decides by an expression over `m`, the message, and `topic`, its name.

    A message for which the expression fails does not pass; why is told once on standard error. So a
    field that only some messages have does no harm.
    """

    def __init__(self, expression: str) -> None:
        self._expression = expression
        self._told: set[str] = set()

    def __call__(self, message: Any, topic: str) -> bool:
        try:
            return bool(
                evaluate(
                    self._expression,
                    names={"m": message, "topic": topic},
                    functions={"to_sec": _seconds},
                    fields=field_of,
                )
            )
        except ExpressionError as error:
            if str(error) not in self._told:
                self._told.add(str(error))
                print(f"ERROR: {error}", file=sys.stderr)
            return False


def _seconds(time: TVal) -> float:
    return time.to_sec()
