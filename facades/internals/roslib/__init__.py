"""Drop-in replacement for Noetic's roslib: `load_manifest`, and modules for packages and names."""

from typing import Any as _Any

import pipros.startup as _startup  # noqa: F401 # the import hook, if pipros.pth did not run
from pipros.basics.lazy_names import star_names as _star_names
from roslib.launcher import load_manifest as load_manifest

__all__ = ["is_interactive", "load_manifest", "set_interactive"]

_MODULES = ("exceptions", "manifest", "packages", "stacks")
"""Modules that `import roslib` makes available in Noetic; imported on first use."""

_interactive = [False]


def is_interactive() -> bool:
    """Return whether the program runs in an interactive shell, as set by `set_interactive`."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Set the value that `is_interactive` returns."""
    _interactive[0] = interactive


def __getattr__(name: str) -> _Any:
    if name in _MODULES:
        from importlib import import_module

        return import_module(f"roslib.{name}")
    raise AttributeError(f"module 'roslib' has no attribute '{name}'")


_star_names(
    __name__,
    "roslib roslib.exceptions roslib.launcher roslib.manifest roslib.manifestlib roslib.packages "
    "roslib.stack_manifest roslib.stacks",
)
