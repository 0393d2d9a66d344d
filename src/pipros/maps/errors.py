"""The errors of map files."""

from __future__ import annotations

from pipros.errors import PiprosError


class MapError(PiprosError, ValueError):
    """A map cannot be read or written; the text says which file, and why."""


class NoMapFile(MapError):
    """A file of the map cannot be opened."""


class BadMapImage(MapError):
    """The picture cannot be read."""


class BadMapDescription(MapError):
    """The YAML file is not the description of a map."""
