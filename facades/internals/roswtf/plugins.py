"""Rules that other packages provide. Facade of `pipros.health.wtf.plugins`."""

from __future__ import annotations

import sys

from pipros.basics.lazy_names import star_names as _star_names
from pipros.health.wtf import plugins as _plugins

__all__ = ["load_plugins"]

_star_names(__name__, "os roslib rospkg sys")


def load_plugins() -> tuple[list[_plugins.Check], list[_plugins.Check]]:
    """Return the checks of all plugins: the static checks, and the checks that need a running system."""
    return _plugins.load_plugins(say=print, complain=lambda text: print(text, file=sys.stderr))
