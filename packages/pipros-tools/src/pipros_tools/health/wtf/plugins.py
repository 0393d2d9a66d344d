"""Plugins: rules from packages that export `<roswtf plugin="module"/>`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any

from pipros.basics.errors import PiprosError
from pipros_workspace.dependency_graph import DependencyGraph
from pipros_workspace.index import PackageIndex

Check = Callable[[Any], Any]
"""A function in a plugin. Its argument is the context that the `roswtf` facade creates for plugins."""


def _ignore(_text: str) -> None:
    """Do nothing."""


def load_plugins(
    index: PackageIndex | None = None,
    *,
    say: Callable[[str], Any] = _ignore,
    complain: Callable[[str], Any] = _ignore,
) -> tuple[list[Check], list[Check]]:
    """Return the static and online checks from all plugins. Online checks need a running system.

    A plugin is a module with a function `roswtf_plugin_static`, `roswtf_plugin_online` or both, which take
    the context. A plugin that cannot be loaded is skipped; `complain` is called with the reason.
    """
    graph = DependencyGraph(index or PackageIndex.from_environment())
    static: list[Check] = []
    online: list[Check] = []
    try:
        exporters = list(graph.exporters("roswtf", "plugin", None))
    except (PiprosError, OSError) as error:
        complain(f"cannot look for plugins: {error}")
        return static, online
    for package, name in exporters:
        try:
            module = import_module(name)
        except Exception as error:  # the plugin's code may raise any exception
            complain(f"Unable to load plugin [{name}] from package [{package.name}]: {error}")
            continue
        found = [
            (kind, getattr(module, f"roswtf_plugin_{label}", None))
            for kind, label in ((static, "static"), (online, "online"))
        ]
        if all(check is None for _, check in found):
            complain(
                f"Cannot load plugin [{name}] from package [{package.name}]: it defines neither "
                "roswtf_plugin_static nor roswtf_plugin_online"
            )
            continue
        for kind, check in found:
            if check is not None:
                kind.append(check)
        say(f"Loaded plugin {name}")
    return static, online


def run_checks(checks: Iterable[Check], context: object, *, complain: Callable[[str], Any]) -> None:
    """Call plugins' checks with their context. Call `complain` for each check that raises an exception."""
    for check in checks:
        try:
            check(context)
        except Exception as error:  # the plugin's code may raise any exception
            complain(f"ERROR: plugin [{getattr(check, '__module__', check)}] failed: {error}")
