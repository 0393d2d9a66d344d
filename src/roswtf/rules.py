"""What a rule makes of the result of its function; for plugins. Facade of `pipros.health.wtf.rules`."""

from pipros.health.wtf.rules import (
    error_rule,
    warning_rule,
)

__all__ = [
    "error_rule",
    "warning_rule",
]
