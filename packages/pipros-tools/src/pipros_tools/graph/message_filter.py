"""`--filter`: selects messages with an expression that cannot modify them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.msg.field_access import field_of
from pipros.safe.expr import evaluate
from pipros.safe.expr_walk import ExpressionError
from pipros_tools.graph.output import to_stderr

if TYPE_CHECKING:
    from pipros.basics.printable import Say
    from pipros.msg.time import TVal


class MessageFilter:
    """Evaluates an expression over `m`, the message, and `topic`, its topic name.

    If the expression fails for a message, the message is not selected, so an expression can use a field that
    only some messages have. Each distinct reason is passed to `complain` once.
    """

    def __init__(self, expression: str, *, complain: Say = to_stderr) -> None:
        self._expression = expression
        self._report = complain
        self._reasons: set[str] = set()

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
            if str(error) not in self._reasons:
                self._reasons.add(str(error))
                self._report(f"ERROR: {error}")
            return False


def _seconds(time: TVal) -> float:
    return time.to_sec()
