"""Exceptions raised by conversions."""

from __future__ import annotations

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable

_TEXT_LIMIT = 2_000


class ConversionError(PiprosError):
    """A message cannot be converted, for example because its bytes do not fit its type.

    The text is made printable, because it may quote a peer or a file.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(printable(text, _TEXT_LIMIT))


class BoundExceeded(ConversionError):
    """A string or an array is longer than the target type allows."""


class NotConvertible(ConversionError):
    """Two types cannot be converted into each other. The text names the fields or the missing rule."""


class InvalidRules(PiprosError):
    """A file with mapping rules or gateway rules is malformed."""
