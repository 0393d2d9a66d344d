"""Exceptions for pictures."""

from __future__ import annotations

from pipros.basics.errors import PiprosError


class PictureError(PiprosError, ValueError):
    """The data is not a valid picture, or the format does not support the image."""
