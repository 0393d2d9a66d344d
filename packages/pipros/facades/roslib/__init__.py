"""Drop-in replacement for Noetic's roslib: `load_manifest`, and modules for packages and names."""

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
from pipros.basics.lazy_names import lazy_names as _lazy_names
from roslib.launcher import load_manifest as load_manifest

__all__ = ["is_interactive", "load_manifest", "set_interactive"]

_interactive = [False]


def is_interactive() -> bool:
    """Return whether the program runs in an interactive shell, as set by `set_interactive`."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Set the value that `is_interactive` returns."""
    _interactive[0] = interactive


__getattr__, __dir__ = _lazy_names(__name__, {}, ("exceptions", "launcher", "message", "packages"))
