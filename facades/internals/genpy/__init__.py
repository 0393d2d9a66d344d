"""Drop-in replacement for Noetic's genpy, also for modules that genpy generated; facade of `pipros.msg`."""

from genpy import message, rostime
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.base import Message, struct_I
from pipros.msg.errors import DeserializationError, MessageException, SerializationError
from pipros.msg.time import Duration, Time, TVal

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "SerializationError",
    "TVal",
    "Time",
    "message",
    "rostime",
    "struct_I",
]

_star_names(__name__, hidden="message rostime")
