"""What the rules look at. Facade of `pipros.health.wtf.context`."""

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf.context import (
    WtfContext,
    WtfException,
)

__all__ = [
    "WtfContext",
    "WtfException",
]

_star_names(__name__, "os rosgraph roslaunch rospkg sys roswtf.model:WtfWarning")
