"""Messages from YAML values, as `rostopic pub` takes them."""

from __future__ import annotations

from typing import Any

from pipros.graph.errors import GraphError
from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.msg.errors import MessageException
from pipros.msg.from_yaml import fill_message_args, get_printable_message_args
from pipros.msg.time import NS_PER_S, Time


def message_from_yaml(message_class: type[Message], value: Any, now_ns: int) -> Message:
    """A message with the fields of a dictionary, or of a list in their order; None leaves the defaults.

    As values, `now` is the time, and `auto` a header with that time.

    Raises:
        GraphError: too many or too few values, an unknown field, or one of the wrong type.
    """
    message = message_class()
    now = Time(*divmod(now_ns, NS_PER_S))
    header = type(message.header) if message._has_header else load_message_class("std_msgs/Header")  # type: ignore[attr-defined]
    values = value if isinstance(value, list) else [] if value is None else [value]
    try:
        fill_message_args(message, values, {"now": now, "auto": header(stamp=now)})
        message._check_types()
    except (MessageException, ValueError) as error:
        raise GraphError(f"{error}\n\nArgs are: [{get_printable_message_args(message)}]") from None
    return message
