"""Errors of simulated worlds and robots."""

from __future__ import annotations

from pipros.basics.errors import PiprosError


class InvalidSettings(PiprosError, ValueError):
    """A setting or a world file is invalid. The error text contains the name and the value."""


class Rejected(PiprosError):
    """A request cannot be performed. The error text is logged, or shown on the page that sent the request."""
