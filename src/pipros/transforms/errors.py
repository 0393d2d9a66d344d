"""Why there is no transform, with tf's texts."""

from __future__ import annotations

from pipros.errors import PiprosError


class TransformException(PiprosError):
    """The transform does not exist."""


class LookupException(TransformException):
    """A frame does not exist, or the frames form a loop."""


class ConnectivityException(TransformException):
    """The frames are not part of one tree."""


class ExtrapolationException(TransformException):
    """The time is before or after what is known."""


class InvalidArgumentException(TransformException):
    """The name of a frame is invalid."""


class TimeoutException(TransformException):
    """A transform did not come in time."""
