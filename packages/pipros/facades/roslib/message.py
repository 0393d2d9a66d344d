"""`roslib.message`, for legacy scripts: the contents of `genpy.message`."""

from genpy.message import (
    DeserializationError,
    Duration,
    Message,
    SerializationError,
    Time,
    TVal,
    check_type,
    fill_message_args,
    get_message_class,
    get_printable_message_args,
    get_service_class,
    strify_message,
)

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "SerializationError",
    "TVal",
    "Time",
    "check_type",
    "fill_message_args",
    "get_message_class",
    "get_printable_message_args",
    "get_service_class",
    "strify_message",
]
