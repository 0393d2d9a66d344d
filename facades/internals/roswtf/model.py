"""What rules found. Facade of `pipros.health.wtf.rules`."""

from pipros.health.wtf.rules import WtfError, WtfWarning

__all__ = ["WtfError", "WtfWarning"]
