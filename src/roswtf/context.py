"""What the rules look at. Facade of `pipros.health.wtf.context`."""

from pipros.health.wtf.context import (
    WtfContext,
    WtfException,
)

__all__ = [
    "WtfContext",
    "WtfException",
]
