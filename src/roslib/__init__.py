"""`roslib`, for old scripts: `load_manifest`, and modules that find packages and work with names."""

from typing import Any as _Any

import pipros.startup as _startup  # noqa: F401 # the import hook, where pipros.pth did not run
from roslib.launcher import load_manifest as load_manifest

__all__ = ["is_interactive", "load_manifest", "set_interactive"]

#: What `import roslib` alone makes attributes in Noetic, and what is imported here when it is asked for.
_MODULES = ("exceptions", "manifest", "packages", "stacks")

_interactive = [False]


def is_interactive() -> bool:
    """Whether `set_interactive(True)` said that a person sits at a prompt."""
    return _interactive[0]


def set_interactive(interactive: bool) -> None:
    """Has `is_interactive` answer that from now on."""
    _interactive[0] = interactive


def __getattr__(name: str) -> _Any:
    if name in _MODULES:
        from importlib import import_module

        return import_module(f"roslib.{name}")
    raise AttributeError(f"module 'roslib' has no attribute '{name}'")
