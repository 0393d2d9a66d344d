"""Creates messages from YAML values in the syntax of `rostopic pub`."""

from __future__ import annotations

from typing import Any

from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.msg.check import check_values
from pipros.msg.errors import MessageException
from pipros.msg.from_yaml import fill_message_args, get_printable_message_args
from pipros.msg.time import NS_PER_S, Time
from pipros_tools.graph.errors import GraphError


def message_from_yaml(message_class: type[Message], value: Any, now_ns: int) -> Message:
    """Create a message from a dictionary, or from a list in field order.

    If `value` is None, keep the defaults. The value `now` is replaced by the current time, and `auto` by a
    header with the current time.

    Raises:
        GraphError: there are too many or too few values, or a field is unknown or has the wrong type.
    """
    message = message_class()
    now = Time(*divmod(now_ns, NS_PER_S))
    header = type(message.header) if message._has_header else load_message_class("std_msgs/Header")  # type: ignore[attr-defined]
    values = value if isinstance(value, list) else [] if value is None else [value]
    try:
        fill_message_args(message, values, {"now": now, "auto": header(stamp=now)})
        check_values(message)
    except (MessageException, ValueError) as error:
        raise GraphError(f"{error}\n\nArgs are: [{get_printable_message_args(message)}]") from None
    return message
