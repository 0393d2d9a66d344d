"""Errors of map files."""

from __future__ import annotations

from pipros.basics.errors import PiprosError


class MapError(PiprosError, ValueError):
    """A map cannot be read or written. The error text names the file and the reason."""


class NoMapFile(MapError):
    """The YAML file or the image of a map cannot be opened."""


class BadMapImage(MapError):
    """The image of a map is invalid."""


class BadMapDescription(MapError):
    """The YAML file of a map is invalid."""
