"""Exceptions for messages. `genpy` exports them under the same names."""

from __future__ import annotations

from pipros.basics.errors import PiprosError


class MessageException(PiprosError):
    """A message cannot be created, filled, written or read."""

    __module__ = "genpy.message"  # genuine ROS uses this name; the same applies to the classes below


class SerializationError(MessageException):
    """A value does not fit the type of its field."""

    __module__ = "genpy.message"


class DeserializationError(MessageException):
    """The data is not a serialized message of the expected type."""

    __module__ = "genpy.message"
