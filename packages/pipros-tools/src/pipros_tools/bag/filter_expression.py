"""Select messages in a bag with an expression that uses `topic`, `m` (the message) and `t` (its time).

Expressions cannot change messages. The idioms in the ROS tutorials are supported: `t.to_sec() < 10`,
`topic.startswith("/cam")`, `m._type == "std_msgs/String"`, and
`any(x.header.frame_id == "map" for x in m.transforms)`.
"""

from __future__ import annotations

from typing import Any

from pipros.msg.field_access import field_of
from pipros.safe.expr import Expression


class MessageExpression:
    """An expression that is evaluated for one message at a time.

    Raises:
        ExpressionError: the text is malformed.
    """

    def __init__(self, text: str) -> None:
        self._expression = Expression(text, fields=field_of)
        self.needs_message = "m" in self._expression.names()
        """False if the result depends only on the topic and the time."""
        self.needs_time = "t" in self._expression.names()

    def value(self, topic: str, message: Any, time: Any) -> Any:
        """Return the value of the expression. Raise `ExpressionError` if the evaluation fails."""
        return self._expression.value({"topic": topic, "m": message, "t": time})
