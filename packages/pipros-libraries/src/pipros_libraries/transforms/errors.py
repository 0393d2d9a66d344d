"""Exceptions raised by transform lookups. The error texts match tf2's."""

from __future__ import annotations

from pipros.basics.errors import PiprosError


class TransformException(PiprosError):
    """A transform is not available."""


class LookupException(TransformException):
    """A frame does not exist, or the frame tree contains a loop."""


class ConnectivityException(TransformException):
    """The frames are not part of the same tree."""


class ExtrapolationException(TransformException):
    """The lookup time is before or after the buffered transforms."""


class InvalidArgumentException(TransformException):
    """A frame ID is invalid."""


class TimeoutException(TransformException):
    """A transform did not become available in time."""
