"""What a rule makes of the result of its function; for plugins. Facade of `pipros.health.wtf.rules`."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf.rules import (
    error_rule,
    warning_rule,
)

__all__ = [
    "error_rule",
    "warning_rule",
]

_star_names(__name__, "roswtf.model:WtfError roswtf.model:WtfWarning")
