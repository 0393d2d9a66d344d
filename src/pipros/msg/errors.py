"""The errors of messages; `genpy` has these exceptions under the same names."""

from __future__ import annotations

from pipros.errors import PiprosError


class MessageException(PiprosError):
    """A message cannot be made, filled, written or read."""

    __module__ = "genpy.message"  # as in genuine ROS; so in the classes below


class SerializationError(MessageException):
    """A field of a message has a value that its type cannot carry."""

    __module__ = "genpy.message"


class DeserializationError(MessageException):
    """Bytes are not a serialized message of the expected type."""

    __module__ = "genpy.message"
