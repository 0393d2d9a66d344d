"""Errors of map files."""

from __future__ import annotations

from pipros.basics.errors import PiprosError


class MapError(PiprosError, ValueError):
    """A map cannot be read or written. The error text names the file and the reason."""


class NoMapFile(MapError):
    """A map's YAML file or image cannot be read."""


class BadMapImage(MapError):
    """A map's image is invalid."""


class BadMapDescription(MapError):
    """A map's YAML file is invalid."""
