"""What goes wrong with messages; `genpy` offers these exceptions under the same names."""

from __future__ import annotations

from pipros.errors import PiprosError


class MessageException(PiprosError):
    """Something is wrong with a message."""

    __module__ = "genpy.message"  # the name that people know it by, as for the classes below


class SerializationError(MessageException):
    """A field of a message has a value that its type cannot carry."""

    __module__ = "genpy.message"


class DeserializationError(MessageException):
    """Bytes are not a serialized message of the expected type."""

    __module__ = "genpy.message"
